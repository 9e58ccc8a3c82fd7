"""How a room is read from the database, and what its pages report is stored."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, cast

from sqlalchemy import Connection, Table, Text, bindparam, func, select, update
from sqlalchemy import cast as cast_to

from app.classroom.live import REPORTED
from app.classroom.tables import Attempt as Stored
from app.classroom.tables import Room, Seat
from app.classroom.work import SHOWN_ANSWER, Attempt, works

_ROOM, _SEAT, _ATTEMPT = (cast(Table, each.__table__) for each in (Room, Seat, Stored))
# Built once: a class that moves is stored five times a second.
_REPORTS = (
    update(_SEAT)
    .where(_SEAT.c.id == bindparam("of_seat"), _SEAT.c.removed.is_(False))
    .values({name: bindparam(f"new_{name}") for name in REPORTED})
)


def read(connection: Connection, room: str, work: bool = True) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """A room's row, and the rows of its seats with the `work` of each, by exercise.

    Args:
        work: whether it is needed: a class may have given a hundred thousand answers.
    """
    row = connection.execute(select(_ROOM).where(_ROOM.c.id == room)).mappings().one()
    a = _ATTEMPT.c
    answer = func.substr(cast_to(a.answer, Text), 1, SHOWN_ANSWER)
    attempts = select(a.seat_id, a.exercise, a.seed, answer, a.verdict, a.score, a.started, a.at)
    found = connection.execute(attempts.where(a.room_id == room).order_by(a.at, a.id)) if work else ()
    done = works(Attempt(one.seat_id, "", *one[1:]) for one in found)
    seats = connection.execute(select(_SEAT).where(_SEAT.c.room_id == room)).mappings()
    return dict(row), [{**seat, "work": done.get(seat["id"], {})} for seat in seats]


def store_reports(
    connection: Connection, room: str, columns: Mapping[str, Any], seats: Iterable[Mapping[str, Any]]
) -> None:
    """Store columns of a room, and the reported columns of seats with their `id`."""
    if columns:
        connection.execute(update(_ROOM).where(_ROOM.c.id == room).values(**columns))
    rows = [{"of_seat": one["id"]} | {f"new_{name}": one[name] for name in REPORTED} for one in seats]
    if rows:
        connection.execute(_REPORTS, rows)
