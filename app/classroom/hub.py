"""The rooms of one process: who has pages in them, and the threads that store what these report.

One `Hub` per process; ``app.viewer`` has it in its `Services`. It costs nothing until a page with a ticket comes:
no thread, no file, no import of SQLAlchemy. A page does::

    ticket = hub.ticket(connection.room_token)         # None: the visitor is in no room
    attendance = hub.attend(ticket, changed)           # `changed` is called, from any thread, after each change
    view = attendance.room                             # a RoomView: immutable, the latest state
    if view.closed: ...                                # a sentence: the room has ended, or the seat was removed
    if view.problem: ...                               # a sentence: the database is away; reports are kept
    attendance.tell_page(state.encode(page))           # the teacher's page for all; a student's for the wall
    confirmed = attendance.submit(NewAttempt(...))     # stored for good, or raises ClassroomUnavailable
    attendance.leave()

A room lives in one process, in memory: in the process that has its pages. With several hosts behind one address,
the proxy sends all pages of a room to the same one. What one page reports, others see at once; a thread for each
room with pages stores it within `TICK`, shows students' arms to the teacher together, and looks who is away. A
room whose storing fails holds up no other. Every `LOOK` the thread asks whether another program has changed the
room, such as ``kinboard room end``.

After a start, the first page of a room reads it from the database. Two tabs of one seat are two attendances of one
ticket; both see and tell the same seat. Pages are notified only of what they can see. `changed` must return at
once: post to the inbox of the page. All methods are thread-safe. Only `ticket` (once per process), `attend`,
`submit`, `remove_seat`, `remove_unseen`, `rename_seat` and `end_room` wait for the database; they belong in the
worker of a page, never in the event loop.
"""

from __future__ import annotations

import contextlib
import logging
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app.classroom.attendance import Attendance
from app.classroom.clock import steady
from app.classroom.live import LiveRoom, Place
from app.classroom.revisions import REVISIONS, revision_of
from app.classroom.views import ERASING, NO_ROOM, ClassroomUnavailable, Ticket, UnknownRoomError
from app.shared.settings import Settings

if TYPE_CHECKING:
    from app.classroom.database import Database
    from app.classroom.rooms import Rooms

logger = logging.getLogger("kinboard.classroom")

DATABASE_FILE = "classroom.db"
TICK = 0.2  # seconds between two times that reports are stored and arms are shown
LOOK = 2.0  # seconds between two looks for what other programs have changed
RETRY = 0.5  # seconds after an error of the database
RETRY_ROOM = 5.0  # seconds after another error
UNSTORED = "What happens in this room cannot be stored now; the server log has the details."
LINGER = 5.0  # seconds that a room stays in memory after its last page has left
STOPPING = 2.0  # seconds in which the last reports are stored when the service stops


