"""The classroom's database: SQLite in a folder, or PostgreSQL.

Nothing happens before the first transaction: then the folder and the file are made, and migrations are run.
Several processes may do so at the same time; the database makes them wait for each other. An error of the database
becomes `ClassroomUnavailable`, and one that is due to the values alone `RefusedError`: each with a sentence for a
page, and the error itself in the log.

SQLite lets one transaction write at a time. The others look again after pauses that grow to a tenth of a second,
and while many come, one of them may find the database locked each time until its patience ends. So the threads of
a process write in turns: only one of them looks, and all others wait for it.
"""

from __future__ import annotations

import contextlib
import logging
import os
import secrets
import sqlite3
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event, insert, inspect, select, text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import DataError, IntegrityError, SQLAlchemyError

from app.classroom import erasure, marks
from app.classroom.clock import steady
from app.classroom.revisions import REVISIONS
from app.classroom.tables import REVISION, Setting
from app.classroom.views import BUSY, ClassroomUnavailable, RefusedError

logger = logging.getLogger("kinboard.classroom")

WAIT = 3.0  # seconds for a lock, or for a connection
PATIENCE = 10.0  # seconds for what a whole class does in the same moment, such as joining
ERASE_WAIT = 100  # milliseconds for short readers; writers wait too
LOG_EVERY = 10.0  # seconds between two lines about errors
_MIGRATION_LOCK = 0x6B696E  # of PostgreSQL
_KEY = "key"
NEWER = (
    "The classroom's database was written by a newer version of Kinboard than this one. "
    "Tell the operator of this service; everything else works."
)
UNFIT = "The classroom's database refuses what was sent: it cannot be stored. Other things can."


class NewerDatabaseError(Exception):
    """The database has had a migration that this version does not know."""


