"""Everybody comes at once."""

from __future__ import annotations

import asyncio
import time
from typing import Any

from load import percentile, table
from load.raw import Http, request
from load.service import Service, serve
from load.visitor import Visitor


async def measure(service: Service, count: int) -> dict[str, Any]:
    """So many tabs opened in the same moment, while somebody asks whether the process is alive."""
    before = service.usage()
    visitors = [Visitor() for _ in range(count)]
    began = time.perf_counter()
    probe = asyncio.create_task(_probe(service.port))
    came = await asyncio.gather(*(visitor.connect(service.port) for visitor in visitors), return_exceptions=True)
    there = [visitor for visitor, error in zip(visitors, came, strict=True) if error is None]
    for visitor in there:
        await visitor.quiet()
    probe.cancel()
    probes = await probe
    after = service.usage()
    for visitor in there:
        visitor.close()
    arms = [visitor.complete - visitor.began for visitor in there]
    return {
        "visitors": count,
        "failed": count - len(there),
        "why": "; ".join(sorted({repr(error) for error in came if error is not None})),
        "arm p50 s": percentile(arms, 50),
        "arm p99 s": percentile(arms, 99),
        "all pages s": max((visitor.last for visitor in there), default=began) - began,
        "alive p50 ms": 1e3 * percentile(probes, 50),
        "alive max ms": 1e3 * percentile(probes, 100),
        "service CPU s": after.seconds - before.seconds,
        "kB a page": sum(visitor.bytes for visitor in there) / max(1, len(there)) / 1e3,
        "MB a visitor": (after.memory - before.memory) / max(1, len(there)) / 1e6,
    }


async def _probe(port: int) -> list[float]:
    """Times of /livez, asked over and over until cancelled."""
    found: list[float] = []
    connection = await Http.open(port)
    try:
        while True:
            began = time.perf_counter()
            await connection.ask(request("GET", "/livez"))
            found.append(time.perf_counter() - began)
            await asyncio.sleep(0.02)
    except asyncio.CancelledError:
        return found
    finally:
        connection.close()


def run(quick: bool, counts: list[int] | None = None) -> dict[str, Any]:
    """The table on stdout, and what is in it."""
    rows = []
    for count in counts or ([20] if quick else [50, 200]):
        with serve(client_share="1") as service:  # all come from one address
            rows.append(asyncio.run(measure(service, count)))
    print(table("storm: everybody at once", rows))
    return {"rows": rows}
