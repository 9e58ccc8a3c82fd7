"""Clouds of tool points for many readers: computed beside them, shared, and bounded in memory.

A cloud is its description, :class:`Cloud`: whoever asks for the same one gets the same bits, whichever part of it
is computed when. So nothing has to be kept: what the cache has dropped is computed again. Two ways to read:

`Clouds.part` for readers that come back, such as the viewer's visitors: parts are cached, thirty visitors who
press start at once share one computation, and a pause is a reader who does not ask. `Clouds.stream` for readers
that pass through, such as a download of ten million points: in order, each slice forgotten once it is taken.
"""

from __future__ import annotations

import os
import sys
import threading
from collections import OrderedDict, deque
from collections.abc import Generator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

from app.shared.processor import spread
from kin import Robot, WorkspaceChunk, workspace_slice
from kin.workspace import Measure, Strategy

# Points of a part: a few milliseconds of work where points are drawn, half a second where they are descended to.
DRAWN, DESCENDED = 1 << 16, 1 << 13
FIRST = 1 << 9  # of the first part of a cloud that is descended to: there should be something to see at once
BEHIND = 10  # niceness of the threads: a visitor who drags goes first


@dataclass(frozen=True)
class Cloud:
    """Which cloud: what `kin.sample_workspace` takes, hashable. Parts are numbered from 0."""

    robot: Robot
    n: int
    seed: int = 0
    strategy: Strategy = "uniform"
    measures: tuple[Measure, ...] = ()
    limits: tuple[tuple[float, float] | None, ...] | None = None
    locked: tuple[float | None, ...] | None = None

    @cached_property
    def edges(self) -> tuple[int, ...]:
        """Where parts begin and end, from 0 to n: part i is points ``edges[i]`` to ``edges[i + 1] − 1``."""
        size, most = (FIRST, DESCENDED) if self.strategy in ("boundary", "volume") else (DRAWN, DRAWN)
        edges = [0]
        while edges[-1] < self.n:
            edges.append(min(edges[-1] + size, self.n))
            size = min(2 * size, most)
        return tuple(edges)

    @property
    def parts(self) -> int:
        """How many parts there are."""
        return len(self.edges) - 1

    def slice(self, start: int, stop: int, with_q: bool = False) -> WorkspaceChunk:
        """Points start, …, stop − 1, computed here and now; raises `kin.InputError` as `kin.workspace_slice`."""
        return workspace_slice(
            self.robot,
            self.n,
            start,
            stop,
            seed=self.seed,
            strategy=self.strategy,
            limits=self.limits,
            locked=self.locked,
            measure=self.measures or None,
            with_q=with_q,
        )


class Clouds:
    """Threads that compute clouds, and the parts they computed last. Any thread may use it.

    Args:
        max_bytes: how much is kept; the part used longest ago goes first.
        threads: how many compute; all cores but one by default.
    """

    def __init__(self, max_bytes: int = 512 << 20, threads: int | None = None) -> None:
        self._max_bytes = max_bytes
        self._threads = threads or max(1, (os.cpu_count() or 2) - 1)
        self._pool = ThreadPoolExecutor(self._threads, thread_name_prefix="cloud", initializer=step_back)
        self._lock = threading.Lock()
        self._parts: OrderedDict[tuple[Cloud, int], Future[WorkspaceChunk]] = OrderedDict()
        self._sizes: dict[tuple[Cloud, int], int] = {}  # of the parts that are ready
        self._bytes = 0

    @property
    def bytes(self) -> int:
        """How much is kept now."""
        return self._bytes

    def part(self, cloud: Cloud, index: int) -> Future[WorkspaceChunk]:
        """Part `index` of a cloud: there already, or being computed. Do not cancel it: others may wait for it."""
        key = (cloud, index)
        with self._lock:
            future = self._parts.get(key)
            if future is not None:
                self._parts.move_to_end(key)
                return future
            future = self._pool.submit(cloud.slice, cloud.edges[index], cloud.edges[index + 1])
            self._parts[key] = future
        future.add_done_callback(lambda done: self._keep(key, done))
        return future

    def stream(self, cloud: Cloud, size: int = DRAWN, with_q: bool = False) -> Generator[WorkspaceChunk]:
        """The whole cloud in order, in slices of `size` points, computed a little ahead of the reader.

        Closing the generator stops the work. A wrong argument raises when the first slice is taken.
        """
        ahead: deque[Future[WorkspaceChunk]] = deque()
        start = 0
        try:
            while start < cloud.n or ahead:
                while start < cloud.n and len(ahead) <= self._threads:
                    stop = min(start + size, cloud.n)
                    ahead.append(self._pool.submit(cloud.slice, start, stop, with_q))
                    start = stop
                yield ahead.popleft().result()
        finally:
            for future in ahead:
                future.cancel()

    def close(self) -> None:
        """Begin nothing more; returns at once, slices under way end behind it."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _keep(self, key: tuple[Cloud, int], done: Future[WorkspaceChunk]) -> None:
        """Count a part that is ready, and drop what is too much."""
        with self._lock:
            if done.cancelled() or done.exception() is not None:
                self._parts.pop(key, None)  # the next reader tries again
                return
            self._sizes[key] = _size(done.result())
            self._bytes += self._sizes[key]
            while self._bytes > self._max_bytes:
                oldest = next(k for k in self._parts if k in self._sizes)
                del self._parts[oldest]
                self._bytes -= self._sizes.pop(oldest)


def _size(chunk: WorkspaceChunk) -> int:
    return chunk.points.nbytes + sum(values.nbytes for values in chunk.measures.values())


def step_back() -> None:
    """Lets everybody else's work go first, on any processor.

    Linux schedules threads by niceness; elsewhere it is the process's.
    """
    spread()
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), BEHIND)
