"""Visitors who play a program, each their own: how evenly the pictures come, and what it costs beside dragging."""

from __future__ import annotations

import asyncio
import sys
import time
from typing import Any

from load import percentile, table
from load.drag import connected
from load.drag import measure as measure_drag
from load.service import Service, serve
from load.visitor import Visitor

JOINT = "1 rotating base"
POSES = (20.0, 160.0)  # degrees of the joint at the two waypoints
_PAUSE = 0.3  # s between what is pressed
_UP = 2.0  # s until the program is played


async def press(visitor: Visitor, number: int, name: str, value: object = None) -> None:
    """Press a button of the tab Program, and give it a moment."""
    visitor.say("feature", ["program", [name, number], value])
    await asyncio.sleep(_PAUSE)


async def start(visitor: Visitor) -> None:
    """Record two poses and play them in a loop."""
    for number, angle in enumerate(POSES, 1):
        visitor.set(JOINT, angle)
        await asyncio.sleep(4 * _PAUSE)
        await press(visitor, number, "record")
    await press(visitor, 3, "loop", True)
    await press(visitor, 4, "play")


async def measure(service: Service, count: int, seconds: float) -> dict[str, Any]:
    """So many visitors at a time."""
    empty = service.usage()
    visitors = await connected(service, count)
    await asyncio.gather(*(start(visitor) for visitor in visitors))
    await asyncio.sleep(_UP)
    full = service.usage()
    before = [visitor.pictures for visitor in visitors]
    began, spent = time.perf_counter(), time.process_time()
    for visitor in visitors:
        visitor.times.clear()
    await asyncio.sleep(seconds)
    wall, own = time.perf_counter() - began, time.process_time() - spent
    used = service.seconds() - full.seconds
    gaps = [b - a for visitor in visitors for a, b in zip(visitor.times, list(visitor.times)[1:], strict=False)]
    shown = sum(visitor.pictures for visitor in visitors) - sum(before)
    for visitor in visitors:
        visitor.close()
    return {
        "visitors": count,
        "pictures/s each": shown / wall / count,
        "gap p50 ms": 1e3 * percentile(gaps, 50),
        "gap p95 ms": 1e3 * percentile(gaps, 95),
        "service CPU %": 100 * used / wall,
        "CPU ms a picture": 1e3 * used / max(shown, 1),
        "client CPU %": 100 * own / wall,
        "MB a visitor": (full.memory - empty.memory) / count / 1e6,
    }


def _say(text: str) -> None:
    """What is being done, on stderr: the tables come at the end."""
    print(time.strftime("%H:%M:%S"), text, file=sys.stderr, flush=True)


def run(quick: bool, counts: list[int] | None = None) -> dict[str, Any]:
    """The table on stdout with that of as many dragging visitors, and what is in them."""
    counts = counts or ([1, 10] if quick else [1, 10, 30])
    seconds = 3.0 if quick else 15.0
    played, dragged = [], []
    for count in counts:
        for rows, drags in ((played, False), (dragged, True)):
            _say(f"{count} visitors who {'drag' if drags else 'play'}: the service starts")
            with serve() as service:
                _say("measuring")
                asyncio.run(measure_drag(service, 1, 1.0))  # nobody's first drag
                if drags:
                    rows.append(asyncio.run(measure_drag(service, count, seconds)))
                else:
                    rows.append(asyncio.run(measure(service, count, seconds)))
    print(table(f"play: programs in a loop for {seconds:g} s", played))
    print(table(f"drag: as many visitors for {seconds:g} s", dragged))
    return {"rows": played, "drag": dragged, "seconds": seconds}
