"""What a class makes of each exercise: figures of classical test theory, and the causes of wrong answers.

An exercise is an item of a test. Its difficulty is the share of students who are right at the first try: later
tries have seen a verdict. Its discrimination is the point-biserial correlation of being right with the rest score,
the share of their other exercises in which students were right: with the item itself in the score, it would be too
high (Crocker and Algina, *Introduction to Classical and Modern Test Theory*, 1986, chapter 14; Allen and Yen,
*Introduction to Measurement Theory*, 1979).
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import correlation, median

from app.classroom.results.table import Member
from app.classroom.work import Attempt
from app.exercises.questions import RELATED, WRITTEN

MOST = 6  # causes of an exercise
FEW = 8  # students, below whom nothing is said about an exercise
EASY, HARD = 0.95, 0.2  # shares of students who are right at the first try
LEAST_DISCRIMINATION = 0.2  # below, an item is to be eliminated, or completely revised (Ebel, 1965)
# Numbers of the arm's parts are the same for all students, others are each student's own.
NUMBERS = re.compile(
    r"\b((?:row|joint|frame|link|column|axis) \d+"
    r"|(?:rows|joints|frames|links|columns|axes) \d+(?:(?:,| and| to) \d+)*)"
    r"|[−-]?\d+(?:[.,]\d+)?",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Reason:
    """A reason why answers were wrong, in the words for the first of the students who gave such answers.

    Reasons that differ by the numbers in them alone, which are each student's own, are one.
    """

    words: str
    students: tuple[str, ...]


@dataclass(frozen=True)
class Cause:
    """A mistake that led to wrong answers.

    Attributes:
        code: as `app.exercises.questions.Verdict` has it; empty: the mistake is known by its words alone.
        reasons: those of the most students first.
        students: how many gave such answers; each of them is in one of the reasons, or in several.
    """

    code: str
    reasons: tuple[Reason, ...]
    students: int


@dataclass(frozen=True)
class Item:
    """The figures of an exercise.

    Attributes:
        students: how many have answered it, or asked for the answer.
        first: how many of them were right at the first try.
        looked: how many asked for the answer.
        seconds: the median time until the first answer, from when it was opened last; None: there is none.
        compared: how many students the discrimination is of.
        discrimination: None: fewer than `FEW`, or all alike.
        causes: those of the most students first, `MOST` at most.
    """

    exercise: str
    students: int
    first: int
    looked: int
    seconds: float | None
    compared: int
    discrimination: float | None
    causes: tuple[Cause, ...]

    @property
    def remark(self) -> str:
        """What is wrong with the exercise for this class, as a sentence; empty: nothing that is certain."""
        if self.students >= FEW and self.first >= EASY * self.students:
            return f"Too easy: {100 * EASY:.0f} % or more are right at the first try."
        if self.students >= FEW and self.first <= HARD * self.students:
            return f"Too hard: {100 * HARD:.0f} % or fewer are right at the first try."
        r = self.discrimination
        if r is not None and r + 1.0 / math.sqrt(self.compared - 1) < LEAST_DISCRIMINATION:  # its standard error
            return "Does not discriminate: students who are right in the rest are hardly more often right here."
        return ""


def items(members: Iterable[Member], attempts: Sequence[Attempt], order: Sequence[str] = ()) -> list[Item]:
    """Of each exercise with an answer: those of `order` first, then in the order of the first answers.

    Args:
        attempts: in the order of time.
    """
    names = {one.seat: one.alias for one in sorted(members, key=lambda one: one.number)}
    mine = [one for one in attempts if one.seat in names]
    first: dict[str, dict[str, Attempt]] = {key: {} for key in order}  # by exercise and seat
    looked: dict[str, set[str]] = {}
    for one in mine:
        first.setdefault(one.exercise, {}).setdefault(one.seat, one)
        if one.gave_up:
            looked.setdefault(one.exercise, set()).add(one.seat)
    tried = Counter(seat for tries in first.values() for seat in tries)
    right = Counter(seat for tries in first.values() for seat, one in tries.items() if one.score >= 1.0)
    wrong = _causes(names, mine)
    found: list[Item] = []
    for exercise, tries in first.items():
        others = [seat for seat in tries if tried[seat] > 1]
        scores = [float(tries[seat].score >= 1.0) for seat in others]
        rest = [(right[seat] - score) / (tried[seat] - 1) for seat, score in zip(others, scores, strict=True)]
        seconds = [max(0.0, one.at - one.started) for one in tries.values() if not one.gave_up]
        if tries:
            found.append(
                Item(
                    exercise,
                    len(tries),
                    sum(one.score >= 1.0 for one in tries.values()),
                    len(looked.get(exercise, ())),
                    median(seconds) if seconds else None,
                    len(others),
                    _correlation(scores, rest),
                    wrong.get(exercise, ()),
                )
            )
    return found


def _correlation(scores: list[float], rest: list[float]) -> float | None:
    if len(scores) < FEW or len(set(scores)) < 2 or len(set(rest)) < 2:
        return None
    return correlation(scores, rest)


def _causes(names: dict[str, str], attempts: Iterable[Attempt]) -> dict[str, tuple[Cause, ...]]:
    """The causes of wrong answers, by exercise."""
    wrong: dict[str, dict[tuple[str, str], dict[str, tuple[str, set[str]]]]] = {}
    for one in attempts:
        if one.score < 1.0 and not one.gave_up:
            words = NUMBERS.sub(r"\1", one.verdict)
            code = "" if one.cause in (WRITTEN, RELATED) else one.cause
            reasons = wrong.setdefault(one.exercise, {}).setdefault((code, "" if code else words), {})
            reasons.setdefault(words, (one.verdict, set()))[1].add(one.seat)
    found = {}
    for exercise, causes in wrong.items():
        counted = [
            (len(set[str]().union(*(seats for _, seats in reasons.values()))), code, reasons)
            for (code, _), reasons in causes.items()
        ]
        most = sorted(counted, key=lambda cause: -cause[0])[:MOST]
        found[exercise] = tuple(Cause(code, _reasons(names, reasons), count) for count, code, reasons in most)
    return found


def _reasons(names: dict[str, str], reasons: dict[str, tuple[str, set[str]]]) -> tuple[Reason, ...]:
    listed = sorted(reasons.values(), key=lambda reason: -len(reason[1]))
    return tuple(Reason(words, tuple(names[seat] for seat in names if seat in seats)) for words, seats in listed)
