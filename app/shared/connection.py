"""A visitor's connection: what the service offers the viewer, and what the viewer offers the service.

Messages pass between both by function calls in one event loop; there is no second connection inside the service.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from typing import Protocol

from app.shared.security import Rights

SILENCE = "kinboard.silence"  # what a websocket's scope has `Connection.silence` as, in its state
DELAY = "kinboard.delay"  # and there: a function, the seconds from the last ping to its answer, None before one
LINE = "kinboard.line"  # and there: a `Line`


def never_silent() -> float:
    """The silence of a connection of which nothing is known."""
    return 0.0


class ConnectionEnded(Exception):  # noqa: N818 - not an error
    """A connection has ended, or must end, with this close code (RFC 6455, 7.4) and reason."""

    def __init__(self, code: int, reason: str = "") -> None:
        super().__init__(code, reason)
        self.code = code
        self.reason = reason


class Line(Protocol):
    """What a websocket can do without a task of the event loop, besides ASGI; only the loop's thread calls it."""

    sent: int  # bytes of messages that `send_now` has sent

    def hear(self, take: Callable[[bytes], bool]) -> None:
        """Give `take` the binary messages that come while the application waits for one; see `Connection.hear`."""

    def send_now(self, data: bytes) -> bool:
        """Send a binary message; False, and nothing is sent, if the line is full or has ended."""


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

    def hear(self, take: Callable[[bytes], bool]) -> None:
        """Have messages that come while `receive` waits go to `take` first, at once and without an inspection.

        What it returns True for is handled. It must be quick, and refuse all but messages that it has read wholly.
        Some messages never get there, such as those that come in a burst: `receive` returns them.
        """

    def send_now(self, data: bytes) -> bool:
        """Send a message if that needs no wait; False: nothing was sent, and `send` may wait or raise."""


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
