"""Whether the seat of a guest is still there: who has joined a room uses the viewer as long as the room goes on.

The cookie names the room and the seat. The database is asked about each of them at most every few seconds. So the
viewer is soon lost when a room ends or a student is removed.
"""

from __future__ import annotations

import time

from starlette.concurrency import run_in_threadpool

from app.classroom import ClassroomUnavailable, Hub, Ticket

FRESH = 3.0  # seconds for which an answer of the database is used
MOST = 5000  # answers that are kept


class Guests:
    """Answers for one process; for one event loop."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._known: dict[Ticket, tuple[float, bool]] = {}  # when it was asked, and what was said

    async def admits(self, room: str, seat: str) -> bool:
        """Whether the room goes on and the seat is in it.

        While the database is away, a signed cookie is enough: the class goes on.
        """
        ticket = Ticket(room, seat)
        asked, admitted = self._known.get(ticket, (-FRESH, False))
        if time.monotonic() - asked < FRESH:
            return admitted
        try:
            admitted = self._hub.in_use and await run_in_threadpool(lambda: self._hub.rooms.is_open(ticket))
        except ClassroomUnavailable:
            return True
        self._known.pop(ticket, None)
        self._known[ticket] = time.monotonic(), admitted
        while len(self._known) > MOST:
            del self._known[next(iter(self._known))]
        return admitted
