"""Hours of visitors in minutes: they come, drag, draw a cloud, ask, and go, and leave nothing behind."""

from __future__ import annotations

import asyncio
import json
import time
from typing import Any

from load import table
from load.drag import HZ, hand
from load.raw import Http, request
from load.service import Service, Usage, serve
from load.visitor import Visitor

POINTS = 20_000
WARM_UP = 3  # rounds after which everything that is made once has been made
PATIENCE = 20.0  # seconds until whatever belongs to visitors who left must be gone
# Bytes. The allocator keeps and splinters some tens of megabytes at first; what leaks, leaks with each visit, and
# an arm's page alone is four times the second figure.
KEPT, MOST_PER_VISIT = 48 << 20, 64 << 10


async def soak(service: Service, rounds: int, visitors: int, seconds: float) -> tuple[Usage, Usage]:
    """What the service holds before and after so many rounds of visits, with nobody there."""
    for _ in range(WARM_UP):
        await _round(service, visitors, seconds)
    before = await _at_rest(service, None)
    for _ in range(rounds):
        await _round(service, visitors, seconds)
    return before, await _at_rest(service, before)


async def _round(service: Service, visitors: int, seconds: float) -> None:
    await asyncio.gather(*(_visit(service.port, seconds) for _ in range(visitors)), _program(service.port))


async def _visit(port: int, seconds: float) -> None:
    visitor = Visitor()
    await visitor.connect(port)
    await visitor.quiet()
    await hand(visitor, time.perf_counter(), seconds, HZ)
    visitor.set("Points", POINTS)
    visitor.set("Cloud", "Start")
    end = time.perf_counter() + PATIENCE
    while visitor.points < POINTS:
        if time.perf_counter() > end:
            raise RuntimeError(f"only {visitor.points} points of {POINTS} within {PATIENCE:g} s")
        await asyncio.sleep(0.02)
    visitor.close()


async def _program(port: int) -> None:
    """REST beside the visitors: an answer, a refusal, a cloud taken and one left in the middle."""
    connection = await Http.open(port)
    robot = "/api/v1/robots/pioneer5"
    body = json.dumps({"target": {"position": [0.045, 0.191, -0.211]}}).encode()
    asked = (
        (request("POST", f"{robot}/ik", body), 200),
        (request("POST", f"{robot}/ik", b"{}"), 422),
        (request("GET", f"{robot}/workspace?n={POINTS}&format=bin"), 200),
    )
    for what, expected in asked:
        if (status := await connection.ask(what)) != expected:
            raise RuntimeError(f"answered {status} instead of {expected}: {connection.body[:200]!r}")
    leaving = asyncio.create_task(connection.ask(request("GET", f"{robot}/workspace?n=5000000&format=bin")))
    await asyncio.sleep(0.05)
    leaving.cancel()
    connection.close()


async def _at_rest(service: Service, wanted: Usage | None) -> Usage:
    """What is held once nothing falls any more, or once it is no more than `wanted`."""
    end = time.perf_counter() + PATIENCE
    found = service.usage()
    while time.perf_counter() < end:
        await asyncio.sleep(1.0)
        now = service.usage()
        if wanted is None and (now.threads, now.files) == (found.threads, found.files):
            return now
        if wanted is not None and now.threads <= wanted.threads and now.files <= wanted.files:
            return now
        found = now
    return found


def left_behind(before: Usage, after: Usage, visits: int) -> list[str]:
    """What did not go with the visitors, in words; nothing, if all is well."""
    found = []
    if after.threads > before.threads:
        found.append(f"{after.threads - before.threads} threads")
    if after.files > before.files:
        found.append(f"{after.files - before.files} file handles")
    if after.memory - before.memory > KEPT + MOST_PER_VISIT * visits:
        found.append(f"{(after.memory - before.memory) / visits / 1e3:.0f} kB a visit")
    return found


def run(quick: bool, workers: int, only: list[int] | None = None) -> dict[str, Any]:
    """The table on stdout, and what is in it; `only`: how many rounds."""
    rounds, visitors, seconds = (only[0] if only else 4 if quick else 60), 4, 1.0
    with serve(workers) as service:
        before, after = asyncio.run(soak(service, rounds, visitors, seconds))
    visits = rounds * visitors
    rows = [
        {"": name, "threads": u.threads, "files": u.files, "memory MB": u.memory / 1e6}
        for name, u in (("before", before), ("after", after))
    ]
    left = left_behind(before, after, visits)
    print(table(f"soak: {visits} visits, {workers} worker(s)", rows))
    kilobytes = (after.memory - before.memory) / visits / 1e3
    print(f"{kilobytes:.1f} kB a visit; left behind: {', '.join(left) or 'nothing'}")
    return {"rows": rows, "visits": visits, "left behind": left}
