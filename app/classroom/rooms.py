"""Opening, joining and ending rooms. Each operation is one transaction."""

from __future__ import annotations

import json
import secrets
import unicodedata
from dataclasses import dataclass, fields

from sqlalchemy import Connection, Text, cast, delete, func, insert, select, update

from app.classroom import erasure, marks
from app.classroom.clock import now
from app.classroom.database import PATIENCE, Database
from app.classroom.tables import TOKEN_BYTES, Attempt, LtiSeat, Room, Seat
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
from app.classroom.work import ANSWER_SHOWN
from app.shared.clients import share_of

LONGEST_ALIAS, LONGEST_TITLE = 32, 80  # characters
MIN_LIFE, MAX_LIFE = 60.0, 200 * 24 * 3600.0  # seconds: a term
MAX_SEATS = 200
MAX_ATTEMPTS, MAX_STORED = 2000, 1_000_000  # of one seat: answers, and characters of them
UNSEEN = 60.0  # seconds after which a seat whose page has never come may be given to somebody else
LONGEST_ANSWER = 20_000  # characters, as JSON
_TRIES = 20  # of random codes


@dataclass(frozen=True)
class OpenRoom:
    """A room as its teacher sees it.

    Attributes:
        token: the signed token of the teacher's link.
        alias: of the seat of the ticket; empty for the teacher.
    """

    id: str
    code: str
    title: str
    created: float
    ends: float
    token: str
    students: int = 0
    alias: str = ""


