"""Clients that misbehave, all at once: what `siege` lets loose on a service.

Each attack comes from an address of its own and repeats its round, with a pause in between, until the time is up.
A round that the service refuses or ends is a round like any other. The attackers run in a process of their own
with the lowest priority: they share the machine with the service and with those who measure.
"""

from __future__ import annotations

import asyncio
import functools
import json
import os
import random
import re
import socket
import time
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection

import msgspec

from load.live import Programmed
from load.raw import frame, handshake, request
from load.visitor import SUBPROTOCOL, Visitor

API = "/api/v1/robots"
FAR = {"position": [5.0, 0.0, 0.0], "wxyz": [1.0, 0.0, 0.0, 0.0]}  # out of reach: takes the longest
NEAR = {"position": [0.4, 0.1, 0.5], "wxyz": [0.0, 1.0, 0.0, 0.0]}
HOLD = 75.0  # seconds that a client holds what it got without reading: longer than KINBOARD_SEND_TIMEOUT
FLOOD = 20.0  # seconds of one flood
_STATUS = re.compile(rb"HTTP/1\.1 (\d{3}) ")
_encode = msgspec.msgpack.Encoder().encode


@dataclass
class Attacker:
    """One attack on a service: where it is, and what came of it.

    Attributes:
        token: the access token; attackers without it send none, or a wrong one.
        source: address from which this attack comes.
        rounds, sent, failed: rounds that ended, bytes sent, rounds that the service ended.
        statuses: of the answers that were read.
    """

    port: int
    token: str
    source: str
    rounds: int = 0
    sent: int = 0
    failed: int = 0
    statuses: Counter[str] = field(default_factory=Counter)

    @asynccontextmanager
    async def line(self, first: bytes, receive: int = 0) -> AsyncIterator[socket.socket]:
        """A connection on which `first` has been sent; `receive`: the size of its buffer."""
        connection = socket.socket()
        try:
            connection.setblocking(False)
            if receive:
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive)
            connection.bind((self.source, 0))
            await asyncio.get_running_loop().sock_connect(connection, ("127.0.0.1", self.port))
            await self.send(connection, first)
            yield connection
        finally:
            connection.close()

    async def send(self, connection: socket.socket, data: bytes) -> None:
        """Send all of it."""
        await asyncio.get_running_loop().sock_sendall(connection, data)
        self.sent += len(data)

    async def read(self, connection: socket.socket, until_closed: bool = True) -> None:
        """Read, and count the statuses, until the service closes the connection, or until something is there."""
        while data := await asyncio.get_running_loop().sock_recv(connection, 1 << 18):
            for status in _STATUS.findall(data):
                self.statuses[status.decode()] += 1
            if not until_closed:
                return

    async def flood(self, connection: socket.socket, data: bytes, seconds: float) -> None:
        """Send the same over and over, as fast as it is taken, and read what comes back."""

        reading = asyncio.create_task(self.read(connection))
        try:
            async with asyncio.timeout(seconds):
                while True:
                    await self.send(connection, data)
        finally:
            reading.cancel()
            await asyncio.gather(reading, return_exceptions=True)

    def ask(self, method: str, path: str, body: object = None) -> bytes:
        """A request with the token."""
        return request(method, f"{API}/{path}", None if body is None else json.dumps(body).encode(), self.token)


Round = Callable[[Attacker], Awaitable[None]]


@dataclass(frozen=True)
class Attack:
    """One kind of attack.

    Attributes:
        clients: how many do it at a time.
        pause: seconds between two rounds of one client.
    """

    name: str
    round: Round
    clients: int
    pause: float


# -- connections -----------------------------------------------------------------------------------------------


