"""Kernels that find the values of the given joint at which a branch exists inside the limits.

First, where branches exist (:mod:`kin.solvers.offset7.places`). Then, for each branch, one continuous function,
the *slack*, says how far its joints are inside their limits. It is sampled where the branch exists, more closely
beside where it begins to exist, and where a joint turns by more, from sample to sample, than it is away from its
limit (:mod:`kin.solvers.offset7.samples`): near a singularity joints turn fast. Zeros are found between samples of
opposite signs, all of a target at the same time, and a peak or a dip between samples that could pass zero is
searched for by golden sections. Of each branch's values, the one at which the joints move least from the seed is
chosen (:mod:`kin.solvers.offset7.nearest`).
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import inlined, jit
from kin.kernels.simd import rounded
from kin.solvers.offset7.lanes import ELBOW, FIRST, MARGIN, SECOND, SETUP, SIDE, SPACE, VALUE, lanes, set_up
from kin.solvers.offset7.nearest import nearest_values
from kin.solvers.offset7.places import marks_of, places_of
from kin.solvers.offset7.samples import (
    DOUBT_SPACE,
    LENGTH,
    ONE,
    OTHER,
    PASS_SPACE,
    PLACES,
    REACH,
    SAMPLES_SPACE,
    X,
    in_order,
    sample,
)
from kin.solvers.offset7.search import STEPS, Target, Whole, narrowed, next_in, peak, turns
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_INSET = TOLERANCES.interval_inset
_WIDTH = 1e-12  # rad, to which the end of an interval is found
_HAIR = TOLERANCES.limit
INTERVALS = 256  # of all branches, at most
_ENDS = 2 * INTERVALS
# Columns of ends of intervals: branch; a value inside, the slack there; one outside, the slack; a third one, the
# slack. Those outside are NaN where the range of the joint ends.
_BRANCH, _A, _FA, _B, _FB, _C, _FC, _WHOSE = range(8)
_NOWHERE = (math.nan, math.nan)
Point = tuple[float, float]  # value, slack


@jit
def feasible(
    params: Array, T: Array, box: Array, span: tuple[float, float], wanted: float, seed: tuple[float, float],
    arcs: Array, chosen: Array,
) -> int:  # fmt: skip
    """arcs ``(INTERVALS, 3)`` ← rows (branch, low, high): the feasible values of the given joint; their number.

    box ``(3, 7)``: seed and limits as chain angles. span: where the joint may be. chosen ``(8,)`` ← the feasible
    value at which the joints move least from the seed, or the one nearest to `wanted` if the seed's value is NaN;
    where there is none, the sample at which the branch is least outside the limits; NaN where it does not exist.
    seed: its value of the given joint, and what a step of that joint counts.
    """
    setup = np.empty(SETUP)
    set_up(params, T, box, setup)
    target = (params, T, box, setup)
    marks = marks_of(params, T, span, wanted)
    at, after = np.empty(marks.shape[0], dtype=np.int64), np.empty(LENGTH, dtype=np.int64)
    passes, L, D = (np.empty(PASS_SPACE), np.empty(PASS_SPACE)), np.empty(SPACE), np.empty(DOUBT_SPACE)
    S, ordered, places, scratch = (
        np.empty(SAMPLES_SPACE), np.empty(SAMPLES_SPACE), np.empty((2, PLACES)), np.empty((2, LENGTH)),
    )  # fmt: skip
    ends, Z = np.empty((_ENDS, _WHOSE)), np.empty((_WHOSE + 1, _ENDS + 8))
    found = 0
    for elbow in range(2):
        m = places_of(target, 1.0 - 2.0 * elbow, marks, places, at)
        sample(target, 1.0 - 2.0 * elbow, places, m, S, after, passes, L, D)
        for side in range(2):
            n = in_order(S, after, side * m, ordered)
            look = scratch[0, :n], scratch[1, :n]
            for wrist in range(2):
                k, before, column = 4 * elbow + 2 * side + wrist, found, OTHER if wrist == 1 else ONE
                chain = ordered[X : X + n], ordered[REACH : REACH + n], ordered[column : column + n]
                found = _ends_of(target, k, chain, look, ends, found)
                chosen[k] = math.nan
                if found == before:
                    first = column + side * m
                    chosen[k] = _least_outside(S[first : first + m], places[1], marks, at)
    _narrow(target, ends, found, L, Z)
    found = _joined(ends, found, arcs)
    for k in range(8):
        nearest = _nearest(arcs, k, found, wanted)
        chosen[k] = chosen[k] if math.isnan(nearest) else nearest
    if not math.isnan(seed[0]):
        nearest_values(target, seed, arcs, found, chosen, L)
    return found


@jit
def _ends_of(
    target: Target, k: int, chain: tuple[Array, Array, Array], look: tuple[Array, Array], ends: Array, found: int
) -> int:
    """Append brackets of the ends of branch k's feasible intervals to the rows of `ends`; returns their number.

    chain: values, margins and slacks of n samples; look: scratch, ``(n,)`` each. Rows are appended in pairs.
    """
    x, margin, f = chain
    sense, crosses = look
    n = x.shape[0]
    turns(x, f, sense)
    _where_to_look(margin, f, sense, crosses)
    for i in range(n):
        if sense[i] == 0.0 and crosses[i] == 0.0 and 0 < i < n - 1:
            continue
        if i == 0 and f[0] >= 0.0:
            found = _end(ends, found, k, (x[0], f[0]), _NOWHERE, _NOWHERE)
        if sense[i] != 0.0:
            before, after = (x[i - 1], f[i - 1]), (x[i + 1], f[i + 1])
            top = peak(target, k, 0.0, before[0], after[0], sense[i])
            if (sense[i] > 0.0) == (top[1] >= 0.0):
                for beside in (before, after):
                    inside, outside = (top, beside) if sense[i] > 0.0 else (beside, top)
                    found = _end(ends, found, k, inside, outside, _NOWHERE)
        if i == n - 1:
            if f[i] >= 0.0:
                found = _end(ends, found, k, (x[i], f[i]), _NOWHERE, _NOWHERE)
        elif crosses[i] != 0.0:
            a, b = (i + 1, i) if f[i] < 0.0 else (i, i + 1)
            c = min(max(2 * a - b, 0), n - 1)  # the sample behind the one inside
            third = (x[c], f[c]) if margin[c] >= 0.0 else _NOWHERE
            found = _end(ends, found, k, (x[a], f[a]), (x[b], f[b]), third)
    return found


@jit
def _where_to_look(margin: Array, f: Array, sense: Array, crosses: Array) -> None:
    """crosses ``(n,)`` ← 1.0 if f has a zero behind a sample; sense ``(n,)`` ← 0.0 if a branch ends beside it."""
    n = f.shape[0]
    for i in range(n - 1):
        crosses[i] = 1.0 if (f[i] >= 0.0) != (f[i + 1] >= 0.0) else 0.0
    for i in range(1, n - 1):
        exists = (margin[i - 1] >= 0.0) & (margin[i] >= 0.0) & (margin[i + 1] >= 0.0)
        sense[i] = sense[i] if exists else 0.0


@inlined
def _end(ends: Array, found: int, k: int, a: Point, b: Point, c: Point) -> int:
    """Append a bracket, or nothing where `ends` is full: only pairs are used."""
    if found < ends.shape[0]:
        ends[found, _BRANCH], ends[found, _A], ends[found, _FA] = k, a[0], a[1]
        ends[found, _B], ends[found, _FB], ends[found, _C], ends[found, _FC] = b[0], b[1], c[0], c[1]
        found += 1
    return found


@jit
def _narrow(target: Target, ends: Array, count: int, L: Array, Z: Array) -> None:
    """Column _A of ends ``(count, 7)`` ← the feasible sides of the zeros; all are narrowed at the same time.

    Z ``(8, _ENDS)``: scratch, the columns of those that are still wide, and whose they are.
    """
    params, T, box, setup = target
    n = 0
    for i in range(count):
        if abs(ends[i, _B] - ends[i, _A]) >= _WIDTH:
            for j in range(_WHOSE):
                Z[j, n] = ends[i, j]
            Z[_WHOSE, n] = i
            if not ends[i, _C] < math.inf:
                Z[_C, n], Z[_FC, n] = ends[i, _A], ends[i, _FA]
            n += 1
    for _ in range(STEPS):
        if n == 0:
            break
        _next_values(Z, n, L)
        lanes(params, T, box, setup, L, n)
        _take(L, n, Z)
        wide = 0
        for i in range(n):
            ends[int(Z[_WHOSE, i]), _A] = Z[_A, i] if Z[_FA, i] >= 0.0 else Z[_B, i]
            if abs(Z[_B, i] - Z[_A, i]) >= _WIDTH:
                for j in range(_WHOSE + 1):
                    Z[j, wide] = Z[j, i]
                wide += 1
        n = wide


@jit
def _next_values(Z: Array, n: int, L: Array) -> None:
    """Lanes 0 to n − 1 of L ← where to look for the zeros in the brackets of Z."""
    for i in range(n):
        k = Z[_BRANCH, i]
        upper = k - 4.0 if k >= 4.0 else k
        L[ELBOW + i], L[SIDE + i] = 1.0 if k < 4.0 else -1.0, 1.0 if upper < 2.0 else -1.0
        L[VALUE + i] = next_in((Z[_A, i], Z[_FA, i], Z[_B, i], Z[_FB, i], Z[_C, i], Z[_FC, i]), _WIDTH)


@jit
def _take(L: Array, n: int, Z: Array) -> None:
    """The brackets of Z, narrowed by what `lanes` found."""
    for i in range(n):
        k = Z[_BRANCH, i]
        half = 0.5 * k
        slack = L[FIRST + i] if half == rounded(half) else L[SECOND + i]
        slack = L[MARGIN + i] if L[MARGIN + i] < 0.0 else slack
        bracket = (Z[_A, i], Z[_FA, i], Z[_B, i], Z[_FB, i], Z[_C, i], Z[_FC, i])
        Z[_A, i], Z[_FA, i], Z[_B, i], Z[_FB, i], Z[_C, i], Z[_FC, i] = narrowed(bracket, L[VALUE + i], slack)


@jit
def _joined(ends: Array, count: int, arcs: Array) -> int:
    """arcs ``(m, 3)`` ← the intervals between pairs of ends, those that a hair divides as one; their number.

    Where the wrist aligns, joints jump within rounding errors, which is not a gap.
    """
    found = 0
    for i in range(0, count - 1, 2):
        if found > 0 and arcs[found - 1, 0] == ends[i, 0] and ends[i, 1] - arcs[found - 1, 2] < _HAIR:
            arcs[found - 1, 2] = ends[i + 1, 1]
            continue
        arcs[found, 0], arcs[found, 1], arcs[found, 2] = ends[i, 0], ends[i, 1], ends[i + 1, 1]
        found += 1
    return found


@jit
def _least_outside(slack: Array, margin: Array, marks: Array, at: Whole) -> float:
    """The mark at which a branch is least outside the limits, NaN if it exists at none."""
    best, value = -math.inf, math.nan
    for i in range(marks.shape[0]):
        if margin[at[i]] >= 0.0 and slack[at[i]] > best:
            best, value = slack[at[i]], marks[i]
    return value


@jit
def _nearest(arcs: Array, k: int, found: int, wanted: float) -> float:
    """The value of the intervals of branch k nearest to the wanted one: that one, or slightly inside an end."""
    best = math.nan
    for i in range(found):
        if arcs[i, 0] != k:
            continue
        if arcs[i, 1] <= wanted <= arcs[i, 2]:
            return wanted
        inset = min(_INSET, 0.5 * (arcs[i, 2] - arcs[i, 1]))
        x = min(max(wanted, arcs[i, 1] + inset), arcs[i, 2] - inset)
        if math.isnan(best) or abs(x - wanted) < abs(best - wanted):
            best = x
    return best
