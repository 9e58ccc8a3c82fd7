"""The exercises in the tab *Learn*: a list by topic, one exercise at a time, hints, answers, verdicts.

`sheet` holds what is entered, `views` makes the HTML, `drawing` the frames in the
scene, and `feature` connects them to the visitor's page. What is asked and judged is in :mod:`app.exercises`.
"""
