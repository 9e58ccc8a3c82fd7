"""Sizes, sections and posture maps of arms, comparisons and other answers, computed once for all who ask.

A volume takes seconds, as may the mistakes that explain why two arms differ; the other sizes take a tenth of
one. A computation ends when the last caller leaves its subscription. A section takes some 100 kB.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple, TypeVar

from app.shared.computations import ComputationCache, SharedComputation, Subscription
from app.shared.threads import background_threads, lower_priority
from kin import JointConstraints, Obstacle, Robot, compare, leave_singularity, posture_map
from kin.comparison import Comparison, Frames
from kin.escape import Exits
from kin.ik.options import FREE
from kin.postures import PostureMap
from kin.transforms import Array
from kin.workspace import Section, WorkspaceFacts, workspace_facts, workspace_section

T = TypeVar("T")
Plane = tuple[tuple[float, ...], tuple[float, ...]]

KEPT = 64  # sizes, and as many sections
NODES = (24, 48, 96)  # along a side of a posture map, coarse to fine


class PostureRequest(NamedTuple):
    """A posture map by the arguments of `kin.posture_map`; a key of the cache."""

    robot: Robot
    constraints: JointConstraints
    respect_limits: bool
    target: tuple[tuple[float, ...], ...] | None
    normal: tuple[float, ...] | None
    joints: tuple[int, int] | None
    q: tuple[float, ...] | None


class Summaries:
    """Cache of sizes of workspaces, of sections and of `kin.compare`. Any thread may use it.

    Args:
        kept: how many results of each kind are kept.
        threads: how many are computed at a time; by default as many as there are processors but one.
        max_pending: the most computations of each kind that may be pending where a caller asks for the limit.
    """

    def __init__(self, kept: int = KEPT, threads: int | None = None, max_pending: int = 32) -> None:
        self._max_pending = max_pending
        self._executor = ThreadPoolExecutor(threads or background_threads(), "summary", lower_priority)
        self._facts: ComputationCache[WorkspaceFacts] = ComputationCache(self._executor, kept)
        self._sections: ComputationCache[Section] = ComputationCache(self._executor, kept)
        self._comparisons: ComputationCache[Comparison] = ComputationCache(self._executor, kept)
        self._others: ComputationCache[Any] = ComputationCache(self._executor, kept)

    def facts(
        self,
        robot: Robot,
        constraints: JointConstraints = FREE,
        effort: int | None = 4,
        limited: bool = False,
    ) -> Subscription[WorkspaceFacts]:
        """Sizes as by `kin.workspace.workspace_facts`.

        Args:
            robot: the arm.
            constraints: as in the core function.
            effort: as in the core function; None: without volume and surface.
            limited: raise `TooManyPendingError` instead of queueing behind too many computations.
        """

        def compute(computation: SharedComputation[WorkspaceFacts]) -> WorkspaceFacts:
            volume, cancel = effort is not None, computation.check
            tries = effort if effort is not None else 4
            return workspace_facts(robot, constraints=constraints, effort=tries, volume=volume, cancel=cancel)

        key = (robot, constraints, effort)
        return self._facts.subscribe(key, compute, self._max_pending if limited else None)

    def section(
        self,
        robot: Robot,
        plane: Plane | None = None,
        constraints: JointConstraints = FREE,
        resolution: int = 96,
        limited: bool = False,
        signed: bool = False,
    ) -> Subscription[Section]:
        """A section as by `kin.workspace.workspace_section`. `constraints` and `limited` as in `facts`."""

        def compute(computation: SharedComputation[Section]) -> Section:
            cancel = computation.check
            return workspace_section(
                robot, plane, constraints=constraints, resolution=resolution, signed=signed, cancel=cancel
            )

        key = (robot, plane, constraints, resolution, signed)
        return self._sections.subscribe(key, compute, self._max_pending if limited else None)

    def comparison(self, a: Robot, b: Robot, frames: Frames) -> Subscription[Comparison]:
        """A comparison as by `kin.compare`; the partial result is the verdict without explanations."""

        def compute(computation: SharedComputation[Comparison]) -> Comparison:
            computation.latest = compare(a, b, frames=frames, explain=False)
            return compare(a, b, frames=frames, cancel=computation.check)

        return self._comparisons.subscribe((a, b, frames), compute)

    def postures(self, request: PostureRequest) -> Subscription[PostureMap]:
        """A map as by `kin.posture_map`; partial results are coarser ones, and progress counts nodes."""

        def compute(computation: SharedComputation[PostureMap]) -> PostureMap:
            arguments = request._asdict()
            computation.total, before = sum(nodes**2 for nodes in NODES), 0
            for nodes in NODES:
                computation.latest = posture_map(**arguments, resolution=nodes, cancel=computation.check)
                before += nodes**2
                computation.done = before
            assert computation.latest is not None
            return computation.latest

        return self._others.subscribe(request, compute)

    def once(self, key: Hashable, compute: Callable[[Callable[[], None]], T]) -> Subscription[T]:
        """What `compute` returns for this key, for all who ask; its argument raises once nobody waits any more."""
        return self._others.subscribe(key, lambda computation: compute(computation.check))

    def exits(self, robot: Robot, q: Array, obstacles: tuple[Obstacle, ...]) -> Subscription[Exits]:
        """The ways out of a singularity as by `kin.leave_singularity`; links with known bodies do not touch."""
        itself = bool(robot.capsules)
        return self.once(
            ("exits", robot, q.tobytes(), obstacles),
            lambda cancel: leave_singularity(
                robot, q, obstacles=obstacles, avoid_self_collision=itself, cancel=cancel
            ),
        )

    @property
    def pending(self) -> int:
        """How many computations wait or run."""
        caches = self._facts, self._sections, self._comparisons, self._others
        return sum(each.pending for each in caches)

    def close(self) -> None:
        """Start nothing more; returns at once."""
        self._facts.close()
        self._sections.close()
        self._comparisons.close()
        self._others.close()
        self._executor.shutdown(wait=False, cancel_futures=True)
