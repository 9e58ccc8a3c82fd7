"""Another arm to ask the question of a lesson about: the same question has other numbers there."""

from __future__ import annotations

import random
import re

from app.exercises.lesson_text import LessonText
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Question
from kin import Robot, get_robot
from kin.units import DEFAULT_UNITS

_NUMBER = re.compile(r"[-−]?\d+(?:[.,]\d+)?")


def other_arm(
    lesson: type[Lesson], text: LessonText, question: str, robot_id: str, source: random.Random
) -> Robot:
    """One of the lesson's arms for which the question with this key differs in its numbers alone.

    If there is none, the arm of this id, or the lesson's first one if it asks about no arm of this id.
    """
    first = robot_id if robot_id in text.arms else text.arms[0]
    asked = _question(lesson, text, question, get_robot(first))
    others = [get_robot(arm) for arm in text.arms if arm != first]
    source.shuffle(others)
    for other in others:
        found = _question(lesson, text, question, other)
        if asked is not None and found is not None and _differ_in_numbers(asked, found):
            return other
    return get_robot(robot_id if robot_id in text.every_arm else first)


def _question(lesson: type[Lesson], text: LessonText, key: str, robot: Robot) -> Question | None:
    return dict(lesson.outline_in(robot, DEFAULT_UNITS, text).questions()).get(key)


def _differ_in_numbers(a: Question, b: Question) -> bool:
    words = [_NUMBER.sub("#", one.prompt) for one in (a, b)]
    forms = [(one.asked().form, len(one.asked().labels), one.asked().units) for one in (a, b)]
    return words[0] == words[1] and forms[0] == forms[1] and a.solution() != b.solution()
