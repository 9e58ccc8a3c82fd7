"""Compiled: the configuration whose tool point is nearest to a given point, over several descents."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import jit
from kin.transforms import Array
from kin.workspace.region import BoundedArm
from kin.workspace.search.descent import Scratch, make_scratch, minimise

_SAME = 1e-6  # squared distances that differ by less than this fraction count as equal
_GRAIN = 1e-8  # a descent ends when the next step would lower the squared distance by less than this fraction

Rows = NDArray[np.int64]


class Cells(NamedTuple):
    """Cubes of a `CellMap` as compiled functions take them.

    Attributes:
        corners: ``(m, 3)`` least corner of each cube.
        edge: ``(3,)`` sides of a cube.
        seeds: ``(m, s, n)`` configurations to start descents from.
    """

    corners: Array
    edge: Array
    seeds: Array


@jit
def squared_distance(f: Array) -> None:
    """f ``(15,)`` ← half the squared distance to a point, which the caller puts into f[9:12]."""
    for r in range(15):
        f[r] = 1.0 if r == 0 or r == 4 or r == 8 else 0.0


@jit
def nearest_from(
    arm: BoundedArm, seeds: Array, first: int, f: Array, tolerance: float, alike: int, best: Array, work: Scratch
) -> float:
    """best ``(n,)`` ← the nearest configuration, over descents from the seeds ``(s, n)``; returns its distance.

    Args:
        arm: the arm and its limits.
        seeds: starts, of which `first` is taken first.
        f: from `squared_distance`.
        tolerance: descents end once closer than this.
        alike: they also end when this many ended at the same distance.
        best: result.
        work: from `make_scratch`.
    """
    least = math.inf
    enough = 0.5 * tolerance * tolerance
    ended = 0
    q = work.q
    for k in range(seeds.shape[0]):
        i = (first + k) % seeds.shape[0]
        for j in range(q.shape[0]):
            q[j] = seeds[i, j]
        height = minimise(arm, f, enough, _GRAIN, q, work)
        same = abs(height - least) <= _SAME * least
        ended = ended + 1 if same else ended
        if height < least:
            ended = ended if same else 1
            least = height
            for j in range(q.shape[0]):
                best[j] = q[j]
        if least <= enough or ended >= alike:
            break
    return math.sqrt(2.0 * max(least, 0.0))


@jit
def nearest_each(
    arm: BoundedArm, p: Array, rows: Rows, seeds: Array, tolerance: float, alike: int, q: Array, distance: Array
) -> None:
    """q ``(k, n)``, distance ``(k,)`` ← the nearest configuration to each point ``(k, 3)``.

    Args:
        arm: the arm and its limits.
        p: points.
        rows: row of each point in `seeds`, −1 to leave q and distance as they are.
        seeds: ``(m, s, n)`` starts.
        tolerance, alike: as of `nearest_from`.
        q: on entry a start that is tried before the seeds, or NaN; with `alike` 1 it is the only one.
        distance: result.
    """
    n = q.shape[1]
    work = make_scratch(n)
    f, guess = np.empty(15), np.empty((1, n))
    squared_distance(f)
    for i in range(p.shape[0]):
        if rows[i] < 0:
            continue
        f[9], f[10], f[11] = p[i, 0], p[i, 1], p[i, 2]
        near = math.inf
        if not math.isnan(q[i, 0]):
            for j in range(n):
                guess[0, j] = q[i, j]
            near = nearest_from(arm, guess, 0, f, tolerance, alike, q[i], work)
        if near > tolerance and (alike > 1 or near == math.inf):
            for j in range(n):
                guess[0, j] = q[i, j]
            distance[i] = nearest_from(arm, seeds[rows[i]], 0, f, tolerance, alike, q[i], work)
            if distance[i] <= near:
                continue
            for j in range(n):
                q[i, j] = guess[0, j]
        distance[i] = near
