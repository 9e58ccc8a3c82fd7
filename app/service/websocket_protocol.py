"""Websockets as uvicorn speaks them, with a budget for frames and for waiting.

uvicorn parses all that has arrived at once, answers each ping, and keeps every part of a message in fragments. A
client could fill the event loop with frames that never become a message. Here every frame counts against a budget;
when it is spent, the rest stays unread until there is more. A client that answers no ping, or takes
nothing of what it is sent, is disconnected after ``KINBOARD_SEND_TIMEOUT``.

:mod:`app.service.uvicorn_names` lists what it uses of uvicorn; only where all of it is there, this is imported.
"""

from __future__ import annotations

import asyncio
import contextlib
import struct
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.exceptions import InvalidState
from websockets.frames import CloseCode, Frame
from websockets.http11 import Request

from app.api.problems import ProblemError
from app.live.codes import PATH as LIVE
from app.service.config import GuardedConfig
from app.service.guard import Outflow
from app.service.http_protocol import raw_answer
from app.service.web.inspection import BURST, RATE, MessageLimit
from app.shared.connection import DELAY, LINE, SILENCE

if TYPE_CHECKING:
    from uvicorn._types import ASGIReceiveEvent, ASGISendEvent

if sys.platform == "linux":
    import fcntl
    import termios

