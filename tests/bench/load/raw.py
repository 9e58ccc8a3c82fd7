"""HTTP and websockets with as little work as possible: a client that is slow measures itself.

Both are asyncio protocols that parse what our own service sends and nothing else: bodies with a length, websocket
frames in one piece.
"""

from __future__ import annotations

import asyncio
import base64
import os
import struct
from collections.abc import Callable

_HEADERS_END = b"\r\n\r\n"
_KEPT = 1 << 20  # bytes


class Http(asyncio.Protocol):
    """One connection that is kept; one request at a time."""

    def __init__(self) -> None:
        self._transport: asyncio.Transport
        self._buffer = bytearray()
        self._left = -1  # bytes of the body still to come; −1 while the head is read
        self._answer: asyncio.Future[int] | None = None
        self._status = 0
        self._parts: list[bytes] | None = None  # of a body that is kept
        self.body = b""
        self.received = 0

    @classmethod
    async def open(cls, port: int) -> Http:
        """A connection to this port of this machine."""
        _, protocol = await asyncio.get_running_loop().create_connection(cls, "127.0.0.1", port)
        return protocol

    async def ask(self, request: bytes) -> int:
        """The status of the answer to a whole request, as `request` makes it.

        Its length is in `received`, and the body in `body` unless it is too long to be kept.
        """
        self._answer = asyncio.get_running_loop().create_future()
        self.received = 0
        self._transport.write(request)
        return await self._answer

    def close(self) -> None:
        """Hang up."""
        self._transport.abort()

    # asyncio.Protocol

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        if self._left < 0:
            self._buffer += data
            end = self._buffer.find(_HEADERS_END)
            if end < 0:
                return
            head = bytes(self._buffer[:end]).lower()
            data = bytes(self._buffer[end + 4 :])
            self._buffer.clear()
            self._status = int(head[9:12])
            at = head.find(b"\r\ncontent-length:")
            self._left = int(head[at + 17 :].split(b"\r\n", 1)[0]) if at >= 0 else 0
            self._parts = [] if self._left <= _KEPT else None
        self._left -= len(data)
        self.received += len(data)
        if self._parts is not None:
            self._parts.append(data)
        if self._left <= 0:
            self._left = -1
            self.body = b"".join(self._parts or ())
            if self._answer is not None and not self._answer.done():
                self._answer.set_result(self._status)

    def connection_lost(self, error: Exception | None) -> None:
        if self._answer is not None and not self._answer.done():
            self._answer.set_exception(ConnectionError("the service hung up"))


def request(method: str, path: str, body: bytes | None = None, token: str = "") -> bytes:
    """A request as bytes, JSON if it has a body."""
    head = f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n{_bearer(token)}"
    if body is None:
        return f"{head}\r\n".encode()
    return f"{head}Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body


def handshake(path: str, subprotocol: str = "", token: str = "", cookie: str = "") -> bytes:
    """The request that opens a websocket."""
    key = base64.b64encode(os.urandom(16)).decode()
    kept = f"Cookie: {cookie}\r\n" if cookie else ""
    offer = f"Sec-WebSocket-Protocol: {subprotocol}\r\n" if subprotocol else ""
    return (
        f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n{offer}{kept}{_bearer(token)}\r\n"
    ).encode()


def frame(opcode: int, data: bytes = b"", final: bool = True) -> bytes:
    """A frame of a websocket, masked with zeros."""
    first, length = final << 7 | opcode, len(data)
    if length < 126:
        head = struct.pack(">BB", first, 0x80 | length)
    elif length < 1 << 16:
        head = struct.pack(">BBH", first, 0x80 | 126, length)
    else:
        head = struct.pack(">BBQ", first, 0x80 | 127, length)
    return head + bytes(4) + data


def _bearer(token: str) -> str:
    return f"Authorization: Bearer {token}\r\n" if token else ""


class Socket(asyncio.Protocol):
    """A websocket; `heard` is called with each message, as bytes.

    Frames are masked with zeros, which costs nothing and is as good as any mask where nobody stands between.
    """

    def __init__(self, hello: bytes, heard: Callable[[bytes], object]) -> None:
        self._hello = hello
        self._heard = heard
        self._buffer = bytearray()
        self._transport: asyncio.Transport
        self._upgraded = False
        self.opened: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.closed: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    @classmethod
    async def open(
        cls,
        port: int,
        path: str,
        subprotocol: str,
        heard: Callable[[bytes], object],
        token: str = "",
        source: str = "127.0.0.1",
        cookie: str = "",
    ) -> Socket:
        """A websocket that has shaken hands; raises `ConnectionError` if it was refused."""
        _, protocol = await asyncio.get_running_loop().create_connection(
            lambda: cls(handshake(path, subprotocol, token, cookie), heard),
            "127.0.0.1",
            port,
            local_addr=(source, 0),
        )
        try:
            await protocol.opened
        except BaseException:  # refused, or nobody waits any longer
            protocol._transport.abort()
            raise
        return protocol

    def send(self, data: bytes) -> None:
        """A binary message."""
        self._transport.write(frame(2, data))

    def send_text(self, text: str) -> None:
        """A text message."""
        self._transport.write(frame(1, text.encode()))

    def stop_reading(self) -> None:
        """Read nothing more of what the service sends."""
        self._transport.pause_reading()

    def close(self) -> None:
        """Say goodbye, as a browser does whose tab is closed."""
        if not self._transport.is_closing():
            self._transport.write(frame(8, struct.pack(">H", 1001)))
            self._transport.close()

    # asyncio.Protocol

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        transport.write(self._hello)

    def data_received(self, data: bytes) -> None:
        self._buffer += data
        if not self._upgraded:
            end = self._buffer.find(_HEADERS_END)
            if end < 0:
                return
            status = bytes(self._buffer[9:12])
            del self._buffer[: end + 4]
            if self.opened.done():  # nobody waits any longer
                return
            if status != b"101":
                self.opened.set_exception(ConnectionError(f"refused with {status.decode()}"))
                self._transport.abort()
                return
            self._upgraded = True
            self.opened.set_result(None)
        self._take_frames()

    def connection_lost(self, error: Exception | None) -> None:
        for waiting in (self.opened, self.closed):
            if not waiting.done():
                waiting.set_exception(ConnectionError("the service hung up"))
                waiting.exception()  # nobody has to ask

    def _take_frames(self) -> None:
        buffer, at = self._buffer, 0
        while len(buffer) - at >= 2:
            length, begin = buffer[at + 1], at + 2
            if length >= 126:
                width = 2 if length == 126 else 8
                length, begin = int.from_bytes(buffer[begin : begin + width], "big"), begin + width
            if len(buffer) < begin + length:
                break
            opcode, whole = buffer[at] & 0x0F, buffer[at] & 0x80
            data = bytes(memoryview(buffer)[begin : begin + length])
            at = begin + length
            if not whole or opcode == 0:
                raise RuntimeError("a message in several frames: this client does not put them together")
            if opcode in (1, 2):
                self._heard(data)
            elif opcode == 9:
                self._transport.write(frame(10, data))
            elif opcode == 8:
                if not self.closed.done():
                    self.closed.set_result(int.from_bytes(data[:2], "big"))
                self._transport.close()
        del buffer[:at]
