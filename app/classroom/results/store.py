"""Reads the attempts of a room from the classroom's database."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

from sqlalchemy import literal, null, select, tuple_

from app.classroom.database import Database
from app.classroom.results.table import Attempt
from app.classroom.tables import Attempt as Stored
from app.classroom.tables import Seat

PAGE = 100  # attempts that are read at a time; each has up to 20 000 characters of an answer
SHORT_PAGE = 5000  # the same without answers


def attempts_of(database: Database, room: str, answers: bool = True) -> list[Attempt]:
    """All attempts of a room at once, as `pages_of` has them."""
    return list(chain.from_iterable(pages_of(database, room, answers, PAGE if answers else SHORT_PAGE)))


def pages_of(database: Database, room: str, answers: bool = True, size: int = PAGE) -> Iterator[list[Attempt]]:
    """The attempts of a room's present seats in the order of time, `size` at a time.

    Each page is a transaction of its own, so a slow reader holds up nobody. The iterator raises
    `ClassroomUnavailable`.

    Args:
        answers: whether the answers are read: a class may have given gigabytes of them, and a table needs none.
    """
    answer = Stored.answer if answers else null()
    query = (
        select(
            Stored.seat_id, Seat.alias, Stored.exercise, Stored.seed, answer, Stored.verdict, Stored.score,
            Stored.started, Stored.at, Stored.id,
        )
        .join(Seat, Seat.id == Stored.seat_id)
        .where(Stored.room_id == room, Seat.removed.is_(False))
        .order_by(Stored.at, Stored.id)
        .limit(size)
    )  # fmt: skip
    place = tuple_(Stored.at, Stored.id)
    after = query
    while True:
        with database.read() as connection:
            rows = connection.execute(after).all()
        if rows:
            yield [Attempt(*row[:-1]) for row in rows]
        if len(rows) < size:
            return
        after = query.where(place > tuple_(literal(rows[-1].at), literal(rows[-1].id)))
