"""What a class got wrong: for each exercise the reasons of wrong answers, in the words for one of the students."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from app.classroom.results.gains import first_scores
from app.classroom.results.table import Member
from app.classroom.work import Attempt

MOST = 6  # reasons of an exercise
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
class Mistakes:
    """What was wrong with the answers to an exercise.

    Attributes:
        students: how many have answered it, or asked for the answer.
        first: how many of them were right at the first try.
        reasons: those of the most students first, `MOST` at most.
    """

    exercise: str
    students: int
    first: int
    reasons: tuple[Reason, ...]


def mistakes(members: Iterable[Member], attempts: Sequence[Attempt]) -> list[Mistakes]:
    """Of each exercise with a wrong answer, in the order of the first ones; attempts come in the order of time."""
    names = {one.seat: one.alias for one in sorted(members, key=lambda one: one.number)}
    wrong: dict[str, dict[str, tuple[str, set[str]]]] = {}  # exercise, words without numbers: words, seats
    for one in attempts:
        if one.seat in names and one.score < 1.0 and not one.gave_up:
            reasons = wrong.setdefault(one.exercise, {})
            reasons.setdefault(NUMBERS.sub(r"\1", one.verdict), (one.verdict, set()))[1].add(one.seat)
    first = {key: score for key, score in first_scores(attempts).items() if key[0] in names}
    found = []
    for exercise, reasons in wrong.items():
        scores = [score for (_, asked), score in first.items() if asked == exercise]
        listed = sorted(reasons.values(), key=lambda reason: -len(reason[1]))[:MOST]
        said = tuple(
            Reason(words, tuple(names[seat] for seat in names if seat in seats)) for words, seats in listed
        )
        found.append(Mistakes(exercise, len(scores), sum(s >= 1.0 for s in scores), said))
    return found
