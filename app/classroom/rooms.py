"""Opening, joining and ending rooms, and what may not be lost of them: each is one transaction.

A room lives in one process: the one with its pages has it in memory (:class:`app.classroom.live.LiveRoom`). Each
change is stored first, and then taken over into memory. It counts the version of the room in the database, so one
that another program has changed, such as a command, is noticed within the transaction, and read anew before it is
changed. The first change of a room without pages reads it in the same way.
"""

from __future__ import annotations

import contextlib
import json
import secrets
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

from sqlalchemy import Connection, Text, cast, delete, func, insert, select, update

from app.classroom import erasure, marks
from app.classroom.clock import now
from app.classroom.database import PATIENCE, WAIT, Database
from app.classroom.live import LiveRoom, came
from app.classroom.store import read, store_reports
from app.classroom.tables import TOKEN_BYTES, LtiSeat, Room, Seat
from app.classroom.tables import Attempt as Stored
from app.classroom.tokens import Tokens, new_code, read_code
from app.classroom.views import (
    DELETED,
    ERASED,
    ERASING,
    NO_ROOM,
    ClassroomUnavailable,
    Confirmed,
    NewAttempt,
    RefusedError,
    Ticket,
    UnknownRoomError,
    in_one_line,
)
from app.classroom.work import ANSWER_SHOWN, NOTHING, SHOWN_ANSWER, Attempt, Work
from app.shared.clients import share_of

LONGEST_ALIAS, LONGEST_TITLE = 32, 80  # characters
MIN_LIFE, MAX_LIFE = 60.0, 200 * 24 * 3600.0  # seconds: a term
MAX_SEATS = 200
MAX_ATTEMPTS, MAX_STORED = 2000, 1_000_000  # of one seat: answers, and characters of them
UNSEEN = 60.0  # seconds after which a seat whose page has never come may be given to somebody else
LONGEST_ANSWER = 20_000  # characters, as JSON
GONE = "The room has ended, or the teacher has removed you. The answer is not stored."
_TRIES = 20  # of random codes
_BLANK: dict[str, Any] = {
    "alias": "",
    "hand": 0.0,
    "task": "",
    "tries": 0,
    "voted": "",
    "vote": 0,
    "page": "",
    "gone": False,
    "driven": "",
    "recalled": [],
}


@dataclass(frozen=True)
class OpenRoom:
    """A room as its teacher sees it.

    Attributes:
        token: the signed token of the teacher's link.
        students: how many have come.
        awaited: how many have joined and are not here yet.
        alias: of the seat of the ticket; empty for the teacher.
    """

    id: str
    code: str
    title: str
    created: float
    ends: float
    token: str
    students: int = 0
    awaited: int = 0
    alias: str = ""


