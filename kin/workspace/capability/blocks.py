"""Capability map: from which directions the tool can approach each place of the workspace, and how well.

The bounding box of the workspace is divided into cubes, voxels, and the arm is evaluated at the centre of each
(Zacharias, Borst and Hirzinger, Capturing robot workspace structure, IROS 2007):

- **reachable**: whether the tool point can be at the centre, whatever the orientation;
- **approachable**: for each direction of a spherical design (:mod:`kin.workspace.capability.sphere`), whether the
  tool point can be at the centre with the tool's z axis along it, for at least one roll about it; the **share** of
  these directions;
- **manipulability**: the best `kin.manipulability` among the configurations that were evaluated.

All inside the limits. :mod:`kin.workspace.capability.evaluation` describes how the directions are decided and how
far a negative answer can be trusted. Whether a centre that no direction of the set fits is reachable is decided by
:mod:`kin.workspace.search.cells`, whose misses are rare.

The grid is fixed once; its blocks are independent of each other and can be computed anywhere, in any order:
`capability_block` gives the same bits in every process on one kind of processor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kin.errors import InputError, finite_number
from kin.fk import manipulability
from kin.ik.options import JointConstraints, Limits, Locks
from kin.named import robot_of
from kin.robot import Robot
from kin.tolerances import TOLERANCES
from kin.transforms import Array
from kin.workspace.capability.evaluation import Method, evaluator
from kin.workspace.capability.sphere import spherical_design
from kin.workspace.region import Region, checked_integer
from kin.workspace.search.cells import cell_map
from kin.workspace.search.extremes import along

Rows = NDArray[np.int64]

MOST = 1 << 24  # voxels of a grid
_TARGETS = 1 << 14  # of a block, about


@dataclass(frozen=True, repr=False)
class CapabilityGrid:
    """The voxels and directions of a map: plain data, equal and hashable by value, can be sent to another process.

    Attributes:
        robot: the arm.
        bounds: (lower, upper) of each joint, equal for a locked one, infinite for one without limits.
        origin: least corner of the grid, m.
        voxel: side of a voxel, m.
        shape: voxels along x, y, z.
        count: number of directions.
    """

    robot: Robot
    bounds: tuple[tuple[float, float], ...]
    origin: tuple[float, float, float]
    voxel: float
    shape: tuple[int, int, int]
    count: int

    def __repr__(self) -> str:
        """The arm, the voxels and the number of directions."""
        shape = " × ".join(map(str, self.shape))
        return f"CapabilityGrid({self.robot.id!r}, {shape} voxels of {self.voxel:.4g} m, {self.count} directions)"

    def __getstate__(self) -> dict[str, object]:
        """The fields alone: the cached list of blocks is not sent along."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @property
    def directions(self) -> Array:
        """The approach directions ``(m, 3)``, unit vectors."""
        return spherical_design(self.count)

    @property
    def method(self) -> Method:
        """How the directions are decided, see :mod:`kin.workspace.capability.evaluation`."""
        return evaluator(self.robot, self.bounds, self.count).method

    @cached_property
    def blocks(self) -> tuple[range, ...]:
        """The voxels of each block, by their numbers in C order."""
        total, size = math.prod(self.shape), max(1, _TARGETS // self.count)
        return tuple(range(start, min(start + size, total)) for start in range(0, total, size))

    def index(self, numbers: Rows) -> Rows:
        """Where voxels are in the grid.

        Args:
            numbers: ``(k,)`` of the voxels, in C order, as in `blocks`.

        Returns:
            Indices ``(k, 3)`` along x, y and z, from 0.

        Raises:
            ValueError: a number that no voxel of the grid has.

        Examples:
            >>> import kin, numpy as np
            >>> grid = kin.workspace.capability_grid("planar2r", resolution=6, directions=12)
            >>> grid.index(np.array([0, 1])).shape
            (2, 3)
        """
        return np.stack(np.unravel_index(numbers, self.shape), axis=-1).astype(np.int64)

    def centres(self, index: Rows) -> Array:
        """The points at which the arm is evaluated.

        Args:
            index: ``(k, 3)`` of the voxels, along x, y and z, from 0.

        Returns:
            Centres ``(k, 3)`` in metres, in the world frame.

        Examples:
            >>> import kin, numpy as np
            >>> grid = kin.workspace.capability_grid("planar2r", resolution=6, directions=12)
            >>> bool(np.allclose(grid.centres(np.zeros((1, 3))), np.array(grid.origin) + grid.voxel / 2))
            True
        """
        return np.asarray(np.array(self.origin) + (index + 0.5) * self.voxel)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CapabilityBlock:
    """The reachable voxels of one block.

    Attributes:
        block: its index in `CapabilityGrid.blocks`.
        numbers: ``(k,)`` of the voxels, ascending.
        approachable: ``(k, m)`` which directions.
        manipulability: ``(k,)`` the best.
    """

    block: int
    numbers: Rows
    approachable: NDArray[np.bool_]
    manipulability: NDArray[np.float32]

    def __repr__(self) -> str:
        """Its index, and how many of its voxels can be reached."""
        return f"CapabilityBlock({self.block}, {len(self.numbers)} voxels)"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CapabilityMap:
    """The reachable voxels of a grid and their values; flat arrays, read-only.

    Attributes:
        grid: voxels and directions: `grid.origin`, `grid.voxel`, `grid.shape`, `grid.directions`, `grid.method`.
        index: ``(k, 3)`` place of each voxel in the grid.
        centres: ``(k, 3)`` their centres, m.
        approachable: ``(k, m)`` which of the grid's directions.
        share: ``(k,)`` of the directions, 0 to 1; 0 where the point is reachable with other directions only.
        manipulability: ``(k,)`` the best found.
        volume: of the reachable voxels, m³.
    """

    grid: CapabilityGrid
    index: Rows
    centres: Array
    approachable: NDArray[np.bool_]
    share: NDArray[np.float32]
    manipulability: NDArray[np.float32]
    volume: float

    def __repr__(self) -> str:
        """The grid, and how much of it can be reached."""
        return f"CapabilityMap({len(self.index)} voxels, {self.volume:.4g} m³, of {self.grid!r})"


def capability_grid(
    robot: Robot | str,
    *,
    voxel: float | None = None,
    resolution: int = 25,
    limits: Limits | None = None,
    locked: Locks | None = None,
    constraints: JointConstraints | None = None,
    directions: int = 48,
) -> CapabilityGrid:
    """The grid over the bounding box of the points the tool reaches.

    Args:
        robot: the arm, or the id of a built-in one.
        voxel: side of a voxel in metres; None to derive it from `resolution`.
        resolution: voxels along the longest side of the box, 1 to 256.
        limits, locked: as in `kin.JointConstraints`.
        constraints: both as one value, instead of `limits` and `locked`.
        directions: 12, 24, 48 or 96, see `kin.workspace.capability.sphere.spherical_design`.

    Returns:
        The grid, whose blocks are computed one by one.

    Raises:
        InputError: naming the wrong argument; also a voxel so small that there would be more than 2²⁴.

    Examples:
        >>> import kin
        >>> len(kin.workspace.capability_grid("planar2r", resolution=6, directions=12).blocks) > 0
        True
    """
    spherical_design(directions)
    robot, allowed = robot_of(robot), JointConstraints.of(limits, locked, constraints)
    lower, upper, _ = allowed.bounds(robot)
    bounds = tuple(zip(lower.tolist(), upper.tolist(), strict=True))
    count = checked_integer("resolution", resolution, 1, 256, "a whole number from 1 to 256")
    region = Region.finite(robot, allowed)
    box = [along(region, axis) for axis in np.eye(3)]
    low, high = (np.array([getattr(span, end).value for span in box]) for end in ("least", "largest"))
    size = high - low
    # Slightly more than the box: voxels that only touch its ends would be an empty layer.
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

    Args:
        grid: from `capability_grid`.
        block: index of the block.

    Returns:
        The voxels of the block.

    Raises:
        InputError: there is no such block.

    Examples:
        >>> import kin
        >>> grid = kin.workspace.capability_grid("planar2r", resolution=6, directions=12)
        >>> kin.workspace.capability_block(grid, 0).block
        0
    """
    number = checked_integer(
        "block", block, 0, len(grid.blocks) - 1, f"a whole number from 0 to {len(grid.blocks) - 1}"
    )
    arm = evaluator(grid.robot, grid.bounds, grid.count)
    voxels = grid.blocks[number]
    numbers = np.arange(voxels.start, voxels.stop, dtype=np.int64)
    centres = grid.centres(grid.index(numbers))
    best = arm.best(centres)
    found = best.max(axis=1)
    # Where no direction of the set fits, one in between may.
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
    """The map of a grid from its blocks, in any order; from some of the blocks, the map of these.

    Args:
        grid: from `capability_grid`.
        blocks: from `capability_block` with this grid.

    Returns:
        The map.

    Examples:
        >>> import kin
        >>> grid = kin.workspace.capability_grid("planar2r", resolution=6, directions=12)
        >>> blocks = [kin.workspace.capability_block(grid, i) for i in range(len(grid.blocks))]
        >>> bool(kin.workspace.capability_join(grid, blocks).share.max() > 0.0)
        True
    """
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
    robot: Robot | str,
    *,
    voxel: float | None = None,
    resolution: int = 25,
    limits: Limits | None = None,
    locked: Locks | None = None,
    constraints: JointConstraints | None = None,
    directions: int = 48,
) -> CapabilityMap:
    """The capability map of an arm, block after block; arguments and errors as of `capability_grid`.

    For threads, progress or several machines, compute the blocks of the grid one by one.

    Args:
        robot: the arm, or the id of a built-in one.
        voxel, resolution, limits, locked, constraints, directions: as in `kin.workspace.capability_grid`.

    Returns:
        The reachable voxels, and the share of directions that each allows.

    Raises:
        InputError: naming the wrong argument.

    Examples:
        >>> import kin
        >>> bool(kin.workspace.capability_map("planar2r", resolution=6, directions=12).share.max() > 0.0)
        True
    """
    allowed = JointConstraints.of(limits, locked, constraints)
    grid = capability_grid(robot, voxel=voxel, resolution=resolution, constraints=allowed, directions=directions)
    return capability_join(grid, (capability_block(grid, block) for block in range(len(grid.blocks))))
