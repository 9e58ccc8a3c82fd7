"""Features as declarations: settings, what the panel and the scene show for them, and what events do.

A feature states what is to be seen, and a reconciler keeps viser's handles equal to it, sending only differences.
`fields` are settings: one line is the control, the check, the entry in a link and the name of the undo step.
`facts` are what is known of the settings and the arm. `panel` and `scene` are the nodes and their reconcilers,
`feature` connects them to the page.
"""
