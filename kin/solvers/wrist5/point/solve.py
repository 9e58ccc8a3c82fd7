"""The solver for a tool point alone, as :mod:`kin.solvers.wrist5.closed_form` calls it."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import excess, nearest_image
from kin.solvers.canonical import at_every_turn
from kin.solvers.common import HIGH, LOW
from kin.solvers.contract import Candidates, Obstacle, RedundancyParameter, SolverInput
from kin.solvers.wrist5.geometry import Geometry
from kin.solvers.wrist5.point.constants import REACH
from kin.solvers.wrist5.point.planes import planes_of
from kin.solvers.wrist5.point.search import explore
from kin.solvers.wrist5.point.theta5 import theta5_intervals, window
from kin.transforms import Array

REDUNDANCIES = (RedundancyParameter("theta4", "θ4", joint=3), RedundancyParameter("theta5", "θ5", joint=4))


def solve(geometry: Geometry, problem: SolverInput) -> Candidates:
    """Per branch, the configuration that brings the tool point to the target's and is nearest to the seed.

    `problem.values` are θ4 and θ5 as joint values, kept exactly where they are numbers. If nothing is inside the
    limits, the rows hold the configurations found that exceed them least. If the point is out of reach they are
    NaN and `gap` is the distance; if only the given values prevent a solution, `gap` is 0.

    Returns:
        Candidates: `values` ``(8, 2)``: θ4, θ5 used; `arcs[0]`: every θ4 inside the limits for which some θ5 (or
        the given one) is feasible; `arcs[1]`: every θ5 inside the limits that is, with the θ4 used. Radians.
    """
    g = geometry
    out, none = np.full((8, 5), math.nan), np.empty((0, 3))
    k = _constants(g, problem.T)
    gap = _gap(k)
    if gap > REACH:
        return Candidates(out, out[:, 3:], (none, none), gap, Obstacle("point"))
    box = np.array([problem.seed, problem.lower, problem.upper]) + g.offset
    if not problem.respect_limits:
        box[LOW], box[HIGH] = -math.inf, math.inf
    held = {j: float(problem.values[j - 3] + g.offset[j]) for j in (3, 4) if not math.isnan(problem.values[j - 3])}
    answer = np.full((8, 6), math.nan)
    turns = _search(k, box, held, answer)
    tilts: list[tuple[int, float, float]] = []
    for branch in _found(answer):
        out[branch] = answer[branch, :5] - g.offset
        for j in held:
            out[branch, j] = problem.values[j - 3]
        tilts += _theta5_of(k, branch, answer[branch], box)
    arcs = tuple(
        at_every_turn(rows, float(box[LOW, j]), float(box[HIGH, j])) - np.array([0.0, g.offset[j], g.offset[j]])
        for rows, j in ((turns, 3), (np.array(tilts, dtype=np.float64).reshape(-1, 3), 4))
    )
    obstacle = Obstacle("given joint values") if np.isnan(out).all() else None
    return Candidates(out, out[:, 3:], arcs, 0.0, obstacle)


def _search(k: Array, box: Array, held: dict[int, float], answer: Array) -> Array:
    """answer ``(8, 6)`` ← the best configuration of each branch, given joints held; returns the feasible θ4."""
    own = box.copy()
    for j, value in held.items():
        own[LOW:, j] = value
    turns = explore(k, own, own[LOW:], False, answer)
    if 3 in held:
        free = own.copy()
        free[LOW:, 3] = box[LOW:, 3]
        turns = explore(k, free, free[LOW:], False, np.full((8, 6), math.nan))
    if 4 in held and excess(held[4], box[LOW, 4], box[HIGH, 4]) > 0.0:
        turns = turns[:0]
    if not _found(answer):
        # Nothing is inside the limits: drop those of one joint after the other, then all, for the least excess.
        for joints in ((0,), (1,), (2,), (3,), (4,), (0, 1, 2, 3, 4)):
            free = own.copy()
            for j in set(joints) - set(held):
                free[LOW, j], free[HIGH, j] = -math.inf, math.inf
            if len(joints) == 1 or not _found(answer):
                explore(k, free, own[LOW:], True, answer)
    return turns


def _theta5_of(k: Array, branch: int, row: Array, box: Array) -> list[tuple[int, float, float]]:
    """The feasible θ5 of one branch at the θ4 of its answer, row ``(6,)``."""
    planes, pieces = np.empty((17, 7)), np.empty((128, 4))
    planes = planes[: planes_of(k, box[LOW], box[HIGH], planes)]
    n = theta5_intervals(k, row[3], planes, box, pieces)
    rows = [(branch, low, high) for name, low, high, _ in pieces[:n].tolist() if name == branch]
    if not rows and all(excess(row[i], box[LOW, i], box[HIGH, i]) == 0.0 for i in range(5)):
        # At the end of θ4's interval a single θ5 is left, which rounding may hide.
        start, stop = window(box[LOW, 4], box[HIGH, 4])
        t5 = float(nearest_image(row[4], 0.5 * (start + stop), start, stop))
        rows = [(branch, t5, t5)]
    return rows


def _found(answer: Array) -> list[int]:
    """The branches that answer ``(8, 6)`` has a configuration of."""
    return [branch for branch, cost in enumerate(answer[:, 5].tolist()) if not math.isnan(cost)]


def _constants(g: Geometry, T: Array) -> Array:
    """The constants of a problem ``(10,)``, see `kin.solvers.wrist5.point.constants`."""
    x, y, z = (g.inverse_base[:3, :3] @ T[:3, 3] + g.inverse_base[:3, 3]).tolist()
    square = x * x + y * y + z * z + g.a1**2 - g.a2**2 - g.d4**2 - g.d6**2
    return np.array([g.a1, g.a2, g.d4, g.d6, x, y, -z, math.hypot(x, y), math.atan2(y, x), square])


def _gap(k: Array) -> float:
    """Metres by which the point is out of reach, without joint limits; not positive if it is within.

    The wrist centre reaches the annulus |a2 − d4| … a2 + d4 about (a1, 0) of any plane through axis 1, and the
    tool every direction from it: the point must be d6 from the annulus' nearest point at most, and from its
    farthest at least.
    """
    a1, a2, d4, d6, _, _, h, r, _, _ = k.tolist()
    outer, inner = a2 + d4, abs(a2 - d4)
    shorter, longer = math.hypot(r - abs(a1), h), math.hypot(r + abs(a1), h)
    nearest = max(0.0, min(max(shorter - outer, inner - shorter), max(longer - outer, inner - longer)))
    return float(max(nearest - abs(d6), abs(d6) - (longer + outer)))
