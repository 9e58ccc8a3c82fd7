"""What a websocket does without a task of the event loop: messages that are heard, and sent, at once."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from typing import Any

from live_server import serve, wait_for
from starlette.types import Receive, Scope, Send
from websockets.sync.client import connect

from app.service.websocket_protocol import AT_ONCE
from app.shared.connection import LINE, Line

COUNT = 5 * AT_ONCE


class App:
    """Writes down which way messages have come: heard at once, or received."""

    def __init__(self, take: Callable[[bytes], bool] = lambda _: True) -> None:
        self.came: list[tuple[str, bytes]] = []
        self.line: Any = None
        self.sent: list[bool] = []
        self._take = take
        self.ended = threading.Event()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            for done in ("startup", "shutdown"):
                await receive()
                await send({"type": f"lifespan.{done}.complete"})
            return
        line: Line = scope["state"][LINE]
        self.line = line
        line.hear(self._hear)
        self.sent.append(line.send_now(b"too early"))
        await send({"type": "websocket.accept"})
        self.sent.append(line.send_now(b"hello"))
        while (event := await receive())["type"] != "websocket.disconnect":
            if event["type"] == "websocket.receive":
                self.came.append(("received", event["bytes"]))
        self.sent.append(line.send_now(b"too late"))
        self.ended.set()

    def _hear(self, data: bytes) -> bool:
        if not self._take(data):
            return False
        self.came.append(("heard", data))
        return True


def frame(data: bytes) -> bytes:
    """A masked binary frame, with a mask that changes nothing."""
    return bytes([0x82, 0x80 | len(data), 0, 0, 0, 0]) + data


def burst(port: int, messages: list[bytes]) -> socket.socket:
    """All messages in one piece, after the handshake."""
    connection = socket.create_connection(("127.0.0.1", port))
    fields = ["GET / HTTP/1.1", "Host: localhost", "Upgrade: websocket", "Connection: Upgrade"]
    fields += ["Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="]
    connection.sendall("\r\n".join([*fields, "", ""]).encode())
    answer = b""
    while not answer.endswith(b"hello"):
        answer += connection.recv(1)
    connection.sendall(b"".join(map(frame, messages)))
    return connection


def test_messages_are_heard_while_the_application_waits() -> None:
    app = App()
    with serve(app) as port, connect(f"ws://127.0.0.1:{port}/") as client:
        assert client.recv() == b"hello"
        for k in range(3):
            client.send(b"%d" % k)
            wait_for(lambda k=k: len(app.came) == k + 1)
    assert app.came == [("heard", b"0"), ("heard", b"1"), ("heard", b"2")]


def test_a_burst_keeps_its_order_and_lets_others_come_between() -> None:
    app, messages = App(), [b"%d" % k for k in range(COUNT)]
    with serve(app) as port, burst(port, messages):
        wait_for(lambda: len(app.came) == COUNT)
    assert [data for _, data in app.came] == messages
    ways = "".join(way[0] for way, _ in app.came)
    assert ways.startswith("h" * AT_ONCE + "r")
    assert "h" * (AT_ONCE + 1) not in ways, "one client has the event loop for itself"


def test_what_is_not_taken_is_received_and_nothing_overtakes_it() -> None:
    app, messages = App(take=lambda data: int(data) % 3 != 0), [b"%d" % k for k in range(COUNT)]
    with serve(app) as port, burst(port, messages):
        wait_for(lambda: len(app.came) == COUNT)
    assert [data for _, data in app.came] == messages
    assert all(way == "received" for way, data in app.came if int(data) % 3 == 0)


def test_nothing_is_sent_at_once_before_the_handshake_or_after_the_end() -> None:
    app = App()
    with serve(app) as port:
        with connect(f"ws://127.0.0.1:{port}/") as client:
            assert client.recv() == b"hello"
        assert app.ended.wait(10)
    assert app.sent == [False, True, False]
    assert app.line.sent == len(b"hello")


def test_a_line_that_is_full_takes_nothing_at_once() -> None:
    app = App()
    with serve(app) as port, burst(port, [b"0"]):
        wait_for(lambda: app.came)
        loop = app.line.loop

        def fill() -> None:
            for _ in range(200):
                app.sent.append(app.line.send_now(bytes(1 << 20)))

        loop.call_soon_threadsafe(fill)
        wait_for(lambda: len(app.sent) == 202)
        assert not app.sent[-1]
        assert sum(app.sent) < 100, "the memory of the service would fill"
