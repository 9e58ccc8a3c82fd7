"""Reads the attempts of a room from the classroom's database."""

from __future__ import annotations

from sqlalchemy import null, select

from app.classroom.database import Database
from app.classroom.results.table import Attempt
from app.classroom.tables import Attempt as Stored
from app.classroom.tables import Seat


def attempts_of(database: Database, room: str, answers: bool = True) -> list[Attempt]:
    """All attempts of a room's present seats, in the order of time; raises `ClassroomUnavailable`.

    Args:
        answers: whether the answers are read: a class may have given gigabytes of them, and a table needs none.
    """
    answer = Stored.answer if answers else null()
    query = (
        select(
            Stored.seat_id, Seat.alias, Stored.exercise, Stored.seed, answer, Stored.verdict, Stored.score,
            Stored.started, Stored.at,
        )
        .join(Seat, Seat.id == Stored.seat_id)
        .where(Stored.room_id == room, Seat.removed.is_(False))
        .order_by(Stored.at)
    )  # fmt: skip
    with database.read() as connection:
        return [Attempt(*row) for row in connection.execute(query)]
