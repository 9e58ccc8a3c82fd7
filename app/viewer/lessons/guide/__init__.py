"""The common block of all lessons: goal, steps, predictions and check.

`outline` has what a lesson asks, `judging` says whether an answer is right and why not, `progress` keeps which
questions were answered. None of them knows the page, so they are tested without a browser. `views` makes the HTML,
and `feature` connects it to the visitor's page. A lesson of this kind is a
:class:`~app.viewer.lessons.guide.lesson.Lesson`.
"""
