"""Capability maps, computed once for all readers, visible while they grow, bounded in memory.

A map is identified by its description, :class:`MapRequest`. Readers of the same map share one computation and see
its growing result. It runs as long as it has a reader, and is cancelled when the last one leaves. Finished maps
are kept for later readers. Two maps are computed at a time; others wait for their turn.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from app.shared.computations import ComputationCache, SharedComputation, Subscription
from app.shared.mapreduce import run_local
from app.shared.threads import background_threads, lower_priority
from kin import JointConstraints, Robot
from kin.ik.options import FREE
from kin.workspace import CapabilityBlock, CapabilityMap, capability_grid, capability_join

PUBLISHED_EVERY = 0.5  # s between two partial results


@dataclass(frozen=True)
class MapRequest:
    """Description of a map: what `kin.workspace.capability_grid` takes, hashable."""

    robot: Robot
    resolution: int = 25
    directions: int = 48
    constraints: JointConstraints = FREE


class MapTimeError(Exception):
    """A map took longer than maps may.

    Attributes:
        seconds: that a map may take.
    """

    def __init__(self, seconds: float) -> None:
        super().__init__(f"the map was not finished after {seconds:g} s")
        self.seconds = seconds


class Maps:
    """Threads that compute maps, and a cache of the maps. Any thread may use it.

    Args:
        max_bytes: the most that is kept; the map used longest ago is dropped first.
        threads: how many compute one map; by default as many as there are processors but one.
        at_once: how many maps are computed at a time.
        seconds: how long one map may be computed; then its future raises `MapTimeError`.
    """

    def __init__(
        self,
        max_bytes: int = 64 << 20,
        threads: int | None = None,
        at_once: int = 2,
        seconds: float = 600.0,
    ) -> None:
        self._seconds = seconds
        self._threads = threads or background_threads()
        self._executor = ThreadPoolExecutor(at_once, thread_name_prefix="map", initializer=lower_priority)
        self._maps: ComputationCache[CapabilityMap] = ComputationCache(self._executor, max_bytes, _size)

    def subscribe(self, request: MapRequest) -> Subscription[CapabilityMap]:
        """A reader of this map: progress in blocks, the growing map, and the future of the whole map.

        The future raises `kin.InputError` for an invalid description, as `kin.workspace.capability_grid` does.
        """
        return self._maps.subscribe(request, lambda computation: self._compute(request, computation))

    @property
    def pending(self) -> int:
        """How many computations wait or run."""
        return self._maps.pending

    @property
    def bytes(self) -> int:
        """How much is kept now, finished maps only."""
        return self._maps.size

    def close(self) -> None:
        """Stop after the blocks under way; returns at once."""
        self._maps.close()
        self._executor.shutdown(wait=False, cancel_futures=True)

    def _compute(self, request: MapRequest, computation: SharedComputation[CapabilityMap]) -> CapabilityMap:
        grid = capability_grid(
            request.robot,
            resolution=request.resolution,
            directions=request.directions,
            constraints=request.constraints,
        )
        computation.total = len(grid.blocks)
        blocks: list[CapabilityBlock] = []
        published = 0.0
        ends = time.perf_counter() + self._seconds
        running = run_local(grid, self._threads, lower_priority)
        try:
            for block in running:
                computation.check()
                blocks.append(block)
                computation.done = len(blocks)
                now = time.perf_counter()
                if now > ends and len(blocks) < len(grid.blocks):
                    computation.latest = capability_join(grid, blocks)
                    raise MapTimeError(self._seconds)
                if now - published >= PUBLISHED_EVERY:
                    published, computation.latest = now, capability_join(grid, blocks)
        finally:
            running.close()
        return capability_join(grid, blocks)


def _size(found: CapabilityMap) -> int:
    arrays = (found.index, found.centres, found.approachable, found.share, found.manipulability)
    return sum(array.nbytes for array in arrays)
