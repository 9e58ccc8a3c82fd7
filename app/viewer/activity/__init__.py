"""What is open in one page, what was done there, and what is withheld. No module here knows the page.

:class:`~app.viewer.activity.activity.Activity` is the one owner. `practice` has the marks and numbers of the
exercises, `progress` the way through a course, and `places` says where exercises are done.
"""