CONTROL_COST: Final = 8.0  # of a frame that is no whole message, in messages
PIECE: Final = 512  # bytes parsed before frames are counted: at most 85 frames
MAX_FRAGMENTS: Final = 64  # of one message
LIVE_PING: Final = 2.0  # the same of a page's program: the page shows how long an answer takes
MAX_LIVE: Final = 2 << 20  # bytes of a program's message: what is too large is refused in words, up to this size
SMALL: Final = 64 * 1024  # bytes of a message that costs no more than any other
LARGE_COST: Final = 1 / 8192  # of each byte of a larger one, in messages: 1 MiB costs half a second of them
AT_ONCE: Final = 4  # messages of a client that are handled in a row, before others have their turn
LINGER: Final = 5.0  # seconds between two looks whether a line is still slow


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """One websocket connection."""

    def __init__(self, config: GuardedConfig, *args: Any, **kwargs: Any) -> None:
        super().__init__(config, *args, **kwargs)
        self.guard = config.guard
        self._host = "unknown"
        self._outflow: Outflow
        self._budget = MessageLimit(RATE, BURST)
        self._unread = bytearray()  # received, not yet parsed
        self._resting: asyncio.TimerHandle | None = None  # until there is budget again
        self._resumed = False
        self._queued = 0
        self._heard = time.monotonic()
        self._take: Callable[[bytes], bool] | None = None  # see `hear`
        self._awaited = False  # whether the application waits for a message
        self._taken = 0  # messages in a row that `_take` has handled
        self.sent = 0

    # the connection

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._host = self.client[0] if self.client else "unknown"
        self._outflow = Outflow(self.transport, self.guard.send_timeout)
        self.guard.add(self, self._host)

    def connection_lost(self, exc: Exception | None) -> None:
        self.guard.remove(self, self._host)
        self._unread.clear()
        if self._resting is not None:
            self._resting.cancel()
        super().connection_lost(exc)

    def resume_writing(self) -> None:
        self._outflow.flowed = self._resumed = True
        super().resume_writing()

    def check(self, now: float) -> None:
        """Disconnect a client that takes nothing of what it is sent."""
        if self._outflow.stuck(now):
            self._note_unread()
            self.transport.abort()
        elif self._unread:
            self._parse_more()  # the closing handshake, after our close frame

    # what the client sends

    def data_received(self, data: bytes) -> None:
        self._heard = time.monotonic()
        self._taken = 0
        self._unread += data
        self._parse_more()

    async def receive(self) -> ASGIReceiveEvent:
        self._awaited = True
        try:
            message = await self.queue.get()
        finally:
            self._awaited = False
        if self.queue.empty():
            self._parse_more()
        return message

    def _parse_more(self) -> None:
        """Parse what has arrived: until there is a message, or the budget is spent.

        uvicorn stops reading the socket at each message and starts again when it has been taken: two calls to the
        system for each. Here reading goes on until something has arrived that may not be parsed yet.
        """
        paused, self.read_paused = self.read_paused, True  # uvicorn leaves the transport as it is then
        while self._unread and self._is_reading():
            piece = bytes(self._unread[:PIECE])
            del self._unread[:PIECE]
            super().data_received(piece)
            if self.conn.handshake_exc is not None and not self.handshake_initiated:
                self._reject("This is not a valid websocket handshake.")
        self.read_paused = paused
        if self.transport.is_closing():
            return
        if bool(self._unread) != paused:
            self.read_paused = not paused
            (self.transport.resume_reading if paused else self.transport.pause_reading)()

    def _is_reading(self) -> bool:
        """Whether another piece may be parsed now. After our close frame messages are dropped, unread."""
        if self._resting is not None or self.transport.is_closing():
            return False
        return self.queue.empty() or self.close_sent

    def _spend(self, cost: float) -> None:
        wait = self._budget.spend(self.loop.time(), cost)
        if wait > 0.0 and self._resting is None:
            self._resting = self.loop.call_later(wait, self._rested)

    def _rested(self) -> None:
        self._resting = None
        self._parse_more()

    def handle_connect(self, event: Request) -> None:
        offered = event.headers.get_all("Sec-WebSocket-Protocol")
        if not event.path.isascii() or not all(value.isascii() for value in offered):
            self.handshake_initiated = True
            self._reject("The address and the subprotocols of a websocket are ASCII.")
        else:
            super().handle_connect(event)
            if self.response.status_code == 101:
                self.scope["state"][SILENCE] = self._silence
                self.scope["state"][DELAY] = self._delay
                self.scope["state"][LINE] = self
                if LIVE in event.path:
                    self.conn.max_message_size = MAX_LIVE
                    self.ping_interval = min(LIVE_PING, self.ping_interval or LIVE_PING)

    def _silence(self) -> float:
        """For how many seconds the client has sent nothing, not even an answer to a ping. Thread-safe."""
        return time.monotonic() - self._heard

    def _delay(self) -> float | None:
        """Seconds from the last ping to its answer; None before the first one."""
        return self.last_ping_rtt or None

    def _reject(self, why: str) -> None:
        """Answer 400 to a handshake."""
        self.handshake_complete = self.close_sent = True
        problem = ProblemError(400, "bad-request", why)
        self.transport.write(raw_answer(problem, self.default_headers))
        self.transport.close()

    def handle_text(self, event: Frame) -> None:
        self._spend(_cost(event, 1.0 if event.fin else CONTROL_COST))
        super().handle_text(event)

    def handle_bytes(self, event: Frame) -> None:
        self._spend(_cost(event, 1.0 if event.fin else CONTROL_COST))
        if not (event.fin and self._is_taken(event.data)):
            super().handle_bytes(event)

    def hear(self, take: Callable[[bytes], bool]) -> None:
        """Give `take` the whole binary messages that the application waits for: no task need wake for them.

        What it returns True for is handled. No message overtakes another, and after `AT_ONCE` in a row one passes
        through the application, so that a client who sends many at once holds up nobody.
        """
        self._take = take

    def _is_taken(self, data: bytes | bytearray | memoryview) -> bool:
        waits = self._awaited and self.queue.empty() and not self.close_sent and self._taken < AT_ONCE
        if self._take is None or not waits:
            return False
        self._taken += 1
        return self._take(bytes(data))

    def handle_cont(self, event: Frame) -> None:
        self._spend(_cost(event, CONTROL_COST))
        super().handle_cont(event)
        if len(self.frames) > MAX_FRAGMENTS:
            self.conn.fail(CloseCode.MESSAGE_TOO_BIG, f"more than {MAX_FRAGMENTS} fragments")
            self.handle_parser_exception()

    def send_receive_event_to_app(self) -> None:
        if self.curr_msg_data_type == "text" and not _is_utf8(b"".join(self.frames)):
            self.conn.fail(CloseCode.INVALID_DATA, "a text message that is not UTF-8")
            self.handle_parser_exception()
        else:
            super().send_receive_event_to_app()

    def handle_ping(self) -> None:
        self._spend(CONTROL_COST)
        if not self.transport.is_closing():  # otherwise asyncio logs a line for each answer
            super().handle_ping()

    def handle_pong(self, event: Frame) -> None:
        self._spend(CONTROL_COST)
        super().handle_pong(event)

    # what the client reads

    async def send(self, message: ASGISendEvent) -> None:
        if self.handshake_complete and not self.close_sent and self.transport.is_closing():
            raise ClientDisconnected  # asyncio says so in its next round, and logs a line for each write before
        await super().send(message)

    def send_now(self, data: bytes) -> bool:
        """Send a binary message without a wait; False, and nothing is sent, if the line is full or has ended."""
        is_open = self.handshake_complete and not (self.close_sent or self.disconnected)
        if not is_open or not self.writable.is_set() or self.transport.is_closing():
            return False
        try:
            self.conn.send_binary(data)
        except InvalidState:
            return False
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.sent += len(data)
        return True

    def send_keepalive_ping(self) -> None:
        self._queued, self._resumed = self._unsent(), False
        super().send_keepalive_ping()

    def keepalive_timeout(self) -> None:
        """Disconnect a client that has not answered a ping, unless the ping still waits behind data on its way."""
        unsent = self._unsent()
        if unsent and (self._resumed or unsent < self._queued):
            self._queued, self._resumed = unsent, False
            self.pong_timer = self.loop.call_later(LINGER, self.keepalive_timeout)
            return
        self._note_unread()
        super().keepalive_timeout()
        if unsent:
            self.transport.abort()

    def _unsent(self) -> int:
        """Bytes that the client has not acknowledged, as far as the system tells."""
        waiting = self.transport.get_write_buffer_size()
        if sys.platform != "linux":
            return waiting
        with contextlib.suppress(OSError):  # already closed
            number = self.transport.get_extra_info("socket").fileno()
            waiting += struct.unpack("i", fcntl.ioctl(number, termios.TIOCOUTQ, bytes(4)))[0]
        return waiting

    def _note_unread(self) -> None:
        seconds = f"{self.guard.send_timeout:g} s (KINBOARD_SEND_TIMEOUT)"
        self.guard.note("unread", f"{self._host} read nothing from a websocket for {seconds} and is disconnected")


def _cost(event: Frame, least: float) -> float:
    """What a frame costs, in messages."""
    size = len(event.data)
    return least if size <= SMALL else max(least, size * LARGE_COST)


def _is_utf8(data: bytes) -> bool:
    try:
        data.decode()
    except UnicodeDecodeError:
        return False
    return True
