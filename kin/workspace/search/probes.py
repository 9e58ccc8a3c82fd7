"""How full each cell of the map is: the distances from random points in it to the workspace.

The fraction of the points that can be reached estimates how much of the cube belongs to the workspace. Points that
are missed by less than some depth estimate the layer of that thickness around the workspace, and with it the area
of its boundary (Steiner's formula: the layer's volume is area · depth + curvature · depth² + …).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from threading import RLock
from typing import NamedTuple

import numpy as np

from kin.ik.problem import never_cancel
from kin.kernels.compile import jit
from kin.transforms import Array
from kin.workspace.region import BoundedArm, Region
from kin.workspace.sampling.streams import Words, fraction, hashed, stream_key
from kin.workspace.search.cells import CellMap, cell_map
from kin.workspace.search.descent import make_scratch
from kin.workspace.search.extremes import along, base_axis, from_axis, from_point
from kin.workspace.search.nearest import Cells, Rows, nearest_from, squared_distance

TRIES = 4  # points per cube that the sampling strategies are built on
ALIKE = 3  # descents that have to end alike before a point counts as missed
CLOSE = 1e-3  # of a cube's side: a point that is missed by less counts as reached
TOUCH = 1e-4  # of a cube's side: a descent ends there
LAYER = 0.5  # of a cube's side: thickness of the layer around the workspace
_STREAM = 0xA71A5  # of the random points
_CUBES = 256  # probed between two calls of `cancel`


class _Sizes(NamedTuple):
    """What contains the workspace: a point outside of it is out of reach, without a descent.

    Attributes:
        centre, point, axis: ``(3,)`` the shoulder, and joint 1's axis.
        reach, radius: ``(2,)`` least and largest distance from the shoulder, and from the axis.
        low, high: ``(3,)`` the bounding box.
    """

    centre: Array
    point: Array
    axis: Array
    reach: Array
    radius: Array
    low: Array
    high: Array


_UNKNOWN = _Sizes(*np.zeros((3, 3)), *np.zeros((2, 2)), *np.zeros((2, 3)))
_ALL = (math.inf, math.inf)  # what `_probe_each` is asked for where all points are to be probed


@jit
def _outside(p: Array, sizes: _Sizes) -> float:
    """How far a point ``(3,)`` is from the workspace at least, by its sizes."""
    far = square = along = around = 0.0
    for r in range(3):
        far = max(far, max(sizes.low[r] - p[r], p[r] - sizes.high[r]))
        square += (p[r] - sizes.centre[r]) ** 2
        along += (p[r] - sizes.point[r]) * sizes.axis[r]
        around += (p[r] - sizes.point[r]) ** 2
    distance, radius = math.sqrt(square), math.sqrt(max(around - along * along, 0.0))
    far = max(far, max(sizes.reach[0] - distance, distance - sizes.reach[1]))
    far = max(far, max(sizes.radius[0] - radius, radius - sizes.radius[1]))
    return float(far)


@jit
def _probe_each(
    arm: BoundedArm,
    cells: Cells,
    sizes: _Sizes,
    first: int,
    key: Words,
    tolerance: float,
    alike: int,
    wanted: tuple[float, float],
    distance: Array,
) -> None:
    """distance ``(m, tries)`` ← from random points of each cube, numbered from `first`, to the workspace.

    Only entries that are NaN are computed, and in each cube only until one is in ``(wanted[0], wanted[1]]``. They
    stay NaN where the point is farther than that by the sizes.
    """
    n = arm.lower.shape[0]
    work = make_scratch(n)
    best, f = np.empty(n), np.empty(15)
    squared_distance(f)
    least, most = wanted
    for i in range(distance.shape[0]):
        found = False
        for t in range(distance.shape[1]):
            found = found or least < distance[i, t] <= most
        for t in range(distance.shape[1]):
            if found or not math.isnan(distance[i, t]):
                continue
            place = hashed(key[0], np.uint64((first + i) * distance.shape[1] + t))
            for r in range(3):
                f[9 + r] = cells.corners[i, r] + fraction(hashed(place, np.uint64(r))) * cells.edge[r]
            if _outside(f[9:12], sizes) <= most:
                distance[i, t] = nearest_from(arm, cells.seeds[i], t, f, tolerance, alike, best, work)
                found = least < distance[i, t] <= most


@dataclass(frozen=True, eq=False)
class CellProbes:
    """Distances ``(m, tries)`` from random points in each cube of a map to the workspace."""

    map: CellMap
    distance: Array


class SamplingProbes:
    """The probes that the sampling strategies are built on. Each strategy makes those that it needs.

    A strategy asks which cubes have a point at certain distances. So the points of a cube are probed until one is,
    and those that the exact sizes of the workspace put farther away are not probed: most of the points out of
    reach, which take several times as long as the others. Any thread may use it; those that come while it computes
    wait for the result.
    """

    def __init__(self, region: Region) -> None:
        self._region = region
        self._lock = RLock()

    @cached_property
    def map(self) -> CellMap:
        """The map of the region."""
        with self._lock:
            return cell_map(self._region)

    @cached_property
    def reached(self) -> Rows:
        """Rows of the cubes with a point that was reached."""
        return self._rows(-1.0, CLOSE * self.map.size)

    @cached_property
    def outer(self) -> Rows:
        """Rows of the cubes with a point in the layer around the workspace."""
        return self._rows(CLOSE * self.map.size, LAYER * self.map.size)

    @cached_property
    def _distance(self) -> Array:
        return np.full((len(self.map.corners), TRIES), math.nan)

    @cached_property
    def _sizes(self) -> _Sizes:
        point, axis, shoulder = base_axis(self._region)
        box = [along(self._region, direction) for direction in np.eye(3)]
        reach, radius = from_point(self._region, shoulder), from_axis(self._region, point, axis)
        return _Sizes(
            centre=shoulder,
            point=point,
            axis=axis,
            reach=np.array([reach.least.value, reach.largest.value]),
            radius=np.array([radius.least.value, radius.largest.value]),
            low=np.array([span.least.value for span in box]),
            high=np.array([span.largest.value for span in box]),
        )

    def _rows(self, least: float, most: float) -> Rows:
        with self._lock:
            found, key = self.map, np.array([stream_key(_STREAM, 0)], dtype=np.uint64)
            _probe_each(
                self._region.arm,
                found.cells(),
                self._sizes,
                0,
                key,
                TOUCH * found.size,
                ALIKE,
                (least, most),
                self._distance,
            )
            return np.flatnonzero(((self._distance > least) & (self._distance <= most)).any(axis=1))


@lru_cache(maxsize=8)
def sampling_probes(region: Region) -> SamplingProbes:
    """The probes of a region, cached."""
    return SamplingProbes(region)


def probe_cells(region: Region, tries: int, alike: int, cancel: Callable[[], None] = never_cancel) -> CellProbes:
    """Probes with `tries` points per cube; `alike` descents have to end alike before a point counts as missed.

    `cancel` is called now and then, and raises to cancel.
    """
    found = cell_map(region)
    distance = np.full((len(found.corners), tries), math.nan)
    key = np.array([stream_key(_STREAM, 0)], dtype=np.uint64)
    for first in range(0, len(distance), _CUBES):
        cancel()
        some = slice(first, first + _CUBES)
        _probe_each(
            region.arm, found.cells(some), _UNKNOWN, first, key, TOUCH * found.size, alike, _ALL, distance[some]
        )
    return CellProbes(found, distance)
