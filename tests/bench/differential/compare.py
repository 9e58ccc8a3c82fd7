"""Two answers to one question: identical, equal within 1e-9, or different, and in what."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np

from differential.answers import Answer
from differential.intervals import Judged, judge
from differential.questions import Question

CLOSE = 1e-9  # radians or metres


class Grade(IntEnum):
    """How alike two answers are."""

    IDENTICAL = 0
    CLOSE = 1
    DIFFERENT = 2


@dataclass(slots=True)
class Verdict:
    """The comparison of one question.

    Attributes:
        grades: of each part that is not identical.
        judged: intervals that only one tree has.
    """

    number: int
    grades: dict[str, Grade] = field(default_factory=dict)
    judged: list[Judged] = field(default_factory=list)

    @property
    def grade(self) -> Grade:
        """That of the part which differs most."""
        return max(self.grades.values(), default=Grade.IDENTICAL)

    def __str__(self) -> str:
        parts = [part for part, grade in self.grades.items() if grade is self.grade]
        wrong = [judged for judged in self.judged if judged.wrong]
        for judged in wrong[:1]:
            low, high = judged.interval
            what = "infeasible and new" if judged.new else "feasible and lost"
            parts.append(f"{what}: [{low!r}, {high!r}] on {judged.branch!r}")
        return ", ".join(parts)


def compare(robot: Any, number: int, old: Answer, new: Answer) -> Verdict:
    """What differs between the answers of two trees. The question is made again only if intervals are judged."""
    grades = {
        "status": _same(old.status, new.status),
        "cause": _same((old.cause, old.solver), (new.cause, new.solver)),
        "branches": _same(old.branches, new.branches),
        "intervals": grade_of(_flat(old), _flat(new)),
    }
    for name in dict.fromkeys((*old.arrays, *new.arrays)):
        pair = old.arrays.get(name), new.arrays.get(name)
        grades[name] = Grade.DIFFERENT if pair[0] is None or pair[1] is None else grade_of(pair[0], pair[1])
    verdict = Verdict(number, {part: grade for part, grade in grades.items() if grade})
    if grades["intervals"] is Grade.DIFFERENT or grades["branches"] is Grade.DIFFERENT:
        verdict.judged = judge(Question.of(robot, number), old, new)
    return verdict


def grade_of(old: np.ndarray, new: np.ndarray) -> Grade:
    """How alike two arrays are; the same shape and NaN at the same places, or they are different."""
    if old.shape != new.shape:
        return Grade.DIFFERENT
    if old.tobytes() == new.tobytes() or np.array_equal(old, new, equal_nan=True):
        return Grade.IDENTICAL
    return Grade.CLOSE if np.allclose(old, new, rtol=0.0, atol=CLOSE, equal_nan=True) else Grade.DIFFERENT


def _same(old: object, new: object) -> Grade:
    return Grade.IDENTICAL if old == new else Grade.DIFFERENT


def _flat(answer: Answer) -> np.ndarray:
    """All redundancy parameters and their intervals in one row, with their numbers."""
    found = [float(len(answer.ranges))]
    for ranges in answer.ranges:
        for _, value, intervals in ranges:
            found += [value, float(len(intervals)), *(end for interval in intervals for end in interval)]
    return np.array(found)
