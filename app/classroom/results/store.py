"""Reads the attempts of a room from the classroom's database."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from itertools import chain

from sqlalchemy import Text, cast, func, literal, select, tuple_

from app.classroom.database import Database
from app.classroom.live import came
from app.classroom.results.table import Member
from app.classroom.tables import Attempt as Stored
from app.classroom.tables import Room, Seat
from app.classroom.views import Recalled
from app.classroom.work import SHOWN_ANSWER, Attempt

PAGE = 100  # attempts that are read at a time; each has up to 20 000 characters of an answer
SHORT_PAGE = 5000  # the same without answers


def attempts_of(database: Database, room: str, answers: bool = True) -> list[Attempt]:
    """All attempts of a room at once, as `pages_of` has them."""
    return list(chain.from_iterable(pages_of(database, room, answers, PAGE if answers else SHORT_PAGE)))


def members_of(database: Database, room: str) -> list[Member]:
    """The students of a room, without those who were removed. Numbers count these too, so they never change."""
    query = select(Seat.id, Seat.alias, Seat.beat, Seat.tries, Seat.removed).where(Seat.room_id == room)
    with database.read() as connection:
        seats = connection.execute(query.order_by(Seat.joined, Seat.id)).all()
    return [
        Member(seat.id, seat.alias, number, came(seat.beat, seat.tries))
        for number, seat in enumerate(seats, 1)
        if not seat.removed
    ]


def recalled_of(database: Database, room: str) -> Recalled:
    """What the present students of a room were asked again."""
    query = select(Seat.recalled).where(Seat.room_id == room, Seat.removed.is_(False))
    with database.read() as connection:
        return reduce(Recalled.plus, connection.scalars(query), Recalled())


@dataclass(frozen=True)
class Sent:
    """What the teacher has sent to a room.

    Attributes:
        task: the exercise that is the task, or empty.
        course: as JSON, or empty.
        own: the texts of the exercises that only the teacher has, by id: the newest at the end.
    """

    task: str = ""
    course: str = ""
    own: Mapping[str, Sequence[str]] = field(default_factory=dict)


def sent_to(database: Database, room: str) -> Sent:
    """What the teacher has sent to a room."""
    with database.read() as connection:
        state = connection.scalar(select(Room.state).where(Room.id == room)) or {}
    task = str((state.get("task") or {}).get("exercise", ""))
    return Sent(task, str(state.get("course") or ""), state.get("own") or {})


def pages_of(database: Database, room: str, answers: bool = True, size: int = PAGE) -> Iterator[list[Attempt]]:
    """The attempts of a room's present seats in the order of time, `size` at a time.

    Each page is a transaction of its own, so a slow reader holds up nobody. The iterator raises
    `ClassroomUnavailable`.

    Args:
        answers: whether answers are read whole: a class may have given gigabytes of them. Otherwise the
            beginning of their JSON is.
    """
    answer = Stored.answer if answers else func.substr(cast(Stored.answer, Text), 1, SHOWN_ANSWER)
    numbers = {one.seat: one.number for one in members_of(database, room)}
    query = (
        select(
            Stored.seat_id,
            Seat.alias,
            Stored.exercise,
            Stored.seed,
            answer,
            Stored.verdict,
            Stored.score,
            Stored.started,
            Stored.at,
            Stored.cause,
            Stored.id,
        )
        .join(Seat, Seat.id == Stored.seat_id)
        .where(Stored.room_id == room, Seat.removed.is_(False))
        .order_by(Stored.at, Stored.id)
        .limit(size)
    )
    place = tuple_(Stored.at, Stored.id)
    after = query
    while True:
        with database.read() as connection:
            rows = connection.execute(after).all()
        if rows:
            yield [
                replace(Attempt(*row[:-2]), number=numbers.get(row.seat_id, 0), cause=row.cause) for row in rows
            ]
        if len(rows) < size:
            return
        after = query.where(place > tuple_(literal(rows[-1].at), literal(rows[-1].id)))
