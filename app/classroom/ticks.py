"""What the hub asks the database in each tick."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from functools import lru_cache
from typing import Any, cast

from sqlalchemy import Connection, Table, Text, Update, bindparam, func, select, update
from sqlalchemy import cast as cast_to

from app.classroom.clock import now
from app.classroom.live import Pending
from app.classroom.rooms import next_version
from app.classroom.tables import Attempt as Stored
from app.classroom.tables import Room, Seat
from app.classroom.work import SHOWN_ANSWER, Attempt, works

_ROOM, _SEAT = cast(Table, Room.__table__), cast(Table, Seat.__table__)
# Statements are built once: a process asks the first of them thirty times a second.
_VERSIONS = select(_ROOM.c.id, _ROOM.c.version).where(
    _ROOM.c.id.in_(bindparam("rooms", expanding=True)), _ROOM.c.ends > bindparam("now")
)
_ROW = select(_ROOM).where(_ROOM.c.id == bindparam("room"))
_CHANGED = select(_SEAT).where(_SEAT.c.room_id == bindparam("room"), _SEAT.c.version > bindparam("known"))
_THERE = (_SEAT.c.room_id == bindparam("in_room"), _SEAT.c.removed.is_(False))
_PRESENT = (
    update(_SEAT)
    .where(*_THERE, _SEAT.c.id.in_(bindparam("of_seats", expanding=True)))
    .values(beat=_SEAT.c.beat + 1, version=bindparam("new_version"))
)
_A = cast(Table, Stored.__table__).c
_ATTEMPTS = (
    select(
        _A.seat_id,
        _A.exercise,
        _A.seed,
        func.substr(cast_to(_A.answer, Text), 1, SHOWN_ANSWER),
        _A.verdict,
        _A.score,
        _A.started,
        _A.at,
    )
    .where(_A.seat_id.in_(bindparam("of_seats", expanding=True)))
    .order_by(_A.seat_id, _A.at, _A.id)
)
Loaded = tuple[dict[str, Any], list[dict[str, Any]]]


def store(connection: Connection, room: str, pending: Pending, beats: Set[str]) -> int | None:
    """Store what is pending, and who is here (seats; the teacher's is ""); None: the room has ended."""
    version = next_version(connection, room)
    if version is None:
        return None
    values: dict[str, Any] = {}
    if pending.page is not None:
        values["page"] = pending.page
    if pending.state:
        values["state"] = {**(connection.scalar(select(Room.state).where(Room.id == room)) or {}), **pending.state}
    if "" in beats:
        values["beat"] = Room.beat + 1
    if values:
        connection.execute(update(Room).where(Room.id == room).values(values))
    alike: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for seat, columns in pending.seats.items():
        row = {"in_room": room, "of_seat": seat, "new_version": version}
        alike.setdefault(tuple(sorted(columns)), []).append(row | {f"new_{k}": v for k, v in columns.items()})
    for names, rows in alike.items():
        connection.execute(_update_seats(names), rows)
    if students := beats - {""}:
        connection.execute(_PRESENT, {"in_room": room, "of_seats": sorted(students), "new_version": version})
    return version


@lru_cache(maxsize=64)
def _update_seats(names: tuple[str, ...]) -> Update:
    """Sets these columns of seats: one statement for all of a class that have the same news."""
    columns: dict[str, Any] = {name: bindparam(f"new_{name}") for name in names}
    one = (*_THERE, _SEAT.c.id == bindparam("of_seat"))
    return update(_SEAT).where(*one).values(version=bindparam("new_version"), **columns)


def fetch(
    connection: Connection, known: Mapping[str, int], tries_of: Callable[[str], Mapping[str, int]]
) -> dict[str, Loaded | None]:
    """The rooms that have changed since the known versions, with the seats that have; None: the room has ended.

    Args:
        tries_of: how many attempts of each seat of a room are known. Seats with others come with their `work`.
    """
    versions = {row.id: row.version for row in connection.execute(_VERSIONS, {"rooms": list(known), "now": now()})}
    found: dict[str, Loaded | None] = {room: None for room in known if room not in versions}
    for room, version in versions.items():
        if version != known[room]:
            row = connection.execute(_ROW, {"room": room}).mappings().one_or_none()
            changed = connection.execute(_CHANGED, {"room": room, "known": known[room]})
            seats = [dict(seat) for seat in changed.mappings()]
            _add_work(connection, seats, tries_of(room))
            found[room] = None if row is None else (dict(row), seats)
    return found


def _add_work(connection: Connection, seats: list[dict[str, Any]], tries: Mapping[str, int]) -> None:
    """Read the attempts of those seats that have other ones than are known."""
    more = {seat["id"]: seat for seat in seats if seat["tries"] != tries.get(seat["id"], 0)}
    if not more:
        return
    rows = connection.execute(_ATTEMPTS, {"of_seats": sorted(more)})
    found = works(Attempt(row.seat_id, "", *row[1:]) for row in rows)
    for seat_id, seat in more.items():
        seat["work"] = found.get(seat_id, {})
