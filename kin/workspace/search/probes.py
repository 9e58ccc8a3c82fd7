"""How full each cell of the map is: the distances from random points in it to the workspace.

The fraction of the points that can be reached estimates how much of the cube belongs to the workspace. Points that
are missed by less than some depth estimate the layer of that thickness around the workspace, and with it the area
of its boundary (Steiner's formula: the layer's volume is area · depth + curvature · depth² + …).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from kin.ik.problem import never_cancel
from kin.kernels.compile import jit
from kin.transforms import Array
from kin.workspace.region import BoundedArm, Region
from kin.workspace.sampling.streams import Words, fraction, hashed, stream_key
from kin.workspace.search.cells import CellMap, cell_map
from kin.workspace.search.descent import make_scratch
from kin.workspace.search.nearest import Cells, Rows, nearest_from, squared_distance

TRIES = 4  # points per cube that the sampling strategies are built on
ALIKE = 3  # descents that have to end alike before a point counts as missed
CLOSE = 1e-3  # of a cube's side: a point that is missed by less counts as reached
TOUCH = 1e-4  # of a cube's side: a descent ends there
LAYER = 0.5  # of a cube's side: thickness of the layer around the workspace
_STREAM = 0xA71A5  # of the random points
_CUBES = 256  # probed between two calls of `stop`


@dataclass(frozen=True, eq=False)
class CellProbes:
    """Distances ``(m, tries)`` from random points in each cube of a map to the workspace."""

    map: CellMap
    distance: Array

    @property
    def reached(self) -> Rows:
        """Rows of the cubes with a point that was reached."""
        return np.flatnonzero((self.distance <= CLOSE * self.map.size).any(axis=1))

    @property
    def outer(self) -> Rows:
        """Rows of the cubes with a point in the layer around the workspace."""
        size = self.map.size
        return np.flatnonzero(((self.distance > CLOSE * size) & (self.distance <= LAYER * size)).any(axis=1))


@jit
def _probe_each(
    arm: BoundedArm, cells: Cells, first: int, key: Words, tolerance: float, alike: int, distance: Array
) -> None:
    """distance ``(m, tries)`` ← from random points of each cube, numbered from `first`, to the workspace."""
    n = arm.lower.shape[0]
    work = make_scratch(n)
    best, f = np.empty(n), np.empty(15)
    squared_distance(f)
    for i in range(distance.shape[0]):
        for t in range(distance.shape[1]):
            place = hashed(key[0], np.uint64((first + i) * distance.shape[1] + t))
            for r in range(3):
                f[9 + r] = cells.corners[i, r] + fraction(hashed(place, np.uint64(r))) * cells.edge[r]
            distance[i, t] = nearest_from(arm, cells.seeds[i], t, f, tolerance, alike, best, work)


@lru_cache(maxsize=8)
def sampling_probes(region: Region) -> CellProbes:
    """The probes that the sampling strategies are built on; made in seconds and cached."""
    return probe_cells(region, TRIES, ALIKE)


def probe_cells(region: Region, tries: int, alike: int, stop: Callable[[], None] = never_cancel) -> CellProbes:
    """Probes with `tries` points per cube; `alike` descents have to end alike before a point counts as missed.

    `stop` is called now and then, and raises to cancel.
    """
    found = cell_map(region)
    distance = np.empty((len(found.corners), tries))
    key = np.array([stream_key(_STREAM, 0)], dtype=np.uint64)
    for first in range(0, len(distance), _CUBES):
        stop()
        some = slice(first, first + _CUBES)
        _probe_each(region.arm, found.cells(some), first, key, TOUCH * found.size, alike, distance[some])
    return CellProbes(found, distance)
