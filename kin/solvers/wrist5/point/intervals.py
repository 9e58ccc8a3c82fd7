"""Intervals of one redundancy parameter as rows (branch, low, high): merging, choosing, whole-turn images."""

from __future__ import annotations

import math
from bisect import bisect_right

import numpy as np

from kin.angles import TURN
from kin.tolerances import TOLERANCES
from kin.transforms import Array

SAME = 1e-11  # rad; values closer than this are one
Row = tuple[int, float, float]


def merge(ends: list[tuple[float, int]], marks: list[float], seen: list[int]) -> list[Row]:
    """Intervals from their possible ends.

    ends: (θ4, branch), sorted; 8 is added to a branch of which a sign is a matter of rounding. marks: their
    distinct values. seen: between each two marks, the feasible branches, one bit each.
    """
    rows: list[Row] = []
    for branch in range(8):
        bit = 1 << branch
        for i, t4 in enumerate(marks[:-1]):
            if seen[i] & bit:
                if rows and rows[-1][0] == branch and rows[-1][2] == t4:
                    rows[-1] = (branch, rows[-1][1], marks[i + 1])
                else:
                    rows.append((branch, t4, marks[i + 1]))
    for t4, name in ends:
        i = bisect_right(marks, t4) - 1
        around = [mask for mask in (seen[i - 1 : i] if i else []) + seen[i : i + 1] if mask]
        # An isolated point; where branches meet, its name is a matter of rounding.
        alone = not any(mask >> name % 8 & 1 for mask in around) if name < 8 else not around
        if alone and (name % 8, marks[i], marks[i]) not in rows:
            rows.append((name % 8, marks[i], marks[i]))
    return rows


def union(rows: list[Row]) -> list[Row]:
    """The intervals of one branch in ascending order; those that overlap or touch become one."""
    out: list[Row] = []
    for branch, low, high in sorted(rows):
        if out and low <= out[-1][2] + SAME:
            out[-1] = (branch, out[-1][1], max(high, out[-1][2]))
        else:
            out.append((branch, low, high))
    return out


def nearest(rows: list[Row], branch: int, preferred: float) -> float:
    """The value nearest to `preferred` in the intervals of a branch, slightly inside; NaN if there is none."""
    values = []
    for name, low, high in rows:
        if name == branch:
            inset = min(TOLERANCES.interval_inset, 0.5 * (high - low))
            values.append(min(max(preferred, low + inset), high - inset))
    return min(values, key=lambda value: abs(value - preferred), default=math.nan)


def as_joint_values(rows: list[Row], limits: Array, offset: float) -> Array:
    """Canonical intervals as joint values ``(k, 3)``, with all whole-turn images inside the limits ``(2,)``."""
    low, high = limits.tolist()
    turns = int((high - low) / TURN) if math.isfinite(high - low) else 0
    images = [
        (branch, a + TURN * turn - offset, min(b + TURN * turn, high) - offset)
        for turn in range(turns + 1)
        for branch, a, b in rows
        if a + TURN * turn <= high
    ]
    return np.array(images, dtype=np.float64).reshape(-1, 3)
