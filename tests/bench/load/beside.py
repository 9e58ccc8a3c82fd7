"""Visitors who drag beside programs: four clients with batches of 1000 inverse kinematics, one with new equations.

The programs run in a process of their own, so that what they read does not delay the measured hands.
"""

from __future__ import annotations

import asyncio
import json
import random
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from load import percentile, table
from load.drag import measure
from load.raw import Http, request
from load.rest import cases
from load.service import Service, serve

BATCHES = 4
BEFORE = 2.0  # s that the programs ask before visitors come
PATIENCE = 60.0  # s for an answer
Asked = list[tuple[str, int, float]]  # name, status and seconds of each request


def _arm() -> dict[str, Any]:
    """A table of six rows that nobody has asked for before."""

    def near(most: float) -> float:
        return round(random.uniform(50, most), 3)

    rows: list[dict[str, Any]] = [
        {"name": "a", "d": near(500), "a": near(200), "alpha": -90},
        {"name": "b", "a": near(500)},
        {"name": "c", "a": near(100), "alpha": -90},
        {"name": "d", "d": near(500), "alpha": 90},
        {"name": "e", "a": near(100), "alpha": -90},
        {"name": "f", "d": near(200)},
    ]
    return {"convention": "standard", "units": {"length": "mm", "angle": "deg"}, "rows": rows}


async def _client(port: int, ask: Callable[[], bytes], end: float, name: str, found: Asked) -> None:
    client = await Http.open(port)
    while (began := time.perf_counter()) < end:
        try:
            status = await asyncio.wait_for(client.ask(ask()), PATIENCE)
        except (ConnectionError, TimeoutError):
            status = 0
            client.close()
            client = await Http.open(port)
        found.append((name, status, time.perf_counter() - began))
        if status != 200:
            await asyncio.sleep(0.2)
    client.close()


async def load(port: int, seconds: float) -> Asked:
    """What the programs met."""
    batch = next(case.request for case in cases() if case.name == "ik of 1000")
    found: Asked = []
    end = time.perf_counter() + seconds

    def equations() -> bytes:
        return request("POST", "/api/v1/equations/formulas", json.dumps({"robot": _arm()}).encode())

    asking = [_client(port, lambda: batch, end, "ik of 1000", found) for _ in range(BATCHES)]
    await asyncio.gather(*asking, _client(port, equations, end, "equations", found))
    return found


def _programs(service: Service, seconds: float) -> subprocess.Popen[str]:
    root = Path(__file__).parents[3]
    code = (
        "import sys, asyncio, json; sys.path[:0] = sys.argv[3:]; from load.beside import load; "
        "print(json.dumps(asyncio.run(load(int(sys.argv[1]), float(sys.argv[2])))))"
    )
    paths = [str(path) for path in (root, root / "tests", root / "tests" / "bench")]
    command = [sys.executable, "-c", code, str(service.port), str(seconds), *paths]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


async def _measured(service: Service, count: int, seconds: float) -> dict[str, Any]:
    with _programs(service, seconds + 10.0 + BEFORE + 0.12 * count) as programs:
        await asyncio.sleep(BEFORE)
        row = await measure(service, count, seconds)
        said, _ = await asyncio.to_thread(programs.communicate)
    asked: Asked = json.loads(said)
    batches = [took for name, status, took in asked if name == "ik of 1000" and status == 200]
    books = [took for name, status, took in asked if name == "equations" and status == 200]
    return row | {
        "batches": len(batches),
        "batch p50 ms": 1e3 * percentile(batches, 50),
        "batch p95 ms": 1e3 * percentile(batches, 95),
        "equations": len(books),
        "equations p50 ms": 1e3 * percentile(books, 50),
        "refused": sum(status != 200 for _, status, _ in asked),
    }


def run(quick: bool, counts: list[int] | None = None) -> dict[str, Any]:
    """The table on stdout, and what is in it."""
    seconds = 5.0 if quick else 15.0
    rows = []
    for count in counts or [10, 30]:
        with serve() as service:
            asyncio.run(measure(service, 1, 1.0))  # nobody's first drag
            asyncio.run(load(service.port, 4.0))  # nor first request
            rows.append(asyncio.run(_measured(service, count, seconds)))
    print(table(f"beside programs: 20 events/s each for {seconds:g} s", rows))
    return {"rows": rows, "seconds": seconds}
