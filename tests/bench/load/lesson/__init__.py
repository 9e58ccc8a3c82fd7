"""A class: until the students' pictures show a teacher's drag, a wall of their arms, and joining."""

from __future__ import annotations

import asyncio
import math
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from postgres_server import running as running_postgres

from app.classroom import COOKIE, Hub
from load import latencies, percentile, table
from load.drag import HZ
from load.lesson.joining import join
from load.play import JOINT
from load.service import Service, serve
from load.visitor import Visitor

JOINING = 5.0  # s in which all come
WALL_HZ = 5.0
UP = 2.0  # s until a page has taken what was pressed
PATIENCE = 3.0  # s for the last pictures


@contextmanager
def served(url: str | None = None) -> Iterator[tuple[Service, Hub]]:
    """A service with an empty database of rooms, SQLite or the one of this URL, and our own door to it."""
    with tempfile.TemporaryDirectory(prefix="kinboard-lesson-") as data:
        settings = {"data": data} if url is None else {"data": data, "database_url": url}
        with serve(**settings) as service:
            hub = Hub(Path(data), url)
            try:
                yield service, hub
            finally:
                hub.close()


async def members(service: Service, hub: Hub, count: int) -> list[Visitor]:
    """A teacher, who is the first, and so many students of a new room, with whole pages."""
    room = hub.rooms.open("Load", 3600.0)
    seats = [hub.rooms.tokens.sign(hub.rooms.join(room.code, f"Student {i + 1}")) for i in range(count)]
    visitors = [Visitor(cookie=f"{COOKIE}={token}") for token in (room.token, *seats)]
    for visitor in visitors:
        await visitor.connect(service.port)
    for visitor in visitors:
        await visitor.quiet(timeout=10.0)
    return visitors


async def press(visitor: Visitor, number: int, name: str) -> None:
    """Press a button of the tab Class."""
    visitor.say("feature", ["class", [name, number], None])
    await asyncio.sleep(UP)


async def follow(service: Service, hub: Hub, count: int, seconds: float) -> dict[str, Any]:
    """A teacher drags for so long, and so many students watch."""
    teacher, *students = await members(service, hub, count)
    await press(teacher, 1, "follow")
    before, shown = service.seconds(), sum(student.pictures for student in students)
    began, spent, drags = time.perf_counter(), time.process_time(), 0
    teacher.grab()
    for k in range(round(seconds * HZ)):
        await asyncio.sleep(max(0.0, began + k / HZ - time.perf_counter()))
        if teacher.drag():
            drags += 1
            for student in students:
                student.watch(teacher)
    wall, own = time.perf_counter() - began, time.process_time() - spent
    used, shown = service.seconds() - before, sum(student.pictures for student in students) - shown
    end = time.perf_counter() + PATIENCE
    while any(student.unanswered for student in students) and time.perf_counter() < end:
        await asyncio.sleep(0.02)
    teacher.release()
    for visitor in (teacher, *students):
        visitor.close()
    waited = [x for student in students for x in student.latencies]
    return {
        "students": count,
        "drags": drags,
        "pictures": len(waited),
        **latencies(waited),
        "teacher's p95 ms": 1e3 * percentile(teacher.latencies, 95),
        "unanswered": sum(student.unanswered for student in students),
        "service CPU %": 100 * used / wall,
        "CPU ms a picture": 1e3 * used / max(shown, 1),
        "client CPU %": 100 * own / wall,
    }


async def _move(visitors: list[Visitor], seconds: float) -> None:
    """Each moves a joint at `WALL_HZ`, evenly out of step."""

    async def one(k: int, visitor: Visitor, begin: float) -> None:
        for i in range(round(seconds * WALL_HZ)):
            due = begin + (i + k / len(visitors)) / WALL_HZ
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
            visitor.set(JOINT, 90.0 + 40.0 * math.sin(0.3 * i + k))

    begin = time.perf_counter()
    await asyncio.gather(*(one(k, visitor, begin) for k, visitor in enumerate(visitors)))


async def wall(service: Service, hub: Hub, count: int, seconds: float) -> list[dict[str, Any]]:
    """What so many students cost who move at 5 Hz: outside of a room, in one, and on the teacher's wall."""
    rows = []
    for name in ("no room", "in a room", "on the wall"):
        if name == "no room":
            teacher, students = Visitor(), [Visitor() for _ in range(count)]
            for visitor in (teacher, *students):
                await visitor.connect(service.port)
                await visitor.quiet(timeout=10.0)
        elif name == "in a room":
            teacher, *students = await members(service, hub, count)
        else:
            await press(teacher, 1, "wall")
        await asyncio.sleep(UP)
        before, received, began = service.seconds(), teacher.bytes, time.perf_counter()
        await _move(students, seconds)
        spent = time.perf_counter() - began
        rows.append(
            {
                "students": name,
                "service CPU %": 100 * (service.seconds() - before) / spent,
                "kB/s to the teacher": (teacher.bytes - received) / spent / 1e3,
            }
        )
        if name != "in a room":
            for visitor in (teacher, *students):
                visitor.close()
            await asyncio.sleep(UP)
    rows.append({"students": "the wall alone", **{k: rows[2][k] - rows[1][k] for k in list(rows[0])[1:]}})
    return rows


def run(quick: bool, counts: list[int] | None = None) -> dict[str, Any]:
    """The tables on stdout, and what is in them."""
    count, seconds = (counts or [5 if quick else 30])[0], 3.0 if quick else 15.0
    found: dict[str, Any] = {}
    drags = f"lesson: a teacher drags at {HZ:g} events/s for {seconds:g} s"
    with served() as running:
        found["follow"] = asyncio.run(follow(*running, count, seconds))
        print(table(drags, [found["follow"]]))
    with served() as running:
        found["wall"] = asyncio.run(wall(*running, count, seconds))
        print(table(f"lesson: {count} students move at {WALL_HZ:g} Hz for {seconds:g} s", found["wall"]))
    with served() as running:
        found["join"] = asyncio.run(join(*running, 2 * count, JOINING))
        print(table(f"lesson: students join within {JOINING:g} s", [found["join"]]))
    with running_postgres() as server, served(server.create()) as running:
        found["follow, PostgreSQL"] = asyncio.run(follow(*running, count, seconds))
        print(table(f"{drags}, PostgreSQL", [found["follow, PostgreSQL"]]))
    return found
