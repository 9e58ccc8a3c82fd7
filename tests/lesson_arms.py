"""Lessons with the arms that they ask about: what is true of every question is tested on these."""

from __future__ import annotations

from app.exercises.lesson_text import texts_of
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.lesson import Lesson
from kin import Robot, get_robot


def arms_of(lesson: str) -> list[Robot]:
    """Those of the whole lesson, but for single steps."""
    return [get_robot(arm) for arm in texts_of(lesson).arms]


# With the arms of single steps, for which all other steps are empty.
ASKED: list[tuple[type[Lesson], Robot]] = [
    (lesson, get_robot(arm)) for lesson in LESSONS for arm in texts_of(lesson.key).every_arm
]
IDS = [f"{lesson.key}-{robot.id}" for lesson, robot in ASKED]
