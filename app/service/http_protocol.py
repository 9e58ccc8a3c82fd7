"""HTTP/1.1 as uvicorn speaks it, with bounds on what a client can make the service hold.

uvicorn queues any number of pipelined requests, collects a head of any size, and waits for requests without end.
Here a connection has at most `MAX_PIPELINE` requests waiting, heads are bounded, and requests must arrive in time.
Refusals are problem documents.

A request in chunks may have more than its body: extensions of chunks, and trailer fields after the last one.
uvicorn adds trailers to the header fields. Here both are counted, bounded as the head is, and dropped. A request
whose end or host is ambiguous is refused: httptools checks its length, `_check_head` the rest. One that offers
another protocol than websockets is read as if it did not.

:mod:`app.service.uvicorn_names` lists what it uses of uvicorn; only where all of it is there, this is imported.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from typing import Any, Final, Literal

import httptools
from pydantic_core import to_json
from uvicorn.protocols.http.httptools_impl import STATUS_LINE, HttpToolsProtocol

from app.api.problems import ProblemError
from app.service.guard import GuardedConfig
from app.shared.problems import MEDIA_TYPE

MAX_PIPELINE: Final = 16  # requests of a connection that wait for the one being answered
MAX_HEAD: Final = 64 * 1024  # bytes
MAX_HEADERS: Final = 128
CHUNK_FRAME: Final = 16  # bytes of a chunk besides its data that do not count: its size and two line ends
MIN_RATE: Final = 1024.0  # bytes per second, on average, at which a body must arrive


class HttpProtocol(HttpToolsProtocol):
    """One HTTP connection."""

    def __init__(self, config: GuardedConfig, *args: Any, **kwargs: Any) -> None:
        super().__init__(config, *args, **kwargs)
        self.guard = config.guard
        self.ended = False  # no more requests are read from this connection
        self._part: Literal["", "head", "body"] = ""  # of a request, which the client is sending
        self._ignored_upgrade = False  # the head offers another protocol, and is parsed again without that
        self._head = 0  # bytes of an incomplete head, without those that came with its beginning
        self._besides = 0  # bytes after the head that are neither body nor frames of chunks
        self._received = 0  # bytes since the message began
        self._since = 0.0  # when we began to wait for what the client is to send
        self._last = 0.0  # when it last sent something

    # the connection

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._since = self._last = self.loop.time()
        if reason := self.guard.accept(transport, self.check):
            self._refuse(ProblemError(503, "busy", f"No connection is free: {reason}.", "Try again in a moment."))

    def connection_lost(self, exc: Exception | None) -> None:
        self.guard.forget(self.transport)
        super().connection_lost(exc)

    def handle_websocket_upgrade(self) -> None:
        self.ended = True
        super().handle_websocket_upgrade()

    def check(self, now: float) -> None:
        """Close the connection if its client has not sent a request, or the rest of one, in time."""
        ours = self.ended or self.pipeline or self.flow.read_paused
        answered = self.cycle is None or self.cycle.response_complete
        timeout, late = self.guard.receive_timeout, False
        if ours or not (answered or self._part == "body"):
            self._since = self._last = now
        elif self._part == "body":
            late = now - self._last > timeout or now - self._since > timeout + self._received / MIN_RATE
        else:
            late = now - self._since > timeout
        if late and self._part:
            self._refuse_late(f"{timeout:g} s")
        elif late:  # an idle connection
            self.transport.close()

    def _refuse_late(self, timeout: str) -> None:
        host = self.client[0] if self.client else "unknown"
        self.guard.note(
            f"late {self._part}",
            f"the {self._part} of a request from {host} did not arrive within {timeout} "
            "(KINBOARD_RECEIVE_TIMEOUT); the connection is closed",
        )
        detail = f"The {self._part} of the request did not arrive within {timeout}."
        self._refuse(ProblemError(408, "request-timeout", detail, "Send the request again, without pauses."))

    # the parser

    def data_received(self, data: bytes) -> None:
        self._unset_keepalive_if_required()
        self._received += len(data)
        self._last = self.loop.time()
        for start in range(0, len(data), MAX_HEAD):
            self._parse(data[start : start + MAX_HEAD])

    def _parse(self, piece: bytes) -> None:
        """Parse at most `MAX_HEAD` bytes.

        How much of a piece belongs to a head, or to what follows it, that begins within the piece is not known and
        not counted. So at most two pieces of an incomplete field are kept before it is refused.
        """
        if self.ended:
            return
        self._besides += len(piece)
        try:
            self.parser.feed_data(piece)
        except httptools.HttpParserUpgrade as upgrade:
            if self._should_upgrade():
                self.handle_websocket_upgrade()
            else:
                self._parse(self._plain_head())
                self._parse(piece[upgrade.args[0] :])
        except httptools.HttpParserError as error:
            self._end(error.__context__)
        else:
            self._bound(len(piece))

    def _bound(self, size: int) -> None:
        """Refuse an incomplete message with too much besides its body, after a piece of this size."""
        if self._part == "body":
            self._besides = max(0, self._besides)
            if self._besides > MAX_HEAD:
                self._refuse(_too_large("Trailers and chunk extensions have", "", "Send them in the body."))
        elif self._part == "head":
            self._head += size if self._head >= 0 else 1
            if self._head > MAX_HEAD or len(self.headers) > MAX_HEADERS:
                self._refuse(_head_too_large())

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
        self._part = "head"
        self._head, self._received = -1, 0
        self._since = self.loop.time()

    def on_header(self, name: bytes, value: bytes) -> None:
        if self._part == "head":
            super().on_header(name, value)

    def on_headers_complete(self) -> None:
        size = len(self.url) + sum(len(name) + len(value) + 4 for name, value in self.headers)
        if size > MAX_HEAD or len(self.headers) > MAX_HEADERS:  # a whole head may have come at once
            raise _head_too_large()
        _check_head(self.parser.get_http_version(), self.parser.get_method(), self.url, self.headers)
        self._ignored_upgrade = self.parser.should_upgrade() and not self._should_upgrade()
        if not self._ignored_upgrade:
            super().on_headers_complete()
            self._part, self._besides = "body", 0

    def on_body(self, body: bytes) -> None:
        self._besides -= len(body) + CHUNK_FRAME  # at least once for each chunk
        super().on_body(body)

    def on_message_complete(self) -> None:
        self._part = ""
        if not self._ignored_upgrade:
            super().on_message_complete()

    def _end(self, error: BaseException | None) -> None:
        """The parser has stopped."""
        if isinstance(error, _PipelineFullError):
            # What was read is answered, then the connection is closed: clients send the rest again.
            line = f"a client sent more than {MAX_PIPELINE} requests ahead; the rest is not read"
            self.guard.note("pipeline", line)
            self._answer_and_close()
        elif isinstance(error, ProblemError):
            self._refuse(error)
        else:
            self.guard.note("malformed", "a client sent something that is not HTTP; the connection is closed")
            self._refuse(ProblemError(400, "bad-request", "This is not a valid HTTP request."))

    def _answer_and_close(self) -> None:
        self.ended = True
        self.flow.pause_reading()
        self.cycle.keep_alive = False

    def _refuse(self, error: ProblemError) -> None:
        """Answer with a problem document, if no answer to an earlier request is on its way, and close."""
        self.ended = True
        current = self._part == "body"
        unanswered = self.cycle is not None and not self.cycle.response_complete
        if self.pipeline or (unanswered and not current):
            self._answer_and_close()
            if current:  # it would never be answered
                self.transport.close()
        elif not (current and self.cycle.response_started):
            self.transport.write(raw_answer(error, self.server_state.default_headers))
            self.transport.close()
        else:
            self.transport.close()


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
    fields = f" or {MAX_HEADERS} fields"
    return _too_large("The head of the request has", fields, "Send fewer or shorter header fields.")


def _too_large(what: str, fields: str, hint: str) -> ProblemError:
    return ProblemError(431, "head-too-large", f"{what} more than {MAX_HEAD} bytes{fields}.", hint)


def _check_head(version: str, method: bytes, url: bytes, headers: Iterable[tuple[bytes, bytes]]) -> None:
    """Raises `ProblemError` for another HTTP, for no host or several, in unknown codings, or not in ASCII."""
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
    protocols = [value for name, value in headers if name == b"sec-websocket-protocol"]
    if not all(text.isascii() for text in (url, *protocols)):
        raise ProblemError(400, "bad-request", "The address and the subprotocols of a websocket are ASCII.")
