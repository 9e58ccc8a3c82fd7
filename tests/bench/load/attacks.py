"""Each attack alone beside visitors who drag, in turn with quiet seconds: which of them is felt, and why."""

from __future__ import annotations

import asyncio
import time
from typing import Any

from load import percentile, table
from load.attackers import ATTACKS
from load.raw import Http, request
from load.service import Service, serve
from load.siege import TOKEN, Siege

QUIET, ATTACKED, BEGINNING = 4.0, 12.0, 2.0  # seconds; an attack begins before it is measured
EVERY = 0.05  # seconds between two looks at the event loop


async def _look(service: Service, found: list[float]) -> None:
    """How long the event loop takes to answer what needs no thread."""
    connection = await Http.open(service.port)
    try:
        while True:
            began = time.perf_counter()
            await connection.ask(request("GET", "/favicon.ico"))
            found.append(time.perf_counter() - began)
            await asyncio.sleep(EVERY)
    finally:
        connection.close()


async def _phase(siege: Siege, name: str, seconds: float) -> dict[str, float]:
    """What visitors met, how late the event loop was, and what share of a processor the service used."""
    late: list[float] = []
    looking = asyncio.create_task(_look(siege.service, late))
    before, began = (siege.service.loop_seconds(), siege.service.seconds()), time.perf_counter()
    phase = await siege.phase(name, seconds)
    wall = time.perf_counter() - began
    after = siege.service.loop_seconds(), siege.service.seconds()
    looking.cancel()
    await asyncio.gather(looking, return_exceptions=True)
    return {
        "p50 ms": 1e3 * percentile(phase.drags, 50),
        "p95 ms": 1e3 * percentile(phase.drags, 95),
        "max ms": 1e3 * percentile(phase.drags, 100),
        "ik p95 ms": 1e3 * percentile(phase.requests, 95),
        "loop p95 ms": 1e3 * percentile(late, 95),
        "loop CPU %": 100 * (after[0] - before[0]) / wall,
        "CPU %": 100 * (after[1] - before[1]) / wall,
    }


async def measure(siege: Siege, groups: list[list[str]], attacked: float, quiet: float) -> list[dict[str, Any]]:
    """Each group of attacks at once, one group after the other."""
    await siege.connect()
    rows = []
    for names in groups:
        before = await _phase(siege, "quiet", quiet)
        async with siege.attack(attacked + BEGINNING, names):
            await asyncio.sleep(BEGINNING)
            during = await _phase(siege, "attacked", attacked)
        rows.append({"attack": ", ".join(names), "quiet p95 ms": before["p95 ms"], **during})
        await asyncio.sleep(BEGINNING)
    siege.close()
    return rows


def run(quick: bool, only: list[str] | None = None) -> dict[str, Any]:
    """The table on stdout, and what is in it; `only`: names of attacks, or parts of them."""
    names = [attack.name for attack in ATTACKS]
    chosen = [name for name in names if only is None or any(part in name for part in only)]
    if not chosen:
        raise SystemExit(f"no attack is called {only}; there are: {', '.join(names)}")
    seconds = ATTACKED / 3 if quick else ATTACKED
    with serve(token=TOKEN, read_only="1") as service:
        rows = asyncio.run(measure(Siege(service), [[name] for name in chosen], seconds, QUIET))
    print("\n" + table(f"attacks: {seconds:g} s each", rows))
    return {"rows": rows, "seconds": seconds}
