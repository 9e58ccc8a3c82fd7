"""Clouds of tool points, slice by slice: any slice can be computed by itself, with the same bits.

The configuration of sample i depends on the arm, the limits and locks, the strategy, the seed and i alone, never
on the chunk, the thread or earlier samples. So threads may compute any slices in any order, a longer cloud
continues a shorter one, and configurations need not be stored: the point's index gives them again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError
from kin.fk import fk_positions
from kin.ik.options import JointConstraints, Limits, Locks
from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import Array
from kin.workspace.clouds.measures import Measure, measure_names, measured
from kin.workspace.clouds.targets import targeted
from kin.workspace.region import Region, checked_integer
from kin.workspace.results import WorkspaceChunk
from kin.workspace.sampling.kernels import Points, configurations_of, sample_configurations, sample_points
from kin.workspace.sampling.streams import Streams, Words, joint_streams

Strategy = Literal["uniform", "quasi", "boundary", "volume"]
STRATEGIES: tuple[Strategy, ...] = get_args(Strategy)
MOST = 1 << 53  # indices up to here are whole numbers everywhere, in JSON too


def sample_workspace(
    robot: Robot | str,
    n: int,
    *,
    seed: int = 0,
    strategy: Strategy = "uniform",
    limits: Limits | None = None,
    locked: Locks | None = None,
    constraints: JointConstraints | None = None,
    chunk: int = 65536,
    measure: Measure | Sequence[Measure] | None = None,
    with_q: bool = False,
) -> Iterator[WorkspaceChunk]:
    """A cloud of n points that the tool reaches, in chunks.

    Args:
        robot: the arm, or the id of a built-in one.
        n: how many points, up to 2⁵³.
        seed: a whole number from 0; another seed gives another cloud.
        strategy: ``"uniform"``: each joint evenly between its limits, pseudo-random; ``"quasi"``: the same, spread
            more evenly by an additive recurrence; ``"volume"``: evenly over the workspace itself; ``"boundary"``:
            on its envelope. The last two descend towards random points, which takes some ten and a few hundred
            microseconds per point, and half a second once per arm and limits; :mod:`kin.workspace.clouds.targets`
            describes their accuracy.
        limits, locked: as in `kin.JointConstraints`, respected exactly. A joint without limits is sampled from ±π.
        constraints: both as one value, instead of `limits` and `locked`.
        chunk: points per chunk; the points do not depend on it.
        measure: ``"manipulability"``, ``"limit_margin"``, or both.
        with_q: whether chunks carry their configurations.

    Returns:
        An iterator of chunks.

    Raises:
        InputError: naming the wrong argument, at the call, not when the first chunk is taken.

    Examples:
        >>> import kin
        >>> sum(len(chunk.points) for chunk in kin.workspace.sample_workspace("ur5", 1000, chunk=400))
        1000
    """
    total = _count("n", n)
    size = _count("chunk", chunk)
    samples = _Samples.of(robot_of(robot), seed, strategy, JointConstraints.of(limits, locked, constraints))
    names = measure_names(measure)
    return (
        samples.slice(start, min(start + size, total), total, names, with_q) for start in range(0, total, size)
    )


def workspace_slice(
    robot: Robot | str,
    n: int,
    start: int,
    end: int,
    *,
    seed: int = 0,
    strategy: Strategy = "uniform",
    limits: Limits | None = None,
    locked: Locks | None = None,
    constraints: JointConstraints | None = None,
    measure: Measure | Sequence[Measure] | None = None,
    with_q: bool = False,
) -> WorkspaceChunk:
    """Points start, …, end − 1 of the cloud that `sample_workspace` with the same arguments gives, bit by bit.

    The kernels release the GIL: threads may compute slices in parallel.

    Args:
        robot: the arm, or the id of a built-in one.
        n: points of the whole cloud.
        start: index of the first point.
        end: index after the last point.
        seed, strategy, limits, locked, constraints, measure, with_q: as in `kin.workspace.sample_workspace`.

    Returns:
        The points, and what was asked for with them.

    Raises:
        InputError: naming the wrong argument.

    Examples:
        >>> import kin
        >>> kin.workspace.workspace_slice("ur5", 1000, 100, 110, with_q=True).q.shape
        (10, 6)
    """
    total = _count("n", n)
    first = checked_integer("start", start, 0, total - 1, f"a whole number from 0 to {total - 1}")
    last = checked_integer("end", end, first + 1, total, f"a whole number from {first + 1} to {total}")
    samples = _Samples.of(robot_of(robot), seed, strategy, JointConstraints.of(limits, locked, constraints))
    return samples.slice(first, last, total, measure_names(measure), with_q)


def workspace_configurations(
    robot: Robot | str,
    index: ArrayLike,
    *,
    seed: int = 0,
    strategy: Strategy = "uniform",
    limits: Limits | None = None,
    locked: Locks | None = None,
    constraints: JointConstraints | None = None,
) -> Array:
    """The configurations ``(..., n)`` behind points of a cloud, by their indices ``(...)``: one, or any array.

    Args:
        robot: the arm, or the id of a built-in one.
        index: of the points, from 0.
        seed, strategy, limits, locked, constraints: as in `kin.workspace.sample_workspace`.

    Returns:
        The configurations.

    Raises:
        InputError: naming the wrong argument.

    Examples:
        >>> import kin
        >>> kin.workspace.workspace_configurations("ur5", [0, 17]).shape
        (2, 6)
    """
    robot = robot_of(robot)
    samples = _Samples.of(robot, seed, strategy, JointConstraints.of(limits, locked, constraints))
    try:
        indices = np.asarray(index)
    except (ValueError, RecursionError):  # rows of different lengths, or a list that contains itself
        raise InputError("index", index, "a whole number from 0, or an array of them") from None
    if indices.dtype.kind not in "iu" or (indices.size and not 0 <= indices.min() <= indices.max() < MOST):
        raise InputError("index", index, "a whole number from 0, or an array of them")
    flat = np.ascontiguousarray(indices, dtype=np.uint64).reshape(-1)
    return samples.configurations(flat).reshape(*indices.shape, robot.n)


def _count(field: str, value: object) -> int:
    return checked_integer(field, value, 1, MOST, "a whole number from 1 to 2⁵³")


@dataclass(frozen=True)
class _Samples:
    """All samples of a region, seed and strategy, checked."""

    region: Region
    seed: int
    strategy: Strategy

    @classmethod
    def of(cls, robot: Robot, seed: int, strategy: Strategy, constraints: JointConstraints) -> _Samples:
        if strategy not in STRATEGIES:
            raise InputError("strategy", strategy, "one of " + ", ".join(f'"{name}"' for name in STRATEGIES))
        checked = checked_integer("seed", seed, 0, (1 << 64) - 1, "a whole number from 0 to 2⁶⁴ − 1")
        return cls(Region.finite(robot, constraints), checked, strategy)

    @property
    def by_target(self) -> bool:
        """Whether samples are made by descents towards targets."""
        return self.strategy in ("boundary", "volume")

    @cached_property
    def streams(self) -> Streams:
        """The random numbers of the joints."""
        return joint_streams(self.seed, self.region.movable, self.strategy == "quasi")

    def configurations(self, index: Words) -> Array:
        """The configurations ``(k, n)`` of samples ``(k,)``."""
        if self.by_target:
            return targeted(self.region, self.strategy, self.seed, index)
        q = np.empty((len(index), self.region.robot.n))
        configurations_of(self.region.arm, self.streams, index, q)
        return q

    def run(self, start: int, end: int) -> Array:
        """The configurations ``(k, n)`` of samples start, …, end − 1."""
        if self.by_target:
            return self.configurations(np.arange(start, end, dtype=np.uint64))
        q = np.empty((end - start, self.region.robot.n))
        sample_configurations(self.region.arm, self.streams, start, q)
        return q

    def slice(self, start: int, end: int, total: int, names: tuple[Measure, ...], with_q: bool) -> WorkspaceChunk:
        """Samples start, …, end − 1 of a cloud of `total`."""
        region = self.region
        q = self.run(start, end) if names or with_q or self.by_target else None
        cloud: Points
        if self.by_target and q is not None:
            cloud = fk_positions(region.robot, q).astype(np.float32)
        else:
            cloud = np.empty((end - start, 3), dtype=np.float32)
            sample_points(region.arm, self.streams, start, cloud)
        measures: dict[str, Points] = {}
        if q is not None:
            measures = {name: measured(region, name, q) for name in names}
        return WorkspaceChunk(
            points=cloud, q=q if with_q else None, measures=measures, start=start, done=end, total=total
        )
