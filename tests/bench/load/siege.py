"""All attacks at once beside visitors who drag: attacked and quiet minutes take turns."""

from __future__ import annotations

import asyncio
import json
import multiprocessing
import re
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from app.shared.settings import Settings
from load import percentile, table
from load.attackers import attack
from load.drag import HZ, hand
from load.raw import Http, request
from load.service import Service, serve
from load.visitor import Visitor

TOKEN = "the-token-of-this-siege"
VISITORS = 10
# Seconds: an attack lasts longer than KINBOARD_SEND_TIMEOUT, so that clients that do not read meet it.
ATTACKED, SETTLING, QUIET = 110.0, 10.0, 60.0
RATIO = 3.0  # of the 95th percentile of drags, attacked to quiet
ATTACKERS = 300.0  # seconds for attackers to begin, and to end: on a busy machine they get few turns
# Bytes of program, kernels and robots of one process, and of the one that starts them, as in docs/limits.md.
PROGRAM, STARTER = 0.3e9, 0.1e9
BODIES = 0.03e9  # of the bodies of packages
_TARGET = json.dumps({"target": {"position": [0.045, 0.191, -0.211]}}).encode()
_COUNTED = re.compile(r'^kinboard_requests_total\{.*status="(\d+)"\} (\S+)$', re.MULTILINE)


@dataclass
class Phase:
    """What the well-behaved clients met in one phase.

    Attributes:
        name: attacked or quiet.
        drags: seconds until the picture answered each event.
        late: the longest time in seconds that an event was sent after it was due.
        lost, unanswered: connections of visitors that ended; events that nothing answered.
        requests, refused: of a program that asks for inverse kinematics; those without an answer with 200.
        peak: bytes of memory at most.
    """

    name: str
    drags: list[float] = field(default_factory=list)
    late: float = 0.0
    lost: int = 0
    unanswered: int = 0
    requests: list[float] = field(default_factory=list)
    refused: int = 0
    peak: int = 0

    def row(self, number: int | str) -> dict[str, Any]:
        """One line of the table."""
        return {
            "phase": f"{number} {self.name}",
            "drags": len(self.drags),
            "p50 ms": 1e3 * percentile(self.drags, 50),
            "p95 ms": 1e3 * percentile(self.drags, 95),
            "max ms": 1e3 * percentile(self.drags, 100),
            "lost": self.lost,
            "unanswered": self.unanswered,
            "client late ms": 1e3 * self.late,
            "ik p50 ms": 1e3 * percentile(self.requests, 50),
            "ik p95 ms": 1e3 * percentile(self.requests, 95),
            "ik refused": self.refused,
            "peak MB": self.peak / 1e6,
        }


def limit(settings: Settings) -> float:
    """Bytes that the service may hold, besides visitors and computations: the sum in docs/limits.md."""
    caches = settings.cloud_memory + settings.map_memory + settings.mesh_memory + BODIES
    requests = settings.answer_memory + settings.upload_memory
    return (1 + settings.processes) * PROGRAM + caches + requests + STARTER


class Siege:
    """A service, its visitors, and what was measured.

    Args:
        niceness: of the attackers. The lowest priority leaves the processors to the service, as attackers on other
            machines would; on a machine that others use it gives them hardly any turns.
    """

    def __init__(self, service: Service, niceness: int = 19) -> None:
        self.service = service
        self._niceness = niceness
        self.phases: list[Phase] = []
        self.attacks: list[dict[str, Any]] = []
        self._visitors: list[Visitor] = []

    async def run(self, rounds: int, attacked: float, settling: float, quiet: float) -> None:
        """Quiet at first, then so many rounds of an attack and a quiet time."""
        await self.connect()
        await self.phase("quiet", quiet)
        for _ in range(rounds):
            async with self.attack(attacked) as found:
                await self.phase("attacked", attacked)
            self._add_attacks(found)
            await asyncio.sleep(settling)
            await self.phase("quiet", quiet)
        self.close()

    async def connect(self) -> None:
        """The visitors come, one after the other."""
        self._visitors = [Visitor(TOKEN) for _ in range(VISITORS)]
        for visitor in self._visitors:
            await visitor.connect(self.service.port)
        for visitor in self._visitors:
            await visitor.quiet()

    def close(self) -> None:
        """The visitors leave."""
        for visitor in self._visitors:
            visitor.close()

    @asynccontextmanager
    async def attack(self, seconds: float, names: list[str] | None = None) -> AsyncIterator[list[dict[str, Any]]]:
        """All attacks, or those of these names, for so long; what came of them is there after the context."""
        here, there = multiprocessing.Pipe(duplex=False)
        context = multiprocessing.get_context("spawn")
        process = context.Process(
            target=attack, args=(self.service.port, TOKEN, seconds, there, names, self._niceness), daemon=True
        )
        process.start()
        found: list[dict[str, Any]] = []
        try:
            await _message(here, process)  # they have begun
            yield found
            found += (await _message(here, process))[1]
        finally:
            process.kill()
            process.join()

    def _add_attacks(self, found: list[dict[str, Any]]) -> None:
        if not self.attacks:
            self.attacks = found
            return
        for row, more in zip(self.attacks, found, strict=True):
            row.update({name: row[name] + value for name, value in more.items() if name != "attack"})

    async def phase(self, name: str, seconds: float) -> Phase:
        """All visitors drag for so long: what the well-behaved clients met."""
        phase = Phase(name)
        self.phases.append(phase)
        others = [asyncio.create_task(self._watch(phase)), asyncio.create_task(self._ask(phase))]
        begin = time.perf_counter() + 0.1
        await asyncio.gather(*(self._drag(phase, k, begin, seconds) for k in range(VISITORS)))
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)
        print(table("", [phase.row(len(self.phases))]), flush=True)
        return phase

    async def _drag(self, phase: Phase, k: int, begin: float, seconds: float) -> None:
        visitor = self._visitors[k]
        visitor.latencies = phase.drags
        late = await hand(visitor, begin + k / (VISITORS * HZ), seconds, HZ)
        phase.late = max(phase.late, late)
        phase.unanswered += visitor.unanswered
        if visitor.lost or visitor.unanswered:
            phase.lost += visitor.lost
            visitor.close()
            self._visitors[k] = Visitor(TOKEN)
            await self._visitors[k].connect(self.service.port)
            await self._visitors[k].quiet()

    async def _watch(self, phase: Phase) -> None:
        while True:
            phase.peak = max(phase.peak, self.service.resident())
            await asyncio.sleep(0.25)

    async def _ask(self, phase: Phase) -> None:
        """A program with the token: one request after the other, two a second."""
        while True:
            connection = await Http.open(self.service.port)
            try:
                while True:
                    began = time.perf_counter()
                    status = await connection.ask(request("POST", "/api/v1/robots/pioneer5/ik", _TARGET, TOKEN))
                    phase.requests.append(time.perf_counter() - began)
                    phase.refused += status != 200
                    await asyncio.sleep(0.5)
            except ConnectionError:
                phase.refused += 1
                await asyncio.sleep(0.5)
            finally:
                connection.close()