@dataclass(frozen=True)
class Swept:
    """What became of those whose page has never come.

    Attributes:
        count: how many were removed.
        new: aliases of those who stay because they have joined within the last minute.
        answered: aliases of those who stay because answers of theirs are stored.
    """

    count: int
    new: tuple[str, ...] = ()
    answered: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Who stays and why; empty: nobody does."""
        new, answered = (", ".join(names) for names in (self.new, self.answered))
        said = f"{new}: joined less than a minute ago; press again later." if new else ""
        return " ".join(filter(None, (said, f"{answered}: answers are stored." if answered else "")))


class Rooms:
    """All rooms of a database.

    Args:
        most: how many rooms there may be at a time.
        share: of these, for one client.
    """

    def __init__(self, database: Database, most: int = 100, share: float = 1.0) -> None:
        self._database = database
        self._most = most
        self._most_of_one = share_of(most, share)
        self._tokens: Tokens | None = None

    @property
    def tokens(self) -> Tokens:
        """Signs with the key of this database; raises `ClassroomUnavailable`."""
        if self._tokens is None:
            self._tokens = Tokens(self._database.key())
        return self._tokens

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
            connection.execute(
                insert(Room).values(
                    id=room,
                    code=code,
                    title=title,
                    created=begin,
                    ends=begin + life,
                    version=1,
                    state={},
                    page="",
                    beat=0,
                    opener=opener,
                )
            )
        return OpenRoom(room, code, title, begin, begin + life, tokens.sign(Ticket(room)))

    def join(self, code: str, alias: str, known: Ticket | None = None) -> Ticket:
        """Take a seat; who has one in this room already (`known`) keeps it, under the new alias.

        An alias that another student has gets a number; `find` says which one it is.

        Raises:
            UnknownRoomError: no room has this code.
            RefusedError: the alias is invalid, or the room is full.
        """
        code = read_code(code)
        with self._database.write(wait=PATIENCE) as connection:
            query = select(Room.id).where(Room.code == code, Room.ends > now())
            room = connection.scalar(query.with_for_update())
            if room is None:
                raise UnknownRoomError(NO_ROOM, "code")
            alias = clean_name(alias, LONGEST_ALIAS, "alias")
            version = next_version(connection, room)
            mine = known.seat if known is not None and known.room == room else ""
            alias = _free_alias(connection, room, alias, mine)
            if known is not None and known.room == room and known.seat:
                same = update(Seat).where(Seat.id == known.seat, Seat.room_id == room, Seat.removed.is_(False))
                if connection.execute(same.values(alias=alias, version=version)).rowcount:
                    erasure.note(connection)  # of the alias before
                    return known
            taken = select(func.count()).where(Seat.room_id == room, Seat.removed.is_(False))
            full = (connection.scalar(taken) or 0) >= MAX_SEATS
            if full and not _remove_unseen(connection, room, version):
                raise RefusedError(f"This room is full ({MAX_SEATS} of {MAX_SEATS} students).", "code")
            ticket = Ticket(room, secrets.token_hex(TOKEN_BYTES))
            connection.execute(
                insert(Seat).values(
                    id=ticket.seat,
                    room_id=room,
                    alias=alias,
                    joined=now(),
                    hand=0.0,
                    task="",
                    tries=0,
                    solved=False,
                    voted="",
                    vote=0,
                    page="",
                    beat=0,
                    version=version,
                    removed=False,
                    gone=False,
                    driven="",
                )
            )
        return ticket

    def find(self, ticket: Ticket) -> OpenRoom | None:
        """The room of a ticket; None if it has ended or the seat was removed."""
        with self._database.read() as connection:
            room = connection.execute(select(Room).where(Room.id == ticket.room, Room.ends > now())).one_or_none()
            if room is None:
                return None
            seats = select(Seat.id, Seat.alias).where(Seat.room_id == room.id, Seat.removed.is_(False))
            aliases = {seat.id: seat.alias for seat in connection.execute(seats)}
        if ticket.seat and ticket.seat not in aliases:
            return None
        token = self.tokens.sign(Ticket(room.id))
        return OpenRoom(
            room.id,
            room.code,
            room.title,
            room.created,
            room.ends,
            "" if ticket.seat else token,
            len(aliases),
            aliases.get(ticket.seat, ""),
        )

    def is_open(self, ticket: Ticket) -> bool:
        """Whether the room of a ticket goes on, and its seat was not removed."""
        query = select(Room.id).where(Room.id == ticket.room)
        if ticket.seat:
            query = query.join(Seat, Seat.room_id == Room.id).where(
                Seat.id == ticket.seat, Seat.removed.is_(False)
            )
        with self._database.read() as connection:
            query = query.where(Room.ends > now())  # not earlier: the first transaction may change how it counts
            return connection.scalar(query) is not None

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
        return ended

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
        with self._database.write() as connection:
            version = next_version(connection, room)
            mine = Seat.id == seat, Seat.room_id == room
            if connection.execute(update(Seat).where(*mine).values(**_ERASED, version=version)).rowcount:
                connection.execute(delete(Attempt).where(Attempt.seat_id == seat, Attempt.room_id == room))
                connection.execute(delete(LtiSeat).where(LtiSeat.seat_id == seat))
                erasure.note(connection)
        self.erase()

    def remove_unseen(self, room: str) -> Swept:
        """Remove who has joined a while ago and whose page has never come; returns how many, and who stays."""
        left = select(Seat.alias, Seat.tries).where(Seat.room_id == room, Seat.removed.is_(False), Seat.beat == 0)
        with self._database.write() as connection:
            removed = _remove_unseen(connection, room, next_version(connection, room))
            stay = connection.execute(left.order_by(Seat.joined)).all()
        self.erase()
        return Swept(
            removed,
            new=tuple(seat.alias for seat in stay if not seat.tries),
            answered=tuple(seat.alias for seat in stay if seat.tries),
        )

    def rename_seat(self, room: str, seat: str, alias: str) -> str:
        """Give a seat another alias; returns it, numbered if another student has it. Raises `RefusedError`."""
        alias = clean_name(alias, LONGEST_ALIAS, "alias")
        with self._database.write() as connection:
            version = next_version(connection, room)
            alias = _free_alias(connection, room, alias, seat)
            one = update(Seat).where(Seat.id == seat, Seat.room_id == room, Seat.removed.is_(False))
            connection.execute(one.values(alias=alias, version=version))
            erasure.note(connection)
        self.erase()
        return alias

    def submit(self, ticket: Ticket, attempt: NewAttempt) -> Confirmed:
        """Store an attempt; the same attempt again is stored once. Raises `RefusedError` if the seat is gone."""
        if not 0.0 <= attempt.score <= 1.0:
            raise ValueError(f"score is {attempt.score}; it must be from 0 to 1")
        if len(json.dumps(attempt.answer)) > LONGEST_ANSWER:
            raise RefusedError(f"The answer is longer than {LONGEST_ANSWER} characters. It is not stored.")
        with self._database.write() as connection:
            version = next_version(connection, ticket.room)
            mine = (Seat.id == ticket.seat, Seat.room_id == ticket.room, Seat.removed.is_(False))
            seat = connection.execute(select(Seat.id).where(*mine)).one_or_none()
            if version is None or seat is None:
                raise RefusedError("The room has ended, or the teacher has removed you. The answer is not stored.")
            stored = connection.execute(
                select(Attempt.at, Attempt.seat_id).where(Attempt.id == attempt.id)
            ).one_or_none()
            if stored is not None:
                if stored.seat_id != ticket.seat:
                    raise RefusedError("This attempt belongs to another student.")
                return Confirmed(attempt.id, stored.at)
            size = func.coalesce(func.sum(func.length(cast(Attempt.answer, Text))), 0)
            mine_all = select(func.count(), size).where(Attempt.seat_id == ticket.seat)
            made, stored_size = connection.execute(mine_all).one()
            if made >= MAX_ATTEMPTS:
                raise RefusedError(f"You have made {MAX_ATTEMPTS} attempts in this room; no more are stored.")
            if stored_size >= MAX_STORED:
                raise RefusedError(f"Your answers in this room have {MAX_STORED} characters; no more are stored.")
            if not attempt.gave_up and _was_shown(connection, ticket.seat, attempt):
                raise RefusedError("You have seen the answer to this task. Answers to other numbers count.")
            at = now()
            values = {field.name: getattr(attempt, field.name) for field in fields(attempt)}
            connection.execute(insert(Attempt).values(room_id=ticket.room, seat_id=ticket.seat, at=at, **values))
            connection.execute(update(Seat).where(*mine).values(tries=made + 1, version=version))
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


_ERASED: dict[str, object] = {
    "removed": True,
    "alias": "",
    "page": "",
    "hand": 0.0,
    "task": "",
    "tries": 0,
    "voted": "",
    "vote": 0,
    "gone": False,
    "driven": "",
}


def _remove_unseen(connection: Connection, room: str, version: int | None) -> int:
    """As `Rooms.remove_unseen`, in a writing transaction."""
    answered = select(Attempt.seat_id).where(Attempt.room_id == room)
    unseen = update(Seat).where(
        Seat.room_id == room,
        Seat.removed.is_(False),
        Seat.beat == 0,
        Seat.joined < now() - UNSEEN,
        Seat.id.not_in(answered),
    )
    count = connection.execute(unseen.values(**_ERASED, version=version)).rowcount
    if count:
        erasure.note(connection)
    return count


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


def _free_alias(connection: Connection, room: str, alias: str, seat: str) -> str:
    """An alias that no other student of a room has, in capitals or not: ``Bob 2`` where there is a Bob."""
    others = select(Seat.alias).where(Seat.room_id == room, Seat.id != seat, Seat.removed.is_(False))
    taken = {_folded(other) for other in connection.scalars(others)}
    found, number = alias, 1
    while _folded(found) in taken:
        number += 1
        end = f" {number}"
        found = alias[: LONGEST_ALIAS - len(end)].rstrip() + end
    return found


def _folded(alias: str) -> str:
    return unicodedata.normalize("NFKC", alias).casefold()


def next_version(connection: Connection, room: str) -> int | None:
    """Count a change of a room, in a writing transaction; None if it has ended.

    The room's row stays locked until the transaction ends, so versions are stored in their order.
    """
    query = update(Room).where(Room.id == room).values(version=Room.version + 1).returning(Room.version)
    return connection.scalar(query)


def _was_shown(connection: Connection, seat: str, attempt: NewAttempt) -> bool:
    """Whether the seat has seen the answer to these numbers, on whichever of its pages."""
    same = (Attempt.seat_id == seat, Attempt.exercise == attempt.exercise, Attempt.seed == attempt.seed)
    return connection.scalar(select(Attempt.id).where(*same, Attempt.verdict == ANSWER_SHOWN).limit(1)) is not None


def _unused_code(connection: Connection) -> str:
    for _ in range(_TRIES):
        code = new_code()
        if connection.scalar(select(Room.id).where(Room.code == code)) is None:
            return code
    raise RefusedError("No join code is free. Try again.")