@dataclass(frozen=True)
class Swept:
    """What became of those whose page has never come.

    Attributes:
        count: how many were removed.
        new: aliases of those who stay because they have joined within the last minute.
    """

    count: int
    new: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Who stays and why; empty: nobody does."""
        return f"{', '.join(self.new)}: joined less than a minute ago; press again later." if self.new else ""


class Change:
    """A transaction that changes a room: the database has it at once, the memory when it is stored."""

    def __init__(self, connection: Connection, live: LiveRoom, version: int) -> None:
        self.connection, self.live, self.version = connection, live, version
        self.taken: dict[str, dict[str, Any]] = {}  # columns, by seat

    def add(self, seat: str, **columns: Any) -> None:
        """Add a seat."""
        row = {**_BLANK, "id": seat, "joined": now(), "beat": 0, "removed": False, **columns}
        self.connection.execute(insert(Seat).values(**row, room_id=self.live.id))
        self.taken[seat] = {**row, "work": {}}

    def set(self, seats: Iterable[str], **columns: Any) -> None:
        """Set columns of seats."""
        self.connection.execute(update(Seat).where(Seat.id.in_(seats)).values(**columns))
        self.taken |= {seat: dict(columns) for seat in seats}

    def rename(self, seat: str, alias: str) -> None:
        """Give a seat another alias; the one before is erased."""
        self.set([seat], alias=alias)
        erasure.note(self.connection)

    def remove(self, seats: list[str]) -> None:
        """Erase seats: alias, page and attempts, and whom a learning platform has them for."""
        if not seats:
            return
        self.set(seats, **_BLANK, removed=True)
        self.connection.execute(delete(Stored).where(Stored.seat_id.in_(seats)))
        self.connection.execute(delete(LtiSeat).where(LtiSeat.seat_id.in_(seats)))
        for seat in seats:
            self.taken[seat]["work"] = {}
        erasure.note(self.connection)


class Rooms:
    """All rooms of a database.

    Args:
        most: how many rooms there may be at a time.
        share: of these, for one client.
        lives: the rooms in memory, by id.
        attempted: called with the seat of each attempt that was stored.
    """

    def __init__(
        self,
        database: Database,
        most: int,
        share: float,
        lives: Mapping[str, LiveRoom],
        attempted: Callable[[str], None],
    ) -> None:
        self._database = database
        self._most = most
        self._most_of_one = share_of(most, share)
        self._lives = lives
        self._attempted = attempted
        self._tokens: Tokens | None = None

    @property
    def tokens(self) -> Tokens:
        """Signs with the key of this database; raises `ClassroomUnavailable`."""
        if self._tokens is None:
            self._tokens = Tokens(self._database.key())
        return self._tokens

    @contextlib.contextmanager
    def changing(self, room: str, durable: bool = True, wait: float | None = None) -> Iterator[Change]:
        """Change a room; raises `UnknownRoomError` if it has ended, and `ClassroomUnavailable`."""
        kept = self._lives.get(room)
        live = kept or LiveRoom(room)
        with live.turn(PATIENCE):  # a whole class may answer in the same moment
            with self._database.write(durable, wait) as connection:
                going_on = update(Room).where(Room.id == room, Room.ends > now())
                version = connection.scalar(going_on.values(version=Room.version + 1).returning(Room.version))
                if version is None:
                    raise UnknownRoomError(NO_ROOM, "code")
                if version != live.version + 1:
                    row, seats = read(connection, room, work=kept is not None)
                    live.load({**row, "version": version - 1}, seats)  # the rest is not stored yet
                change = Change(connection, live, version)
                yield change
            live.take(version, change.taken)
        live.notify()

    def store(self, live: LiveRoom) -> None:
        """Store what the pages of a room have reported; raises as `changing`, and loses nothing then."""
        taken: dict[str, set[str]] = {}
        try:
            with self.changing(live.id, durable=False) as change:
                taken, columns, rows = live.reports()
                store_reports(change.connection, live.id, columns, rows)
        except BaseException:
            live.put_back(taken)
            raise

    def look(self, live: LiveRoom) -> None:
        """Read a room if another program has changed it; raises as `changing`."""
        with live.turn(WAIT), self._database.read() as connection:
            version = connection.scalar(select(Room.version).where(Room.id == live.id, Room.ends > now()))
            if version is None:
                raise UnknownRoomError(NO_ROOM, "code")
            if version != live.version:
                live.load(*read(connection, live.id))
        live.notify()

    def open(self, title: str, life: float, client: str = "") -> OpenRoom:
        """Open a room that is erased after `life` seconds; raises `RefusedError`.

        Args:
            client: who opens it, as `app.shared.clients` has it: one may open a share of all rooms. Empty: the
                operator or a learning platform, without a share.
        """
        title = clean_name(title, LONGEST_TITLE, "title") if title.strip() else "Class"
        if not MIN_LIFE <= life <= MAX_LIFE:
            raise RefusedError(f"A room may last from one minute to {MAX_LIFE / 86400:.0f} days.", "hours")
        tokens = self.tokens
        self.sweep()
        begin, room = now(), secrets.token_hex(TOKEN_BYTES)
        with self._database.write() as connection:
            count = connection.scalar(select(func.count()).select_from(Room)) or 0
            if count >= self._most:
                raise RefusedError(
                    "This service has as many rooms as it may. End one of them, or try again later."
                )
            opener = tokens.bucket(client) if client else 0
            mine = select(func.count()).where(Room.opener == opener)
            if opener and (connection.scalar(mine) or 0) >= self._most_of_one:
                raise RefusedError(
                    f"{self._most_of_one} rooms were opened from your address; it may have no more at a time. "
                    "End one of them, or try again later."
                )
            code = _unused_code(connection)
            marks.keep(connection, anew=count == 0)
            row = {"id": room, "code": code, "title": title, "created": begin, "ends": begin + life}
            connection.execute(insert(Room).values(**row, opener=opener))
        return OpenRoom(room, code, title, begin, begin + life, tokens.sign(Ticket(room)))

    def join(self, code: str, alias: str, known: Ticket | None = None) -> Ticket:
        """Take a seat; who has one in this room already (`known`) keeps it, under the new alias.

        An alias that another student has gets a number; `find` says which one it is.

        Raises:
            UnknownRoomError: no room has this code.
            RefusedError: the alias is invalid, or the room is full.
        """
        with self._database.read() as connection:
            query = select(Room.id).where(Room.code == read_code(code), Room.ends > now())
            room = connection.scalar(query)
        if room is None:
            raise UnknownRoomError(NO_ROOM, "code")
        alias = clean_name(alias, LONGEST_ALIAS, "alias")
        mine = known.seat if known is not None and known.room == room else ""
        with self.changing(room, wait=PATIENCE) as change:
            seats = change.live.present
            alias = _free_alias(seats, alias, mine)
            if known is not None and mine in {seat["id"] for seat in seats}:
                change.rename(mine, alias)
                return known
            if len(seats) >= MAX_SEATS:
                unseen = _unseen(seats)
                if not unseen:
                    raise RefusedError(f"This room is full ({MAX_SEATS} of {MAX_SEATS} students).", "code")
                change.remove(unseen)
            ticket = Ticket(room, secrets.token_hex(TOKEN_BYTES))
            change.add(ticket.seat, alias=alias)
        return ticket

    def find(self, ticket: Ticket) -> OpenRoom | None:
        """The room of a ticket; None if it has ended or the seat was removed."""
        with self._database.read() as connection:
            room = connection.execute(select(Room).where(Room.id == ticket.room, Room.ends > now())).one_or_none()
            if room is None:
                return None
            query = select(Seat.id, Seat.alias, Seat.beat, Seat.tries)
            seats = connection.execute(query.where(Seat.room_id == room.id, Seat.removed.is_(False))).all()
        aliases = {seat.id: seat.alias for seat in seats}
        if ticket.seat and ticket.seat not in aliases:
            return None
        token = "" if ticket.seat else self.tokens.sign(ticket)
        shown = room.id, room.code, room.title, room.created, room.ends, token
        students = sum(came(seat.beat, seat.tries) for seat in seats)
        return OpenRoom(*shown, students, len(seats) - students, aliases.get(ticket.seat, ""))

    def is_open(self, ticket: Ticket) -> bool:
        """Whether the room of a ticket goes on, and its seat was not removed."""
        return self.find(ticket) is not None

    def all(self) -> list[OpenRoom]:
        """All rooms, the newest first."""
        with self._database.read() as connection:
            ids = connection.scalars(select(Room.id).order_by(Room.created.desc())).all()
        return [room for room in (self.find(Ticket(each)) for each in ids) if room is not None]

    def end(self, room: str) -> bool:
        """End a room and delete everything in it; returns whether there was one. `erased` says what is left."""
        with self._database.write() as connection:
            ended = connection.execute(delete(Room).where(Room.id == room)).rowcount > 0
            if ended:
                erasure.note(connection)
        if ended:
            self.erase()
        if (live := self._lives.get(room)) is not None:
            self.close(live)
        return ended

    def close(self, live: LiveRoom) -> None:
        """Say to the pages of a room that has ended what is true of it."""
        try:
            words = self.said_of_ended()
        except ClassroomUnavailable:
            words = ERASING
        live.close(words)

    def erase(self) -> bool:
        """Erase what was deleted, if the database lets us; returns whether there is nothing left to be tried."""
        try:
            return self._database.erase() or not self._database.overwrites
        except ClassroomUnavailable:
            return False

    def said_of_ended(self) -> str:
        """What is true of rooms that have ended, as a sentence; raises `ClassroomUnavailable`."""
        if not self._database.overwrites:
            return DELETED
        with self._database.read() as connection:
            return ERASING if erasure.noted(connection) else ERASED

    def remove_seat(self, room: str, seat: str) -> None:
        """Erase a seat: its alias, page and attempts, and whom a learning platform has it for."""
        with self.changing(room) as change:
            change.remove([one["id"] for one in change.live.present if one["id"] == seat])
        self.erase()

    def remove_unseen(self, room: str) -> Swept:
        """Remove who has joined a while ago and whose page has never come; returns how many, and who stays."""
        with self.changing(room) as change:
            seats = change.live.present
            unseen = _unseen(seats)
            change.remove(unseen)
            stay = [seat["alias"] for seat in seats if not _came(seat) and seat["id"] not in unseen]
        self.erase()
        return Swept(len(unseen), tuple(stay))

    def rename_seat(self, room: str, seat: str, alias: str) -> str:
        """Give a seat another alias; returns it, numbered if another student has it. Raises `RefusedError`."""
        alias = clean_name(alias, LONGEST_ALIAS, "alias")
        with self.changing(room) as change:
            seats = change.live.present
            alias = _free_alias(seats, alias, seat)
            if seat in {one["id"] for one in seats}:
                change.rename(seat, alias)
        self.erase()
        return alias

    def submit(self, ticket: Ticket, attempt: NewAttempt) -> Confirmed:
        """Store an attempt; the same attempt again is stored once. Raises `RefusedError` if the seat is gone."""
        if not 0.0 <= attempt.score <= 1.0:
            raise ValueError(f"score is {attempt.score}; it must be from 0 to 1")
        text = json.dumps(attempt.answer)
        if len(text) > LONGEST_ANSWER:
            raise RefusedError(f"The answer is longer than {LONGEST_ANSWER} characters. It is not stored.")
        try:
            with self.changing(ticket.room) as change:
                seat = next((one for one in change.live.present if one["id"] == ticket.seat), None)
                if seat is None:
                    raise RefusedError(GONE)
                at = _stored_at(change.connection, ticket, attempt)
                if at is None:
                    at = now()
                    values = {field.name: getattr(attempt, field.name) for field in fields(attempt)}
                    row = {**values, "room_id": ticket.room, "seat_id": ticket.seat, "at": at}
                    change.connection.execute(insert(Stored).values(**row))
                    change.set([ticket.seat], tries=seat["tries"] + 1)
                    change.taken[ticket.seat]["work"] = _with_attempt(seat["work"], attempt, text, at)
        except UnknownRoomError:
            raise RefusedError(GONE) from None
        self._attempted(ticket.seat)
        return Confirmed(attempt.id, at)

    def sweep(self) -> int:
        """Erase the rooms whose time is over; returns how many. For those that go on, store what the time is."""
        self._database.resume_time()
        with self._database.read() as connection:
            over = connection.scalars(select(Room.id).where(Room.ends <= now())).all()
            going_on = connection.scalar(select(Room.id).where(Room.ends > now()).limit(1)) is not None
        if going_on:
            with self._database.write(durable=False) as connection:
                marks.keep(connection)
        ended = sum(self.end(room) for room in over)
        self.erase()  # also what other processes have deleted, and what an earlier one could not erase
        return ended


def clean_name(text: str, longest: int, field: str) -> str:
    """An alias or a title in one line, without control characters; raises `RefusedError`."""
    kept = in_one_line(text)
    if not kept:
        raise RefusedError(f"The {field} is empty. Choose 1 to {longest} characters.", field)
    if all(unicodedata.category(letter)[0] in "MZ" for letter in kept):
        raise RefusedError(f"The {field} has marks alone, and no letter, digit or sign to carry them.", field)
    if len(kept) > longest:
        raise RefusedError(f"The {field} has {len(kept)} characters; at most {longest} are allowed.", field)
    return kept


def _unseen(seats: Iterable[Mapping[str, Any]]) -> list[str]:
    """Seats whose page has never come, and that are old enough to be given to somebody else."""
    old = now() - UNSEEN
    return [one["id"] for one in seats if not _came(one) and one["joined"] < old]


def _came(seat: Mapping[str, Any]) -> bool:
    return came(seat["beat"], seat["tries"])


def _free_alias(seats: Iterable[Mapping[str, Any]], alias: str, seat: str) -> str:
    """An alias that no other student of a room has, in capitals or not: ``Bob 2`` where there is a Bob."""
    taken = {_folded(one["alias"]) for one in seats if one["id"] != seat}
    found, number = alias, 1
    while _folded(found) in taken:
        number += 1
        end = f" {number}"
        found = alias[: LONGEST_ALIAS - len(end)].rstrip() + end
    return found


def _folded(alias: str) -> str:
    return unicodedata.normalize("NFKC", alias).casefold()


def _stored_at(connection: Connection, ticket: Ticket, attempt: NewAttempt) -> float | None:
    """When an attempt was stored; None: it was not, and may be. Raises `RefusedError`."""
    stored = connection.execute(select(Stored.at, Stored.seat_id).where(Stored.id == attempt.id)).one_or_none()
    if stored is not None:
        if stored.seat_id != ticket.seat:
            raise RefusedError("This attempt belongs to another student.")
        return float(stored.at)
    size = func.coalesce(func.sum(func.length(cast(Stored.answer, Text))), 0)
    made, characters = connection.execute(select(func.count(), size).where(Stored.seat_id == ticket.seat)).one()
    if made >= MAX_ATTEMPTS:
        raise RefusedError(f"You have made {MAX_ATTEMPTS} attempts in this room; no more are stored.")
    if characters >= MAX_STORED:
        raise RefusedError(f"Your answers in this room have {MAX_STORED} characters; no more are stored.")
    same = (Stored.seat_id == ticket.seat, Stored.exercise == attempt.exercise, Stored.seed == attempt.seed)
    shown = select(Stored.id).where(*same, Stored.verdict == ANSWER_SHOWN).limit(1)
    if not attempt.gave_up and connection.scalar(shown) is not None:
        raise RefusedError("You have seen the answer to this task. Answers to other numbers count.")
    return None


def _with_attempt(done: Mapping[str, Work], new: NewAttempt, answer: str, at: float) -> dict[str, Work]:
    """The work of a seat, by exercise, with one more attempt."""
    shown = answer[:SHOWN_ANSWER]
    one = Attempt("", "", new.exercise, new.seed, shown, new.verdict, new.score, new.started, at)
    return {**done, new.exercise: done.get(new.exercise, NOTHING).plus(one)}


def _unused_code(connection: Connection) -> str:
    for _ in range(_TRIES):
        code = new_code()
        if connection.scalar(select(Room.id).where(Room.code == code)) is None:
            return code
    raise RefusedError("No join code is free. Try again.")
