"""Feasible intervals of θ5 for a given θ4: where a limit is met, where the arm stops closing, tests in between."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN, nearest_image
from kin.kernels.compile import jit
from kin.solvers.common import HIGH, LOW
from kin.solvers.wrist5.point.configuration import branch_at, fits
from kin.solvers.wrist5.point.constants import BRANCH, D6, END, JOINT, P0, PC, PR, PT, RAD, SHEET, START, M
from kin.solvers.wrist5.point.edges import level_roots, stretched
from kin.transforms import Array

_TIGHT = 1e-13  # rad; breaks closer than this are one


@jit
def _breaks(k: Array, t4: float, planes: Array, start: float, end: float, breaks: Array) -> int:
    """breaks ← every θ5 in [start, end] where a limit, the edge of reach or the end of a branch is met."""
    d6, r = k[D6], k[RAD]
    lever, forward = d6 * math.sin(t4), d6 * math.cos(t4)
    breaks[0], breaks[1] = 0.0, math.pi
    count = 2
    for i in range(planes.shape[0]):
        joint, m = planes[i, JOINT], planes[i, M]
        if joint == 1.0 or joint == 2.0:
            level = planes[i, P0], planes[i, PC] * d6, -planes[i, PT] * forward, planes[i, PR]
            count = level_roots(level, r, lever, start, end, breaks, count)
        elif joint <= 0.0 and lever != 0.0 and abs(m) <= abs(lever) * (1.0 + 1e-12):
            t = math.asin(min(max(m / lever, -1.0), 1.0))
            breaks[count], breaks[count + 1] = t, math.pi - t
            count += 2
    return stretched(k, lever, breaks, count)


@jit
def window(low: float, high: float) -> tuple[float, float]:
    """At most one turn of a joint's range: from its lower limit, or from −π if it has none."""
    if not math.isfinite(low):
        low = -math.pi if not math.isfinite(high) else high - TURN
    return low, min(high, low + TURN)


@jit
def _into_window(breaks: Array, count: int, low: float, high: float) -> int:
    """Replace the breaks by their images inside [low, high], add the ends, sort; returns the new number."""
    kept = 0
    for i in range(count):
        x = nearest_image(breaks[i], 0.5 * (low + high), low, high)
        if low <= x <= high:
            breaks[kept] = x
            kept += 1
    breaks[kept], breaks[kept + 1] = low, high
    kept += 2
    for i in range(1, kept):
        moving = breaks[i]
        j = i - 1
        while j >= 0 and breaks[j] > moving:
            breaks[j + 1] = breaks[j]
            j -= 1
        breaks[j + 1] = moving
    return kept


@jit
def _add_piece(rows: Array, found: int, branch: int, low: float, high: float, sheet: int) -> int:
    """Append (branch, low, high, sheet), or extend the last row if it ends at low; returns the number of rows."""
    last = found - 1
    if found > 0 and rows[last, BRANCH] == branch and rows[last, END] == low and rows[last, SHEET] == sheet:
        rows[last, END] = high
    elif found < rows.shape[0]:
        rows[found, BRANCH], rows[found, START] = branch, low
        rows[found, END], rows[found, SHEET] = high, sheet
        found += 1
    return found


@jit
def theta5_intervals(k: Array, t4: float, planes: Array, box: Array, rows: Array) -> int:
    """rows ``(n, 4)`` ← the feasible θ5 at this θ4, as (branch, start, end, sheet); returns their number."""
    breaks, q = np.empty(256), np.empty(5)
    found = 0
    start, end = window(box[LOW, 4], box[HIGH, 4])
    count = _into_window(breaks, _breaks(k, t4, planes, start, end, breaks), start, end)
    for sheet in range(4):
        inside = False
        alone = -1
        last = math.nan
        for i in range(count):
            t5 = breaks[i]
            if inside and t5 - last < _TIGHT:
                continue
            feasible = fits(k, t4, t5, sheet, box, q)
            here = branch_at(k, q) % 8 if feasible else -1
            joined = feasible and inside and fits(k, t4, 0.5 * (last + t5), sheet, box, q)
            # A feasible break between two infeasible pieces is an interval of its own.
            if joined:
                found = _add_piece(rows, found, branch_at(k, q) % 8, last, t5, sheet)
            elif alone >= 0:
                found = _add_piece(rows, found, alone, last, last, sheet)
            alone = -1 if joined else here
            inside, last = feasible, t5
        if alone >= 0:
            found = _add_piece(rows, found, alone, last, last, sheet)
    return found
