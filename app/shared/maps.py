"""Capability maps for many readers: computed once for all who ask, shown while they grow, bounded in memory.

A map is its description, :class:`Wanted`. Whoever asks for the same one shares one computation and sees what there
is of it so far; it goes on as long as anybody reads it, and is stopped when the last reader leaves. Finished maps
are kept for those who come later. Two are computed at a time: the others wait for their turn.
"""

from __future__ import annotations

import os
import threading
import time
from collections import OrderedDict
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import dataclass, field

from app.shared.clouds import step_back
from app.shared.mapreduce import run_local
from kin import CapabilityBlock, CapabilityMap, Robot, capability_grid, capability_join

PUBLISHED = 0.5  # s between two looks at a growing map


@dataclass(frozen=True)
class Wanted:
    """Which map: what `kin.capability_grid` takes, hashable."""

    robot: Robot
    resolution: int = 25
    directions: int = 48
    limits: tuple[tuple[float, float] | None, ...] | None = None
    locked: tuple[float | None, ...] | None = None


@dataclass(eq=False)
class _Work:
    """One computation. Written by its thread, but for `readers` and `stopped`, which the lock protects."""

    wanted: Wanted
    readers: int = 0
    stopped: bool = False
    done: int = 0
    total: int = 0
    latest: CapabilityMap | None = None
    future: Future[CapabilityMap] = field(default_factory=Future)


class Reader:
    """Somebody who waits for a map and looks at it meanwhile. `leave` when it is no longer wanted."""

    def __init__(self, maps: Maps, work: _Work) -> None:
        self._maps = maps
        self._work = work
        self._reading = True

    @property
    def wanted(self) -> Wanted:
        """Which map."""
        return self._work.wanted

    @property
    def done(self) -> int:
        """How many blocks are computed."""
        return self._work.done

    @property
    def total(self) -> int:
        """How many blocks there are; 0 until its turn has come."""
        return self._work.total

    @property
    def finished(self) -> bool:
        """Whether the map is there, or never will be."""
        return self._work.future.done()

    @property
    def latest(self) -> CapabilityMap | None:
        """What there is of the map, the same object for all readers; None before the first block."""
        return self._work.latest

    @property
    def future(self) -> Future[CapabilityMap]:
        """The whole map, or what computing it has raised. Do not cancel it: others may wait for it."""
        return self._work.future

    def leave(self) -> None:
        """Want it no longer: the last reader's leaving stops the work. Any number of times."""
        reading, self._reading = self._reading, False
        if reading:
            self._maps._left(self._work)


class Maps:
    """Threads that compute maps, and the maps that were asked for last. Any thread may use it.

    Args:
        max_bytes: how much is kept; the map asked for longest ago goes first.
        threads: how many compute a map; all cores but one by default.
        at_once: how many maps are computed at a time.
    """

    def __init__(self, max_bytes: int = 64 << 20, threads: int | None = None, at_once: int = 2) -> None:
        self._max_bytes = max_bytes
        self._threads = threads or max(1, (os.cpu_count() or 2) - 1)
        self._pool = ThreadPoolExecutor(at_once, thread_name_prefix="map", initializer=step_back)
        self._lock = threading.Lock()
        self._works: OrderedDict[Wanted, _Work] = OrderedDict()
        self._closed = False

    def read(self, wanted: Wanted) -> Reader:
        """A reader of this map: there already, being computed, or begun for this one.

        What is wrong with the description is raised by the reader's `future`, as by `kin.capability_grid`.
        """
        with self._lock:
            work = self._works.get(wanted)
            if work is None:
                work = self._works[wanted] = _Work(wanted)
                self._pool.submit(self._run, work)
            self._works.move_to_end(wanted)
            work.readers += 1
        return Reader(self, work)

    @property
    def bytes(self) -> int:
        """How much is kept now, finished maps only."""
        with self._lock:
            return sum(map(_size, self._works.values()))

    def close(self) -> None:
        """Stop all work after the blocks at hand; returns at once."""
        with self._lock:
            self._closed = True
            for work in self._works.values():
                work.future.cancel()  # if it has not begun
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _left(self, work: _Work) -> None:
        with self._lock:
            work.readers -= 1
            if work.readers == 0 and not work.future.done():
                # Whoever asks from now on begins anew: this one may have passed the point of return.
                work.stopped = True
                work.future.cancel()  # if it has not begun
                self._forget(work)

    def _run(self, work: _Work) -> None:
        if not work.future.set_running_or_notify_cancel():
            return
        try:
            found = self._compute(work)
        except Exception as error:  # noqa: BLE001 - whoever reads the map raises it
            with self._lock:
                self._forget(work)  # the next reader tries again
            work.future.set_exception(error)
            return
        work.latest = found
        work.future.set_result(found)
        with self._lock:
            kept = sum(map(_size, self._works.values()))
            for old in list(self._works.values()):
                if kept <= self._max_bytes:
                    break
                kept -= _size(old)
                if old.future.done():
                    self._forget(old)

    def _compute(self, work: _Work) -> CapabilityMap:
        """The map, published as it grows; raises `CancelledError` when nobody wants it any more."""
        wanted = work.wanted
        grid = capability_grid(
            wanted.robot,
            resolution=wanted.resolution,
            directions=wanted.directions,
            limits=wanted.limits,
            locked=wanted.locked,
        )
        work.total = len(grid.blocks)
        blocks: list[CapabilityBlock] = []
        published = 0.0
        running = run_local(grid, self._threads, step_back)
        try:
            for block in running:
                if work.stopped or self._closed:
                    raise CancelledError
                blocks.append(block)
                work.done = len(blocks)
                now = time.perf_counter()
                if now - published >= PUBLISHED:
                    published, work.latest = now, capability_join(grid, blocks)
        finally:
            running.close()
        return capability_join(grid, blocks)

    def _forget(self, work: _Work) -> None:
        if self._works.get(work.wanted) is work:
            del self._works[work.wanted]


def _size(work: _Work) -> int:
    """Bytes of a map that is finished."""
    found = work.latest
    if found is None or not work.future.done():
        return 0
    arrays = (found.index, found.centres, found.approachable, found.share, found.manipulability)
    return sum(array.nbytes for array in arrays)
