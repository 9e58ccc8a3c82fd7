"""A room in memory: what its pages see of each other, and what they report.

What must not be lost, such as a seat or an answer, is stored first and then taken over (`take`). What pages report
all the time, such as arms, is seen at once and stored soon after: `unsaved` names what the database does not have.
No SQL and no threads here, but locks: pages call from theirs.
"""

from __future__ import annotations

import contextlib
import logging
import math
import threading
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from app.classroom.clock import steady
from app.classroom.views import BUSY, ClassroomUnavailable, Poll, Recalled, RoomView, SeatView, Shown, Task, Ticket

logger = logging.getLogger("kinboard.classroom")

AWAY = 7.0  # seconds without a sign of a page's browser, which is asked for one every two seconds
REMOVED = "The teacher has removed you."
MOST_OWN = 40_000  # characters of the texts of own exercises: the state is stored with each change of it
MOST_VERSIONS = 4  # of one of them
REPORTED = ("hand", "task", "gone", "driven", "recalled", "voted", "vote", "page", "beat")  # columns of a seat


@dataclass
class Place:
    """One page in the room.

    Attributes:
        changed: called after each change that the page can see, from any thread.
        silence: for how many seconds nothing has come from the page's browser.
        stamp: of what the page was last notified of.
    """

    ticket: Ticket
    changed: Callable[[], None]
    silence: Callable[[], float]
    stamp: Hashable = None