async def _pipeline(attacker: Attacker) -> None:
    """Requests without a token, a hundred thousand ahead; every second client reads the answers."""
    ahead = request("GET", "/livez") * 1000
    async with attacker.line(ahead) as connection:
        if attacker.rounds % 2:
            await attacker.flood(connection, ahead, FLOOD)
        else:
            async with asyncio.timeout(FLOOD):
                for _ in range(100):
                    await attacker.send(connection, ahead)
                await asyncio.sleep(FLOOD)


async def _half_a_head(attacker: Attacker) -> None:
    async with attacker.line(b"GET /livez HTTP/1.1\r\nHost: local") as connection:
        await attacker.read(connection)


async def _stalled_upload(attacker: Attacker) -> None:
    """Seven of eight megabytes, and nothing more."""
    head = attacker.ask("POST", "pioneer5/fk", "").replace(b"Content-Length: 2", b"Content-Length: 8000000")
    async with attacker.line(head + bytes(7_000_000)) as connection:
        await attacker.read(connection)


_ROW = [0.123456789] * 5


@functools.cache
def _bodies() -> dict[str, list[tuple[str, bytes]]]:
    """Bodies of up to 8 MB and their routes: some have too many values, others are parsed and then refused."""
    found: dict[str, list[tuple[str, object]]] = {
        "many values": [
            ("fk", {"q": [_ROW] * 110_000}),
            ("fk", {"q": [[]] * 1_900_000}),
            ("ik", {"target": [FAR] * 90_000}),
            ("fk", {f"a name as long as this {k}": 1 for k in range(220_000)}),
        ],
        "fewer": [
            ("fk", {"q": "x" * 8_000_000}),
            ("fk", {"q": [_ROW] * 32_000}),
            ("fk", {f"a name as long as this {k}": "y" * 50 for k in range(90_000)}),
            ("ik", {"target": [FAR] * 14_000}),
        ],
    }
    return {kind: [(path, json.dumps(body).encode()) for path, body in bodies] for kind, bodies in found.items()}


def _large_body(kind: str) -> Round:
    async def send(attacker: Attacker) -> None:
        path, body = _bodies()[kind][attacker.rounds % 4]
        async with attacker.line(request("POST", f"{API}/pioneer5/{path}", body, attacker.token)) as connection:
            await attacker.read(connection, until_closed=False)

    return send


async def _wrong_token(attacker: Attacker) -> None:
    async with attacker.line(request("GET", API, token=f"wrong-{random.random()}")) as connection:
        await attacker.read(connection, until_closed=False)


async def _nonsense(attacker: Attacker) -> None:
    async with attacker.line(os.urandom(2000) + b"\r\n\r\n") as connection:
        await attacker.read(connection)


# -- answers ---------------------------------------------------------------------------------------------------


async def _huge_batch(attacker: Attacker) -> None:
    """All images of many targets: refused before it is computed, or answered and not read."""
    count = (4000, 100, 400)[attacker.rounds % 3]
    body = {"target": [NEAR] * count, "images": "all", "max_solutions": 1000}
    async with attacker.line(attacker.ask("POST", "ur5/ik", body), receive=4096) as connection:
        if count == 4000:
            await attacker.read(connection, until_closed=False)
        else:
            await asyncio.sleep(FLOOD)


def _unread(path: str, body: object = None) -> Round:
    async def hold(attacker: Attacker) -> None:
        first = attacker.ask("GET" if body is None else "POST", path, body)
        async with attacker.line(first, receive=4096):
            await asyncio.sleep(HOLD)

    return hold


async def _unread_stream(attacker: Attacker) -> None:
    path = f"{API}/pioneer5/workspace/stream?n=90000000"
    async with attacker.line(handshake(path, token=attacker.token), receive=4096):
        await asyncio.sleep(HOLD)


async def _unread_viewer(attacker: Attacker) -> None:
    """A visitor who draws a large cloud and reads nothing of it."""
    visitor = Visitor(attacker.token, attacker.source)
    await visitor.connect(attacker.port)
    try:
        await visitor.quiet()
        visitor.set("Points", 4_000_000)
        visitor.stop_reading()
        visitor.set("Cloud", "Start")
        await asyncio.sleep(HOLD)
    finally:
        visitor.close()


