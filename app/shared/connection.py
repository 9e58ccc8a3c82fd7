"""A visitor's connection: what the service offers the viewer, and what the viewer offers the service.

Messages pass between both by function calls in one event loop; there is no second connection inside the service.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Protocol

from app.shared.security import Rights

# In the state of a websocket's scope: a function, the seconds from the last ping to its answer, None before one.
DELAY = "kinboard.delay"


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
    room_token: str  # of a classroom, as the browser's cookie has it; not verified; empty: none

    async def receive(self) -> bytes:
        """The visitor's next message; raises `ConnectionEnded`."""

    async def send(self, data: bytes) -> None:
        """Send a message; returns when the connection takes the next one. Raises `ConnectionEnded`."""


class PageConnection(Protocol):
    """A connection of a page's channel, beside the visitor's `Connection`: texts, which nobody has inspected."""

    rights: Rights

    async def receive(self) -> str:
        """The page's next text; raises `ConnectionEnded`."""

    async def send(self, text: str) -> None:
        """Send a text; returns when the connection takes the next one. Raises `ConnectionEnded`."""


@dataclass(frozen=True)
class SentFile:
    """What the request says of a file that a page sends.

    Attributes:
        feature, key: what it is for.
        name: of the file.
        size: its bytes.
    """

    feature: str
    key: str
    name: str
    size: int


class FileRefused(Exception):  # noqa: N818 - an answer
    """A file is not taken.

    Attributes:
        status: of the answer.
        why: in words.
        said: whether the page says so already.
    """

    def __init__(self, status: int, why: str, said: bool = False) -> None:
        super().__init__(status, why)
        self.status, self.why, self.said = status, why, said


class Viewer(Protocol):
    """Serves the connections of all visitors, in the event loop that it was started with."""

    def page(self) -> bytes:
        """The HTML of the page that connects."""

    async def serve(self, connection: Connection) -> ConnectionEnded:
        """Serve one visitor until the connection ends; returns why."""

    async def serve_channel(self, connection: PageConnection, name: str) -> ConnectionEnded:
        """Serve the channel of this name until the connection ends; returns why. Another name: code 1008."""

    async def receive_file(self, name: str, sent: SentFile, parts: AsyncIterator[bytes]) -> None:
        """Receive a file for the page whose channel has this name; raises `FileRefused`."""
