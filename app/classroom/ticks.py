"""What the hub asks the database in each tick."""

from __future__ import annotations

from collections.abc import Mapping, Set
from functools import lru_cache
from typing import Any, cast

from sqlalchemy import Connection, Table, Update, bindparam, case, select, update

from app.classroom.clock import now
from app.classroom.live import Pending
from app.classroom.rooms import next_version
from app.classroom.tables import Room, Seat

COUNTED = ("tries", "solved")  # of the task that is open
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
    if "task" in names:  # an answer to this task may have been stored before the news that it is open
        known = _SEAT.c.task == columns["task"]
        for name in COUNTED:  # what is pending is shown, and kept if this is not stored
            columns[name] = case((known, _SEAT.c[name]), else_=columns[name])
    one = (*_THERE, _SEAT.c.id == bindparam("of_seat"))
    return update(_SEAT).where(*one).values(version=bindparam("new_version"), **columns)


def fetch(connection: Connection, known: Mapping[str, int]) -> dict[str, Loaded | None]:
    """The rooms that have changed since the known versions, with the seats that have; None: the room has ended."""
    versions = {row.id: row.version for row in connection.execute(_VERSIONS, {"rooms": list(known), "now": now()})}
    found: dict[str, Loaded | None] = {room: None for room in known if room not in versions}
    for room, version in versions.items():
        if version != known[room]:
            row = connection.execute(_ROW, {"room": room}).mappings().one_or_none()
            changed = connection.execute(_CHANGED, {"room": room, "known": known[room]})
            seats = [dict(seat) for seat in changed.mappings()]
            found[room] = None if row is None else (dict(row), seats)
    return found
