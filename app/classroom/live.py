"""The live copy of a room in one process: what the database last said, and what it does not know yet.

No locks and no threads here: `app.classroom.hub` sees to both.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Set
from dataclasses import dataclass, field
from typing import Any

from app.classroom.clock import steady
from app.classroom.views import Poll, RoomView, SeatView, Shown, Task, Ticket

AWAY = 7.0  # seconds without a beat after which nobody is assumed to be there
SILENT_AWAY = 2.5  # the same where a page is connected and silent: the beats of other processes come every 2 s
REMOVED = "The teacher has removed you."
MOST_OWN = 40_000  # characters of the texts of own exercises: the state is read with each change of the room
MOST_VERSIONS = 4  # of one of them
_UNSEEN = {"beat", "version", "tries"}  # columns that no page shows
_PAGE = {"page"}


@dataclass
class LiveSeat:
    """One seat: the columns of its row with its work by exercise, and when its beat was last seen to grow."""

    row: dict[str, Any]
    heard: float = field(default_factory=steady)


@dataclass
class Pending:
    """What the database does not know yet."""

    page: str | None = None
    state: dict[str, Any] = field(default_factory=dict)
    seats: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return self.page is not None or bool(self.state or self.seats)

    def add_older(self, older: Pending) -> None:
        """Put back what could not be stored."""
        self.page = older.page if self.page is None else self.page
        self.state = {**older.state, **self.state}
        for seat, values in older.seats.items():
            self.seats[seat] = {**values, **self.seats.get(seat, {})}


class LiveRoom:
    """The room's row, its seats, and what is pending."""

    def __init__(self, room: str) -> None:
        self.id = room
        self.row: dict[str, Any] = {}
        self.state: dict[str, Any] = {}
        self.seats: dict[str, LiveSeat] = {}
        self.pending = Pending()
        self.flying = Pending()  # on its way into the database
        self.retry_at = -math.inf  # when `pending` is tried again, after an error that is this room's alone
        self.pages: dict[str, str] = {}  # newest states of students' pages, for the next time they are due
        self._paged = -math.inf  # when they were last taken
        self._seen_by_all = self._seen_by_teacher = 0  # counts of changes
        self.heard = steady()  # when the teacher's beat was last seen to grow
        self.here: set[str] = set()  # seats with a page in this process; the teacher's is ""
        self.silent: set[str] = set()  # seats whose pages in this process are connected and say nothing
        self.away: frozenset[str] = frozenset()
        self.closed = ""
        self.problem = ""

    @property
    def version(self) -> int:
        """The version up to which everything is known; -1: nothing is."""
        return int(self.row.get("version", -1))

    def stamp(self, ticket: Ticket) -> Hashable:
        """Another one whenever what `view` returns has changed, but for the own page of a seat.

        Most changes in a class are arms that move, which concern the teacher's page alone.
        """
        return self._seen_by_all, self.closed, self.problem, 0 if ticket.seat else self._seen_by_teacher

    def is_shown(self, seat: str) -> bool:
        """Whether the teacher shows the arm of this seat to all."""
        shown = self.state.get("shown")
        return shown is not None and shown["seat"] == seat

    def _note(self, seat: str, columns: Set[str]) -> None:
        """Count a change of these columns of a seat. The page of a seat is for the teacher to see."""
        if columns - _PAGE or (columns and self.is_shown(seat)):
            self._seen_by_all += 1
        elif columns:
            self._seen_by_teacher += 1

    def load(self, row: Mapping[str, Any], seats: list[dict[str, Any]]) -> None:
        """Take over what the database says; what is pending or on its way is newer."""
        if self.row and row["beat"] != self.row["beat"]:
            self.heard = steady()
        newer = self.pending.page is not None or self.flying.page is not None
        page = self.row.get("page", "") if newer else row["page"]
        before = self.row, self.state
        self.row = {**row, "page": page}
        self.state = {**row["state"], **self.flying.state, **self.pending.state}
        if self.state != before[1] or _changed(before[0], self.row) - {"state"}:
            self._seen_by_all += 1
        for new in seats:
            known = self.seats.get(new["id"])
            pending = {**self.flying.seats.get(new["id"], {}), **self.pending.seats.get(new["id"], {})}
            if known is None:
                self.seats[new["id"]] = LiveSeat({"work": {}, **new, **pending})
                self._seen_by_all += 1
                continue
            if new["beat"] != known.row["beat"]:
                known.heard = steady()
            before_seat, known.row = known.row, {"work": known.row["work"], **new, **pending}
            self._note(new["id"], _changed(before_seat, known.row))

    def tell_page(self, page: str) -> None:
        """The teacher's page, shared with all."""
        self.row["page"] = self.pending.page = page
        self._seen_by_all += 1

    def tell_state(self, values: dict[str, Any]) -> None:
        """What the teacher has set."""
        self.state.update(values)
        self.pending.state.update(values)
        self._seen_by_all += 1

    def tell_own(self, own: Mapping[str, str]) -> None:
        """Keep the texts of exercises that only the teacher has: results name them after another one was sent.

        Of each there is a list of its different texts, the newest at the end. Where older ones were left out, it
        begins with an empty text. If there are too many, those that were sent longest ago are forgotten.
        """
        if not own:
            return
        kept: dict[str, list[str]] = dict(self.state.get("own") or {})
        for key, text in own.items():
            texts = [*(one for one in kept.pop(key, []) if one != text), text]
            kept[key] = texts if len(texts) <= MOST_VERSIONS else ["", *texts[1 - MOST_VERSIONS :]]
        while len(kept) > len(own) and sum(len(one) for texts in kept.values() for one in texts) > MOST_OWN:
            del kept[next(iter(kept))]
        self.tell_state({"own": kept})

    def tell_seat(self, seat: str, values: dict[str, Any]) -> None:
        """What a student did."""
        if seat in self.seats and not self.seats[seat].row["removed"]:
            self.seats[seat].row.update(values)
            self.pending.seats.setdefault(seat, {}).update(values)
            self._note(seat, set(values))

    def note_beats(self, seats: Set[str]) -> None:
        """These have a page in this process, and the database knows."""
        for seat in seats & self.seats.keys():
            self.seats[seat].heard = steady()
        if "" in seats:
            self.heard = steady()

    def take_pages(self, every: float) -> bool:
        """Take the students' pages if it is time, all together; returns whether there were any."""
        time = steady()
        if not self.pages or time - self._paged < every:
            return False
        self._paged = time
        pages, self.pages = self.pages, {}
        for seat, page in pages.items():
            self.tell_seat(seat, {"page": page})
        return True

    def note_absence(self) -> bool:
        """Find out who is away; returns whether that has changed."""
        time = steady()
        heard = {"": self.heard, **{seat: live.heard for seat, live in self.seats.items()}}
        away = {
            seat
            for seat, last in heard.items()
            if seat not in self.here and last < time - (SILENT_AWAY if seat in self.silent else AWAY)
        }
        changed = away != self.away
        self.away = frozenset(away)
        self._seen_by_all += changed
        return changed

    def view(self, ticket: Ticket) -> RoomView:
        """What one page may see."""
        if self.closed or not self.row:
            return RoomView(self.id, closed=self.closed, problem=self.problem)
        mine = self.seats.get(ticket.seat)
        if ticket.seat and (mine is None or mine.row["removed"]):
            return RoomView(self.id, closed=REMOVED)
        present = [live.row for live in self.seats.values() if not live.row["removed"]]
        seats: tuple[SeatView, ...] = ()
        if not ticket.seat:
            present.sort(key=lambda row: (row["joined"], row["id"]))
            seats = tuple(self._seat(row) for row in present)
        row, state = self.row, self.state
        task = state.get("task")
        return RoomView(
            id=self.id,
            code=row["code"],
            title=row["title"],
            created=row["created"],
            ends=row["ends"],
            page=row["page"],
            follow=bool(state.get("follow")),
            frozen=bool(state.get("frozen")),
            task=None if task is None else Task(task["exercise"], task["at"], task.get("own", "")),
            shown=self._shown(),
            poll=self._poll(present, None if mine is None else mine.row),
            course=state.get("course") or "",
            course_at=float(state.get("course_at") or 0.0),
            own={} if ticket.seat else {key: tuple(texts) for key, texts in (state.get("own") or {}).items()},
            teacher_away="" in self.away,
            students=len(present),
            seat=None if mine is None else self._seat(mine.row),
            seats=seats,
            problem=self.problem,
        )

    def _seat(self, row: Mapping[str, Any]) -> SeatView:
        names = ("id", "alias", "hand", "task", "gone", "driven", "work", "page")
        seen = row["beat"] > 0 or row["id"] in self.here
        return SeatView(**{name: row[name] for name in names}, away=row["id"] in self.away, seen=seen)

    def _shown(self) -> Shown | None:
        shown = self.state.get("shown")
        seat = None if shown is None else self.seats.get(shown["seat"])
        if shown is None or seat is None or seat.row["removed"]:
            return None
        return Shown(shown["seat"], seat.row["alias"] if shown["named"] else "", seat.row["page"])

    def _poll(self, present: list[dict[str, Any]], mine: Mapping[str, Any] | None) -> Poll | None:
        poll = self.state.get("poll")
        if poll is None:
            return None
        choices = tuple(poll["choices"])
        votes = [0] * len(choices)
        for row in present:
            if row["voted"] == poll["id"] and 0 <= row["vote"] < len(choices):
                votes[row["vote"]] += 1
        chosen = mine["vote"] if mine is not None and mine["voted"] == poll["id"] else None
        return Poll(poll["id"], poll["question"], choices, poll["open"], tuple(votes), chosen)


def _changed(before: Mapping[str, Any], after: Mapping[str, Any]) -> set[str]:
    """The columns that pages show and that are not as they were."""
    return {name for name, value in after.items() if name not in _UNSEEN and before.get(name) != value}
