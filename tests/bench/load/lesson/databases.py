"""From process to process: asking for a room's version against PostgreSQL's LISTEN and NOTIFY.

One process sends pages of a room at the pace of a drag, with the statements of `app.classroom.ticks`; another one
waits for them, in either way. The page holds the time at which it was sent.
"""

from __future__ import annotations

import multiprocessing
import tempfile
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Literal, get_args

import psutil
import psycopg
from postgres_server import Postgres
from sqlalchemy import text

from app.classroom import Hub
from app.classroom.hub import BEAT, TICK
from app.classroom.live import Pending
from app.classroom.ticks import fetch, store
from load import percentile
from load.drag import HZ
from load.service import family, seconds_of

Way = Literal["polling", "LISTEN/NOTIFY"]
CHANNEL = "kinboard_bench"


def compare(server: Postgres | None, seconds: float) -> list[dict[str, Any]]:
    """Polling on SQLite and, with a server, both ways on PostgreSQL; each while the teacher drags, and idle."""
    with tempfile.TemporaryDirectory(prefix="kinboard-databases-") as folder:
        rows = [{"database": "SQLite", **_measure(Path(folder), None, "polling", None, seconds)}]
        ways: tuple[Way, ...] = () if server is None else get_args(Way)
        for way in ways:
            url = server.create()
            rows.append({"database": "PostgreSQL", **_measure(Path(folder), url, way, server.pid, seconds)})
    return rows


def _measure(folder: Path, url: str | None, way: Way, server: int | None, seconds: float) -> dict[str, Any]:
    """Latencies, and processor time of the process that waits and of the database's server."""
    hub = Hub(folder, url)
    room = hub.rooms.open("Load", 3600.0).id
    ours, theirs = multiprocessing.Pipe()
    waiting = multiprocessing.get_context("spawn").Process(target=_wait, args=(folder, url, way, room, theirs))
    waiting.start()
    try:
        assert ours.recv() == "ready"
        idle = _spent(waiting.pid, server, lambda: time.sleep(seconds))
        busy = _spent(waiting.pid, server, lambda: _tell(hub, room, way, seconds))
        with hub.database.write(durable=False) as connection:
            store(connection, room, Pending(page="end"), set())
            if way == "LISTEN/NOTIFY":
                connection.execute(text(f"NOTIFY {CHANNEL}"))
        latencies = ours.recv()
        waiting.join(20.0)
    finally:
        waiting.kill()
        hub.close()
    return {
        "way": way,
        "sent": round(seconds * HZ),
        "seen": len(latencies),
        "p50 ms": 1e3 * percentile(latencies, 50),
        "p95 ms": 1e3 * percentile(latencies, 95),
        "idle CPU %": 100 * idle[0] / seconds,
        "idle server CPU %": 100 * idle[1] / seconds,
        "CPU %": 100 * busy[0] / seconds,
        "server CPU %": 100 * busy[1] / seconds,
    }


def _tell(hub: Hub, room: str, way: Way, seconds: float) -> None:
    begin = time.monotonic()
    for k in range(round(seconds * HZ)):
        time.sleep(max(0.0, begin + k / HZ - time.monotonic()))
        sent = repr(time.monotonic())
        with hub.database.write(durable=False) as connection:
            store(connection, room, Pending(page=sent), set())
            if way == "LISTEN/NOTIFY":
                connection.execute(text(f"NOTIFY {CHANNEL}"))


def _nothing(room: str) -> dict[str, int]:
    """No attempt of any seat is known; there are none."""
    return {}


def _wait(folder: Path, url: str | None, way: Way, room: str, pipe: Connection) -> None:
    """The other process: sends the latencies when the last page has come."""
    hub = Hub(folder, url)
    known, latencies, page = -1, [], ""
    listening = None
    if way == "LISTEN/NOTIFY":
        assert url is not None
        listening = psycopg.connect(url, autocommit=True)
        listening.execute(f"LISTEN {CHANNEL}")
    with hub.database.read() as connection:
        assert fetch(connection, {room: known}, _nothing)[room] is not None
    pipe.send("ready")
    while page != "end":
        with hub.database.read() as connection:
            found = fetch(connection, {room: known}, _nothing).get(room)
        if found is not None:
            known, new = found[0]["version"], found[0]["page"]
            if new not in (page, "", "end"):
                latencies.append(time.monotonic() - float(new))
            page = new
        if listening is None:
            time.sleep(TICK)
        else:
            for _ in listening.notifies(timeout=BEAT, stop_after=1):
                pass
    pipe.send(latencies)
    if listening is not None:
        listening.close()
    hub.close()


def _spent(pid: int | None, server: int | None, act: Any) -> tuple[float, float]:
    """Processor seconds of a process, and of the server with its connections, while something is done."""
    families = [[psutil.Process(pid)], [] if server is None else family(server)]
    before = [sum(map(seconds_of, family)) for family in families]
    act()
    after = [sum(map(seconds_of, family)) for family in families]
    return after[0] - before[0], after[1] - before[1]
