"""Points a second: in the kernel and its steps, through the generator, over REST, into a visitor's page."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import kin
from app.bench import run as bench
from app.bench.contestants import OURS, PEERS
from app.bench.rows import ROWS
from load import table
from load.raw import Http, Socket, request
from load.service import Service, serve
from load.visitor import Visitor

ROBOT = "pioneer5"
_PATIENCE = 300.0  # seconds
_MOST_IN_A_PAGE = 4_000_000


class _Peak:
    """The most memory a service held since then."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._stop = threading.Event()
        self.begin = self.most = service.usage().memory
        self._thread = threading.Thread(target=self._watch)

    @contextmanager
    def watching(self) -> Iterator[None]:
        self._thread.start()
        try:
            yield
        finally:
            self._stop.set()
            self._thread.join()

    def _watch(self) -> None:
        while not self._stop.wait(0.1):
            self.most = max(self.most, self._service.usage().memory)


async def rest(service: Service, n: int) -> None:
    """The whole cloud as ``bin``."""
    connection = await Http.open(service.port)
    status = await connection.ask(request("GET", f"/api/v1/robots/{ROBOT}/workspace?n={n}&format=bin"))
    if status != 200 or connection.received < 12 * n:
        raise RuntimeError(f"answered {status} with {connection.received} bytes")
    connection.close()


async def stream(service: Service, n: int) -> None:
    """The whole cloud through the websocket of the API."""
    received, done = 0, asyncio.Event()

    def heard(data: bytes) -> None:
        nonlocal received
        received += len(data)
        if received >= 12 * n:
            done.set()

    path = f"/api/v1/robots/{ROBOT}/workspace/stream?n={n}"
    socket = await Socket.open(service.port, path, "", heard)
    async with asyncio.timeout(_PATIENCE):
        await done.wait()
    socket.close()


async def page(visitor: Visitor, n: int) -> None:
    """The whole cloud into the page of a visitor who has set the number and presses Start."""
    before = visitor.points
    visitor.set("Cloud", "Start")
    async with asyncio.timeout(_PATIENCE):
        while visitor.points - before < n:
            await asyncio.sleep(0.001)


def _generator(n: int) -> None:
    for _ in kin.workspace.sample_workspace(kin.get_robot(ROBOT), n):
        pass


def alone(quick: bool) -> list[dict[str, Any]]:
    """What a point costs one thread here: the kernel, its steps one by one, numpy, and what nobody can beat."""
    settings = bench.Settings(
        rows=tuple(row for row in ROWS if row.id == "workspace"),
        peers=tuple(peer for peer in PEERS if peer.name == "numpy"),
    )
    (row,) = bench.run(settings.quick() if quick else settings).rows
    steps = {f"{OURS}, {step} only" for step in ("numbers", "kinematics", "conversion", "encoding")}
    whole = sum(entry.turns.median for entry in row.entries if entry.contestant.name in steps)
    kernel = row.named(OURS)
    assert kernel is not None
    return [
        {
            "alone": f"{OURS}, kernel" if entry is kernel else entry.contestant.name,
            "ns a point": 1e9 * entry.turns.median,
            "M/s": 1e-6 / entry.turns.median,
            "× kernel": entry.to_array,
            "% of the steps": 100.0 * entry.turns.median / whole if entry.contestant.name in steps else math.nan,
        }
        for entry in row.entries
    ]


def run(quick: bool, sizes: list[int] | None = None) -> dict[str, Any]:
    """The tables on stdout, and what is in them."""
    steps = alone(quick)
    print(table(f"cloud: {ROBOT}, a thread of this process", steps) + "\n", flush=True)
    rows: list[dict[str, Any]] = []
    with serve() as service:
        for n in sizes or ([100_000] if quick else [1_000_000, 10_000_000]):
            rows += asyncio.run(_of_size(service, n, 2 if quick else 5))
    print(table(f"cloud: {ROBOT}, the fastest run of each", rows))
    return {"alone": steps, "rows": rows, "robot": ROBOT}


async def _of_size(service: Service, n: int, runs: int) -> list[dict[str, Any]]:
    _generator(1000)
    alone: list[float] = []
    for _ in range(runs):
        began = time.perf_counter()
        _generator(n)
        alone.append(time.perf_counter() - began)
    rows: list[dict[str, Any]] = []

    def row(name: str, seconds: float, spent: float, grown: int) -> None:
        rows.append(
            {
                "way": name,
                "points": n,
                "s": seconds,
                "ns a point": 1e9 * seconds / n,
                "M/s": n / seconds / 1e6,
                "× generator": seconds / min(alone),
                "service CPU s": spent,
                "memory grows MB": grown / 1e6,
            }
        )

    row("generator, one thread, here", min(alone), 0.0, 0)

    async def timed(name: str, way: Callable[[], Any]) -> None:
        best, least, grown = float("inf"), 0.0, 0
        for _ in range(runs):
            peak, spent = _Peak(service), service.seconds()
            with peak.watching():
                began = time.perf_counter()
                await way()
                seconds = time.perf_counter() - began
            if seconds < best:
                best, least = seconds, service.seconds() - spent
            grown = max(grown, peak.most - peak.begin)
        row(name, best, least, grown)

    await timed("REST, bin", lambda: rest(service, n))
    await timed("REST, websocket", lambda: stream(service, n))
    if n <= _MOST_IN_A_PAGE:
        visitor = Visitor()
        await visitor.connect(service.port)
        await visitor.offers("Points")
        visitor.set("Points", n)
        await visitor.quiet()
        await timed("viewer", lambda: page(visitor, n))
        visitor.close()
    return rows
