"""A room of a class in its members' pages: who leads, the wall, tasks, questions.

A page without a room has none of this. A member's page is a `ClassroomPage` with one more tab; `following` shows
another page's state in this one, `sharing` says when this page's state is sent, `wall` draws the students' arms
for the teacher. What is common to all pages of a room is in :mod:`app.classroom`.
"""
