"""HTTP/1.1 as uvicorn speaks it, with bounds on what a client can make the service hold.

uvicorn queues any number of pipelined requests, collects a head of any size, and waits for requests without end.
Here a connection has at most `MAX_PIPELINE` requests waiting, heads are bounded, requests must arrive in time, and
answers must be read. Refusals are problem documents. Answers to HTTP/1.0 are not chunked.

A request in chunks may have more than its body: extensions of chunks, and trailer fields after the last one.
uvicorn adds trailers to the header fields. Here both are counted, bounded as the head is, and dropped. A request
whose end or host is ambiguous is refused: httptools checks its length, `_check_head` the rest. One that offers
another protocol than websockets is read as if it did not.

:mod:`app.service.uvicorn_names` lists what it uses of uvicorn; only where all of it is there, this is imported.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final, cast

import httptools
from pydantic_core import to_json
from starlette.types import Message, Receive, Scope, Send
from uvicorn.protocols.http.flow_control import FlowControl
from uvicorn.protocols.http.httptools_impl import STATUS_LINE, HttpToolsProtocol, RequestResponseCycle

from app.api.problems import ProblemError
from app.service.config import GuardedConfig
from app.service.guard import Outflow
from app.shared.problems import MEDIA_TYPE

if TYPE_CHECKING:
    from uvicorn._types import ASGI3Application

MAX_PIPELINE: Final = 16  # requests of a connection that wait for the one being answered
MAX_HEAD: Final = 64 * 1024  # bytes
MAX_HEADERS: Final = 128
CHUNK_FRAME: Final = 16  # bytes of a chunk besides its data that do not count: its size and two line ends
MIN_RATE: Final = 1024.0  # bytes per second, on average, at which a body must arrive


class _Flow(FlowControl):
    """Does not resume reading while requests wait: uvicorn would, after each answer."""

    def __init__(self, protocol: HttpProtocol, transport: asyncio.Transport) -> None:
        super().__init__(transport)
        self._protocol = protocol

    def resume_reading(self) -> None:
        if not self._protocol.pipeline and not self._protocol.ended:
            super().resume_reading()


class HttpProtocol(HttpToolsProtocol):
    """One HTTP connection."""

    def __init__(self, config: GuardedConfig, *args: Any, **kwargs: Any) -> None:
        super().__init__(config, *args, **kwargs)
        self.guard = config.guard
        self.ended = False  # no more requests are read from this connection
        self._host: str | None = None  # None: not counted
        self._outflow: Outflow
        self._in_message = False
        self._head_complete = False
        self._ignored_upgrade = False  # the head offers another protocol, and is parsed again without that
        self._head = 0  # bytes of an incomplete head, without those that came with its beginning
        self._besides = 0  # bytes after the head that are neither body nor frames of chunks
        self._trailers: list[int] = []  # bytes of each trailer field
        self._received = 0  # bytes since the message began
        self._since = 0.0  # when we began to wait for what the client is to send
        self._last = 0.0  # when it last sent something

    # the connection

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        self.transport = transport
        try:
            self._accept(transport)
        except Exception as error:  # noqa: BLE001 - asyncio would leave the connection open, and nobody would answer
            self.guard.note("failed", "a connection could not be accepted and is closed", error)
            self.ended = True
            transport.abort()

    def _accept(self, transport: asyncio.Transport) -> None:
        host = (transport.get_extra_info("peername") or ("unknown",))[0]
        number = transport.get_extra_info("socket").fileno()
        if reason := self.guard.refusal(host, number):
            self.ended = True
            self._write(ProblemError(503, "busy", f"No connection is free: {reason}.", "Try again in a moment."))
            return
        super().connection_made(transport)
        self._host = host
        # Otherwise the body of a small answer waits for the client to acknowledge its head: 40 ms.
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.flow = _Flow(self, transport)
        self._outflow = Outflow(transport, self.guard.send_timeout)
        self._since = self._last = self.loop.time()
        self.guard.add(self, host)

    def connection_lost(self, exc: Exception | None) -> None:
        if self._host is not None:
            self.guard.remove(self, self._host)
        super().connection_lost(exc)

    def resume_writing(self) -> None:
        self._outflow.flowed = True
        super().resume_writing()

    def check(self, now: float) -> None:
        """Close the connection if its client has not read an answer, or not sent a request, in time."""
        if self._outflow.stuck(now):
            self.guard.note(
                "unread",
                f"{self._host} read nothing of an answer for {self.guard.send_timeout:g} s "
                "(KINBOARD_SEND_TIMEOUT); the connection is closed",
            )
            self.transport.abort()
        elif not self._is_waiting():
            self._since = self._last = now
        elif self._is_late(now):
            self._time_out()

    def _is_waiting(self) -> bool:
        """Whether it is the client's turn to send."""
        if self.ended or self.pipeline or self.flow.read_paused:
            return False
        answered = self.cycle is None or self.cycle.response_complete
        return answered or (self._in_message and self._head_complete)

    def _is_late(self, now: float) -> bool:
        timeout = self.guard.receive_timeout
        if not (self._in_message and self._head_complete):
            return now - self._since > timeout
        return now - self._last > timeout or now - self._since > timeout + self._received / MIN_RATE

    def _time_out(self) -> None:
        if not self._in_message:  # an idle connection
            self.transport.close()
            return
        part = "body" if self._head_complete else "head"
        seconds = f"{self.guard.receive_timeout:g} s"
        self.guard.note(
            f"late {part}",
            f"the {part} of a request from {self._host} did not arrive within {seconds} "
            "(KINBOARD_RECEIVE_TIMEOUT); the connection is closed",
        )
        detail = f"The {part} of the request did not arrive within {seconds}."
        self._refuse(ProblemError(408, "request-timeout", detail, "Send the request again, without pauses."))

    # the parser

    def data_received(self, data: bytes) -> None:
        if self.ended:
            return
        self._unset_keepalive_if_required()
        self._received += len(data)
        self._last = self.loop.time()
        view = memoryview(data)
        for start in range(0, len(data), MAX_HEAD):
            if not self._parse(view[start : start + MAX_HEAD]):
                return

    def _parse(self, piece: memoryview | bytes) -> bool:
        """Parse at most `MAX_HEAD` bytes; returns whether what follows them is for this parser too.

        How much of a piece belongs to a head, or to what follows it, that begins within the piece is not known and
        not counted. So at most two pieces of an incomplete field are kept before it is refused.
        """
        self._besides += len(piece)
        try:
            self.parser.feed_data(piece)
        except httptools.HttpParserUpgrade as upgrade:
            if self._should_upgrade():
                self.handle_websocket_upgrade()
                return False
            return self._parse(self._plain_head()) and self._parse(piece[upgrade.args[0] :])
        except httptools.HttpParserError as error:
            self._end(error.__context__)
            return False
        if not self._in_message:
            return True
        if self._head_complete:
            self._besides = max(0, self._besides)
            if self._besides > MAX_HEAD:
                self._refuse(_trailers_too_large())
        else:
            self._head += len(piece) if self._head >= 0 else 1
            if self._head > MAX_HEAD or len(self.headers) > MAX_HEADERS:
                self._refuse(_head_too_large())
        return not self.ended

    def _plain_head(self) -> bytes:
        """The head that was parsed, without the offer of another protocol, for which httptools skips its body."""
        start = self.parser.get_method(), self.url, self.parser.get_http_version().encode()
        lines = [b"%s %s HTTP/%s" % start]
        lines += [name + b": " + value for name, value in self.headers if name != b"upgrade"]
        return b"\r\n".join([*lines, b"", b""])

    def on_message_begin(self) -> None:
        if len(self.pipeline) >= MAX_PIPELINE:
            raise _PipelineFullError
        super().on_message_begin()
        self._in_message, self._head_complete, self._ignored_upgrade = True, False, False
        self._head, self._received, self._trailers = -1, 0, []
        self._since = self.loop.time()

    def on_header(self, name: bytes, value: bytes) -> None:
        if not self._head_complete:
            super().on_header(name, value)
            return
        self._trailers.append(len(name) + len(value) + 4)
        if sum(self._trailers) > MAX_HEAD or len(self._trailers) > MAX_HEADERS:  # they may have come at once too
            raise _trailers_too_large()

    def on_body(self, body: bytes) -> None:
        self._besides -= len(body) + CHUNK_FRAME  # at least once for each chunk
        super().on_body(body)

    def on_headers_complete(self) -> None:
        size = len(self.url) + sum(len(name) + len(value) + 4 for name, value in self.headers)
        if size > MAX_HEAD or len(self.headers) > MAX_HEADERS:  # a whole head may have come at once
            raise _head_too_large()
        _check_head(self.parser.get_http_version(), self.parser.get_method(), self.headers)
        self._ignored_upgrade = self.parser.should_upgrade() and not self._should_upgrade()
        if self._ignored_upgrade:
            return
        super().on_headers_complete()
        self._head_complete, self._besides = True, 0

    def on_message_complete(self) -> None:
        self._in_message = False
        if not self._ignored_upgrade:
            super().on_message_complete()

    def on_response_complete(self) -> None:
        self._since = self._last = self.loop.time()
        super().on_response_complete()

    def _end(self, error: BaseException | None) -> None:
        """The parser has stopped."""
        if isinstance(error, _PipelineFullError):
            # What was read is answered, then the connection is closed: clients send the rest again.
            self.guard.note(
                "pipeline", f"{self._host} sent more than {MAX_PIPELINE} requests ahead; the rest is not read"
            )
            self.ended = True
            self.flow.pause_reading()
            self.cycle.keep_alive = False
        elif isinstance(error, ProblemError):
            self._refuse(error)
        else:
            self.guard.note("malformed", f"{self._host} sent something that is not HTTP; the connection is closed")
            self._refuse(ProblemError(400, "bad-request", "This is not a valid HTTP request."))

    def _refuse(self, error: ProblemError) -> None:
        """Answer with a problem document, if no answer to an earlier request is on its way, and close."""
        self.ended = True
        current = self._in_message and self._head_complete
        unanswered = self.cycle is not None and not self.cycle.response_complete
        if self.pipeline or (unanswered and not current):
            self.flow.pause_reading()
            self.cycle.keep_alive = False
            if current:  # it would never be answered
                self.transport.close()
        elif current and self.cycle.response_started:
            self.transport.close()
        else:
            self._write(error)

    def _write(self, error: ProblemError) -> None:
        self.transport.write(raw_answer(error, self.server_state.default_headers))
        self.transport.close()

    # the application

    def handle_websocket_upgrade(self) -> None:
        if self._host is not None:
            self.guard.remove(self, self._host)
            self._host = None  # the websocket counts itself
        super().handle_websocket_upgrade()

    def _start_asgi_task(self, cycle: RequestResponseCycle, app: ASGI3Application) -> None:
        if cycle.scope["http_version"] == "1.0":
            app = cast("ASGI3Application", _unchunked(app, cycle))
        super()._start_asgi_task(cycle, cast("ASGI3Application", _while_connected(app, cycle)))


