"""Kernels that find the values of the given joint at which a branch exists inside the limits, and choose one.

First, where branches exist (:mod:`kin.solvers.offset7.places`). Then, for each branch, one continuous function,
the *slack*, says how far its joints are inside their limits. It is sampled where the branch exists, more closely
beside where it begins to exist, and where a joint turns by more, from sample to sample, than it is away from its
limit: near a singularity joints turn fast. Zeros are found between samples of opposite signs, and a peak or a dip
between samples that could pass zero is searched for by golden sections. Samples, and all zeros of a target, are
computed many at a time (:mod:`kin.solvers.offset7.lanes`).
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import inlined, jit
from kin.kernels.simd import widest, wrapped
from kin.solvers.blocks import Entries
from kin.solvers.offset7.branches import all_branches, joints_of
from kin.solvers.offset7.geometry import OFFSET, SIGN
from kin.solvers.offset7.lanes import (
    ANGLES,
    ELBOW,
    FIRST,
    MOST,
    ROOM,
    SECOND,
    SETUP,
    SIDE,
    SPACE,
    TURNED,
    VALUE,
    Angles,
    insides,
    lanes,
    limits_of,
    set_up,
)
from kin.solvers.offset7.places import marks_of, places_of
from kin.solvers.offset7.search import STEPS, Target, Whole, narrowed, next_in, peak, turns
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_INSET = TOLERANCES.interval_inset
_WIDTH = 1e-12  # rad, to which the end of an interval is found
_HAIR = TOLERANCES.limit
_PARTS = 4  # of an interval between samples that is looked at more closely
# How far a joint may turn between samples where it may pass a limit, in each pass that adds samples.
_SWINGS = (0.0, 0.0, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05)
# Offsets of the columns of samples of the two branches of an elbow and a side, _CAP values each.
_CAP = 1024
_X, _FIRST, _SECOND, _ROOM, _ANGLES = range(0, 5 * _CAP, _CAP)
_SPACE = _ANGLES + (TURNED + 1) * _CAP

Work = tuple[Array, Array, Array]


@jit
def _sample(target: Target, k: int, S: Array, n: int, fresh: Array, L: Array) -> None:
    """Fill in what `lanes` gives of branches k and k + 1 at those of n samples where fresh ``(n,)`` is 1.0."""
    params, T, box, setup = target
    elbow, side = 1.0 if k < 4 else -1.0, 1.0 if k & 2 == 0 else -1.0
    first = 0
    while first < n:
        count, last = 0, first
        while last < n and count < MOST:
            if fresh[last] > 0.0:
                L[VALUE + count], L[ELBOW + count], L[SIDE + count] = S[_X + last], elbow, side
                count += 1
            last += 1
        lanes(params, T, box, setup, L, count)
        count = 0
        for i in range(first, last):
            if fresh[i] > 0.0:
                S[_FIRST + i], S[_SECOND + i] = L[FIRST + count], L[SECOND + count]
                for j in range(TURNED + 1):
                    S[_ANGLES + j * _CAP + i] = L[ANGLES + j * MOST + count]
                count += 1
        first = last


@inlined
def _angles(S: Array, i: int) -> Angles:
    """The angles at sample i."""
    k = _ANGLES + i
    return S[k], S[k + _CAP], S[k + 2 * _CAP], S[k + 3 * _CAP], S[k + 4 * _CAP], S[k + 5 * _CAP]


@inlined
def _doubt(here: Angles, there: Angles, swing: Angles, second: bool, h: Entries) -> float:
    """The largest swing of a joint that may pass a limit between two samples; 0.0 if none may or one stays out.

    A joint may if it turns by more, there or beside, than it is away from its limit.
    """
    a, b = insides(here, second, h), insides(there, second, h)
    most, out = 0.0, False
    for j in range(6):
        near = min(abs(a[j]), abs(b[j]))
        sure = near >= swing[j]
        out = out | (sure & (a[j] < 0.0) & (b[j] < 0.0))
        most = most if sure else max(most, swing[j])
    return 0.0 if out else most


@jit
def _doubts(setup: Array, S: Array, n: int, D: Array) -> None:
    """D[i] ← the larger `_doubt` of both branches between samples i and i + 1; the columns behind are scratch."""
    widest()
    h = limits_of(setup)
    for j in range(TURNED + 1):
        a, d = _ANGLES + j * _CAP, (j + 1) * _CAP
        for i in range(n - 1):
            exists = (S[_ROOM + i] >= 0.0) & (S[_ROOM + i + 1] >= 0.0)
            D[d + i + 1] = abs(wrapped(S[a + i + 1] - S[a + i])) if exists else 0.0
        D[d] = D[d + n] = 0.0
    for i in range(n - 1):
        k = i + 1
        swing = (
            max(D[_CAP + i], max(D[_CAP + k], D[_CAP + k + 1])),
            max(D[2 * _CAP + i], max(D[2 * _CAP + k], D[2 * _CAP + k + 1])),
            max(D[3 * _CAP + i], max(D[3 * _CAP + k], D[3 * _CAP + k + 1])),
            max(D[4 * _CAP + i], max(D[4 * _CAP + k], D[4 * _CAP + k + 1])),
            max(D[5 * _CAP + i], max(D[5 * _CAP + k], D[5 * _CAP + k + 1])),
            max(D[6 * _CAP + i], max(D[6 * _CAP + k], D[6 * _CAP + k + 1])),
        )
        here, there = _angles(S, i), _angles(S, i + 1)
        doubt = max(_doubt(here, there, swing, False, h), _doubt(here, there, swing, True, h))
        exists = (S[_ROOM + i] >= 0.0) & (S[_ROOM + i + 1] >= 0.0)
        D[i] = doubt if exists else 0.0


@jit
def _refine(target: Target, k: int, least: float, S: Array, n: int, fine: Array, work: Work) -> int:
    """fine ← the n samples S, and more where joints that turn by more than `least` may pass a limit.

    Returns their number; work: `fresh`, the lanes, and scratch of `_doubts`.
    """
    fresh, L, D = work
    _doubts(target[3], S, n, D)
    count = 0
    for i in range(n):
        for row in range(0, _SPACE, _CAP):
            fine[row + count] = S[row + i]
        fresh[count] = 0.0
        count += 1
        if i < n - 1 and D[i] > least and count + n - i + _PARTS < _CAP:
            for part in range(1, _PARTS):
                fine[_X + count] = S[_X + i] + (S[_X + i + 1] - S[_X + i]) * part / _PARTS
                fine[_ROOM + count], fresh[count] = 0.0, 1.0
                count += 1
    if count > n:
        _sample(target, k, fine, count, fresh, L)
    return count


@jit
def _ranges_of(target: Target, k: int, S: Array, n: int, ends: Array, found: int) -> int:
    """Append brackets of the ends of branch k's feasible intervals to ends ``(m, 5)``; returns their number.

    S: n samples. Rows in pairs: (branch, feasible value, slack, value beyond the end, slack); the last two are NaN
    where the range of the joint ends.
    """
    x, room = S[_X : _X + n], S[_ROOM : _ROOM + n]
    f = S[_SECOND : _SECOND + n] if k & 1 == 1 else S[_FIRST : _FIRST + n]
    for i in range(n):
        if i == 0 and f[0] >= 0.0:
            found = _end(ends, found, k, x[0], f[0], math.nan, math.nan)
        if 0 < i < n - 1 and room[i - 1] >= 0.0 and room[i] >= 0.0 and room[i + 1] >= 0.0:
            sense = turns(x, f, i)
            if sense != 0.0:
                top, most = peak(target, k, 0.0, x[i - 1], x[i + 1], sense)
                if sense > 0.0 and most >= 0.0:
                    found = _end(ends, found, k, top, most, x[i - 1], f[i - 1])
                    found = _end(ends, found, k, top, most, x[i + 1], f[i + 1])
                if sense < 0.0 and most < 0.0:
                    found = _end(ends, found, k, x[i - 1], f[i - 1], top, most)
                    found = _end(ends, found, k, x[i + 1], f[i + 1], top, most)
        if i == n - 1:
            if f[i] >= 0.0:
                found = _end(ends, found, k, x[i], f[i], math.nan, math.nan)
        elif f[i] < 0.0 <= f[i + 1]:
            found = _end(ends, found, k, x[i + 1], f[i + 1], x[i], f[i])
        elif f[i] >= 0.0 > f[i + 1]:
            found = _end(ends, found, k, x[i], f[i], x[i + 1], f[i + 1])
    return found


@jit
def _end(ends: Array, found: int, k: int, inside: float, slack: float, outside: float, beyond: float) -> int:
    """Append a bracket, or nothing where `ends` is full: only pairs are used."""
    if found < ends.shape[0]:
        ends[found, 0], ends[found, 1], ends[found, 2] = k, inside, slack
        ends[found, 3], ends[found, 4] = outside, beyond
        found += 1
    return found


@jit
def _narrow(target: Target, ends: Array, count: int, L: Array) -> None:
    """Column 1 of ends ``(count, 5)`` ← the feasible sides of the zeros; all are narrowed at the same time."""
    params, T, box, setup = target
    B, active = np.empty((count, 6)), np.empty(count, dtype=np.int64)
    for i in range(count):
        B[i, 0], B[i, 1], B[i, 2], B[i, 3], B[i, 4], B[i, 5] = (
            ends[i, 1], ends[i, 2], ends[i, 3], ends[i, 4], ends[i, 1], ends[i, 2]
        )  # fmt: skip
    for step in range(STEPS):
        n = 0
        for i in range(count):
            if abs(B[i, 2] - B[i, 0]) >= _WIDTH and n < MOST:
                bracket = (B[i, 0], B[i, 1], B[i, 2], B[i, 3], B[i, 4], B[i, 5])
                k = int(ends[i, 0])
                L[VALUE + n] = next_in(bracket, _WIDTH) if step > 0 else 0.5 * (B[i, 0] + B[i, 2])
                L[ELBOW + n], L[SIDE + n] = 1.0 if k < 4 else -1.0, 1.0 if k & 2 == 0 else -1.0
                active[n] = i
                n += 1
        if n == 0:
            break
        lanes(params, T, box, setup, L, n)
        for j in range(n):
            i = active[j]
            slack = L[FIRST + j] if int(ends[i, 0]) & 1 == 0 else L[SECOND + j]
            bracket = (B[i, 0], B[i, 1], B[i, 2], B[i, 3], B[i, 4], B[i, 5])
            B[i, 0], B[i, 1], B[i, 2], B[i, 3], B[i, 4], B[i, 5] = narrowed(
                bracket, L[VALUE + j], L[ROOM + j] if L[ROOM + j] < 0.0 else slack
            )
    for i in range(count):
        ends[i, 1] = B[i, 0] if B[i, 1] >= 0.0 else B[i, 2]


@jit
def feasible(
    params: Array, T: Array, box: Array, span: tuple[float, float], wanted: float, arcs: Array, chosen: Array
) -> int:
    """arcs ``(m, 3)`` ← rows (branch, low, high): the feasible values of the given joint; returns their number.

    box ``(3, 7)``: seed and limits as chain angles. span: where the joint may be. chosen ``(8,)`` ← the feasible
    value nearest to the wanted one; where there is none, the sample at which the branch is least outside the
    limits; NaN where it does not exist.
    """
    setup = np.empty(SETUP)
    set_up(params, T, box, setup)
    target = (params, T, box, setup)
    marks = marks_of(params, T, span, wanted)
    n = marks.shape[0]
    places, at = np.empty((2, _CAP)), np.empty(n, dtype=np.int64)
    S, finer, fresh, L, D = np.empty(_SPACE), np.empty(_SPACE), np.empty(_CAP), np.empty(SPACE), np.empty(8 * _CAP)
    ends = np.empty((2 * arcs.shape[0], 5))
    found = 0
    for elbow in range(2):
        m = places_of(target, 1.0 - 2.0 * elbow, marks, places, at)
        for side in range(2):
            k, count = 4 * elbow + 2 * side, m
            for i in range(m):
                room = places[1, i]
                S[_X + i], S[_ROOM + i], S[_FIRST + i], S[_SECOND + i] = places[0, i], room, room, room
                fresh[i] = 1.0 if room >= 0.0 else 0.0
            _sample(target, k, S, m, fresh, L)
            chosen[k] = _least_outside(S[_FIRST : _FIRST + m], S[_ROOM : _ROOM + m], marks, at)
            chosen[k + 1] = _least_outside(S[_SECOND : _SECOND + m], S[_ROOM : _ROOM + m], marks, at)
            for least in _SWINGS:
                before, count = count, _refine(target, k, least, S, count, finer, (fresh, L, D))
                if count == before:
                    break
                S, finer = finer, S
            for branch in range(k, k + 2):
                found = _ranges_of(target, branch, S, count, ends, found)
    _narrow(target, ends, found, L)
    found = _joined(ends, found, arcs)
    for k in range(8):
        nearest = _nearest(arcs, k, found, wanted)
        chosen[k] = chosen[k] if math.isnan(nearest) else nearest
    return found


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
def _least_outside(slack: Array, room: Array, marks: Array, at: Whole) -> float:
    """The mark at which a branch is least outside the limits, NaN if it exists at none."""
    best, value = -math.inf, math.nan
    for i in range(marks.shape[0]):
        if room[at[i]] >= 0.0 and slack[at[i]] > best:
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


@jit
def rows_at(params: Array, T: Array, near: Array, chosen: Array, out: Array) -> None:
    """out ``(8, 7)`` ← joint values of each branch at its value of the given joint, chosen ``(8,)``.

    NaN where a branch has none. near ``(7,)``: chain angles that decide what is free.
    """
    rows, room, t, joints = np.empty((8, 7)), np.empty(8), near.copy(), np.empty((8, 7))
    last = math.nan
    for k in range(8):
        for i in range(7):
            out[k, i] = math.nan
        if math.isnan(chosen[k]):
            continue
        if chosen[k] != last:
            last = chosen[k]
            t[0] = params[SIGN] * last + params[OFFSET]
            all_branches(params, T, near, t, -1, rows, room)
            joints_of(params, rows, last, joints)
        for i in range(7):
            out[k, i] = joints[k, i]
