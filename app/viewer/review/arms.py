"""Another arm to ask the question of a lesson about: the same question has other numbers there."""

from __future__ import annotations

import random
import re
from collections.abc import Iterable

from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Question
from kin import Robot
from kin.solvers import family_of
from kin.units import DEFAULT_UNITS

TRIED = 6  # arms: each has all questions of the lesson made
_NUMBER = re.compile(r"[-−]?\d+(?:[.,]\d+)?")


def other_arm(
    lesson: type[Lesson], question: str, robot: Robot, robots: Iterable[Robot], source: random.Random
) -> Robot:
    """An arm for which the question with this key differs in its numbers alone; `robot` itself if there is none.

    Only arms of the same family are tried.
    """
    asked = _question(lesson, question, robot)
    others = [one for one in robots if one.id != robot.id and family_of(one) == family_of(robot)]
    source.shuffle(others)
    for other in others[:TRIED]:
        found = _question(lesson, question, other)
        if asked is not None and found is not None and _differ_in_numbers(asked, found):
            return other
    return robot


def _question(lesson: type[Lesson], key: str, robot: Robot) -> Question | None:
    return dict(lesson.outline(robot, DEFAULT_UNITS).questions()).get(key)


def _differ_in_numbers(a: Question, b: Question) -> bool:
    words = [_NUMBER.sub("#", one.prompt) for one in (a, b)]
    forms = [(one.asked().form, len(one.asked().labels), one.asked().units) for one in (a, b)]
    return words[0] == words[1] and forms[0] == forms[1] and a.solution() != b.solution()
