"""Features as declarations: settings, what panel and scene show for them, what goes on, and what events do.

A feature states what is to be seen, and a reconciler keeps viser's handles equal to it, sending only differences.
`fields` are settings: one line is the control, the check, the entry in a link and the name of the undo step.
`facts` are what is known of the settings and the arm. `panel` and `scene` are the nodes and their reconcilers,
`work` is what takes long or moves by itself, `feature` connects them to the page.
"""
