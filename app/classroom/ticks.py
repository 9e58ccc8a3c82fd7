"""What the hub asks the database in each tick."""

from __future__ import annotations

from collections.abc import Mapping, Set
from typing import Any

from sqlalchemy import Connection, case, select, update

from app.classroom.clock import now
from app.classroom.live import Pending
from app.classroom.rooms import next_version
from app.classroom.tables import Room, Seat

COUNTED = {"tries": Seat.tries, "solved": Seat.solved}  # of the task that is open
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
    there = (Seat.room_id == room, Seat.removed.is_(False))
    for seat, columns in pending.seats.items():
        if "task" in columns:  # an answer to this task may have been stored before the news that it is open
            known = Seat.task == columns["task"]
            counted = {name: case((known, column), else_=columns[name]) for name, column in COUNTED.items()}
            columns = {**columns, **counted}  # what is pending is shown, and kept if this is not stored
        connection.execute(update(Seat).where(*there, Seat.id == seat).values(version=version, **columns))
    if students := beats - {""}:
        present = update(Seat).where(*there, Seat.id.in_(students))
        connection.execute(present.values(beat=Seat.beat + 1, version=version))
    return version


def fetch(connection: Connection, known: Mapping[str, int]) -> dict[str, Loaded | None]:
    """The rooms that have changed since the known versions, with the seats that have; None: the room has ended."""
    query = select(Room.id, Room.version).where(Room.id.in_(known), Room.ends > now())
    versions = {row.id: row.version for row in connection.execute(query)}
    found: dict[str, Loaded | None] = {room: None for room in known if room not in versions}
    for room, version in versions.items():
        if version != known[room]:
            row = connection.execute(select(Room.__table__).where(Room.id == room)).mappings().one_or_none()
            changed = select(Seat.__table__).where(Seat.room_id == room, Seat.version > known[room])
            seats = [dict(seat) for seat in connection.execute(changed).mappings()]
            found[room] = None if row is None else (dict(row), seats)
    return found
