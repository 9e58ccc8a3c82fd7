"""Hours of visitors in minutes: they come, drag, draw a cloud, ask, and go, and leave nothing behind.

With ``--minutes`` the other way round: a few visitors stay for that long and drag now and then, while a program
sends one request a second. What the service holds at the end is compared with what it held after ten minutes.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import time
from typing import Any

from load import latencies, table
from load.drag import HZ, connected, hand
from load.raw import Http, request
from load.rest import cases
from load.service import Service, Usage, serve
from load.visitor import Visitor

POINTS = 20_000
WARM_UP = 3  # rounds after which everything that is made once has been made
PATIENCE = 20.0  # seconds until whatever belongs to visitors who left must be gone
# Bytes. The allocator keeps and splinters some tens of megabytes at first; what leaks, leaks with each visit, and
# an arm's page alone is four times the second figure.
KEPT, MOST_PER_VISIT = 48 << 20, 64 << 10
# The steady load: visitors who stay, seconds between two of their drags, minutes until everything is in use.
STAYING, PAUSE, SETTLED = 3, 15.0, 10


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


async def steady(
    service: Service, minutes: int, minute: float = 60.0
) -> tuple[list[dict[str, Any]], Usage, Usage]:
    """What the service holds, minute by minute, under a small load that never ends.

    Args:
        minute: its length in seconds.

    Returns:
        A row for each minute, and what is held after `SETTLED` minutes (or half-way) and at the end.
    """
    visitors = await connected(service, STAYING)
    answered: list[int] = []  # requests with the expected status, as they come
    load = [asyncio.create_task(_drag_now_and_then(v, k)) for k, v in enumerate(visitors)]
    load.append(asyncio.create_task(_ask_each_second(service.port, answered)))
    usages, rows = [service.usage()], []
    begin = time.perf_counter()
    for k in range(1, minutes + 1):
        await asyncio.wait(
            load, timeout=begin + minute * k - time.perf_counter(), return_when=asyncio.FIRST_COMPLETED
        )
        for task in load:
            if task.done():
                task.result()
        now = service.usage()
        waited = [x for visitor in visitors for x in visitor.latencies]
        rows.append(
            {
                "minute": k,
                "requests": len(answered),
                "drags": len(waited),
                **latencies(waited),
                "unanswered": sum(v.unanswered for v in visitors),
                "lost": sum(v.lost for v in visitors),
                "threads": now.threads,
                "files": now.files,
                "memory MB": now.memory / 1e6,
                "CPU s": now.seconds - usages[-1].seconds,
            }
        )
        print(table("", rows[-1:]), flush=True)
        usages.append(now)
        answered.clear()
        for visitor in visitors:
            visitor.latencies.clear()
    for task in load:
        task.cancel()
    await asyncio.gather(*load, return_exceptions=True)
    for visitor in visitors:
        visitor.close()
    return rows, usages[SETTLED if minutes > SETTLED else minutes // 2], usages[-1]


async def _drag_now_and_then(visitor: Visitor, number: int) -> None:
    await asyncio.sleep(number * PAUSE / STAYING)
    while True:
        await hand(visitor, time.perf_counter(), 2.0, HZ)
        await asyncio.sleep(PAUSE)


async def _ask_each_second(port: int, answered: list[int]) -> None:
    """The requests of the table "rest" in turn, a cloud, a refusal, an unknown address; a connection each."""
    robot = "/api/v1/robots/pioneer5"
    asked = [(case.request, 200) for case in cases()] + [
        (request("GET", f"{robot}/workspace?n={POINTS}&format=bin"), 200),
        (request("POST", f"{robot}/ik", b"{}"), 422),
        (request("GET", "/api/v1/robots/nobody"), 404),
    ]
    due = time.perf_counter()
    for k in itertools.count():
        what, expected = asked[k % len(asked)]
        connection = await Http.open(port)
        status = await connection.ask(what)
        connection.close()
        if status != expected:
            raise RuntimeError(f"answered {status} instead of {expected}: {connection.body[:200]!r}")
        answered.append(status)
        due += 1.0
        await asyncio.sleep(max(0.0, due - time.perf_counter()))


def left_behind(before: Usage, after: Usage, visits: int) -> list[str]:
    """What did not go with the visitors, in words; nothing, if all is well."""
    found = []
    if after.threads > before.threads:
        found.append(f"{after.threads - before.threads} threads")
    if after.files > before.files:
        found.append(f"{after.files - before.files} file handles")
    if after.memory - before.memory > KEPT + MOST_PER_VISIT * visits:
        grown = after.memory - before.memory
        found.append(f"{grown / visits / 1e3:.0f} kB a visit" if visits else f"{grown / 1e6:.0f} MB")
    return found


def run(quick: bool, only: list[int] | None = None, minutes: int | None = None) -> dict[str, Any]:
    """The table on stdout, and what is in it; `only`: how many rounds; `minutes`: of a steady load instead."""
    if minutes is not None:
        return _run_steady(minutes)
    rounds, visitors, seconds = (only[0] if only else 4 if quick else 60), 4, 1.0
    with serve() as service:
        before, after = asyncio.run(soak(service, rounds, visitors, seconds))
    visits = rounds * visitors
    rows = [
        {"": name, "threads": u.threads, "files": u.files, "memory MB": u.memory / 1e6}
        for name, u in (("before", before), ("after", after))
    ]
    left = left_behind(before, after, visits)
    print(table(f"soak: {visits} visits", rows))
    kilobytes = (after.memory - before.memory) / visits / 1e3
    print(f"{kilobytes:.1f} kB a visit; left behind: {', '.join(left) or 'nothing'}")
    return {"rows": rows, "visits": visits, "left behind": left}


def _run_steady(minutes: int) -> dict[str, Any]:
    with serve() as service:
        rows, before, after = asyncio.run(steady(service, minutes))
    left = left_behind(before, after, 0)
    left += [f"{row['lost']} visitors lost in minute {row['minute']}" for row in rows if row["lost"]]
    left += [
        f"{row['unanswered']} drags unanswered in minute {row['minute']}" for row in rows if row["unanswered"] > HZ
    ]
    print("\n" + table(f"soak: {minutes} minutes of steady load", rows))
    for name, usage in (("early", before), ("end", after)):
        print(f"{name}: {usage.memory / 1e6:.0f} MB, {usage.files} files, {usage.threads} threads")
    print(f"left behind: {', '.join(left) or 'nothing'}")
    return {"rows": rows, "minutes": minutes, "left behind": left}
