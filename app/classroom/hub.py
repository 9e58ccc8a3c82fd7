"""The live state of rooms in one process: what a page asks, tells and is news.

One `Hub` per process; ``app.viewer`` has it in its `Services`. It costs nothing until a page with a ticket comes:
no thread, no file, no import of SQLAlchemy. A page does::

    ticket = hub.ticket(connection.room_token)         # None: the visitor is in no room
    attendance = hub.attend(ticket, changed)           # `changed` is called, from any thread, after each change
    view = attendance.room                             # a RoomView: immutable, the latest state that is known
    if view.closed: ...                                # a sentence: the room has ended, or the seat was removed
    if view.problem: ...                               # a sentence: the database is away; reports are kept
    attendance.tell_page(state.encode(page))           # the teacher's page for all; a student's for the wall
    confirmed = attendance.submit(NewAttempt(...))     # stored for good, or raises ClassroomUnavailable
    attendance.leave()

Two tabs of one seat are two attendances of one ticket; both see and tell the same seat. What one page tells,
others in the same process see at once. Those in other processes, on this or another machine, see it through the
database: a thread writes all reports in one transaction, at once if a page has set something. Every `TICK` it
reads the rooms whose version has changed. Pages are notified only of what they can see. `changed` must
return at once: post to the inbox of the page. All methods are thread-safe. Only `ticket` (once per process),
`attend`, `submit`, `remove_seat`, `rename_seat` and `end_room` wait for the database; they belong
in the worker of a page, never in the event loop.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import threading
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app.classroom.attendance import Attendance
from app.classroom.clock import steady
from app.classroom.live import LiveRoom, Pending
from app.classroom.revisions import REVISIONS, revision_of
from app.classroom.views import (
    ERASING,
    NO_ROOM,
    ClassroomUnavailable,
    RoomView,
    Ticket,
    UnknownRoomError,
)
from app.shared.settings import Settings

if TYPE_CHECKING:
    from app.classroom.database import Database
    from app.classroom.rooms import Rooms

logger = logging.getLogger("kinboard.classroom")

DATABASE_FILE = "classroom.db"
TICK = 0.03  # seconds between two looks at the database
BEAT = 2.0  # seconds between two signs that somebody is there
LOOK = 0.5  # seconds between two looks whose connection is silent
SILENT = 5.0  # seconds without a sign of a page's browser, which is asked for one every two seconds
SEAT_PAGE_EVERY = 0.2  # seconds between two states of the students' pages
RETRY = 0.5  # seconds after an error of the database
RETRY_ROOM = 5.0  # seconds after an error of one room, which others do not wait for
UNSTORED = "What happens in this room cannot be stored now; the server log has the details."
LINGER = 5.0  # seconds that the thread waits for the next page after the last has left


class Hub:
    """All rooms that pages of this process attend.

    Args:
        folder: where SQLite's file is, or will be.
        url: of another database.
        most: how many rooms there may be at a time.
        share: of these, for one client.
    """

    def __init__(self, folder: Path, url: str | None = None, most: int = 100, share: float = 1.0) -> None:
        self.folder = folder
        self._source = folder, url
        self._most, self._share = most, share
        self._database: Database | None = None
        self._rooms: Rooms | None = None
        self._lock = threading.RLock()
        self._lives: dict[str, LiveRoom] = {}
        self._attendances: dict[str, list[Attendance]] = {}
        self._thread: threading.Thread | None = None
        self._stopping, self._wake = threading.Event(), threading.Event()
        self._beat_at = self._looked_at = 0.0
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
                self._rooms = Rooms(self._database, self._most, self._share)
            return self._rooms

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
        attendance = Attendance(self, ticket, changed, silence)
        with self._lock:
            live = self._lives.setdefault(ticket.room, LiveRoom(ticket.room))
            self._attendances.setdefault(ticket.room, []).append(attendance)
            self._look_who_is_here(live)
            self._beat_at = 0.0
            if self._thread is None and not self._stopping.is_set():
                self._thread = threading.Thread(target=self._run, name="kinboard-classroom", daemon=True)
                self._thread.start()
            loaded = bool(live.row)
        if not loaded or (ticket.seat and ticket.seat not in live.seats):
            self._poll([ticket.room])
        return attendance

    def close(self) -> None:
        """Store what is pending, and stop; returns soon even if the database does not answer."""
        self._stopping.set()
        self._wake.set()
        thread = self._thread
        if thread is not None:
            thread.join(2.0)
        if self._database is not None:
            self._database.close()

    # For attendances

    def view(self, ticket: Ticket) -> RoomView:
        """What a ticket's page may see."""
        with self._lock:
            return self._lives[ticket.room].view(ticket)

    def tell(self, ticket: Ticket, change: Callable[[LiveRoom], None]) -> None:
        """Change the live room, and let all pages in it know."""
        with self._lock:
            live = self._lives.get(ticket.room)
            if live is None or live.closed or not live.row:
                return
            change(live)
        self._notify([ticket.room])
        self._wake.set()

    def tell_later(self, ticket: Ticket, page: str) -> None:
        """A student's page: at once if all see it, otherwise with the others' every `SEAT_PAGE_EVERY` seconds."""
        with self._lock:
            live = self._lives.get(ticket.room)
            if live is None:
                return
            if not live.is_shown(ticket.seat):
                live.pages[ticket.seat] = page
                return
        self.tell(ticket, lambda live: live.tell_seat(ticket.seat, {"page": page}))

    def refresh(self, room: str) -> None:
        """See now what has just been stored."""
        self._poll([room])

    def closed(self, room: str) -> None:
        """A room has been ended by one of its pages."""
        self._close([room])

    def _close(self, rooms: Iterable[str]) -> None:
        """Say to the pages of rooms that have ended what is true of them."""
        try:
            words = self.rooms.said_of_ended()
        except ClassroomUnavailable:
            words = ERASING
        with self._lock:
            ended = [room for room in rooms if room in self._lives]
            for room in ended:
                self._lives[room].closed = words
        self._notify(ended)

    def leave(self, page: Attendance) -> None:
        """Forget an attendance; what it has reported is still stored."""
        room = page.ticket.room
        with self._lock:
            pages = self._attendances.get(room, [])
            if page in pages:
                pages.remove(page)
                self._look_who_is_here(self._lives[room])

    def _look_who_is_here(self, live: LiveRoom) -> None:
        pages = self._attendances.get(live.id, ())
        live.here = {each.ticket.seat for each in pages if each.silence() < SILENT}
        live.silent = {each.ticket.seat for each in pages} - live.here

    def _notify(self, rooms: Iterable[str]) -> None:
        """Let those pages know for whom something has changed."""
        callbacks = []
        with self._lock:
            for room in rooms:
                for each in self._attendances.get(room, ()):
                    stamp = self._lives[room].stamp(each.ticket)
                    if stamp != each.stamp:
                        each.stamp = stamp
                        callbacks.append(each.changed)
        for changed in callbacks:
            try:
                changed()
            except Exception:
                logger.exception("a page could not be notified that its room has changed")

    # The thread

    def _run(self) -> None:
        idle_since: float | None = None
        while True:
            self._wake.wait(TICK)
            self._wake.clear()
            stopping = self._stopping.is_set()
            try:
                available = self._tick()
            except Exception:
                logger.exception("a tick of the classroom failed")
                available = False
            with self._lock:
                if stopping:
                    return
                if self._attendances:
                    idle_since = None
                elif idle_since is None:
                    idle_since = steady()
                elif steady() - idle_since > LINGER:
                    self._thread = None
                    return
            if not available:
                self._stopping.wait(RETRY)

    def _tick(self) -> bool:
        """Write, read, notify; returns whether the database answered."""
        with self._lock:
            if beat := steady() - self._beat_at >= BEAT:
                self._beat_at = steady()
            if steady() - self._looked_at >= LOOK:
                self._looked_at = steady()
                for live in self._lives.values():
                    self._look_who_is_here(live)
            changed = [live.id for live in self._lives.values() if live.take_pages(SEAT_PAGE_EVERY)]
        self._notify(changed)
        if not self._flush(beat):
            return False
        with self._lock:
            open_rooms = [live.id for live in self._lives.values() if not live.closed]
            erasing = [live.id for live in self._lives.values() if beat and live.closed == ERASING]
        answered = self._poll(open_rooms)
        if erasing:
            self._close(erasing)
        with self._lock:
            absent = [live.id for live in self._lives.values() if live.note_absence()]
            for room in [room for room, pages in self._attendances.items() if not pages]:
                if not self._lives[room].pending:
                    del self._attendances[room], self._lives[room]
        self._notify(absent)
        return answered

    def _flush(self, beat: bool) -> bool:
        with self._lock:
            news: dict[str, tuple[Pending, set[str]]] = {}
            for room, live in sorted(self._lives.items()):  # sorted: two processes lock rooms in the same order
                beats = live.here if beat and live.row else set()
                due = steady() >= live.retry_at or self._stopping.is_set()
                if due and not live.closed and (live.pending or beats):
                    news[room] = live.pending, set(beats)
                    live.flying, live.pending = live.pending, Pending()
        return not news or self._store(news)

    def _store(self, news: dict[str, tuple[Pending, set[str]]]) -> bool:
        """Store news of rooms in one transaction, or put them back; returns whether the database answered."""
        try:
            from app.classroom.ticks import store

            with self.database.write(durable=False) as connection:
                versions = {room: store(connection, room, *each) for room, each in news.items()}
        except ClassroomUnavailable as error:
            self._put_back(news)
            self._set_problem(news, str(error))
            return False
        except Exception:
            if len(news) == 1:
                logger.exception("what happens in a room could not be stored; next try in %g s", RETRY_ROOM)
                self._put_back(news, steady() + RETRY_ROOM)
                self._set_problem(news, UNSTORED)
                return True
            versions = None
        if versions is None:  # each by itself: one room must not hold up the others
            answered = [self._store({room: each}) for room, each in news.items()]
            return all(answered)
        with self._lock:
            for room, version in versions.items():
                live = self._lives[room]
                live.flying, live.retry_at = Pending(), -math.inf
                live.note_beats(news[room][1])
                if version is not None and version <= live.version:  # read meanwhile, below what was on its way
                    live.row["version"] = version - 1
                elif version == live.version + 1:  # nobody else has written: there is nothing to read
                    live.row["version"] = version
        return True

    def _put_back(self, news: Iterable[str], retry_at: float = -math.inf) -> None:
        """What was on its way is pending again, below what has been reported since."""
        with self._lock:
            for room in news:
                live = self._lives[room]
                live.pending.add_older(live.flying)
                live.flying, live.retry_at = Pending(), retry_at

    def _poll(self, rooms: Iterable[str]) -> bool:
        with self._lock:
            known = {room: self._lives[room].version for room in rooms if room in self._lives}
        if not known:
            return True
        try:
            database = self.database
            from app.classroom.ticks import fetch

            with database.read() as connection:
                found = fetch(connection, known, self._tries_of)
        except ClassroomUnavailable as error:
            self._set_problem(known, str(error))
            return False
        with self._lock:
            for room, loaded in found.items():
                live = self._lives.get(room)
                if live is not None and loaded is not None and loaded[0]["version"] >= live.version:
                    live.load(*loaded)
        self._notify(found)
        if ended := [room for room, loaded in found.items() if loaded is None]:
            self._close(ended)
        with self._lock:
            well = [room for room in known if room in self._lives and self._lives[room].retry_at == -math.inf]
        self._set_problem(well, "")
        return True

    def _tries_of(self, room: str) -> Mapping[str, int]:
        """How many attempts of each seat are known."""
        with self._lock:
            live = self._lives.get(room)
            return {} if live is None else {seat: one.row["tries"] for seat, one in live.seats.items()}

    def _set_problem(self, rooms: Iterable[str], problem: str) -> None:
        with self._lock:
            changed = [self._lives[room] for room in rooms if room in self._lives]
            changed = [live for live in changed if live.problem != problem]
            for live in changed:
                live.problem = problem
        self._notify([live.id for live in changed])
