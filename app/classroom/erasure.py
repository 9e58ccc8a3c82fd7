"""Erased means: no byte of it is left in any file of the database.

SQLite overwrites what is deleted (`secure_delete`), first in its log. Only a checkpoint that empties the log
overwrites the file itself and the log's earlier contents. There is none while another program reads the database.
So every deletion leaves a note in the same transaction. The note stays until a checkpoint has succeeded. Every
process tries again while there is a note, also after a restart.

PostgreSQL overwrites what is deleted when it needs the space, and keeps copies in its log and in backups. There,
nothing is noted, and nothing is called erased.
"""

from __future__ import annotations

import secrets

from sqlalchemy import Connection, delete, insert, select, update

from app.classroom.tables import Setting

_NOTE = Setting.name == "erase"


def note(connection: Connection) -> None:
    """Remember, in a writing transaction, that something was deleted and is to be erased from SQLite's file."""
    if connection.dialect.name != "sqlite":
        return
    value = secrets.token_hex(8)
    if connection.execute(update(Setting).where(_NOTE).values(value=value)).rowcount == 0:
        connection.execute(insert(Setting).values(name="erase", value=value))


def noted(connection: Connection) -> str:
    """The last note; empty if everything that was deleted is erased."""
    return connection.scalar(select(Setting.value).where(_NOTE)) or ""


def forget(connection: Connection, value: str) -> None:
    """Everything is erased that was deleted before this note; a newer note stays."""
    connection.execute(delete(Setting).where(_NOTE, Setting.value == value))