async def _trickle(attacker: Attacker) -> None:
    """A byte a second of a large cloud."""
    path = "pioneer5/workspace?n=90000000&format=bin"
    async with attacker.line(attacker.ask("GET", path), receive=4096) as connection:
        async with asyncio.timeout(HOLD):
            while await asyncio.get_running_loop().sock_recv(connection, 1):
                await asyncio.sleep(1.0)


# -- work ------------------------------------------------------------------------------------------------------


async def _abandoned_batch(attacker: Attacker) -> None:
    body = {"target": [FAR] * 5000}
    async with attacker.line(attacker.ask("POST", "panda/ik", body)):
        await asyncio.sleep(1.0)


async def _abandoned_summary(attacker: Attacker) -> None:
    limit = 1.0 + random.random()  # no two of them share their result
    async with attacker.line(attacker.ask("GET", f"irb120/workspace/summary?effort=16&limit=1:-1:{limit:.6f}")):
        await asyncio.sleep(2.0)


# -- websockets ------------------------------------------------------------------------------------------------

_FRAMES = {"ping": frame(9), "pong": frame(10, bytes(125)), "fragment": frame(0, final=False)}


def _frames(path: str, with_token: bool) -> Round:
    """Control frames and fragments, of each kind in turn."""

    async def flood(attacker: Attacker) -> None:
        token = attacker.token if with_token else ""
        piece = _FRAMES[("ping", "pong", "fragment")[attacker.rounds % 3]]
        first = handshake(path, SUBPROTOCOL if path == "/viewer" else "", token)
        async with attacker.line(first) as connection:
            await attacker.send(connection, frame(2, final=False))
            await attacker.flood(connection, piece * (65536 // len(piece)), FLOOD)

    return flood


_KINDS = (
    "GuiUpdateMessage",
    "GuiButtonHoldMessage",
    "TransformControlsUpdateMessage",
    "ViewerCameraMessage",
    "SceneNodeClickMessage",
    "ScenePointerMessage",
    "CommandTriggerMessage",
    "ShareUrlRequest",
)


async def _malformed(attacker: Attacker) -> None:
    """Messages of known kinds with wrong fields, and at last bytes that are no message."""
    first = handshake("/viewer", SUBPROTOCOL, attacker.token)
    async with attacker.line(first) as connection, asyncio.timeout(FLOOD):
        for _ in range(100):
            values = (None, -1, 1e300, "x" * 100, [[]] * 3, {"a": {"b": []}}, True, b"\xff")
            names = ("uuid", "name", "value", "updates", "position", "wxyz", "owner", "button")
            wrong = {name: random.choice(values) for name in random.sample(names, 4)}
            await attacker.send(connection, frame(2, _encode({"type": random.choice(_KINDS), **wrong})))
            await asyncio.sleep(0.01)
        await attacker.send(connection, frame(2, os.urandom(64)))
        await attacker.read(connection)


async def _reconnect(attacker: Attacker) -> None:
    """Visitors who leave before their page is there."""
    async with attacker.line(handshake("/viewer", SUBPROTOCOL, attacker.token)) as connection:
        await attacker.read(connection, until_closed=False)


LIVE = "/api/v1/live/"


async def _codes(attacker: Attacker) -> None:
    """Programs that try codes of pages, ten a round; every second round without a token."""
    token = attacker.token if attacker.rounds % 2 else ""
    for _ in range(10):
        code = "".join(random.choices("ABCDEFGHJKLMNPQRSTUVWXYZ23456789", k=8))
        async with attacker.line(handshake(f"{LIVE}{code}?name=guess", token=token)) as connection:
            for _ in ("handshake", "problem"):
                await attacker.read(connection, until_closed=False)


async def _program(attacker: Attacker) -> None:
    """A program of a page of its own: too many messages, then messages of 1 MB; it reads no answers."""
    visitor = Programmed(attacker.token, attacker.source)
    try:
        await visitor.connect(attacker.port)
        attacker.sent += await visitor.flood(FLOOD / 2, json.dumps({"q": [0.1] * 5, "id": 1}))
        attacker.sent += await visitor.flood(
            FLOOD / 2, json.dumps({"draw": {"a": {"points": [[0.1] * 3] * 70_000}}})
        )
    finally:
        visitor.close()


STREAM = f"{API}/pioneer5/workspace/stream?n=50000000"
ATTACKS = (
    Attack("requests sent ahead", _pipeline, 4, 0.1),
    Attack("half-sent heads", _half_a_head, 100, 0.1),
    Attack("stalled uploads", _stalled_upload, 20, 10.0),
    Attack("bodies of too many values", _large_body("many values"), 3, 0.1),
    Attack("large bodies", _large_body("fewer"), 3, 0.1),
    Attack("wrong tokens", _wrong_token, 4, 0.05),
    Attack("no HTTP", _nonsense, 2, 0.05),
    Attack("huge batches", _huge_batch, 4, 5.0),
    Attack("reachable, not read", _unread("pioneer5/reachable", {"target": [NEAR] * 10_000}), 8, 1.0),
    Attack("clouds, not read", _unread("pioneer5/workspace?n=90000000&format=bin"), 8, 1.0),
    Attack("streams, not read", _unread_stream, 8, 1.0),
    Attack("viewers, not read", _unread_viewer, 4, 1.0),
    Attack("clouds, a byte a second", _trickle, 4, 1.0),
    Attack("abandoned batches", _abandoned_batch, 16, 10.0),
    Attack("abandoned summaries", _abandoned_summary, 16, 10.0),
    Attack("frames, viewer", _frames("/viewer", False), 2, 0.5),
    Attack("frames, viewer with token", _frames("/viewer", True), 1, 0.5),
    Attack("frames, stream", _frames(STREAM, True), 2, 0.5),
    Attack("malformed messages", _malformed, 2, 0.5),
    Attack("reconnects", _reconnect, 2, 0.25),
    Attack("codes of pages", _codes, 2, 0.5),
    Attack("programs of pages", _program, 2, 0.5),
)


async def besiege(
    port: int, token: str, seconds: float, names: list[str] | None = None
) -> list[dict[str, object]]:
    """All attacks at once, or those of these names, for so long: what each has done."""
    chosen = [attack for attack in ATTACKS if names is None or attack.name in names]
    attackers = {attack.name: Attacker(port, token, f"127.0.1.{k + 1}") for k, attack in enumerate(chosen)}
    tasks = [
        asyncio.create_task(_keep_on(attackers[attack.name], attack))
        for attack in chosen
        for _ in range(attack.clients)
    ]
    await asyncio.sleep(seconds)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    return [
        {
            "attack": name,
            "rounds": attacker.rounds,
            "ended by the service": attacker.failed,
            "MB sent": attacker.sent / 1e6,
            "statuses read": attacker.statuses,
        }
        for name, attacker in attackers.items()
    ]


async def _keep_on(attacker: Attacker, attack: Attack) -> None:
    await asyncio.sleep(random.random())
    while True:
        try:
            await attack.round(attacker)
        except TimeoutError:
            pass
        except OSError:  # refused, or cut off
            attacker.failed += 1
        attacker.rounds += 1
        await asyncio.sleep(attack.pause)


def attack(
    port: int, token: str, seconds: float, report: Connection, names: list[str] | None, niceness: int
) -> None:
    """A process of attackers, which ends by itself: sends None when they begin, and what `besiege` returns."""
    os.nice(niceness)
    report.send(None)
    began = time.monotonic()
    found = asyncio.run(besiege(port, token, seconds, names))
    report.send((time.monotonic() - began, found))
