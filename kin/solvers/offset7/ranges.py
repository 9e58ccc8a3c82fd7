"""Kernels that find the values of the given joint at which a branch exists inside the limits, and choose one.

For each branch, one continuous function of the value is positive where the branch is feasible: the least of how
far inside the arm's reach it is and of how far its joints are inside their limits. It is sampled over the joint's
range, and more closely where it comes near zero and where the branch begins to exist. Its zeros are found between
samples of opposite signs, and a peak or a dip between samples that could pass zero is searched for by golden
sections.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.common import HIGH, LOW, NEAR, wrap
from kin.solvers.offset7.branches import all_branches, distances, seen, two_roots
from kin.solvers.offset7.geometry import OFFSET, SIGN
from kin.tolerances import TOLERANCES
from kin.transforms import Array

SAMPLES = 96  # of a whole turn
_LIMIT = TOLERANCES.limit
_INSET = TOLERANCES.interval_inset
_GOLDEN = 0.6180339887498949
_PEAK_STEPS = 24
_ZERO_STEPS = 60
_WIDTH = 1e-12  # rad, to which the end of an interval is found
# How far from an end of the reach the slack is looked at, and the most places where.
_BESIDE = (1e-9, -1e-9, 1e-3, -1e-3)
_MOST_ENDS = 64
_PARTS = 4  # of an interval between samples that is looked at more closely
_EDGE_STEPS = 30
# Shares of such an interval from where a branch begins to exist.
_FROM_EDGE = np.array([0.0, 1e-4, 1e-3, 0.01, 0.03, 0.08, 0.15, 0.25, 0.4, 0.6, 0.8])


@jit
def slack(
    params: Array, T: Array, value: float, box: Array, only: int, rows: Array, room: Array, spare: Array
) -> None:
    """spare ``(8,)`` ← how far each branch is from losing its feasibility at this value of the given joint.

    box ``(3, 7)``: seed and limits as chain angles. `only`, rows ``(8, 7)``, room ``(8,)`` ← as `all_branches`.
    """
    t = box[NEAR].copy()
    t[0] = params[SIGN] * value + params[OFFSET]
    all_branches(params, T, box[NEAR], t, only, rows, room)
    for k in range(8):
        if only >= 0 and k != only:
            continue
        spare[k] = room[k]
        if room[k] < 0.0:
            continue
        for i in range(1, 7):
            half = 0.5 * (box[HIGH, i] - box[LOW, i])
            if half < math.pi:
                inside = half + _LIMIT - abs(wrap(rows[k, i] - 0.5 * (box[HIGH, i] + box[LOW, i])))
                spare[k] = min(spare[k], inside)


@jit
def _at(params: Array, T: Array, value: float, box: Array, work: tuple[Array, Array, Array], k: int) -> float:
    """`slack` of branch k."""
    rows, room, spare = work
    slack(params, T, value, box, k, rows, room, spare)
    return float(spare[k])


@jit
def _zero(
    params: Array, T: Array, box: Array, work: tuple[Array, Array, Array], k: int,
    inside: tuple[float, float], outside: tuple[float, float],
) -> float:  # fmt: skip
    """The feasible side of the zero between two (value, slack) of branch k, by the Illinois method."""
    x, fx = inside
    y, fy = outside
    for step in range(_ZERO_STEPS):
        if abs(y - x) < _WIDTH:
            break
        middle = (x * fy - y * fx) / (fy - fx) if step % 3 < 2 and fx > 0.0 else 0.5 * (x + y)
        if not min(x, y) < middle < max(x, y):
            middle = 0.5 * (x + y)
        f = _at(params, T, middle, box, work, k)
        if f >= 0.0:
            x, fx = middle, f
            fy *= 0.5
        else:
            y, fy = middle, f
            fx *= 0.5
    return x


@jit
def _peak(
    params: Array, T: Array, box: Array, work: tuple[Array, Array, Array], k: int, low: float, high: float,
    sense: float,
) -> tuple[float, float]:  # fmt: skip
    """(value, slack) where the slack of branch k times `sense` is largest in [low, high], or passes zero."""
    x, y = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    fx, fy = sense * _at(params, T, x, box, work, k), sense * _at(params, T, y, box, work, k)
    for _ in range(_PEAK_STEPS):
        if max(fx, fy) > 0.0:
            break
        if fx > fy:
            high, y, fy = y, x, fx
            x = high - _GOLDEN * (high - low)
            fx = sense * _at(params, T, x, box, work, k)
        else:
            low, x, fx = x, y, fy
            y = low + _GOLDEN * (high - low)
            fy = sense * _at(params, T, y, box, work, k)
    return (x, sense * fx) if fx > fy else (y, sense * fy)


@jit
def _at_edge(
    params: Array, T: Array, box: Array, k: int, inside: tuple[float, float], outside: float, arcs: Array,
    found: int,
) -> int:  # fmt: skip
    """Append the interval of branch k, if any, that begins where the branch begins to exist.

    inside: (value, slack) where it exists outside the limits; outside: a value where it does not exist.
    """
    work = (np.empty((8, 7)), np.empty(8), np.empty(8))
    x, y = inside[0], outside
    for _ in range(_ZERO_STEPS):
        middle = 0.5 * (x + y)
        _at(params, T, middle, box, work, k)
        if work[1][k] >= 0.0:
            x = middle
        else:
            y = middle
    f = _at(params, T, x, box, work, k)
    if f < 0.0 or found == arcs.shape[0]:
        return found
    end = _zero(params, T, box, work, k, (x, f), inside)
    arcs[found, 0], arcs[found, 1], arcs[found, 2] = k, min(x, end), max(x, end)
    return found + 1


@jit
def _ranges_of(
    params: Array, T: Array, box: Array, k: int, marks: Array, curves: tuple[Array, Array], arcs: Array, found: int
) -> int:
    """Append the feasible intervals of branch k to arcs.

    marks ``(n,)``: values; curves: the slack there ``(n,)``, and how far inside the arm's reach the branch is.
    """
    samples, there = curves
    work = (np.empty((8, 7)), np.empty(8), np.empty(8))
    n = marks.shape[0]
    start = math.nan
    if samples[0] >= 0.0:
        start = marks[0]
    for i in range(n):
        f = samples[i]
        if 0 < i < n - 1:
            before, after = samples[i - 1], samples[i + 1]
            rise = max(abs(f - before), abs(after - f))
            hump = f < 0.0 and before <= f and after < f and -f < rise
            dip = f >= 0.0 and before >= f and after > f and f < rise and before >= 0.0
            if hump or dip:
                sense = 1.0 if hump else -1.0
                x, fx = _peak(params, T, box, work, k, marks[i - 1], marks[i + 1], sense)
                if hump and fx >= 0.0 and found < arcs.shape[0]:
                    arcs[found, 0] = k
                    arcs[found, 1] = _zero(params, T, box, work, k, (x, fx), (marks[i - 1], before))
                    arcs[found, 2] = _zero(params, T, box, work, k, (x, fx), (marks[i + 1], after))
                    found += 1
                if dip and fx < 0.0 and found < arcs.shape[0]:
                    arcs[found, 0], arcs[found, 1] = k, start
                    arcs[found, 2] = _zero(params, T, box, work, k, (marks[i - 1], before), (x, fx))
                    found += 1
                    start = _zero(params, T, box, work, k, (marks[i + 1], after), (x, fx))
        if i == n - 1:
            break
        after = samples[i + 1]
        if f < 0.0 and after < 0.0 and there[i] >= 0.0 > there[i + 1]:
            found = _at_edge(params, T, box, k, (marks[i], f), marks[i + 1], arcs, found)
        elif f < 0.0 and after < 0.0 and there[i + 1] >= 0.0 > there[i]:
            found = _at_edge(params, T, box, k, (marks[i + 1], after), marks[i], arcs, found)
        if f < 0.0 <= after:
            start = _zero(params, T, box, work, k, (marks[i + 1], after), (marks[i], f))
        elif f >= 0.0 > after and found < arcs.shape[0]:
            arcs[found, 0], arcs[found, 1] = k, start
            arcs[found, 2] = _zero(params, T, box, work, k, (marks[i], f), (marks[i + 1], after))
            found += 1
            start = math.nan
    if not math.isnan(start) and found < arcs.shape[0]:
        arcs[found, 0], arcs[found, 1], arcs[found, 2] = k, start, marks[n - 1]
        found += 1
    return found


@jit
def _refine(
    params: Array, T: Array, box: Array, k: int, coarse: Array, fine: Array, work: tuple[Array, Array, Array]
) -> int:
    """fine ``(3, m)`` ← coarse ``(3, n)`` with more samples of branch k between them; returns their number.

    Rows: value, slack, and how far inside the arm's reach the branch is.
    """
    n, count = coarse.shape[1], 0
    for i in range(n):
        for r in range(3):
            fine[r, count] = coarse[r, i]
        count += 1
        if i == n - 1 or count + n - i + _FROM_EDGE.shape[0] > fine.shape[1]:
            continue
        if (coarse[2, i] < 0.0) != (coarse[2, i + 1] < 0.0):
            count = _from_edge(params, T, box, k, coarse[:, i : i + 2], fine, count, work)
            continue
        slope = 0.0
        for j in range(max(i - 1, 0), min(i + 2, n - 1)):
            slope = max(slope, abs(coarse[1, j + 1] - coarse[1, j]))
        if min(abs(coarse[1, i]), abs(coarse[1, i + 1])) < slope:
            for part in range(1, _PARTS):
                x = coarse[0, i] + (coarse[0, i + 1] - coarse[0, i]) * part / _PARTS
                fine[0, count], fine[1, count] = x, _at(params, T, x, box, work, k)
                fine[2, count] = work[1][k]
                count += 1
    return count


@jit
def _from_edge(
    params: Array, T: Array, box: Array, k: int, ends: Array, fine: Array, count: int,
    work: tuple[Array, Array, Array],
) -> int:  # fmt: skip
    """Append samples from where branch k begins to exist between two samples ``(3, 2)``; returns their number."""
    forward = ends[2, 0] < 0.0
    x, y = (ends[0, 1], ends[0, 0]) if forward else (ends[0, 0], ends[0, 1])
    whole = x
    for _ in range(_EDGE_STEPS):
        middle = 0.5 * (x + y)
        _at(params, T, middle, box, work, k)
        if work[1][k] >= 0.0:
            x = middle
        else:
            y = middle
    m = _FROM_EDGE.shape[0]
    for j in range(m):
        share = _FROM_EDGE[j] if forward else _FROM_EDGE[m - 1 - j]
        value = x + share * (whole - x)
        fine[0, count], fine[1, count] = value, _at(params, T, value, box, work, k)
        fine[2, count] = work[1][k]
        count += 1
    return count


@jit
def _insert(marks: Array, value: float) -> None:
    """Insert a value into the sorted marks ``(n,)``, of which the last place is free."""
    i = marks.shape[0] - 1
    while i > 0 and marks[i - 1] > value:
        marks[i] = marks[i - 1]
        i -= 1
    marks[i] = value


@jit
def _insert_ends(params: Array, T: Array, span: tuple[float, float], marks: Array, n: int) -> int:
    """Insert values beside those where the wrist centre is as far or as near as it can be; returns the number.

    Its squared distance is a sinusoid of the given joint's angle.
    """
    low, high = span
    M, square, roots = np.empty((3, 4)), np.empty(3), np.empty(2)
    for i in range(3):
        seen(params, T, 2.0 * math.pi * i / 3.0, M)
        square[i] = M[0, 3] * M[0, 3] + M[1, 3] * M[1, 3] + M[2, 3] * M[2, 3]
    mean = (square[0] + square[1] + square[2]) / 3.0
    cosine, sine = square[0] - mean, (square[1] - square[2]) / math.sqrt(3.0)
    constant, a, b = distances(params)
    for end in range(2):
        bound = constant + (2.0 - 4.0 * end) * math.sqrt(a * a + b * b)
        if two_roots(cosine, sine, bound - mean, 0.0, roots) < 0.0 or math.isnan(roots[0]):
            continue
        for i in range(2):
            first = params[SIGN] * (roots[i] - params[OFFSET])
            first += 2.0 * math.pi * math.ceil((low - first) / (2.0 * math.pi))
            for beside in _BESIDE:
                if low <= first + beside <= high and n < marks.shape[0]:
                    n += 1
                    _insert(marks[:n], first + beside)
    return n


@jit
def feasible(
    params: Array, T: Array, box: Array, span: tuple[float, float], wanted: float, arcs: Array, chosen: Array
) -> int:
    """arcs ``(m, 3)`` ← rows (branch, low, high): the feasible values of the given joint; returns their number.

    span: where the joint may be. chosen ``(8,)`` ← the feasible value nearest to the wanted one; where there is
    none, the sample at which the branch is least outside the limits; NaN where it does not exist.
    """
    low, high = span
    n = max(8, math.ceil(SAMPLES * (high - low) / (2.0 * math.pi))) + 2 if high > low else 1
    rows, room, spare = np.empty((8, 7)), np.empty(8), np.empty(8)
    every = np.empty(n + _MOST_ENDS)
    for i in range(n):
        every[i] = low + (high - low) * i / (n - 2) if i < n - 1 and n > 1 else low
    if n > 1:
        _insert(every[:n], min(max(wanted, low), high))
        n = _insert_ends(params, T, span, every, n)
    marks, samples, there = every[:n], np.empty((8, n)), np.empty((8, n))
    for i in range(n):
        slack(params, T, marks[i], box, -1, rows, room, spare)
        for k in range(8):
            samples[k, i], there[k, i] = spare[k], room[k]
    found = 0
    work = (rows, room, spare)
    coarse, once, twice = np.empty((3, n)), np.empty((3, 4 * n + 64)), np.empty((3, 8 * n + 256))
    for k in range(8):
        first = found
        for i in range(n):
            coarse[0, i], coarse[1, i], coarse[2, i] = marks[i], samples[k, i], there[k, i]
        m = _refine(params, T, box, k, coarse, once, work)
        m = _refine(params, T, box, k, once[:, :m], twice, work)
        found = _ranges_of(params, T, box, k, twice[0, :m], (twice[1, :m], twice[2, :m]), arcs, found)
        chosen[k] = _nearest(arcs, first, found, wanted)
        if first == found:
            best = -math.inf
            for i in range(n):
                if there[k, i] >= 0.0 and samples[k, i] > best:
                    best, chosen[k] = samples[k, i], marks[i]
    return found


@jit
def _nearest(arcs: Array, first: int, found: int, wanted: float) -> float:
    """The value of the intervals first…found−1 nearest to the wanted one: that one, or slightly inside an end."""
    best = math.nan
    for i in range(first, found):
        if arcs[i, 1] <= wanted <= arcs[i, 2]:
            return wanted
        inset = min(_INSET, 0.5 * (arcs[i, 2] - arcs[i, 1]))
        x = min(max(wanted, arcs[i, 1] + inset), arcs[i, 2] - inset)
        if math.isnan(best) or abs(x - wanted) < abs(best - wanted):
            best = x
    return best
