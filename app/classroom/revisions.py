"""Migrations of the database's tables, and which of them a database has had.

This is known without SQLAlchemy, so a service can say at its start that a database is not one of its own.
"""

from __future__ import annotations

import contextlib
import sqlite3
from pathlib import Path

REVISIONS = ("0001", "0002", "0003", "0004", "0005", "0006", "0007", "0008")  # of this version, in their order


def revision_of(file: Path) -> str | None:
    """The revision of SQLite's file; None if it has none, or cannot be read."""
    with (
        contextlib.suppress(sqlite3.Error),
        contextlib.closing(
            sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", timeout=0.5, uri=True)
        ) as connection,
    ):
        row = connection.execute("SELECT version_num FROM alembic_version").fetchone()
        return None if row is None else str(row[0])
    return None
