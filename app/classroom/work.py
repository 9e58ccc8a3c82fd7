"""What a student has done: answers as they are stored, and what has become of each exercise by them.

It follows from the stored answers alone: a reload, a second tab or a raised hand change nothing about it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

ANSWER_SHOWN = "The answer was shown."  # the verdict of a request for the right answer
SHOWN_ANSWER = 400  # characters of an answer as JSON that are read to show it
STUCK_TRIES = 3  # answers without a right one

Progress = Literal["not begun", "at it", "stuck", "gave up", "solved"]
Settled = Literal["open", "right", "shown"]
# In the order in which they need the teacher.
URGENCY: tuple[Progress, ...] = ("stuck", "gave up", "not begun", "at it", "solved")


@dataclass(frozen=True)
class Attempt:
    """One stored answer of a student, or request for the right one.

    Attributes:
        seat, alias: whose.
        number: of the seat: 1 for who joined the room first.
        answer: plain data, as it was given, or the beginning of its JSON; None where it was not read.
        score: 0 to 1.
        started, at: seconds since 1970.
        cause: of a wrong answer, the code of the mistake, as `app.exercises.questions.Verdict` has it.
    """

    seat: str
    alias: str
    exercise: str
    seed: int
    answer: object
    verdict: str
    score: float
    started: float
    at: float
    number: int = 0
    cause: str = ""

    @property
    def gave_up(self) -> bool:
        """Whether it is a request for the right answer."""
        return self.verdict == ANSWER_SHOWN


@dataclass(frozen=True)
class Numbers:
    """One student's work on one exercise with the numbers of one seed.

    Attributes:
        tries: answers so far.
        credit: the best score, 0 to 1.
        settled: whether the right answer was found, or shown.
    """

    tries: int = 0
    credit: float = 0.0
    settled: Settled = "open"


@dataclass(frozen=True)
class Work:
    """One student's work on one exercise.

    Attributes:
        tries: answers so far; a request for the right one is none.
        score: of the best, 0 to 1.
        began: when the student began, in seconds since 1970.
        found: when the first right answer came; None: there is none.
        shown: whether the right answer was asked for after the last answer.
        seed, answer, verdict: of the last answer, which is no request for the right one.
        numbers: the same by seed.
    """

    tries: int = 0
    score: float = 0.0
    began: float = 0.0
    found: float | None = None
    shown: bool = False
    seed: int = 0
    answer: object = None
    verdict: str = ""
    numbers: Mapping[int, Numbers] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def progress(self) -> Progress:
        """What has become of it. What was solved once stays solved."""
        if self.found is not None:
            return "solved"
        if self.shown:
            return "gave up"
        if self.tries >= STUCK_TRIES:
            return "stuck"
        return "at it" if self.tries else "not begun"

    def plus(self, one: Attempt) -> Work:
        """With one more attempt, the newest."""
        known = self.numbers.get(one.seed, Numbers())
        right = one.score >= 1.0
        settled: Settled = "right" if right else "shown" if one.gave_up else known.settled
        if known.settled != "open":
            settled = known.settled
        began = min(self.began, one.started) if self.numbers else one.started
        numbers = Numbers(known.tries + (not one.gave_up), max(known.credit, one.score), settled)
        last = (self.seed, self.answer, self.verdict) if one.gave_up else (one.seed, one.answer, one.verdict)
        found = one.at if right and self.found is None else self.found
        return Work(
            self.tries + (not one.gave_up),
            max(self.score, one.score),
            began,
            found,
            one.gave_up,
            *last,
            MappingProxyType({**self.numbers, one.seed: numbers}),
        )


NOTHING = Work()


def works(attempts: Iterable[Attempt]) -> dict[str, dict[str, Work]]:
    """The work of each seat, by exercise; attempts come in the order of time."""
    found: dict[str, dict[str, Work]] = {}
    for one in attempts:
        mine = found.setdefault(one.seat, {})
        mine[one.exercise] = mine.get(one.exercise, NOTHING).plus(one)
    return found
