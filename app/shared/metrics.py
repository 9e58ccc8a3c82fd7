"""Metrics of the service in the Prometheus format, served at ``/metrics``.

The processes of a service report as one: each counts in its part of memory that all share, and whichever is asked
adds the parts up. What was counted outlives its process: the one that replaces it goes on counting there.
(prometheus_client's own way needs files in a folder, mapped into memory: a full disk would end the process with
SIGBUS, and a cleaned folder the service.)
"""

from __future__ import annotations

import json
import threading
from collections.abc import MutableSequence
from typing import Any, Final

import numpy as np
from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    disable_created_metrics,
    generate_latest,
    values,
)
from prometheus_client.registry import REGISTRY

CONTENT_TYPE: Final = "text/plain; version=0.0.4; charset=utf-8"
SIZE: Final = 1 << 20  # bytes of a process's part: some 8000 series
# Seconds, from an answer of forward kinematics to the time limits of the settings.
_SECONDS: Final = (
    *(1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0),
    *(20.0, 30.0, 60.0, 120.0, 600.0, 3600.0),
)


class _Part:
    """Counts of one process: a list of names and numbers that only it extends.

    The first 8 bytes say how many are used. An entry is the length of a name (8 bytes), the name in UTF-8 up to a
    multiple of 8 bytes, and the number.
    """

    def __init__(self, memory: MutableSequence[int], process: int) -> None:
        part = np.frombuffer(memory, np.uint8)[process * SIZE : (process + 1) * SIZE]  # type: ignore[call-overload]
        self._bytes, self._sizes, self.numbers = part, part.view(np.int64), part.view(np.float64)
        self.places: dict[str, int] = {}  # indices of `numbers`, by name
        self._read = 8

    def read(self) -> None:
        """Look for what was added."""
        used = int(self._sizes[0])
        while self._read < used:
            start = self._read + 8
            length = int(self._sizes[self._read // 8])
            name = self._bytes[start : start + length].tobytes().decode()
            end = start + length + -length % 8
            self.places[name] = end // 8
            self._read = end + 8

    def place(self, name: str) -> int | None:
        """The index of a number, which is added if need be; None: there is no room."""
        self.read()
        if name in self.places:
            return self.places[name]
        data = name.encode()
        end = self._read + 8 + len(data) + -len(data) % 8
        if end + 8 > SIZE:
            return None
        self._sizes[self._read // 8] = len(data)
        self._bytes[self._read + 8 : self._read + 8 + len(data)] = np.frombuffer(data, np.uint8)
        self._sizes[0] = end + 8  # last: a process that ends in between has added nothing
        self.read()
        return self.places[name]


class _Value:
    """A number of a metric, in the interface that prometheus_client asks for: what this process has counted.

    `get`, which is called for the exposition, adds what the other processes have.
    """

    def __init__(
        self,
        kind: str,
        metric: str,
        name: str,
        labels: tuple[str, ...],
        given: tuple[str, ...],
        *_: object,
        **__: Any,
    ) -> None:
        self.name = json.dumps([metric, name, dict(zip(labels, given, strict=True))])
        self._passing = kind == "gauge"
        self._number = 0.0
        self._place: int | None = None
        with _lock:
            _values[self.name] = self
            self.settle()

    def settle(self) -> None:
        """Get a place in the part of this process, where one that it replaces may have counted."""
        if _parts:
            self._place = _parts[0].place(self.name)
            if self._place is not None and not self._passing:
                self._number += float(_parts[0].numbers[self._place])
            self._write()

    def _write(self) -> None:
        if self._place is not None:
            _parts[0].numbers[self._place] = self._number

    def inc(self, amount: float) -> None:
        with _lock:
            self._number += amount
            self._write()

    def set(self, value: float, timestamp: float | None = None) -> None:
        with _lock:
            self._number = value
            self._write()

    def get(self) -> float:
        with _lock:
            others = (
                float(part.numbers[part.places[self.name]]) for part in _parts[1:] if self.name in part.places
            )
            return self._number + sum(others)

    def get_exemplar(self) -> None:
        return None


_lock = threading.RLock()
_values: dict[str, _Value] = {}
_parts: list[_Part] = []  # that of this process first; none: it is alone
values.ValueClass = _Value

REQUESTS = Counter("kinboard_requests", "Requests by method, route and status.", ("method", "route", "status"))
REQUEST_SECONDS = Histogram(
    "kinboard_request_seconds",
    "Time from the request to the last byte of the response.",
    ("route",),
    buckets=_SECONDS,
)
SOLVE_SECONDS = Histogram(
    "kinboard_solve_seconds", "Time of inverse kinematics for one request or drag.", ("door",), buckets=_SECONDS
)
VISITORS = Gauge("kinboard_visitors", "Open tabs of the viewer.")
CONNECTIONS = Gauge("kinboard_connections", "Open connections.")
REFUSED = Counter(
    "kinboard_refused_connections", "Connections that were refused or ended, and requests not read.", ("why",)
)
PLACES = Gauge("kinboard_places", "Places in use: of requests that compute, streams, viewer.", ("kind",))
PENDING = Gauge(
    "kinboard_pending", "Requests that wait for a place, and computations that wait or run.", ("kind",)
)
HELD_BYTES = Gauge("kinboard_held_bytes", "Bytes of unread answers and of caches.", ("kind",))
RESIDENT = Gauge("kinboard_resident_bytes", "Memory of the service.")
DROPPED = Counter("kinboard_dropped_messages", "Messages of visitors that were not passed on to viser.", ("why",))
STREAMED = Counter("kinboard_stream_bytes", "Bytes sent in streamed responses.", ("stream",))

_ALL: Final = {
    family.name: metric
    for metric in (
        *(REQUESTS, REQUEST_SECONDS, SOLVE_SECONDS, VISITORS, CONNECTIONS, REFUSED, PLACES, PENDING, HELD_BYTES),
        *(RESIDENT, DROPPED, STREAMED),
    )
    for family in metric.describe()
}


def count_together(memory: MutableSequence[int], process: int, processes: int) -> None:
    """Count with the other processes of a service from now on.

    Args:
        memory: shared by all, `SIZE` bytes for each, zero at first.
        process: the number of this one, from 0.
    """
    disable_created_metrics()  # type: ignore[no-untyped-call] # each process would name another time
    with _lock:
        _parts[:] = [_Part(memory, k) for k in sorted(range(processes), key=lambda k: k != process)]
        for value in _values.values():
            value.settle()


def forget_process(memory: MutableSequence[int], process: int) -> None:
    """Drop what a process that has ended reported of its present state, such as its visitors; counters stay."""
    part = _Part(memory, process)
    part.read()
    for name, place in part.places.items():
        if isinstance(_ALL.get(json.loads(name)[0]), Gauge):
            part.numbers[place] = 0.0


def exposition() -> bytes:
    """All metrics, of all processes together."""
    if not _parts:
        return generate_latest(REGISTRY)
    with _lock:
        for part in _parts:
            part.read()
        missing = {name for part in _parts for name in part.places.keys() - _values.keys()}
    for metric, _, labels in map(json.loads, missing):  # what others count, and those before this process did
        labels.pop("le", None)
        _ALL[metric].labels(**labels)
    registry = CollectorRegistry()
    for each in _ALL.values():
        registry.register(each)
    return generate_latest(registry)