def raw_answer(error: ProblemError, headers: Iterable[tuple[bytes, bytes]]) -> bytes:
    """The last answer of a connection, as bytes, for requests that do not reach the application."""
    body = to_json(error.problem)
    lines = [STATUS_LINE[error.status_code]]
    lines += [name + b": " + value + b"\r\n" for name, value in headers]
    lines.append(
        f"content-type: {MEDIA_TYPE}\r\ncontent-length: {len(body)}\r\nx-content-type-options: nosniff\r\n"
        "cache-control: no-store\r\nconnection: close\r\n\r\n".encode()
    )
    return b"".join([*lines, body])


class _PipelineFullError(Exception):
    """A client sends requests faster than they are answered."""


def _head_too_large() -> ProblemError:
    detail = f"The head of the request has more than {MAX_HEAD} bytes or {MAX_HEADERS} fields."
    return ProblemError(431, "head-too-large", detail, "Send fewer or shorter header fields.")


def _trailers_too_large() -> ProblemError:
    detail = f"Trailers and chunk extensions have more than {MAX_HEAD} bytes or {MAX_HEADERS} fields."
    return ProblemError(431, "head-too-large", detail, "Send them in the body.")


def _check_head(version: str, method: bytes, headers: Iterable[tuple[bytes, bytes]]) -> None:
    """Raises `ProblemError` for a request of another HTTP, for no host or several, or in unknown codings."""
    if version not in ("1.0", "1.1"):
        raise ProblemError(505, "bad-request", f"HTTP/{version} is not supported.", "Send HTTP/1.1.")
    hosts = sum(name == b"host" for name, _ in headers)
    if hosts > 1 or (hosts == 0 and version == "1.1"):
        count = f"{hosts} header fields" if hosts else "no header field"
        detail = f"The request has {count} Host."
        raise ProblemError(400, "bad-request", detail, "Send exactly one.")
    if any(name == b"transfer-encoding" and value.strip().lower() != b"chunked" for name, value in headers):
        raise ProblemError(501, "bad-request", "The request has a Transfer-Encoding other than chunked.")
    if method == b"CONNECT":
        raise ProblemError(501, "bad-request", "CONNECT is not supported: this is not a proxy.")


