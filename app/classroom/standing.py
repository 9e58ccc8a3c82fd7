"""How a student is doing: the one value from which list, chips, wall, bar, results and CSV are drawn.

What a student has done follows from the stored answers (:mod:`app.classroom.work`), the rest from the room.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.classroom.views import RoomView, SeatView
from app.classroom.work import NOTHING, URGENCY, Progress, Work

Presence = Literal["following", "by themselves", "away", "not here yet"]


@dataclass(frozen=True)
class Standing:
    """How a student is doing.

    Attributes:
        hand: whether it is up.
        exercise: what `progress` is about: the task of the room, else what the page shows; empty: nothing.
        progress: None without an exercise.
        elsewhere: whether the page shows something else than the task.
        driven: what a program drives with the arm, or empty.
    """

    presence: Presence
    hand: bool
    exercise: str
    progress: Progress | None
    work: Work
    elsewhere: bool = False
    driven: str = ""

    @property
    def here(self) -> bool:
        """Whether a page of the student is connected."""
        return self.presence in ("following", "by themselves")

    @property
    def came(self) -> bool:
        """Whether one ever was."""
        return self.presence != "not here yet"

    @property
    def rank(self) -> tuple[bool, bool, bool, bool, int]:
        """Sorts students: who drives something, then who needs the teacher; last the away and the absent."""
        urgency = URGENCY.index(self.progress or "at it")
        return not self.came, not self.here, not self.driven, not self.hand, urgency


def standing(seat: SeatView, room: RoomView) -> Standing:
    """How a student of a room is doing."""
    if seat.away:
        presence: Presence = "away" if seat.came else "not here yet"
    else:
        led = room.follow or (room.shown is not None and room.shown.seat != seat.id)
        presence = "following" if led and not seat.gone else "by themselves"
    exercise = seat.task if room.task is None else room.task.exercise
    work = seat.work.get(exercise, NOTHING)
    progress = work.progress if exercise else None
    elsewhere = bool(exercise) and seat.task != exercise
    driven = "" if seat.away else seat.driven
    return Standing(presence, seat.hand > 0.0, exercise, progress, work, elsewhere, driven)
