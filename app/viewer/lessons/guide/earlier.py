"""What a check asks of earlier lessons: two exercises with new numbers, first what the student has missed.

They are asked in words and fields below the questions of the check, and leave the scene to these.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Final

from app.exercises import Exercise, Exercises, VariantError
from app.exercises.contract import Posed
from app.exercises.lessons import LESSONS
from app.viewer.activity.activity import Activity
from app.viewer.activity.practice import MOST
from app.viewer.lessons.guide.outline import Question
from kin.units import Units

COUNT: Final = 2
HARDEST: Final = 2  # level

Drawn = tuple[str, int]  # the id of an exercise and the seed of its numbers


def choose(lesson: str, activity: Activity, source: random.Random | None = None) -> tuple[Drawn, ...]:
    """Two exercises of lessons before this one, or as many as there are.

    What was missed comes first, then what belongs to a lesson in which something was missed; if nothing else
    decides, they are of different lessons.
    """
    source = source or random.Random()
    before = LESSONS[: LESSONS.index(lesson)] if lesson in LESSONS else ()
    missed = activity.review.missed
    lessons = {one.lesson for one in missed.values()}

    def rank(one: Exercise) -> int:
        return 0 if one.id in missed else 1 if one.lesson in lessons else 2

    found = [one for one in activity.courses.exercises.all if one.lesson in before and _fits(one, activity)]
    source.shuffle(found)
    chosen: list[Exercise] = []
    while found and len(chosen) < COUNT:
        used = {one.lesson for one in chosen}
        chosen.append(best := min(found, key=lambda one: (rank(one), one.lesson in used)))
        found.remove(best)
    return tuple((one.id, source.randrange(1, MOST)) for one in chosen)


def _fits(exercise: Exercise, activity: Activity) -> bool:
    """Whether the text of an exercise asks it by itself, and its answer may be shown."""
    by_itself = exercise.kind.in_words and exercise.target is None and exercise.level <= HARDEST
    return by_itself and exercise != activity.task and activity.reveals(exercise)


def read(value: object, exercises: Exercises) -> tuple[Drawn, ...]:
    """What the state of a page says was chosen; entries that are not valid are left out."""
    found: list[Drawn] = []
    for entry in value[:COUNT] if isinstance(value, list) else ():
        match entry:
            case [str(exercise_id), int(seed)] if type(seed) is int and 0 < seed < MOST:
                exercise = exercises.get(exercise_id)
                if exercise is not None and exercise.kind.in_words and exercise.target is None:
                    found.append((exercise_id, seed))
    return tuple(found)


def questions(drawn: tuple[Drawn, ...], exercises: Exercises, units: Units) -> dict[str, Question]:
    """The questions, with the keys r1 and r2."""
    made: dict[str, Question] = {}
    for number, (exercise_id, seed) in enumerate(drawn, 1):
        exercise = exercises.get(exercise_id)
        if exercise is None:
            continue
        try:
            variant = exercise.variant(seed)
        except VariantError:  # of an operator's file that was not checked
            continue
        text = f"{exercise.robot.name}. {variant.text(exercise.text, units)}"
        made[f"r{number}"] = Earlier(text, exercise.kind, variant, units, exercise)
    return made


@dataclass(frozen=True, eq=False)
class Earlier(Posed):
    """The question of an exercise, with its own words on the answer."""

    exercise: Exercise

    def solution(self) -> str:
        return self.exercise.solution(self.variant, self.units)
