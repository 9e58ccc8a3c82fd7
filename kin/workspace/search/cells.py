"""A map of the workspace in cubic cells, each with configurations to start descents from.

Half a million evenly spread configurations are sorted into a grid of cubes by the points they reach, and a few
configurations per cube are kept. Descents from those of its cube (:mod:`kin.workspace.search.descent`) then decide
whether a point can be reached, or find the reachable point nearest to it. A ring of cubes around the occupied ones
belongs to the map too, with the configurations of their neighbours: parts of the workspace that the spread
configurations just missed are found that way.

Limits of the method: a descent may end at an inner barrier, a fold of the arm that another start would have
avoided, and count a reachable point as missed; with `SEEDS` starts that is rare. A part of the workspace farther
than a cube from every point of the spread configurations is not found at all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.ik.problem import never_cancel
from kin.kernels.compile import jit
from kin.transforms import Array
from kin.workspace.region import Region
from kin.workspace.sampling.kernels import Points, configurations_of, sample_points
from kin.workspace.sampling.streams import joint_streams
from kin.workspace.search.nearest import Cells, Rows, nearest_each

SPREAD = 1 << 19  # configurations the map is made from
CELLS = 24  # along the longest side
SEEDS = 8  # configurations kept per cube
_SHARED = 2  # configurations a cube passes on to each neighbour
_FLAT = 1e-9  # fraction of the longest side: the workspace is flat along a shorter one
_BLOCK = 1 << 16
_POINTS = 1 << 11  # whose nearest configurations are searched between two calls of `cancel`


@dataclass(frozen=True, eq=False)
class CellMap:
    """The map of a region.

    Attributes:
        region: the region it belongs to.
        origin, edge: ``(3,)`` corner of the grid and sides of a cube; 0 along which the workspace is flat.
        table: ``(a, b, c)`` row of each cube in the arrays below, −1 for one that is not in the map.
        corners: ``(m, 3)`` least corner of each cube.
        seeds: ``(m, SEEDS, n)`` configurations to start from.
        occupied: ``(m,)`` whether a spread configuration reached the cube, not only a neighbour of it.
        cancel: called now and then by long searches; raises to cancel them.
    """

    region: Region
    origin: Array
    edge: Array
    table: Rows
    corners: Array
    seeds: Array
    occupied: NDArray[np.bool_]
    cancel: Callable[[], None] = never_cancel

    @property
    def size(self) -> float:
        """Side of a cube, m."""
        return float(self.edge.max())

    def cancelled_by(self, cancel: Callable[[], None]) -> CellMap:
        """The same map, whose searches call `cancel`."""
        return replace(self, cancel=cancel)

    def cells(self, rows: Rows | slice = slice(None)) -> Cells:
        """Some cubes of the map, all by default, as compiled functions take them."""
        return Cells(self.corners[rows], self.edge, self.seeds[rows])

    def rows(self, p: Array) -> Rows:
        """The rows of the cubes that hold points ``(k, 3)``, −1 for a point outside of the map."""
        steep = np.asarray(self.edge > 0.0)
        place = np.floor((p - self.origin) / np.where(steep, self.edge, 1.0)).astype(np.int64)
        place[:, ~steep] = 0
        inside = np.asarray(((place >= 0) & (place < self.table.shape)).all(axis=1))
        x, y, z = np.where(inside[:, None], place, 0).T
        return np.where(inside, self.table[x, y, z], -1)

    def nearest(
        self, p: Array, tolerance: float, alike: int = SEEDS, guess: Array | None = None
    ) -> tuple[Array, Array]:
        """For points ``(k, 3)`` the nearest configuration found ``(k, n)``, and its distance ``(k,)``.

        Descents start at the `guess` ``(k, n)`` where it is not NaN, then at the cube's configurations; they end
        once closer than `tolerance`, or when `alike` of them ended at the same distance. Points outside of the map
        have an infinite distance and NaN configurations.
        """
        rows = self.rows(p)
        q = np.full((len(p), self.region.robot.n), math.nan) if guess is None else guess.copy()
        distance = np.full(len(p), math.inf)
        p = np.ascontiguousarray(p)
        for start in range(0, len(p), _POINTS):
            self.cancel()
            some = slice(start, start + _POINTS)
            nearest_each(
                self.region.arm, p[some], rows[some], self.seeds, tolerance, alike, q[some], distance[some]
            )
        q[rows < 0] = math.nan
        return q, distance


class _Grid(NamedTuple):
    """Cubes over the points that spread configurations reach, with a ring of empty ones around.

    Attributes:
        origin, edge: as of `CellMap`.
        shape: ``(3,)`` cubes along each axis.
    """

    origin: Array
    edge: Array
    shape: tuple[int, int, int]


@lru_cache(maxsize=8)
def cell_map(region: Region) -> CellMap:
    """The map of a region; made in a tenth of a second and cached."""
    streams = joint_streams(0, region.movable, quasi=True)
    cloud = np.empty((SPREAD, 3), dtype=np.float32)
    for start in range(0, SPREAD, _BLOCK):
        sample_points(region.arm, streams, start, cloud[start : start + _BLOCK])
    grid = _grid_over(cloud)
    held = np.full((*grid.shape, SEEDS), -1, dtype=np.int64)
    _first_in_each(cloud, grid, held)
    picked, inside = _with_neighbours(held)
    table = np.full(grid.shape, -1, dtype=np.int64)
    table[inside] = np.arange(int(inside.sum()))
    index = picked.reshape(-1).astype(np.uint64)
    q = np.empty((len(index), region.robot.n))
    configurations_of(region.arm, streams, index, q)
    return CellMap(
        region=region,
        origin=grid.origin,
        edge=grid.edge,
        table=table,
        corners=np.ascontiguousarray(grid.origin + np.argwhere(inside) * grid.edge),
        seeds=q.reshape(-1, SEEDS, region.robot.n),
        occupied=held[inside][:, 0] >= 0,
    )


def _grid_over(cloud: Points) -> _Grid:
    """The grid over points ``(SPREAD, 3)``."""
    low, high = cloud.min(axis=0).astype(np.float64), cloud.max(axis=0).astype(np.float64)
    side = float((high - low).max()) / CELLS
    steep = high - low > max(_FLAT, 1e-6) * side * CELLS
    edge = np.where(steep, side, 0.0)
    # A ring of empty cubes around, so that every cube has neighbours.
    origin = np.where(steep, low - side, 0.5 * (low + high))
    shape = np.where(steep, np.ceil((high - low) / max(side, 1e-300)) + 2, 1).astype(np.int64)
    a, b, c = shape.tolist()
    return _Grid(origin, edge, (a, b, c))


@jit
def _first_in_each(cloud: Points, grid: _Grid, held: Rows) -> None:
    """held ``(a, b, c, SEEDS)`` ← indices of the first points ``(k, 3)`` in each cube, where there are any."""
    count = np.zeros(grid.shape, dtype=np.int64)
    place = np.zeros(3, dtype=np.int64)
    for i in range(cloud.shape[0]):
        for r in range(3):
            if grid.edge[r] > 0.0:
                cube = math.floor((cloud[i, r] - grid.origin[r]) / grid.edge[r])
                place[r] = min(max(cube, 0), grid.shape[r] - 1)
        a, b, c = place[0], place[1], place[2]
        if count[a, b, c] < held.shape[3]:
            held[a, b, c, count[a, b, c]] = i
            count[a, b, c] += 1


def _with_neighbours(held: Rows) -> tuple[Rows, NDArray[np.bool_]]:
    """Seeds ``(m, SEEDS)`` of every cube that is occupied or next to one, its own first, and which these are."""
    padded = np.pad(held[..., :_SHARED], ((1, 1), (1, 1), (1, 1), (0, 0)), constant_values=-1)
    a, b, c = held.shape[:3]
    shifts = sorted(np.ndindex(3, 3, 3), key=lambda s: sum(abs(i - 1) for i in s))
    shared = [padded[i : i + a, j : j + b, k : k + c] for i, j, k in shifts[1:]]
    choice = np.concatenate([held, *shared], axis=-1)
    inside = np.asarray((choice >= 0).any(axis=-1))
    choice = choice[inside]
    # Those that exist, in order, repeated from the first where there are too few.
    order = np.argsort(choice < 0, axis=1, kind="stable")
    choice = np.take_along_axis(choice, order, axis=1)
    count = (choice >= 0).sum(axis=1, keepdims=True)
    return np.take_along_axis(choice, np.arange(SEEDS) % count, axis=1), inside
