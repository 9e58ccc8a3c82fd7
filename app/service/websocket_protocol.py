"""Websockets as uvicorn speaks them, with bounds on frames that are no messages and on messages that wait.

uvicorn parses all that has arrived at once, answers each ping, and keeps every part of a message in fragments. A
client could fill the event loop with them. Here one that sends many pings, fragments of one message or tiny
messages at a time is disconnected, and messages are read at a bounded rate: the rest waits unread.

:mod:`app.service.uvicorn_names` lists what it uses of uvicorn; only where all of it is there, this is imported.
"""

from __future__ import annotations

from asyncio import sleep
from typing import TYPE_CHECKING, Any, Final

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode, Frame
from websockets.http11 import Request

from app.api.problems import ProblemError
from app.live.codes import PATH as LIVE
from app.service.guard import GuardedConfig
from app.service.http_protocol import raw_answer
from app.service.web.inspection import BURST, RATE, MessageLimit
from app.shared.connection import DELAY

if TYPE_CHECKING:
    from uvicorn._types import ASGIReceiveEvent

PIECE: Final = 4096  # bytes parsed before frames are counted
MAX_WAITING: Final = 4096  # messages that are parsed and not read; those of pages are longer than 64 bytes
AHEAD: Final = 8  # messages of at most a piece that may wait before the next ones are left unread
MAX_FRAGMENTS: Final = 64  # of one message
PING_RATE, PING_BURST = 30.0, 60.0  # pings and pongs of a client in a second, and at once
LIVE_PING: Final = 2.0  # s between two of ours to a page's program: the page shows how long an answer takes
MAX_LIVE: Final = 2 << 20  # bytes of a program's message: what is too large is refused in words, up to this size
SMALL: Final = 64 * 1024  # bytes of a message that costs no more than any other
LARGE_COST: Final = 1 / 8192  # of each byte of a larger one, in messages: 1 MiB costs half a second of them


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """One websocket connection."""

    def __init__(self, config: GuardedConfig, *args: Any, **kwargs: Any) -> None:
        super().__init__(config, *args, **kwargs)
        self.guard = config.guard
        self._messages, self._pings = MessageLimit(RATE, BURST), MessageLimit(PING_RATE, PING_BURST)

    def data_received(self, data: bytes) -> None:
        for start in range(0, len(data), PIECE):
            if self.transport.is_closing():
                return
            super().data_received(data[start : start + PIECE])
            if self.conn.handshake_exc is not None and not self.handshake_initiated:
                self.handshake_complete = self.close_sent = True
                problem = ProblemError(400, "bad-request", "This is not a valid websocket handshake.")
                self.transport.write(raw_answer(problem, self.default_headers))
                self.transport.close()
            elif self.queue.qsize() > MAX_WAITING:
                self._end(CloseCode.POLICY_VIOLATION, f"more than {MAX_WAITING} messages at once")

    def handle_connect(self, event: Request) -> None:
        if LIVE in event.path.partition("?")[0]:
            self.conn.max_message_size = MAX_LIVE
            self.ping_interval = min(LIVE_PING, self.ping_interval or LIVE_PING)
        super().handle_connect(event)
        if self.response.status_code == 101:
            self.scope["state"][DELAY] = lambda: self.last_ping_rtt or None

    async def receive(self) -> ASGIReceiveEvent:
        event = await super().receive()
        content: Any = event.get("bytes") or event.get("text") or b""
        size = len(content)
        wait = self._messages.spend(self.loop.time(), 1.0 if size <= SMALL else size * LARGE_COST)
        if wait > 0.0 and event["type"] == "websocket.receive" and not self.transport.is_closing():
            await sleep(wait)
        return event

    def handle_cont(self, event: Frame) -> None:
        super().handle_cont(event)
        if len(self.frames) > MAX_FRAGMENTS:
            self._end(CloseCode.MESSAGE_TOO_BIG, f"more than {MAX_FRAGMENTS} fragments")

    def handle_ping(self) -> None:
        if self._counted():
            super().handle_ping()

    def handle_pong(self, event: Frame) -> None:
        if self._counted():
            super().handle_pong(event)

    def _counted(self) -> bool:
        """Count a ping or pong; whether it is handled."""
        if self.transport.is_closing():
            return False
        if self._pings.spend(self.loop.time()) <= 0.0:
            return True
        self._end(CloseCode.POLICY_VIOLATION, f"more than {PING_RATE:g} pings in a second")
        return False

    def send_receive_event_to_app(self) -> None:
        try:
            if self.curr_msg_data_type == "text":
                b"".join(self.frames).decode()
        except UnicodeDecodeError:
            self._end(CloseCode.INVALID_DATA, "a text message that is not UTF-8")
            return
        long = sum(map(len, self.frames)) > PIECE  # several of these would take megabytes
        if self.read_paused or long or self.queue.qsize() >= AHEAD:
            super().send_receive_event_to_app()
        else:
            # uvicorn stops reading at each message until it is taken: two system calls for every event of a drag.
            self.read_paused = True
            super().send_receive_event_to_app()
            self.read_paused = False

    def _end(self, code: CloseCode, why: str) -> None:
        """Disconnect a client because of what it has sent; nothing happens if that was done."""
        if self.transport.is_closing():
            return
        self.guard.note("frames", f"a client of a websocket sent {why}, and is disconnected")
        self.conn.fail(code, why)
        if self.conn.close_sent is None:  # the handshake is not complete
            self.transport.close()
        else:
            self.handle_parser_exception()
