"""How a student is doing: the one value from which list, chips, wall, bar, results and CSV are drawn.

What a student has done follows from the stored answers alone (`works`): a reload, a second tab or a raised hand
change nothing about it. Where the student is follows from the room (`standing`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal, get_args

if TYPE_CHECKING:
    from app.classroom.views import RoomView, SeatView

ANSWER_SHOWN = "The answer was shown."  # the verdict of a request for the right answer
SHOWN_ANSWER = 400  # characters of an answer as JSON that are read to show it
STUCK_TRIES = 3  # answers without a right one

Progress = Literal["not begun", "at it", "stuck", "gave up", "solved"]
Presence = Literal["following", "by themselves", "away", "has not come"]
Settled = Literal["open", "right", "shown"]
# In the order in which they need the teacher.
URGENCY: tuple[Progress, ...] = ("stuck", "gave up", "not begun", "at it", "solved")
PRESENCES: tuple[Presence, ...] = get_args(Presence)


@dataclass(frozen=True)
class Attempt:
    """One stored answer of a student, or request for the right one.

    Attributes:
        seat, alias: whose.
        number: of the seat: 1 for who joined the room first.
        answer: plain data, as it was given, or the beginning of its JSON; None where it was not read.
        score: 0 to 1.
        started, at: seconds since 1970.
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
            self.tries + (not one.gave_up), max(self.score, one.score), began, found, one.gave_up, *last,
            MappingProxyType({**self.numbers, one.seed: numbers}),
        )  # fmt: skip


NOTHING = Work()


def works(attempts: Iterable[Attempt]) -> dict[str, dict[str, Work]]:
    """The work of each seat, by exercise; attempts come in the order of time."""
    found: dict[str, dict[str, Work]] = {}
    for one in attempts:
        mine = found.setdefault(one.seat, {})
        mine[one.exercise] = mine.get(one.exercise, NOTHING).plus(one)
    return found


@dataclass(frozen=True)
class Standing:
    """How a student is doing.

    Attributes:
        hand: whether it is up.
        exercise: what `progress` is about: the task of the room, else what the page shows; empty: nothing.
        progress: None without an exercise.
        elsewhere: whether the page shows something else than the task.
    """

    presence: Presence
    hand: bool
    exercise: str
    progress: Progress | None
    work: Work
    elsewhere: bool = False

    @property
    def here(self) -> bool:
        """Whether a page of the student is connected."""
        return self.presence in ("following", "by themselves")

    @property
    def came(self) -> bool:
        """Whether one ever was."""
        return self.presence != "has not come"

    @property
    def rank(self) -> tuple[bool, bool, bool, int]:
        """Sorts students: who needs the teacher first; then who is away, and who has never come."""
        urgency = URGENCY.index(self.progress or "at it")
        return not self.came, not self.here, not self.hand, urgency


def standing(seat: SeatView, room: RoomView) -> Standing:
    """How a student of a room is doing."""
    if seat.away:
        presence: Presence = "away" if seat.seen else "has not come"
    else:
        led = room.follow or (room.shown is not None and room.shown.seat != seat.id)
        presence = "following" if led and not seat.gone else "by themselves"
    exercise = seat.task if room.task is None else room.task.exercise
    work = seat.work.get(exercise, NOTHING)
    progress = work.progress if exercise else None
    return Standing(presence, seat.hand > 0.0, exercise, progress, work, bool(exercise) and seat.task != exercise)
