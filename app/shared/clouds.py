"""Clouds of tool points, computed in background threads, shared by all readers, bounded in memory.

A cloud is identified by its description, :class:`Cloud`: equal descriptions give equal bits, whichever part is
computed when. So nothing has to be kept: a part that the cache has dropped is computed again. Two ways to read:

`Clouds.part` for readers that come back, such as visitors of the viewer: parts are cached, thirty visitors who
press start at once share one computation, and a reader who pauses simply asks for no more parts. `Clouds.stream`
for readers that pass through once, such as a download of ten million points: slices in order, none of them kept.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

from app.shared.computations import ComputationCache
from app.shared.threads import background_threads, lower_priority
from kin import JointConstraints, Robot
from kin.ik.options import FREE
from kin.workspace import Measure, Strategy, WorkspaceChunk, workspace_slice

# Points of a part: a few milliseconds of work for sampled points, half a second for points found by descent.
SAMPLED, DESCENDED = 1 << 16, 1 << 13
FIRST = 1 << 9  # of the first part of a cloud found by descent, so that something is shown at once


@dataclass(frozen=True)
class Cloud:
    """Description of a cloud: what `kin.workspace.sample_workspace` takes, hashable. Parts are numbered from 0."""

    robot: Robot
    n: int
    seed: int = 0
    strategy: Strategy = "uniform"
    measures: tuple[Measure, ...] = ()
    constraints: JointConstraints = FREE

    @property
    def by_descent(self) -> bool:
        """Whether each point is found by a descent, which takes long, instead of sampled."""
        return self.strategy in ("boundary", "volume")

    @property
    def part_size(self) -> int:
        """Points of all parts but the first ones and the last."""
        return DESCENDED if self.by_descent else SAMPLED

    @cached_property
    def edges(self) -> tuple[int, ...]:
        """Where parts begin and end, from 0 to n: part i is points ``edges[i]`` to ``edges[i + 1] − 1``."""
        size = FIRST if self.by_descent else SAMPLED
        edges = [0]
        while edges[-1] < self.n:
            edges.append(min(edges[-1] + size, self.n))
            size = min(2 * size, self.part_size)
        return tuple(edges)

    @property
    def parts(self) -> int:
        """How many parts there are."""
        return len(self.edges) - 1

    def slice(self, start: int, end: int, with_q: bool = False) -> WorkspaceChunk:
        """Points start, …, end − 1, computed by this thread; raises as `kin.workspace.workspace_slice`."""
        return workspace_slice(
            self.robot,
            self.n,
            start,
            end,
            seed=self.seed,
            strategy=self.strategy,
            constraints=self.constraints,
            measure=self.measures or None,
            with_q=with_q,
        )


class Clouds:
    """Threads that compute clouds, and a cache of their parts. Any thread may use it.

    Args:
        max_bytes: the most that is kept; the part used longest ago is dropped first.
        threads: how many compute; by default as many as there are processors but one.
    """

    def __init__(self, max_bytes: int = 512 << 20, threads: int | None = None) -> None:
        self._threads = threads or background_threads()
        self._executor = ThreadPoolExecutor(self._threads, thread_name_prefix="cloud", initializer=lower_priority)
        self._parts: ComputationCache[WorkspaceChunk] = ComputationCache(self._executor, max_bytes, _size)

    @property
    def pending(self) -> int:
        """How many computations wait or run."""
        return self._parts.pending

    @property
    def bytes(self) -> int:
        """How much is kept now."""
        return self._parts.size

    def part(self, cloud: Cloud, index: int) -> Future[WorkspaceChunk]:
        """Part `index` of a cloud. Do not cancel the future: other readers may wait for it."""
        start, stop = cloud.edges[index], cloud.edges[index + 1]
        return self._parts.get((cloud, index), lambda _: cloud.slice(start, stop))

    def stream(self, cloud: Cloud, size: int = SAMPLED, with_q: bool = False) -> Generator[WorkspaceChunk]:
        """The whole cloud in order, in slices of `size` points, computed a little ahead of the reader.

        Closing the generator stops the computation. An invalid argument raises when the first slice is taken.
        """
        ahead: deque[Future[WorkspaceChunk]] = deque()
        start = 0
        try:
            while start < cloud.n or ahead:
                while start < cloud.n and len(ahead) <= self._threads:
                    stop = min(start + size, cloud.n)
                    ahead.append(self._executor.submit(cloud.slice, start, stop, with_q))
                    start = stop
                yield ahead.popleft().result()
        finally:
            for future in ahead:
                future.cancel()

    def close(self) -> None:
        """Start nothing more; returns at once, slices under way end later."""
        self._parts.close()
        self._executor.shutdown(wait=False, cancel_futures=True)


def _size(chunk: WorkspaceChunk) -> int:
    return chunk.points.nbytes + sum(values.nbytes for values in chunk.measures.values())
