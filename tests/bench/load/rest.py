"""Requests a second, beside an endpoint that does nothing."""

from __future__ import annotations

import asyncio
import json
import statistics
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import kin
from load import percentile, table
from load.raw import Http, request
from load.service import Service, serve

EMPTY = "empty (GET /livez)"


@dataclass(slots=True)
class _Case:
    name: str
    request: bytes
    rates: list[float] = field(default_factory=list)  # requests a second, one entry per round
    latencies: list[float] = field(default_factory=list)
    spent: float = 0.0  # processor time of the service

    async def turn(self, service: Service, connections: list[Http], seconds: float) -> None:
        """All connections ask, each as soon as it has its answer."""
        before, began = service.seconds(), time.perf_counter()
        end = began + seconds
        counts = await asyncio.gather(*(self._ask(each, end) for each in connections))
        self.rates.append(sum(counts) / (time.perf_counter() - began))
        self.spent += service.seconds() - before

    async def _ask(self, connection: Http, end: float) -> int:
        count = 0
        while (began := time.perf_counter()) < end:
            status = await connection.ask(self.request)
            self.latencies.append(time.perf_counter() - began)
            if status != 200:
                raise RuntimeError(f"{self.name}: answered {status}: {connection.body[:300]!r}")
            count += 1
        return count


def cases() -> list[_Case]:
    """What is asked: the default arm, anywhere inside its limits."""
    robot = kin.get_robot("pioneer5")
    q = robot.random_q(np.random.default_rng(1), 1000)
    T = kin.fk(robot, q)
    targets = [{"position": t[:3, 3].tolist(), "approach": t[:3, 2].tolist()} for t in T]
    post = f"/api/v1/robots/{robot.id}/"

    def body(**fields: Any) -> bytes:
        return json.dumps(fields).encode()

    return [
        _Case(EMPTY, request("GET", "/livez")),
        _Case("fk", request("POST", post + "fk", body(q=q[0].tolist()))),
        _Case("fk of 1000", request("POST", post + "fk", body(q=q.tolist()))),
        _Case("ik", request("POST", post + "ik", body(target=targets[0]))),
        _Case("ik of 1000", request("POST", post + "ik", body(target=targets, max_solutions=1))),
        _Case("ik of 1000, q and status", request("POST", post + "ik?fields=q,status", body(target=targets))),
    ]


async def measure(
    service: Service, rounds: int, seconds: float, connections: int, names: list[str] | None = None
) -> list[dict[str, Any]]:
    """Every case in turns, round after round, so that what else the machine does befalls all alike."""
    asked = [case for case in cases() if not names or case.name in (*names, EMPTY)]
    clients = [await Http.open(service.port) for _ in range(connections)]
    try:
        for case in asked:
            await case.turn(service, clients, 0.2)
            case.rates.clear(), case.latencies.clear()
            case.spent = 0.0
        for _ in range(rounds):
            for case in asked:
                await case.turn(service, clients, seconds)
    finally:
        for client in clients:
            client.close()
    empty = asked[0]
    return [
        {
            "request": case.name,
            "per second": statistics.median(case.rates),
            "p50 ms": 1e3 * percentile(case.latencies, 50),
            "p99 ms": 1e3 * percentile(case.latencies, 99),
            "% of empty": 100 * statistics.median(a / b for a, b in zip(case.rates, empty.rates, strict=True)),
            "service CPU µs": 1e6 * case.spent / len(case.latencies),
        }
        for case in asked
    ]


def run(quick: bool, names: list[str] | None = None) -> dict[str, Any]:
    """The table on stdout, and what is in it."""
    rounds, seconds, connections = (3, 0.4, 4) if quick else (15, 1.0, 4)
    with serve() as service:
        rows = asyncio.run(measure(service, rounds, seconds, connections, names))
    print(table(f"rest: {connections} connections, {rounds} rounds of {seconds:g} s", rows))
    return {"rows": rows, "rounds": rounds, "seconds": seconds, "connections": connections}
