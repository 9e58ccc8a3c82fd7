"""Capability map: from which directions the tool can be brought to each place of the workspace, and how well.

The bounding box of the workspace is cut into cubes, voxels, and the arm is asked at the centre of each (Zacharias,
Borst and Hirzinger, Capturing robot workspace structure, IROS 2007):

- **reachable**: whether the tool point can be at the centre, whatever the orientation;
- **approachable**: for each direction of a spherical design (:mod:`kin.workspace.capability.sphere`), whether the
tool point can be at the centre with the tool's z axis along it, for at least one roll about it; the **share** of
these
  directions;
- **manipulability**: the best `kin.manipulability` among the configurations that were looked at.

All inside the limits. Every yes was measured by forward kinematics. What a no is worth depends on the arm, and the
map's `method` says which of these it is:

- ``"closed form"``: the approach has a closed form that knows the exact ranges of what it leaves free (roll, arm
  angle): a no is a no. A batch of branches settles almost all; those that exist but break a limit are put to the
  solver one by one. Only where an arm is singular at one roll and not at others may a yes be missed: at targets
  that fill no volume.
- ``"sweep"``: poses have a closed form, approaches do not, as the tool is not on the last joint's axis. `ROLLS`
  rolls are tried, and `SWEEP` values of an arm's own free parameter: narrower ranges are missed.
- ``"search"``: no closed form. `STARTS` descents per direction: a few that can be had are missed.

Whether a centre that no direction of the set fits is reachable is asked of :mod:`kin.workspace.search.cells`,
whose misses are rare. The best manipulability is that of all branches, at `SWEEP` arm angles or rolls where these
are free and count; a finer sweep mostly finds one or two per cent more, at the worst a quarter.

The grid is an agreement made once; its blocks are independent of each other and can be computed anywhere, in any
order: `capability_block` gives the same bits in every process on one kind of processor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kin.axes import screw_z
from kin.errors import InputError
from kin.fk import fk, jacobian, manipulability
from kin.ik.batch import ik_branches
from kin.ik.problem import Limits, Locks, ask, finite_number
from kin.robot import Robot
from kin.solvers import closed_form_of
from kin.solvers.common import TURN
from kin.solvers.contract import APPROACH, POSE, ClosedForm, RedundancyParameter, SolverInput
from kin.tolerances import TOLERANCES
from kin.transforms import Array, frame_from_approach
from kin.workspace.capability.gauge import BLOCKED, NONE, gauge, seek
from kin.workspace.capability.sphere import spherical_design
from kin.workspace.region import Region, checked_integer
from kin.workspace.search.cells import cell_map
from kin.workspace.search.extremes import along

Method = Literal["closed form", "sweep", "search"]
Rows = NDArray[np.int64]

ROLLS = 36  # one every 10°
SWEEP = 8
STARTS = 8
MOST = 1 << 24  # voxels of a grid
_TARGETS = 1 << 14  # of a block, about
# What a radian weighs in a descent, as a share of the arm's reach, and the E it takes for exact: kin.ik.nearest's.
_LEVER, _EXACT = 0.3, 1e-10


@dataclass(frozen=True)
class CapabilityGrid:
    """What is to be computed: plain data, equal and hashable by value; can be sent to another process.

    Attributes:
        robot: the arm.
        bounds: (lower, upper) of each joint, equal for a locked one, infinite for one without limits.
        origin: least corner of the grid, m.
        voxel: side of a voxel, m.
        shape: voxels along x, y, z.
        count: how many directions are asked for.
    """

    robot: Robot
    bounds: tuple[tuple[float, float], ...]
    origin: tuple[float, float, float]
    voxel: float
    shape: tuple[int, int, int]
    count: int

    def __getstate__(self) -> dict[str, object]:
        """The fields alone: the list of blocks need not travel with every one of them."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @property
    def directions(self) -> Array:
        """The approach directions ``(m, 3)``, unit vectors."""
        return spherical_design(self.count)

    @property
    def method(self) -> Method:
        """How the directions are decided, see :mod:`kin.workspace.capability.blocks`."""
        return _arm(self).method

    @cached_property
    def blocks(self) -> tuple[range, ...]:
        """The voxels of each block, by their numbers in C order."""
        total, size = math.prod(self.shape), max(1, _TARGETS // self.count)
        return tuple(range(start, min(start + size, total)) for start in range(0, total, size))

    def index(self, numbers: Rows) -> Rows:
        """Indices ``(k, 3)`` of voxels by their numbers ``(k,)``."""
        return np.stack(np.unravel_index(numbers, self.shape), axis=-1).astype(np.int64)

    def centres(self, index: Rows) -> Array:
        """Centres ``(k, 3)`` in metres of voxels by their indices ``(k, 3)``."""
        return np.asarray(np.array(self.origin) + (index + 0.5) * self.voxel)


@dataclass(frozen=True, slots=True, eq=False)
class CapabilityBlock:
    """The reachable voxels of one block.

    Attributes:
        block: its place in `CapabilityGrid.blocks`.
        numbers: ``(k,)`` of the voxels, rising.
        approachable: ``(k, m)`` which directions.
        manipulability: ``(k,)`` the best.
    """

    block: int
    numbers: Rows
    approachable: NDArray[np.bool_]
    manipulability: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class CapabilityMap:
    """The reachable voxels of a grid, and what was found there; flat arrays, read-only.

    Attributes:
        grid: what was asked: `grid.origin`, `grid.voxel`, `grid.shape`, `grid.directions`, `grid.method`.
        index: ``(k, 3)`` place of each voxel in the grid.
        centres: ``(k, 3)`` their centres, m.
        approachable: ``(k, m)`` which of the grid's directions.
        share: ``(k,)`` of the directions, 0 to 1; 0 where the point is reachable with other directions only.
        manipulability: ``(k,)`` the best that was found.
        volume: of the reachable voxels, m³.
    """

    grid: CapabilityGrid
    index: Rows
    centres: Array
    approachable: NDArray[np.bool_]
    share: NDArray[np.float32]
    manipulability: NDArray[np.float32]
    volume: float


def capability_grid(
    robot: Robot,
    *,
    voxel: float | None = None,
    resolution: int = 25,
    limits: Limits | None = None,
    locked: Locks | None = None,
    directions: int = 48,
) -> CapabilityGrid:
    """The grid over the bounding box of the points the tool reaches.

    Args:
        robot: the arm.
        voxel: side of a voxel in metres; None to have it by `resolution`.
        resolution: voxels along the longest side of the box, 1 to 256.
        limits, locked: as in `kin.solve_ik`.
        directions: 12, 24, 48 or 96, see `kin.workspace.capability.sphere.spherical_design`.

    Raises:
        InputError: naming the wrong argument; also a voxel so small that there would be more than 2²⁴.
    """
    spherical_design(directions)
    question = ask(robot, np.zeros(3), task="position", limits=limits, locked=locked)
    bounds = tuple(zip(question.lower.tolist(), question.upper.tolist(), strict=True))
    count = checked_integer("resolution", resolution, 1, 256, "a whole number from 1 to 256")
    region = Region.of(robot, limits, locked)
    box = [along(region, axis) for axis in np.eye(3)]
    low, high = (np.array([getattr(span, end).value for span in box]) for end in ("least", "largest"))
    size = high - low
    # A hair more than the box: voxels that merely touch its ends would be a layer of nothing.
    side = max(float(size.max()), TOLERANCES.geometry) * (1.0 + 1e-9) / count
    if voxel is not None:
        side = finite_number("voxel", voxel, "metres, more than 0")
        if side <= 0.0:
            raise InputError("voxel", voxel, "metres, more than 0")
        if np.prod(size / side + 1.0) > MOST:
            raise InputError("voxel", voxel, f"metres, large enough for at most {MOST} voxels")
    shape = np.maximum(np.ceil(size / side - 1e-6), 1.0)
    origin = 0.5 * (low + high) - 0.5 * shape * side
    x, y, z = origin.tolist()
    a, b, c = shape.astype(int).tolist()
    return CapabilityGrid(robot, bounds, (x, y, z), side, (a, b, c), directions)


def capability_block(grid: CapabilityGrid, block: int) -> CapabilityBlock:
    """The reachable voxels of one block, 0 to ``len(grid.blocks) − 1``.

    Pure: the same bits in every thread and process. The compiled part releases the GIL.
    """
    number = checked_integer(
        "block", block, 0, len(grid.blocks) - 1, f"a whole number from 0 to {len(grid.blocks) - 1}"
    )
    arm = _arm(grid)
    voxels = grid.blocks[number]
    numbers = np.arange(voxels.start, voxels.stop, dtype=np.int64)
    centres = grid.centres(grid.index(numbers))
    best = arm.best(centres)
    found = best.max(axis=1)
    # Where no direction of the set fits, there may still be one in between.
    others = np.flatnonzero(found < 0.0)
    near, distance = cell_map(arm.region).nearest(centres[others], TOLERANCES.closure_position)
    touched = distance <= TOLERANCES.closure_position
    found[others[touched]] = manipulability(grid.robot, near[touched])
    kept = found >= 0.0
    return CapabilityBlock(
        block=number,
        numbers=numbers[kept],
        approachable=best[kept] >= 0.0,
        manipulability=found[kept].astype(np.float32),
    )


def capability_join(grid: CapabilityGrid, blocks: Iterable[CapabilityBlock]) -> CapabilityMap:
    """The map of a grid from its blocks, which may come in any order; of some blocks, the map of these."""
    found = sorted({part.block: part for part in blocks}.values(), key=lambda part: part.block)
    numbers = np.concatenate([np.empty(0, dtype=np.int64), *(part.numbers for part in found)])
    approachable = np.concatenate([np.empty((0, grid.count), dtype=bool), *(part.approachable for part in found)])
    best = np.concatenate([np.empty(0, dtype=np.float32), *(part.manipulability for part in found)])
    index = grid.index(numbers)
    centres = grid.centres(index)
    share = approachable.mean(axis=1).astype(np.float32)
    for array in (index, centres, approachable, share, best):
        array.flags.writeable = False
    return CapabilityMap(grid, index, centres, approachable, share, best, len(index) * grid.voxel**3)


def capability_map(
    robot: Robot,
    *,
    voxel: float | None = None,
    resolution: int = 25,
    limits: Limits | None = None,
    locked: Locks | None = None,
    directions: int = 48,
) -> CapabilityMap:
    """The capability map of an arm, block after block; arguments and errors as of `capability_grid`.

    Who wants threads, progress or another machine computes the blocks of the grid one by one.
    """
    grid = capability_grid(
        robot, voxel=voxel, resolution=resolution, limits=limits, locked=locked, directions=directions
    )
    return capability_join(grid, (capability_block(grid, block) for block in range(len(grid.blocks))))


@lru_cache(maxsize=8)
def _arm(grid: CapabilityGrid) -> _Arm:
    return _Arm(grid)


class _Arm:
    """What all blocks of a grid share."""

    def __init__(self, grid: CapabilityGrid) -> None:
        robot = grid.robot
        self.robot = robot
        self.lower = np.array([low for low, _ in grid.bounds])
        self.upper = np.array([high for _, high in grid.bounds])
        low = np.where(np.isfinite(self.lower), self.lower, -math.pi)
        high = np.where(np.isfinite(self.upper), self.upper, math.pi)
        self.region = Region(robot, tuple(zip(low.tolist(), high.tolist(), strict=True)))
        self.home = robot.q_home.copy()  # kernels take writable arrays only
        self.turns = np.where(robot.revolute, TURN, 0.0)
        self.rolls = _rolls(robot)
        self.frames = np.stack([frame_from_approach(direction) for direction in grid.directions])
        self.form: ClosedForm | None = None
        self.freedoms: tuple[RedundancyParameter, ...] = ()
        self.values: tuple[float, ...] = (math.nan,)
        self.tried = 1  # rolls about each direction
        self.elsewhere: Robot | None = None
        self.method: Method = "search"
        match = closed_form_of(robot)
        if match is not None:
            self.form = match
            exact = match.handles(APPROACH)
            self.method = "closed form" if exact else "sweep"
            self.freedoms = match.redundancies(APPROACH) if exact else ()
            if not exact:
                self.tried = ROLLS
            elif not self.rolls and not all(freedom.rare for freedom in self.freedoms):
                self.tried = SWEEP
            free = [freedom for freedom in match.redundancies(POSE) if not freedom.rare]
            self.values = self._values(free, exact)
            if not free and (self.rolls or robot.n > 4):
                # What a singularity leaves free is taken from home: another home shows where that is.
                home = (value + 0.3 + 0.2 * i for i, value in enumerate(robot.home))
                self.elsewhere = replace(robot, home=tuple(home))

    def _values(self, free: list[RedundancyParameter], exact: bool) -> tuple[float, ...]:
        """Values of the arm's own free parameter to try, NaN for the one near the home configuration.

        A joint that is free moves no other but those that undo it: its limits are the exact solver's business.
        """
        if not free or (exact and free[0].joint >= 0):
            return (math.nan,)
        low, high = -math.pi, math.pi
        if free[0].joint >= 0:
            low, high = self.region.bounds[free[0].joint]
        return tuple((low + (np.arange(SWEEP) + 0.5) / SWEEP * (high - low)).tolist())

    def best(self, centres: Array) -> Array:
        """The best manipulability ``(k, m)`` at each centre ``(k, 3)`` along each direction, negative if none."""
        T = np.zeros((len(centres), len(self.frames), 4, 4))
        T[..., :3, :3] = self.frames
        T[..., :3, 3] = centres[:, None]
        T[..., 3, 3] = 1.0
        best = np.full(T.shape[:2], NONE)
        if self.method == "search":
            self._search(centres, T, best)
            return best
        for k in range(self.tried):
            turned = T if k == 0 else np.ascontiguousarray(T @ screw_z(TURN * k / self.tried, 0.0))
            for value in self.values:
                self._gauge(turned, ik_branches(self.robot, turned, value), best)
        if self.method == "closed form":
            self._exactly(T, best)
        return best

    def _gauge(self, T: Array, q: Array, best: Array) -> None:
        """Raise best ``(...)`` by configurations ``(..., rows, n)`` of targets ``(..., 4, 4)``, in place."""
        gauge(
            self.robot.model, T.reshape(-1, 4, 4), q.reshape(-1, *q.shape[-2:]), self.lower, self.upper,
            self.turns, self.rolls, best.reshape(-1),
        )  # fmt: skip

    def _exactly(self, T: Array, best: Array) -> None:
        """Ask the solver, which knows the ranges of what is free, where the batch of branches settles nothing.

        Where an approach has a closed form, rolling the tool moves nothing but the wrist: one roll tells whether
        branches exist. Of an arm whose axes are all parallel it moves the last axis.
        """
        open_ = np.argwhere((best == BLOCKED) if self.rolls or self.robot.n > 4 else (best < 0.0))
        if self.elsewhere is not None and len(open_):
            here, there = (
                ik_branches(robot, T[*open_.T]).reshape(len(open_), -1) for robot in (self.robot, self.elsewhere)
            )
            open_ = open_[~np.asarray((here == there) | (np.isnan(here) & np.isnan(there))).all(axis=1)]
        assert self.form is not None  # the method is "closed form"
        values = (math.nan,) * len(self.freedoms)
        for i, j in open_.tolist():
            problem = SolverInput(T[i, j], APPROACH, values, True, self.home, self.lower, self.upper)
            q = self.form.solve(problem).q
            self._gauge(T[i, j], np.ascontiguousarray(q), best[i, j : j + 1])

    def _search(self, centres: Array, T: Array, best: Array) -> None:
        """Descents, at the centres that are reachable at all, each beginning where the one before ended."""
        weight = min(max(_LEVER * self.robot.reach, 0.03), 1.0)
        start, distance = cell_map(self.region).nearest(centres, TOLERANCES.closure_position)
        for i in np.flatnonzero(distance <= TOLERANCES.closure_position).tolist():
            q = np.empty((T.shape[1], 1, self.robot.n))
            seek(
                self.robot.model, T[i], self.region.lower, self.region.upper, self.turns, weight, STARTS,
                _EXACT * min(1.0, weight), start[i], q,
            )  # fmt: skip
            self._gauge(T[i], q, best[i])


def _rolls(robot: Robot) -> bool:
    """Whether the last joint turns the tool about its own z axis and does nothing else."""
    axis = fk(robot, robot.q_home)[:3, 2]
    J = jacobian(robot, robot.q_home)[:, -1]
    moved = np.concatenate([J[:3], np.cross(J[3:], axis)])
    return bool(robot.revolute[-1] and np.abs(moved).max() < TOLERANCES.geometry)
