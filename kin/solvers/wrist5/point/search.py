"""The feasible set of θ4, and on each branch the feasible configuration nearest to the seed.

A box ``(3, 5)`` has the seed and the joint limits as rows NEAR, LOW, HIGH, canonical angles.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from itertools import pairwise

import numpy as np

from kin.angles import nearest_image
from kin.kernels.compile import jit
from kin.solvers.canonical import merged
from kin.solvers.common import HIGH, LOW, NEAR, nearest_in_arcs
from kin.solvers.wrist5.point.configuration import branch_at, fits, keep_best
from kin.solvers.wrist5.point.constants import AMBIGUOUS, BRANCH, END, INSET, JOINT, RAD, SHEET, START, M
from kin.solvers.wrist5.point.newton import move_near
from kin.solvers.wrist5.point.planes import planes_of
from kin.solvers.wrist5.point.theta4 import find_spots
from kin.solvers.wrist5.point.theta5 import theta5_intervals, window
from kin.transforms import Array

_SAME = 1e-11  # rad; values of θ4 closer than this are one


@jit
def _gather(k: Array, spots: Array, box: Array, limits: Array, best: Array, ends: Array) -> int:
    """ends ``(n, 2)`` ← (θ4, branch) of the feasible spots, with the elbow on either side; returns their number.

    best ``(8, 6)`` ← per branch the configuration nearest to the seed, see `keep_best`.
    """
    q = np.empty(5)
    start, stop = window(box[LOW, 3], box[HIGH, 3])
    count = 0
    for i in range(2 * spots.shape[0]):
        j = i // 2
        sheet = (0 if spots[j, 2] >= 0.0 else 2) + i % 2
        if count < ends.shape[0] and fits(k, spots[j, 0], spots[j, 1], sheet, box, q):
            keep_best(k, q, box[NEAR], limits, best)
            ends[count, 0] = min(max(nearest_image(q[3], 0.5 * (start + stop), start, stop), start), stop)
            ends[count, 1] = branch_at(k, q)
            count += 1
    return count


@jit
def _probe(k: Array, turns: Array, planes: Array, box: Array, limits: Array, seen: Array, best: Array) -> None:
    """seen ← for each θ4 in turns the branches with a feasible θ5, one bit each; best as in `_gather`."""
    q, rows = np.empty(5), np.empty((128, 4))
    for i in range(turns.shape[0]):
        mask = 0
        for j in range(theta5_intervals(k, turns[i], planes, box, rows)):
            mask |= 1 << int(rows[j, BRANCH])
            # Two values of each interval: its middle, and the one nearest to the seed, slightly inside.
            middle, half = 0.5 * (rows[j, START] + rows[j, END]), 0.5 * (rows[j, END] - rows[j, START])
            half -= min(half, INSET)
            for t5 in (middle, min(max(box[NEAR, 4], middle - half), middle + half)):
                if fits(k, turns[i], t5, int(rows[j, SHEET]), box, q):
                    keep_best(k, q, box[NEAR], limits, best)
        seen[i] = mask


@jit
def _refine(k: Array, best: Array, box: Array, limits: Array, relaxed: bool, answer: Array) -> None:
    """Move the configurations in best, and the seed, towards the seed within the box; keep the best in answer.

    With `relaxed`, the box is wider than `limits` ``(2, 5)``, and they are moved towards these instead.
    """
    q, floor, ceiling, aims = np.empty(5), np.empty(5), np.empty(5), np.empty((2, 5))
    near, low, high = box[NEAR], box[LOW], box[HIGH]
    for i in range(5):
        for j in range(2):
            aims[j, i] = limits[j, i] if relaxed else near[i]
    for row in range(9):
        if row < 8 and math.isnan(best[row, 5]):
            continue
        for i in range(5):
            q[i] = best[row, i] if row < 8 else near[i]
        if row < 8:
            keep_best(k, q, near, limits, answer)
        for i in range(5):
            q[i] = min(max(q[i], low[i]), high[i])
            floor[i], ceiling[i] = low[i], high[i]
            if row < 8 and (i == 2 or i == 4):
                # Stay on the branch: it is named by the signs of sin θ3 and sin θ5.
                turn = math.floor(q[i] / math.pi)
                floor[i], ceiling[i] = max(low[i], turn * math.pi), min(high[i], (turn + 1.0) * math.pi)
        if move_near(k, aims, floor, ceiling, q):
            keep_best(k, q, near, limits, answer)


def explore(k: Array, box: Array, limits: Array, relaxed: bool, answer: Array) -> Array:
    """Write the best configurations inside the box into answer ``(8, 6)``; returns the feasible θ4 ``(k, 3)``.

    With `relaxed`, the box is wider than `limits` ``(2, 5)``, and the best are those nearest to these.
    """
    planes, best, seen = np.empty((17, 7)), np.full((8, 6), math.nan), np.empty(512)
    spots, found = np.empty((2048, 3)), np.empty((256, 2))
    planes = planes[: planes_of(k, box[LOW], box[HIGH], planes)]
    n = find_spots(k, planes, box, spots)
    n = _gather(k, spots[:n], box, limits, best, found)
    ends = [(t4, int(branch)) for t4, branch in found[:n].tolist()]
    edges = _edges(k, planes.tolist(), *window(box[LOW, 3], box[HIGH, 3]))
    _probe(k, np.array(edges), planes, box, limits, seen, best)
    masks = seen[: len(edges)].tolist()
    ends += [(t4, b) for t4, mask in zip(edges, masks, strict=True) for b in range(8) if int(mask) >> b & 1]
    ends.sort()
    marks: list[float] = []
    for t4, _ in ends:
        if not marks or t4 - marks[-1] > _SAME:
            marks.append(t4)
    middles = np.array([0.5 * (a + b) for a, b in pairwise(marks)])
    _probe(k, middles, planes, box, limits, seen, best)
    rows = _intervals(ends, marks, [int(mask) for mask in seen[: len(middles)].tolist()])
    _probe(k, _nearest(rows, float(box[NEAR, 3])), planes, box, limits, seen, best)
    _refine(k, best, box, limits, relaxed, answer)
    return rows


def _intervals(ends: list[tuple[float, int]], marks: list[float], seen: list[int]) -> Array:
    """Rows (branch, low, high) from the possible ends of intervals, branch after branch.

    ends: (θ4, branch), sorted; 8 is added to a branch of which a sign is a matter of rounding. marks: their
    distinct values. seen: between each two marks, the feasible branches, one bit each.
    """
    spans = [(mask, *span) for mask, span in zip(seen, pairwise(marks), strict=True)]
    rows = merged([(b, low, high) for b in range(8) for mask, low, high in spans if mask >> b & 1], 0.0)
    for t4, name in ends:
        i = bisect_right(marks, t4) - 1
        around = [mask for mask in (seen[i - 1 : i] if i else []) + seen[i : i + 1] if mask]
        # An isolated point; where branches meet, its name is a matter of rounding.
        alone = not any(mask >> name % 8 & 1 for mask in around) if name < 8 else not around
        if alone and (name % 8, marks[i], marks[i]) not in rows:
            rows.append((name % 8, marks[i], marks[i]))
    return np.array(sorted(rows), dtype=np.float64).reshape(-1, 3)


def _nearest(rows: Array, preferred: float) -> Array:
    """Of each branch with an interval the value nearest to `preferred`."""
    names = rows[:, 0].tolist()
    spans = pairwise([*map(names.index, dict.fromkeys(names)), len(names)])
    return np.array([nearest_in_arcs(rows, *span, preferred) for span in spans])


def _edges(k: Array, planes: list[list[float]], start: float, stop: float) -> list[float]:
    """θ4 at its limits and, where a boundary is vertical all along, at the quarter turns.

    A boundary is vertical with the point on axis 1, or with a limit of θ1 at which the arm's plane contains the
    point.
    """
    out = [start, stop] if stop > start else [start]
    if k[RAD] < AMBIGUOUS or any(plane[JOINT] == 0.0 and abs(plane[M]) < AMBIGUOUS for plane in planes):
        quarters = (nearest_image(0.5 * math.pi * i, 0.5 * (start + stop), start, stop) for i in range(4))
        out += [t4 for t4 in quarters if start <= t4 <= stop]
    return out
