"""What is known of each cube of the map by trying points in it: which are full, which the envelope passes through.

The share of the points tried that are reached estimates the share of the cube that is. Points that are missed by
less than some depth estimate the layer of that thickness around the workspace, and with it the area of its
boundary (Steiner's formula: the layer's volume is area · depth + curvature · depth² + …).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from kin.kernels.compile import jit
from kin.transforms import Array
from kin.workspace.clouds.numbers import Words, fraction, hashed, word
from kin.workspace.facts.atlas import SEEDS, Atlas, Rows, atlas, nearest_from, to_point
from kin.workspace.facts.descent import room
from kin.workspace.region import Region
from kin.workspace.results import Estimate

TRIES = 4  # points per cube that the sampling strategies are built on
ALIKE = 3  # descents that must end alike before a point counts as missed
CLOSE = 1e-3  # of a cube's side: nearer is reached
TOUCH = 1e-4  # of a cube's side: a descent ends there
LAYER = 0.5  # of a cube's side: how far out of the envelope a point may be to be one of its layer
_PROBES = 0xA71A5  # stream of the points tried


@dataclass(frozen=True, eq=False)
class Survey:
    """Distances ``(m, tries)`` of points tried in each cube of the map."""

    map: Atlas
    distance: Array

    @property
    def reached(self) -> Rows:
        """Rows of the cubes in which a point was reached."""
        return np.flatnonzero((self.distance <= CLOSE * self.map.size).any(axis=1))

    @property
    def outer(self) -> Rows:
        """Rows of the cubes in which a point of the layer around the workspace was found."""
        size = self.map.size
        return np.flatnonzero(((self.distance > CLOSE * size) & (self.distance <= LAYER * size)).any(axis=1))


@jit
def _try(
    model: Array, low: Array, high: Array, corners: Array, edge: Array, seeds: Array, key: Words, tolerance: float,
    alike: int, distance: Array,
) -> None:  # fmt: skip
    n = low.shape[0]
    work = room(n)
    q, best, f = np.empty(n), np.empty(n), np.empty(15)
    to_point(f)
    for i in range(distance.shape[0]):
        for t in range(distance.shape[1]):
            place = hashed(key[0], np.uint64(i * distance.shape[1] + t))
            for r in range(3):
                f[9 + r] = corners[i, r] + fraction(hashed(place, np.uint64(r))) * edge[r]
            distance[i, t] = nearest_from(model, low, high, seeds[i], t, f, tolerance, alike, q, best, work)


@lru_cache(maxsize=8)
def survey(region: Region) -> Survey:
    """The survey of a region that the sampling strategies are built on; made in seconds and kept."""
    return _survey_of(region, TRIES, ALIKE)


def _survey_of(region: Region, tries: int, alike: int) -> Survey:
    found = atlas(region)
    distance = np.empty((len(found.corners), tries))
    key = np.array([word(_PROBES, 0)], dtype=np.uint64)
    _try(
        region.robot.model, region.lower, region.upper, found.corners, found.edge, found.seeds, key,
        TOUCH * found.size, alike, distance,
    )  # fmt: skip
    return Survey(found, distance)


def volume_and_surface(region: Region, tries: int) -> tuple[Estimate, Estimate]:
    """Volume (m³) and area (m²) of the points reached, by points tried in each cube of the map."""
    done = _survey_of(region, tries, SEEDS)
    size = done.map.size
    if (done.map.edge == 0.0).any():
        flat = "the workspace is flat"
        return Estimate(0.0, 0.0, flat), Estimate(0.0, 0.0, flat)
    cube = float(np.prod(done.map.edge))
    volume, error = _stratified(np.asarray(done.distance <= TOUCH * size, dtype=np.float64), cube)
    # Layers of two depths, drawn on to depth 0.
    out = done.distance > TOUCH * size
    depth = LAYER * size
    wide = (out & (done.distance <= depth)) / depth
    thin = (out & (done.distance <= 0.5 * depth)) / (0.5 * depth)
    area, spread = _stratified(2.0 * thin - wide, cube)
    bend = cube * float((thin - wide).mean(axis=1).sum())
    tried = f"{done.distance.size} points tried in the {len(done.distance)} cubes of a grid of {size:.3g} m"
    return (
        Estimate(volume, error, tried),
        Estimate(
            area, math.hypot(spread, 0.5 * bend), f"layers of {0.5 * depth:.3g} m and {depth:.3g} m, {tried}"
        ),
    )


def _stratified(values: Array, cube: float) -> tuple[float, float]:
    """The sum of cube · mean over the cubes ``(m, tries)``, and its standard error."""
    total = cube * float(values.mean(axis=1).sum())
    return total, cube * math.sqrt(float(values.var(axis=1, ddof=1).sum()) / values.shape[1])