class Database:
    """Transactions on one database; thread-safe.

    Args:
        file: SQLite's, which need not exist.
        url: of another database, such as ``postgresql://user@host/name``.
    """

    def __init__(self, file: Path, url: str | None = None) -> None:
        self._file = None if url else file
        self._url = make_url(url) if url else URL.create("sqlite", database=str(file))
        if self._url.drivername in ("postgresql", "postgres"):
            self._url = self._url.set(drivername="postgresql+psycopg")
        self.newer = False  # whether it was found to be of a newer version when it was last opened
        self._engine: Engine | None = None
        self._inode: tuple[int, int] | None = None
        self._lock = threading.Lock()
        self._writing = threading.Lock()  # held by the thread of this process that may write into SQLite's file
        self._logged = -LOG_EVERY

    @contextlib.contextmanager
    def read(self) -> Iterator[Connection]:
        """A transaction that only reads; raises `ClassroomUnavailable`."""
        with self._words(), self._ready().connect() as connection, connection.begin():
            self._still_there()
            yield connection

    @contextlib.contextmanager
    def write(self, durable: bool = True, wait: float | None = None) -> Iterator[Connection]:
        """A transaction that is stored when the block ends; raises `ClassroomUnavailable`.

        Args:
            durable: whether it survives a power failure; False: it may be lost together with all later ones.
            wait: seconds to wait for others that write; None: `WAIT`.
        """
        end = steady() + (WAIT if wait is None else wait)
        with self._words(), self._turn(end), self._ready().connect() as connection:
            milliseconds = max(1, int(1000 * (end - steady())))
            if self._file is not None:
                connection.execution_options(kinboard_write=True)
                level = "FULL" if durable else "NORMAL"
                raw = connection.connection.driver_connection
                assert raw is not None
                raw.execute(f"PRAGMA synchronous={level}")
                raw.execute(f"PRAGMA busy_timeout={milliseconds}")
            with connection.begin():
                if self._file is None:
                    connection.exec_driver_sql(f"SET LOCAL lock_timeout = {milliseconds}")
                yield connection
                self._still_there()

    @contextlib.contextmanager
    def _turn(self, end: float) -> Iterator[None]:
        """Wait until no other thread of this process writes into SQLite's file, or until `end` (`steady`'s)."""
        if self._file is None:  # a server of databases has a queue of its own
            yield
            return
        if not self._writing.acquire(timeout=max(0.0, end - steady())):
            self._log("other writers of this process kept it for too long")
            raise ClassroomUnavailable(BUSY)
        try:
            yield
        finally:
            self._writing.release()

    def key(self) -> str:
        """The key that signs tokens."""
        query = select(Setting.value).where(Setting.name == _KEY)
        with self.read() as connection:
            found = connection.scalar(query)
        if found is not None:
            return found
        with contextlib.suppress(ClassroomUnavailable, RefusedError), self.write() as connection:
            if connection.scalar(query) is None:
                connection.execute(insert(Setting).values(name=_KEY, value=secrets.token_hex(32)))
        with self.read() as connection:  # another process may have been the first
            return str(connection.execute(query).scalar_one())

    def resume_time(self) -> None:
        """Count the time of rooms on from the stored mark; raises `ClassroomUnavailable`."""
        with self._words():
            _resume_time(self._ready())

    @property
    def lost(self) -> bool:
        """Whether SQLite's file was there and has gone."""
        return self._file is not None and self._inode is not None and not os.access(self._file, os.F_OK)

    @property
    def overwrites(self) -> bool:
        """Whether `erase` can say that something is erased."""
        return self._file is not None

    def erase(self) -> bool:
        """Erase what was deleted from SQLite's files; returns whether nothing of it is left.

        It does not wait for programs that read: they may do so for long. Raises `ClassroomUnavailable`.
        """
        if self._file is None:
            return False
        with self.read() as connection:
            note = erasure.noted(connection)
        if not note:
            return True
        with self._words(), self._ready().connect() as connection:
            raw = connection.connection.driver_connection
            assert raw is not None
            _, frames, copied = raw.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()[0]
            if copied < frames:
                return False  # somebody reads what the file had before; emptying the log would stop all writers
            raw.execute(f"PRAGMA busy_timeout={ERASE_WAIT}")
            try:
                busy, *_ = raw.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()[0]
            finally:
                raw.execute(f"PRAGMA busy_timeout={int(1000 * WAIT)}")
        if busy:
            return False
        with self.write() as connection:
            erasure.forget(connection, note)
        return True

    def close(self) -> None:
        """Close all connections."""
        with self._lock:
            engine, self._engine = self._engine, None
        if engine is not None:
            engine.dispose()

    def _ready(self) -> Engine:
        """The engine, with all tables."""
        with self._lock:
            if self._engine is None:
                self._engine = self._open()
            return self._engine

    def _open(self) -> Engine:
        if self._file is None:
            engine = create_engine(
                self._url,
                pool_pre_ping=True,
                pool_timeout=WAIT,
                hide_parameters=True,
                connect_args={"connect_timeout": max(2, int(WAIT))},
            )
        else:
            if self.lost:
                raise FileNotFoundError(f"{self._file} has disappeared")  # an empty one would end all rooms
            self._file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            engine = create_engine(
                self._url, pool_timeout=WAIT, hide_parameters=True, connect_args={"timeout": WAIT}
            )
            event.listen(engine, "connect", _configure_sqlite)
            event.listen(engine, "begin", _begin_sqlite)
        try:
            self.newer = False
            _migrate(engine)
            _resume_time(engine)
        except BaseException:
            engine.dispose()
            raise
        if self._file is not None:
            found = self._file.stat()
            self._inode = found.st_dev, found.st_ino
        return engine

    def _still_there(self) -> None:
        """Raises if SQLite's file was deleted or replaced: what is written to an open file would be lost."""
        if self._file is not None:
            found = self._file.stat()
            if (found.st_dev, found.st_ino) != self._inode:
                raise FileNotFoundError(f"{self._file} was replaced by another file")

    @contextlib.contextmanager
    def _words(self) -> Iterator[None]:
        """Turn errors of the database into `ClassroomUnavailable`."""
        try:
            yield
        except ModuleNotFoundError as error:
            logger.error("the database's driver is missing: install kinboard[postgres]")
            raise ClassroomUnavailable(_sentence(error)) from error
        except NewerDatabaseError as error:
            self.newer = True
            self._log(f"{error}")
            raise ClassroomUnavailable(NEWER) from error
        except DataError as error:  # these values, and no others
            self._log(_brief(error))
            raise RefusedError(UNFIT) from None  # what caused it names the values
        except (SQLAlchemyError, sqlite3.Error, OSError) as error:
            if isinstance(error, OSError):
                self.close()  # the next transaction opens the file that is there then
            self._log(_brief(error))
            raise ClassroomUnavailable(_sentence(error)) from error

    def _log(self, words: str) -> None:
        if steady() - self._logged > LOG_EVERY:
            self._logged = steady()
            logger.warning("the classroom's database failed: %s", words)