async def _message(line: Connection, process: BaseProcess) -> Any:
    """What the attackers say next; while it is waited for, visitors read what they are sent."""
    end = time.monotonic() + ATTACKERS
    while not line.poll():
        if time.monotonic() > end or not (process.is_alive() or line.poll()):
            raise RuntimeError(f"the attackers ended, or did not report within {ATTACKERS:g} s")
        await asyncio.sleep(0.1)
    return line.recv()


async def answers(service: Service) -> dict[str, int]:
    """How many answers of each status the service has counted."""
    connection = await Http.open(service.port)
    await connection.ask(request("GET", "/metrics", token=TOKEN))
    connection.close()
    found: dict[str, int] = {}
    for status, count in _COUNTED.findall(connection.body.decode()):
        found[status] = found.get(status, 0) + round(float(count))
    return dict(sorted(found.items()))


def run(quick: bool, only: list[int] | None = None) -> dict[str, Any]:
    """The tables on stdout, and what is in them; `only`: how many minutes."""
    minutes = only[0] if only else 3 if quick else 30
    length = ATTACKED + SETTLING + QUIET
    rounds = max(1, round((60.0 * minutes - QUIET) / length))
    with serve(token=TOKEN, read_only="1") as service:
        siege = Siege(service)
        before = service.resident()
        asyncio.run(siege.run(rounds, ATTACKED, SETTLING, QUIET))
        statuses = asyncio.run(answers(service))
        time.sleep(20.0)  # memory is given back when the service is idle
        return report(siege, statuses, before, service.resident())


def report(siege: Siege, statuses: dict[str, int], before: int, after: int) -> dict[str, Any]:
    """The tables on stdout, and what is in them.

    Args:
        statuses: how many answers of each the service has counted.
        before, after: bytes of its memory, with nobody there.
    """
    for row in siege.attacks:
        row["statuses read"] = (
            ", ".join(f"{n} × {code}" for code, n in sorted(row["statuses read"].items())) or "–"
        )
    print("\n" + table("attacks", siege.attacks))
    sums = {name: Phase(name) for name in ("quiet", "attacked")}
    for phase in siege.phases:
        whole = sums[phase.name]
        whole.drags += phase.drags
        whole.requests += phase.requests
        whole.lost, whole.unanswered = whole.lost + phase.lost, whole.unanswered + phase.unanswered
        whole.refused += phase.refused
        whole.late, whole.peak = max(whole.late, phase.late), max(whole.peak, phase.peak)
    rows = [phase.row("all") for phase in sums.values()]
    print("\n" + table(f"siege: {VISITORS} visitors", rows))
    ratio = rows[1]["p95 ms"] / rows[0]["p95 ms"]
    most = max(whole.peak for whole in sums.values())
    bound = limit(Settings())
    failures = sum(count for status, count in statuses.items() if status.startswith("5") and status != "503")
    print(f"p95 attacked / quiet {ratio:.2f}; answers: {', '.join(f'{n} × {s}' for s, n in statuses.items())}")
    sizes = [f"{size / 1e6:.0f} MB" for size in (before, most, after, bound)]
    print("memory: {} before, at most {}, {} after; sum of the limits {}".format(*sizes))
    idle = [row["attack"] for row in siege.attacks if not (row["rounds"] or row["MB sent"])]
    failed = {
        f"the machine was too busy for these attackers: {', '.join(idle)}": idle,
        f"p95 × {ratio:.1f}": ratio > RATIO,
        f"{sum(w.lost for w in sums.values())} visitors lost": any(w.lost for w in sums.values()),
        f"{failures} answers 5xx": failures,
        f"{(most - bound) / 1e6:.0f} MB more than the limits": most > bound,
    }
    wrong = [name for name, is_wrong in failed.items() if is_wrong]
    print(f"not as it should be: {', '.join(wrong) or 'nothing'}")
    return {
        "phases": [phase.row(k + 1) for k, phase in enumerate(siege.phases)],
        "all": rows,
        "attacks": siege.attacks,
        "answers": statuses,
        "memory": {"before": before, "most": most, "after": after, "limits": bound},
        "left behind": wrong,
    }
