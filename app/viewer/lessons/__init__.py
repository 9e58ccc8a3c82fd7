"""Lessons: one idea each, one on show at a time.

Adding a lesson is a folder here with a :class:`~app.viewer.lessons.guide.lesson.Lesson` in its module `lesson`,
which says what it teaches and asks, and a row in `app/exercises/lessons.py`.
"""

from __future__ import annotations

from importlib import import_module

from app.exercises.lessons import LESSONS as KEYS
from app.viewer.lessons.guide.lesson import Lesson


def _lesson(key: str) -> type[Lesson]:
    """The lesson with this key, in the module `lesson` of the folder of this name."""
    found = vars(import_module(f"{__name__}.{key}.lesson")).values()
    (lesson,) = (
        each
        for each in found
        if isinstance(each, type) and issubclass(each, Lesson) and vars(each).get("key") == key
    )
    return lesson


# In the order of a course.
LESSONS: tuple[type[Lesson], ...] = tuple(map(_lesson, KEYS))