def _configure_sqlite(connection: Any, _: object) -> None:
    connection.isolation_level = None  # transactions begin where `_begin_sqlite` says
    _write_ahead(connection)
    for pragma in ("foreign_keys=ON", "secure_delete=ON", "journal_size_limit=4000000"):
        connection.execute(f"PRAGMA {pragma}")


def _write_ahead(connection: Any) -> None:
    """Switch SQLite's file to write-ahead logging, which it keeps; waits while another process does so.

    SQLite's own timeout does not count here. Two processes that switch a new file at the same time both hold it
    for reading, and would wait for each other, so SQLite refuses one of them at once.
    """
    end = steady() + WAIT
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL")
            return
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY or steady() > end:
                raise
        time.sleep(0.01)


def _begin_sqlite(connection: Connection) -> None:
    # A reading transaction that begins to write could not wait for another writer.
    writes = connection.get_execution_options().get("kinboard_write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _migrate(engine: Engine) -> None:
    """Run the migrations that this database lacks, in one transaction; others wait."""
    with engine.connect() as connection:
        with connection.begin():
            found = _revision(connection)
            if found == REVISION:
                return
            if found is not None and found not in REVISIONS:
                raise NewerDatabaseError(f"its revision is {found[:32]}; this version knows up to {REVISION}")
        connection.execution_options(kinboard_write=True)
        with connection.begin():
            if engine.dialect.name == "postgresql":
                connection.execute(text(f"SELECT pg_advisory_xact_lock({_MIGRATION_LOCK})"))
            if _revision(connection) != REVISION:
                from alembic import command  # imported by the first process alone
                from alembic.config import Config

                config = Config()
                folder = str(Path(__file__).parent / "migrations")
                config.set_main_option("script_location", folder.replace("%", "%%"))
                config.attributes["connection"] = connection
                command.upgrade(config, "head")


def _resume_time(engine: Engine) -> None:
    with engine.connect() as connection:
        with connection.begin():
            if not marks.resume(connection):
                return
        connection.execution_options(kinboard_write=True)
        with connection.begin():
            marks.resume_and_keep(connection)


def _revision(connection: Connection) -> str | None:
    if not inspect(connection).has_table("alembic_version"):
        return None
    found = connection.scalar(text("SELECT version_num FROM alembic_version"))
    return None if found is None else str(found)


def _brief(error: Exception) -> str:
    """The first line of the database's own words: a statement and values, which may be personal, come after it."""
    words = str(getattr(error, "orig", None) or error).partition("\n")[0]
    return f"{type(error).__name__}: {words}"[:300]


def _sentence(error: Exception) -> str:
    if isinstance(error, IntegrityError):  # ids are made by us: another launch or host has used one, or removed it
        return "Somebody else has just changed the same in the classroom's database. Try again."
    words = str(getattr(error, "orig", None) or error).lower()
    if "locked" in words or "busy" in words:
        return "Another program has locked the classroom's database for too long. Try again in a moment."
    if "full" in words or "no space" in words or "i/o error" in words:
        return "The disk of the classroom's database is full. Tell the operator of this service."
    if any(part in words for part in ("readonly", "read-only", "permission", "unable to open", "not a directory")):
        return "The classroom's database cannot be written. Tell the operator of this service."
    return "The classroom's database cannot be reached at present. Kinboard keeps trying."