def _while_connected(app: Any, cycle: RequestResponseCycle) -> Any:
    """`app`, whose answer ends when writing fails.

    asyncio reports a lost connection only in the next round of the loop. An answer that is ready is written in one
    round, and asyncio logs a line for each piece after the failure.
    """

    async def connected(scope: Scope, receive: Receive, send: Send) -> None:
        async def send_while_connected(message: Message) -> None:
            if cycle.transport.is_closing() and not cycle.response_complete:
                cycle.disconnected = True
                cycle.message_event.set()
            await send(message)

        await app(scope, receive, send_while_connected)

    return connected


def _unchunked(app: Any, cycle: RequestResponseCycle) -> Any:
    """`app`, with an answer of unknown length that ends with the connection: HTTP/1.0 has no chunks."""

    async def unchunked(scope: Scope, receive: Receive, send: Send) -> None:
        known = True

        async def send_unchunked(message: Message) -> None:
            nonlocal known
            if message["type"] == "http.response.start":
                known = any(name.lower() == b"content-length" for name, _ in message.get("headers", ()))
                if not known:
                    cycle.chunked_encoding = False
            elif not known:
                cycle.expected_content_length = len(message.get("body", b""))
            await send(message)

        await app(scope, receive, send_unchunked)

    return unchunked
