"""A class that comes: the form with the join code, then the page of the viewer."""

from __future__ import annotations

import asyncio
import re
import time
from typing import Any
from urllib.parse import urlencode

from app.classroom import COOKIE, Hub
from load import percentile
from load.service import Service
from load.visitor import Visitor

_COOKIE = re.compile(rf"set-cookie: {COOKIE}=([^;\s]+)", re.IGNORECASE)


async def join(service: Service, hub: Hub, count: int, seconds: float) -> dict[str, Any]:
    """So many students come evenly within so many seconds; each takes a seat and opens a page."""
    room = hub.rooms.open("Load", 3600.0)
    before, began = service.seconds(), time.perf_counter()
    came = await asyncio.gather(
        *(_one(service.port, room.code, k, seconds * k / count) for k in range(count)), return_exceptions=True
    )
    there = [each for each in came if not isinstance(each, BaseException)]
    for visitor, *_ in there:
        await visitor.quiet()
    used = service.seconds() - before
    for visitor, *_ in there:
        visitor.close()
    seats, arms = [each[1] for each in there], [each[2] for each in there]
    return {
        "students": count,
        "lost": count - len(there),
        "why": "; ".join(sorted({repr(each) for each in came if isinstance(each, BaseException)})),
        "seat p50 ms": 1e3 * percentile(seats, 50),
        "seat p95 ms": 1e3 * percentile(seats, 95),
        "arm p50 ms": 1e3 * percentile(arms, 50),
        "arm p95 ms": 1e3 * percentile(arms, 95),
        "all pages s": max((visitor.last for visitor, *_ in there), default=began) - began,
        "CPU ms each": 1e3 * used / max(len(there), 1),
    }


async def _one(port: int, code: str, number: int, after: float) -> tuple[Visitor, float, float]:
    """One student: the page, seconds until the seat was taken, and until the arm was there."""
    await asyncio.sleep(after)
    began = time.perf_counter()
    token = await _seat(port, code, f"Student {number + 1}")
    seated = time.perf_counter() - began
    visitor = Visitor(cookie=f"{COOKIE}={token}")
    await visitor.connect(port)
    return visitor, seated, visitor.complete - began


async def _seat(port: int, code: str, alias: str) -> str:
    """Send the form; returns the token of the seat."""
    body = urlencode({"code": code, "alias": alias})
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(
        f"POST /room/join HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/x-www-form-urlencoded\r\n"
        f"Content-Length: {len(body)}\r\nConnection: close\r\n\r\n{body}".encode()
    )
    head = (await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), 60.0)).decode()
    writer.close()
    found = _COOKIE.search(head)
    if found is None:
        raise ConnectionError(f"no seat: {head.partition(chr(13))[0]}")
    return found[1]
