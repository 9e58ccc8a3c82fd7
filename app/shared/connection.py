"""A visitor's connection: what the service offers the viewer, and what the viewer offers the service.

Messages pass between both by function calls in one event loop; there is no second connection inside the service.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from app.shared.security import Rights

SILENCE = "kinboard.silence"  # what a websocket's scope has `Connection.silence` as, in its state
DELAY = "kinboard.delay"  # and there: a function, the seconds from the last ping to its answer, None before one


def never_silent() -> float:
    """The silence of a connection of which nothing is known."""
    return 0.0


class ConnectionEnded(Exception):  # noqa: N818 - not an error
    """A connection has ended, or must end, with this close code (RFC 6455, 7.4) and reason."""

    def __init__(self, code: int, reason: str = "") -> None:
        super().__init__(code, reason)
        self.code = code
        self.reason = reason


class Connection(Protocol):
    """One visitor's connection. Messages of the visitor have been inspected."""

    subprotocol: str | None
    rights: Rights
    client: str  # as `app.shared.clients` names it
    silence: Callable[[], float]  # for how many seconds nothing has come, not even an answer to a ping
    room_token: str  # of a classroom, as the browser's cookie has it; not verified; empty: none

    async def receive(self) -> bytes:
        """The visitor's next message; raises `ConnectionEnded`."""

    async def send(self, data: bytes) -> None:
        """Send a message; returns when the connection takes the next one. Raises `ConnectionEnded`."""


class Viewer(Protocol):
    """Serves the connections of all visitors, in the event loop that it was started with."""

    def page(self) -> bytes:
        """The HTML of the page that connects."""

    async def serve(self, connection: Connection) -> ConnectionEnded:
        """Serve one visitor until the connection ends; returns why."""
