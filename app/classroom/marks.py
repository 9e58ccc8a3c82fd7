"""A mark in the database. Processes that start later go on counting the time of rooms from it.

It counts while there are rooms. Without any, a process goes by the machine's clock: one that was wrong once does
no harm any more.
"""

from __future__ import annotations

import contextlib
import json

from sqlalchemy import Connection, insert, select, update
from sqlalchemy.exc import IntegrityError

from app.classroom import clock
from app.classroom.clock import Mark
from app.classroom.tables import Room, Setting

_MINE = Setting.name == "clock"


def resume(connection: Connection) -> bool:
    """Count on from the stored mark; returns whether it has to be stored from which time this process goes on.

    That is so after a new start of the machine: further processes shall count as this one does.
    """
    stored = _stored(connection)
    if stored is None or not has_rooms(connection):
        return False
    clock.resume(stored)
    return not clock.is_of_this_start(stored)


def resume_and_keep(connection: Connection) -> None:
    """Like `resume`, and store it, in a writing transaction; another process may have been the first."""
    connection.execute(select(Setting.value).where(_MINE).with_for_update())
    if resume(connection):
        keep(connection, anew=True)


def keep(connection: Connection, anew: bool = False) -> None:
    """Store the present in a writing transaction, unless a later mark is stored; `anew`: in any case."""
    stored, present = _stored(connection), clock.mark()
    if stored is not None and stored.at >= present.at and not anew:
        return
    value = json.dumps(present)
    if connection.execute(update(Setting).where(_MINE).values(value=value)).rowcount == 0:
        with contextlib.suppress(IntegrityError), connection.begin_nested():  # another process was the first
            connection.execute(insert(Setting).values(name="clock", value=value))


def has_rooms(connection: Connection) -> bool:
    """Whether there is any room, also one whose time is over."""
    return connection.scalar(select(Room.id).limit(1)) is not None


def _stored(connection: Connection) -> Mark | None:
    text = connection.scalar(select(Setting.value).where(_MINE))
    if text is None:
        return None
    at, passed, boot = json.loads(text)
    return Mark(float(at), float(passed), str(boot))