class Hub:
    """All rooms that pages of this process attend.

    Args:
        folder: where SQLite's file is, or will be.
        url: of another database.
        most: how many rooms there may be at a time.
        share: of these, for one client.

    Attributes:
        lives: the rooms that are in memory, by id.
    """

    def __init__(self, folder: Path, url: str | None = None, most: int = 100, share: float = 1.0) -> None:
        self.folder = folder
        self._source = folder, url
        self._most, self._share = most, share
        self._database: Database | None = None
        self._rooms: Rooms | None = None
        self._lock = threading.RLock()
        self.lives: dict[str, LiveRoom] = {}
        self._threads: dict[str, threading.Thread] = {}
        self._stopping = threading.Event()
        self.on_attempt: Callable[[str], None] | None = None  # called with the seat of each stored attempt

    @classmethod
    def of(cls, settings: Settings) -> Hub:
        """The hub of a service."""
        url = settings.database_url
        address = None if url is None else url.get_secret_value()
        return cls(settings.data_folder, address, settings.max_rooms, settings.client_share)

    @property
    def in_use(self) -> bool:
        """Whether there is a database with rooms, perhaps of an earlier process."""
        folder, url = self._source
        return url is not None or os.access(folder / DATABASE_FILE, os.F_OK)  # `Path.exists` may raise

    @property
    def opened(self) -> bool:
        """Whether this process has used the database."""
        return self._rooms is not None

    @property
    def absent(self) -> bool:
        """Whether there is no database because nobody has opened a room; one that went away is not absent."""
        return not self.in_use and not self.opened and self.writable

    @property
    def state(self) -> Literal["ready", "read-only", "missing", "newer-database"]:
        """Whether rooms can be opened and joined, as far as that is known without waiting for a database."""
        folder, url = self._source
        if url is None and self.in_use:
            stored = revision_of(folder / DATABASE_FILE)
            newer = stored is not None and stored not in REVISIONS
        else:
            newer = self._database is not None and self._database.newer
        if newer:
            return "newer-database"
        if not self.writable:
            return "read-only"
        return "missing" if self._database is not None and self._database.lost else "ready"

    def check(self) -> None:
        """Ask a server of databases, so that the log has what is wrong with it; of a file, `state` tells."""
        if self._source[1] is None:
            return
        with contextlib.suppress(ClassroomUnavailable):
            self.database.key()

    @property
    def writable(self) -> bool:
        """Whether the database's file can be written or made; True for another database, which is not asked."""
        folder, url = self._source
        if url is not None:
            return True
        file = folder / DATABASE_FILE
        if os.access(file, os.F_OK) and not os.access(file, os.W_OK):
            return False
        there = next(each for each in (folder, *folder.absolute().parents) if os.access(each, os.F_OK))
        return there.is_dir() and os.access(there, os.W_OK | os.X_OK)

    @property
    def rooms(self) -> Rooms:
        """Opens, joins and ends rooms. The first use imports SQLAlchemy."""
        with self._lock:
            if self._rooms is None:
                from app.classroom.database import Database
                from app.classroom.rooms import Rooms

                folder, url = self._source
                self._database = Database(folder / DATABASE_FILE, url)
                self._rooms = Rooms(self._database, self._most, self._share, self.lives, self._attempted)
            return self._rooms

    def _attempted(self, seat: str) -> None:
        if self.on_attempt is not None:
            self.on_attempt(seat)

    @property
    def database(self) -> Database:
        """For what has tables of its own."""
        assert self.rooms is not None
        assert self._database is not None
        return self._database

    def ticket(self, token: str) -> Ticket | None:
        """The ticket of a token from a cookie or a link; None if there is none, or we did not sign it."""
        return self.rooms.tokens.read(token) if token and not self.absent else None

    def join(self, code: str, alias: str, known: Ticket | None = None) -> Ticket:
        """As `Rooms.join`; makes no database, which would be without rooms."""
        if self.absent:
            raise UnknownRoomError(NO_ROOM, "code")
        return self.rooms.join(code, alias, known)

    def attend(
        self, ticket: Ticket, changed: Callable[[], None], silence: Callable[[], float] = lambda: 0.0
    ) -> Attendance:
        """Take part from now on.

        Args:
            changed: called after each change, from any thread.
            silence: for how many seconds nothing has come from the page's browser; who is silent is away.
        """
        place = Place(ticket, changed, silence)
        with self._lock:
            live = self.lives.setdefault(ticket.room, LiveRoom(ticket.room))
            live.enter(place)
            if live.id not in self._threads and not self._stopping.is_set():
                thread = threading.Thread(target=self._run, args=[live], name="kinboard-classroom", daemon=True)
                self._threads[live.id] = thread
                thread.start()
        if not live.knows(ticket.seat):
            self._try(live, lambda: self._look(live))
            live.look_who_is_there()  # who leaves again before the next tick has come, too
        return Attendance(self.rooms, live, place)

    def close(self) -> None:
        """Store what is pending, and stop; returns soon even if the database does not answer."""
        self._stopping.set()
        end = steady() + STOPPING
        with self._lock:
            threads = list(self._threads.values())
        for thread in threads:
            thread.join(max(0.0, end - steady()))
        if self._database is not None:
            self._database.close()

    # The thread of a room

    def _run(self, live: LiveRoom) -> None:
        used = steady()
        while True:
            stopping = self._stopping.wait(TICK)
            try:
                self._tick(live, stopping)
            except Exception:
                logger.exception("a tick of a room failed")
            with self._lock:
                if live.places or live.unsaved:
                    used = steady()
                if stopping or steady() - used > LINGER:
                    del self._threads[live.id], self.lives[live.id]
                    return

    def _tick(self, live: LiveRoom, stopping: bool) -> None:
        live.take_arms()
        live.look_who_is_there()
        live.notify()
        if live.unsaved and (stopping or steady() >= live.retry_at):
            self._try(live, lambda: self.rooms.store(live))
        if steady() >= live.retry_at and (live.problem or steady() - live.looked_at >= LOOK):
            self._try(live, lambda: self._look(live))

    def _look(self, live: LiveRoom) -> None:
        """Take over what other programs have stored; of an ended room, whether it is erased."""
        live.looked_at = steady()
        if not live.closed:
            self.rooms.look(live)
        elif live.closed == ERASING:
            self.rooms.close(live)

    def _try(self, live: LiveRoom, act: Callable[[], None]) -> None:
        """Read or store a room; its pages read what is wrong, and it is tried again."""
        try:
            act()
        except UnknownRoomError:
            self.rooms.close(live)
        except ClassroomUnavailable as error:
            live.retry(RETRY, str(error))
        except Exception:
            logger.exception("what happens in a room could not be stored; next try in %g s", RETRY_ROOM)
            live.retry(RETRY_ROOM, UNSTORED)
        else:
            live.retry(0.0, "")
