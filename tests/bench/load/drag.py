"""Visitors who drag, each their own arm: how long until the picture answers."""

from __future__ import annotations

import asyncio
import time
from typing import Any

from load import latencies, table
from load.service import Service, serve
from load.visitor import Visitor

HZ = 20.0  # what a browser sends
_PATIENCE = 5.0  # seconds for the last answers


async def connected(service: Service, count: int, kind: type[Visitor] = Visitor) -> list[Visitor]:
    """Visitors with whole pages, who came one after the other."""
    visitors = [kind() for _ in range(count)]
    for visitor in visitors:
        await visitor.connect(service.port)
    for visitor in visitors:
        await visitor.quiet()
    return visitors


async def hand(visitor: Visitor, begin: float, seconds: float, hz: float) -> float:
    """Drag for so long; the largest delay in seconds between when an event was due and when it was sent."""
    late = 0.0
    visitor.grab()
    for k in range(round(seconds * hz)):
        due = begin + k / hz
        await asyncio.sleep(max(0.0, due - time.perf_counter()))
        late = max(late, time.perf_counter() - due)
        visitor.drag()
    end = time.perf_counter() + _PATIENCE
    while visitor.unanswered and time.perf_counter() < end:
        await asyncio.sleep(0.02)
    visitor.release()
    return late


async def measure(
    service: Service, count: int, seconds: float, hz: float = HZ, kind: type[Visitor] = Visitor
) -> dict[str, Any]:
    """So many at a time, evenly out of step."""
    empty = service.usage()
    visitors = await connected(service, count, kind)
    full = service.usage()
    began, spent = time.perf_counter(), time.process_time()
    start = began + 0.1
    hands = await asyncio.gather(
        *(hand(visitor, start + k / (count * hz), seconds, hz) for k, visitor in enumerate(visitors))
    )
    wall, own = time.perf_counter() - began, time.process_time() - spent
    service_spent = service.seconds() - full.seconds
    for visitor in visitors:
        visitor.close()
    waited = [x for visitor in visitors for x in visitor.latencies]
    return {
        "visitors": count,
        "events": len(waited),
        **latencies(waited),
        "unanswered": sum(visitor.unanswered for visitor in visitors),
        "pictures/s each": sum(visitor.pictures for visitor in visitors) / wall / count,
        "service CPU %": 100 * service_spent / wall,
        "CPU µs an event": 1e6 * service_spent / max(1, len(waited)),
        "client CPU %": 100 * own / wall,
        "client late ms": 1e3 * max(hands),
        "MB a visitor": (full.memory - empty.memory) / count / 1e6,
        "threads a visitor": (full.threads - empty.threads) / count,
    }


def run(quick: bool, counts: list[int] | None = None) -> dict[str, Any]:
    """The table on stdout, and what is in it."""
    counts = counts or ([1, 10] if quick else [1, 10, 30, 100])
    seconds = 3.0 if quick else 15.0
    rows = []
    for count in counts:
        # A service for each, so that memory begins where it began for the others.
        with serve() as service:
            asyncio.run(measure(service, 1, 1.0))  # nobody's first drag
            rows.append(asyncio.run(measure(service, count, seconds)))
    print(table(f"drag: {HZ:g} events/s each for {seconds:g} s", rows))
    return {"rows": rows, "seconds": seconds, "hz": HZ}