class LiveRoom:
    """The room's row, its seats' rows with the work of each, and its pages.

    Attributes:
        row: empty until it has been read.
        unsaved: columns that were reported and are not stored, by seat; for "", the room's `page` and names of its
            `state`.
        retry_at: when (`steady`'s) the database is asked again after an error.
        looked_at: when it was last asked what other programs have changed.
    """

    def __init__(self, room: str) -> None:
        self.id = room
        self.row: dict[str, Any] = {}
        self.seats: dict[str, dict[str, Any]] = {}
        self.places: list[Place] = []
        self.unsaved: dict[str, set[str]] = {}
        self.retry_at = self.looked_at = -math.inf
        self.away: frozenset[str] = frozenset()
        self.closed = self.problem = ""
        self.lock = threading.RLock()
        self._turn = threading.Lock()
        self._arms: dict[str, str] = {}  # newest states of students' pages, for the next `take_arms`
        self._since, self._heard = steady(), dict[str, float]()  # when a page of a seat gave its last sign
        self._seen_by_all = self._seen_by_teacher = 0  # counts of changes

    @property
    def version(self) -> int:
        """The version of the database's room that is in memory; -1: none is."""
        return int(self.row.get("version", -1))

    @property
    def following(self) -> bool:
        """Whether pages follow the teacher's."""
        return bool(self.row.get("state", {}).get("follow"))

    def knows(self, seat: str) -> bool:
        """Whether the room has been read, and a seat ("" for the teacher's) was in it."""
        with self.lock:
            return bool(self.row) and (not seat or seat in self.seats)

    @property
    def present(self) -> list[dict[str, Any]]:
        """The rows of the seats that were not removed, in the order of joining."""
        with self.lock:
            rows = [row for row in self.seats.values() if _there(row)]
        return sorted(rows, key=lambda row: (row["joined"], row["id"]))

    @contextlib.contextmanager
    def turn(self, wait: float) -> Iterator[None]:
        """Held while this room is read or stored; raises `ClassroomUnavailable`."""
        if not self._turn.acquire(timeout=wait):
            raise ClassroomUnavailable(BUSY)
        try:
            yield
        finally:
            self._turn.release()

    # What the database says

    def load(self, row: Mapping[str, Any], seats: Iterable[Mapping[str, Any]]) -> None:
        """Take over everything; reports that are not stored yet are newer."""
        with self.lock:
            known, state = self.seats, self.row.get("state", {})
            state = {**row["state"], **self._newer("", state)}
            self.row = {**row, **self._newer("", self.row), "state": state}
            self.seats = {one["id"]: {**one, **self._newer(one["id"], known.get(one["id"], {}))} for one in seats}
            self._seen_by_all += 1

    def _newer(self, seat: str, row: Mapping[str, Any]) -> dict[str, Any]:
        return {name: row[name] for name in self.unsaved.get(seat, ()) if name in row}

    def take(self, version: int, seats: Mapping[str, Mapping[str, Any]]) -> None:
        """Take over columns of seats that have been stored."""
        with self.lock:
            self.row["version"] = version
            for seat, columns in seats.items():
                self.seats.setdefault(seat, {}).update(columns)
            self._seen_by_all += bool(seats)

    def reports(self) -> tuple[dict[str, set[str]], dict[str, Any], list[dict[str, Any]]]:
        """What is to be stored now: what was unsaved, columns of the room, and columns of each student's seat."""
        with self.lock:
            taken, self.unsaved = self.unsaved, {}
            room = {name: self.row[name] for name in ("state", "page")} if "" in taken else {}
            rows = [self.seats[seat] for seat in sorted(taken.keys() & self.seats.keys())]
            return taken, room, [{name: row[name] for name in ("id", *REPORTED)} for row in rows if _there(row)]

    def put_back(self, taken: Mapping[str, set[str]]) -> None:
        """What was taken by `reports` could not be stored."""
        with self.lock:
            for seat, names in taken.items():
                self.unsaved.setdefault(seat, set()).update(names)

    # What pages report

    def report(self, page: str | None, own: Mapping[str, str], **state: object) -> None:
        """The teacher's page, and what the teacher has set; `own` as in `with_own`."""
        with self.lock:
            if not self.row or self.closed:
                return
            unsaved = self.unsaved.setdefault("", set())
            if page is not None:
                self.row["page"] = page
                unsaved.add("page")
            if own:
                state["own"] = with_own(self.row["state"].get("own") or {}, own)
            self.row["state"] = {**self.row["state"], **state}
            unsaved.update(state)
            self._seen_by_all += 1
        self.notify()

    def report_seat(self, seat: str, **columns: object) -> None:
        """What a student did."""
        with self.lock:
            self._report_seat(seat, columns)
        self.notify()

    def report_recalled(self, seat: str, more: Recalled) -> None:
        """What a student was asked again, on top of what was reported before."""
        with self.lock:
            known = self.seats.get(seat, {}).get("recalled", ())
            self._report_seat(seat, {"recalled": [*more.plus(known)]})

    def _report_seat(self, seat: str, columns: Mapping[str, object]) -> None:
        row = self.seats.get(seat)
        if row is None or not _there(row) or self.closed or columns.items() <= row.items():
            return
        row.update(columns)
        self.unsaved.setdefault(seat, set()).update(columns)
        if columns.keys() == {"page"} and not self._is_shown(seat):
            self._seen_by_teacher += 1
        else:
            self._seen_by_all += 1

    def report_arm(self, seat: str, page: str) -> None:
        """The state of a student's page: at once if all see it, otherwise with those of others."""
        with self.lock:
            if not self._is_shown(seat):
                self._arms[seat] = page
                return
        self.report_seat(seat, page=page)

    def take_arms(self) -> None:
        """Show the newest states of students' pages, all together."""
        with self.lock:
            arms, self._arms = self._arms, {}
            for seat, page in arms.items():
                self._report_seat(seat, {"page": page})

    # Who is there

    def enter(self, place: Place) -> None:
        """A page takes part from now on."""
        with self.lock:
            self.places.append(place)
        self.look_who_is_there()

    def leave(self, place: Place) -> None:
        """A page has gone; the seat remains."""
        with self.lock:
            if place in self.places:
                self.places.remove(place)

    def look_who_is_there(self) -> None:
        """Find out who is away, and note who has come for the first time."""
        with self.lock:
            time = steady()
            for place in self.places:
                seat = place.ticket.seat
                self._heard[seat] = max(self._heard.get(seat, -math.inf), time - place.silence())
                if seat in self.seats and not self.seats[seat]["beat"]:
                    self._report_seat(seat, {"beat": 1})
            seats = ["", *self.seats]
            away = frozenset(seat for seat in seats if self._heard.get(seat, self._since) < time - AWAY)
            self._seen_by_all += away != self.away
            self.away = away

    def close(self, words: str) -> None:
        """The room has ended, or what is said of that has changed."""
        with self.lock:
            self.closed = words
            self.unsaved.clear()
        self.notify()

    def retry(self, pause: float, problem: str) -> None:
        """Leave the database alone for a while, and say why on all pages; 0 and "": all is well."""
        with self.lock:
            self.retry_at = steady() + pause if pause else -math.inf
            self.problem = problem
        self.notify()

    def notify(self) -> None:
        """Let those pages know for whom something has changed.

        Most changes in a class are arms that move, which concern the teacher's page alone.
        """
        with self.lock:
            seen, changed = (self._seen_by_all, self.closed, self.problem), []
            for place in self.places:
                stamp = (*seen, 0 if place.ticket.seat else self._seen_by_teacher)
                if stamp != place.stamp:
                    place.stamp = stamp
                    changed.append(place.changed)
        for each in changed:
            try:
                each()
            except Exception:
                logger.exception("a page could not be notified that its room has changed")

    # What pages see

    def view(self, ticket: Ticket) -> RoomView:
        """What one page may see."""
        with self.lock:
            if self.closed or not self.row:
                return RoomView(self.id, closed=self.closed, problem=self.problem)
            mine = self.seats.get(ticket.seat)
            if ticket.seat and (mine is None or not _there(mine)):
                return RoomView(self.id, closed=REMOVED)
            present = self.present
            seats = () if ticket.seat else tuple(self._seat(row) for row in present)
            row, state = self.row, self.row["state"]
            task = state.get("task")
            return RoomView(
                id=self.id,
                code=row["code"],
                title=row["title"],
                created=row["created"],
                ends=row["ends"],
                page=row["page"],
                follow=self.following,
                frozen=bool(state.get("frozen")),
                task=None if task is None else Task(task["exercise"], task["at"], task.get("own", "")),
                shown=self._shown(),
                poll=self._poll(present, mine),
                course=state.get("course") or "",
                course_at=float(state.get("course_at") or 0.0),
                exchanged=mine is not None and self._number(mine) % 2 == 0,
                own={} if ticket.seat else {key: tuple(texts) for key, texts in (state.get("own") or {}).items()},
                teacher_away="" in self.away,
                students=len(present),
                seat=None if mine is None else self._seat(mine),
                seats=seats,
                problem=self.problem,
            )

    def _number(self, seat: Mapping[str, Any]) -> int:
        """1 for who joined first; those who were removed count too, so it never changes."""
        place = seat["joined"], seat["id"]
        return sum((row["joined"], row["id"]) <= place for row in self.seats.values())

    def _seat(self, row: Mapping[str, Any]) -> SeatView:
        names = ("id", "alias", "hand", "task", "gone", "driven", "work", "page")
        return SeatView(
            **{name: row[name] for name in names},
            away=row["id"] in self.away,
            came=came(row["beat"], row["tries"]),
        )

    def _is_shown(self, seat: str) -> bool:
        """Whether the teacher shows the arm of this seat to all."""
        shown = self.row.get("state", {}).get("shown")
        return shown is not None and shown["seat"] == seat

    def _shown(self) -> Shown | None:
        shown = self.row["state"].get("shown")
        row = None if shown is None else self.seats.get(shown["seat"])
        if shown is None or row is None or not _there(row):
            return None
        return Shown(shown["seat"], row["alias"] if shown["named"] else "", row["page"])

    def _poll(self, present: list[dict[str, Any]], mine: Mapping[str, Any] | None) -> Poll | None:
        poll = self.row["state"].get("poll")
        if poll is None:
            return None
        choices = tuple(poll["choices"])
        votes = [0] * len(choices)
        for row in present:
            if row["voted"] == poll["id"] and 0 <= row["vote"] < len(choices):
                votes[row["vote"]] += 1
        chosen = mine["vote"] if mine is not None and mine["voted"] == poll["id"] else None
        return Poll(poll["id"], poll["question"], choices, poll["open"], tuple(votes), chosen)


def _there(row: Mapping[str, Any]) -> bool:
    """Whether a seat is there: not removed by the teacher."""
    return not row["removed"]


def came(beat: int, tries: int) -> bool:
    """Whether a page of a seat was ever connected, or an answer of it is stored; of its columns."""
    return beat > 0 or tries > 0


def with_own(kept: Mapping[str, list[str]], own: Mapping[str, str]) -> dict[str, list[str]]:
    """The texts of exercises that only the teacher has: results name them after another one was sent.

    Of each there is a list of its different texts, the newest at the end. Where older ones were left out, it
    begins with an empty text. If there are too many, those that were sent longest ago are forgotten.
    """
    found = dict(kept)
    for key, text in own.items():
        texts = [*(one for one in found.pop(key, []) if one != text), text]
        found[key] = texts if len(texts) <= MOST_VERSIONS else ["", *texts[1 - MOST_VERSIONS :]]
    while len(found) > len(own) and sum(len(one) for texts in found.values() for one in texts) > MOST_OWN:
        del found[next(iter(found))]
    return found
