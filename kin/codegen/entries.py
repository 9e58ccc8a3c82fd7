"""The kernels that generated code calls, in the subset: what `kin.solve_ik` does of one target without words.

They are translated only. A closed form enters as two kernels: `rows`, one of those of
:mod:`kin.codegen.families`, and what it calls.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from kin.ik.candidates import (
    DISTANCE,
    OVERRUN,
    ROLL,
    Requirement,
    Rows,
    accept,
    measure_and_sort,
    measure_rows,
    ranges,
    select,
)  # fmt: skip
from kin.ik.problem import FAR
from kin.kernels.checks import straighten
from kin.solvers.contract import APPROACH, POSE, POSITION
from kin.solvers.numeric import each_of
from kin.tolerances import TOLERANCES
from kin.transforms import Array

Inner = Callable[..., Any]
Limits = tuple[Array, Array, Array, Array]  # lower, upper, whole turns, weights

# What an entry answers with, as the generated files name it.
SOLVED, APPROXIMATE, LIMITS, UNMET, ORIENTATION, UNREACHABLE = range(6)
INVALID = -1
ROWS_OF_ARCS = 256
HALF_TURN = 90  # steps of half a turn
MEETINGS, WEIGHT, _SPREAD = 12, 0.1, 24  # as in `kin.ik.nearest`
_POSITION, _ROTATION = TOLERANCES.closure_position, TOLERANCES.closure_rotation
_SAME, _MET = TOLERANCES.same_branch, TOLERANCES.point_met
_MINIMUM = TOLERANCES.same_minimum_angle
_ALIKE, _SHARE = TOLERANCES.better_minimum, TOLERANCES.better_minimum_share


def solve(
    rows: Inner, inner: Inner, model: Array, params: Array, target: Array, seed: Array, limits: Limits,
    value: float, most: int, found: Rows,
) -> tuple[int, int]:  # fmt: skip
    """Configurations of a pose: (what kind of answer, how many of found.order).

    SOLVED: those inside the limits, nearest to the seed first. APPROXIMATE, of an arm with fewer than six joints:
    those that meet the point and the approach direction, the smallest rotation about it first. LIMITS: those
    outside the limits, the least outside first. UNMET: none. INVALID: the target ``(4, 4)`` is no pose, or the
    seed not finite. value: that of the redundancy parameter, NaN for, of each branch, the one nearest to the
    seed's that the limits allow. most: `Alone.intervals`.
    """
    T = np.empty((4, 4))
    if not _is_valid(target, seed, T):
        return INVALID, 0
    rows(inner, params, T, value, seed, (limits[0], limits[1]), np.empty((most, 3)), found.q)
    pose = _requirement(model, limits, POSE)
    count = measure_and_sort(pose, T, seed, seed, found)
    if count < 0:
        count = _with_seed(pose, T, seed, found) if math.isnan(value) else -1 - count
    if count > 0:
        return SOLVED, count
    blocked = _ordered(found, OVERRUN)
    if blocked > 0:
        return LIMITS, blocked
    if seed.shape[0] < 6:
        approach = _requirement(model, limits, APPROACH)
        stats = np.empty(found.stats.shape)
        for i in range(found.q.shape[0]):
            for k in range(5):
                stats[i, k] = found.stats[i, k]
        measure_rows(approach, T, seed, seed, found.q, found.stats)
        accept(approach, found.stats, True, found.closed, found.good)
        for i in range(found.q.shape[0]):
            found.closed[i] = found.good[i]
            found.stats[i, 1] = stats[i, 1]
        count = _ordered(found, ROLL)
        if count > 0:
            return APPROXIMATE, count
    return UNMET, 0


def by_steps(
    rows: Inner, inner: Inner, model: Array, params: Array, target: Array, seed: Array, limits: Limits,
    value: float, joint: int, most: int, found: Rows,
) -> tuple[int, int]:  # fmt: skip
    """As `solve`, of an arm whose redundancy parameter is a joint, for a value that may be NaN.

    Of NaN it is by steps the one nearest to the seed's at which a configuration is inside the limits; if there is
    none, the seed's. A seed that meets the pose is an answer, also where the formulas miss it.
    """
    low, high = limits[0][joint], limits[1][joint]
    start, steps = value, 0
    if math.isnan(value):
        start = min(max(seed[joint], low), high)
        steps = HALF_TURN if low <= start - math.pi and start + math.pi <= high else 2 * HALF_TURN
    own = math.isnan(value) and start == seed[joint]
    for k in range(1, 2 * steps + 2):
        at = start + (k // 2) * (math.pi / HALF_TURN) * (1.0 if k % 2 == 0 else -1.0)
        if low <= at <= high:
            asked = math.nan if own and k == 1 else at
            status, count = solve(rows, inner, model, params, target, seed, limits, asked, most, found)
            if steps == 0 or status <= SOLVED:  # or INVALID
                return status, count
    return solve(rows, inner, model, params, target, seed, limits, start, most, found)


def _requirement(model: Array, limits: Limits, task: int) -> Requirement:
    """What configurations are measured against, as `kin.solve_ik` does without options."""
    lower, upper, turns, weights = limits
    return Requirement(model, np.zeros(7), lower, upper, turns, weights, task, True, _POSITION, _ROTATION)


def _is_valid(target: Array, seed: Array, T: Array) -> bool:
    """T ← the target with its rotation made orthonormal; whether both can be used.

    Its rotation must have RᵀR = I within `TOLERANCES.rotation_matrix`: what is rounded more, for which
    `kin.solve_ik` takes the nearest rotation and with fewer than six joints widens its tolerances, is refused as
    what is no rotation is.
    """
    for j in range(seed.shape[0]):
        if not abs(seed[j]) <= FAR:
            return False
    return straighten(target, FAR, T) >= 0.0


def _with_seed(pose: Requirement, T: Array, seed: Array, found: Rows) -> int:
    """Make the seed, which meets the target, the row of the branch that it is on, and the first solution."""
    k, n = found.q.shape
    one, stats = np.empty((1, n)), np.empty((1, 5))
    for j in range(n):
        one[0, j] = seed[j]
    measure_rows(pose, T, seed, seed, one, stats)
    row, least = -1, _SAME
    for i in range(k):
        apart = 0.0
        for j in range(n):
            apart = max(apart, abs(found.q[i, j] - one[0, j]))
        if found.good[i] and apart < least:
            row, least = i, apart
    for i in range(k):
        if row < 0 and not found.good[i]:
            row = i
    row = max(row, 0)
    for j in range(n):
        found.q[row, j] = one[0, j]
    for j in range(5):
        found.stats[row, j] = stats[0, j]
    found.closed[row] = True
    found.good[row] = True
    key = np.empty(k)
    for i in range(k):
        key[i] = found.stats[i, DISTANCE] if found.good[i] else math.inf
    return _taken(found, key)


def _ordered(found: Rows, column: int) -> int:
    """found.order ← the rows that meet the task, the smallest statistic first; their number."""
    key = np.empty(found.q.shape[0])
    for i in range(found.q.shape[0]):
        value = abs(found.stats[i, column])
        if column == OVERRUN:  # rounding must not decide, as in kin.ik.failures
            value = float(np.round(1e12 * value)) / 1e12
        key[i] = value if found.closed[i] else math.inf
    return _taken(found, key)


def _taken(found: Rows, key: Array) -> int:
    kept, count = select(found.q, key)
    for i in range(count):
        found.order[i] = kept[i]
    return count


def intervals(
    rows: Inner, inner: Inner, params: Array, target: Array, seed: Array, limits: Limits, circular: bool,
    q: Array, out: Array,
) -> int:  # fmt: skip
    """out ``(m, 3)`` ← rows (branch, low, high): the values of the redundancy parameter that the limits allow.

    Those of each branch, sorted and joined; if they are circular in (−π, π]. Returns their number, or INVALID.
    """
    T = np.empty((4, 4))
    if not _is_valid(target, seed, T):
        return INVALID
    arcs = np.empty((ROWS_OF_ARCS, 3))
    count = rows(inner, params, T, math.nan, seed, (limits[0], limits[1]), arcs, q)
    together = np.zeros(q.shape[0], dtype=np.bool_)
    return ranges(arcs[: max(count, 0)], np.arange(q.shape[0]), together, circular, out)


def nearest(
    rows: Inner, inner: Inner, model: Array, params: Array, target: Array, seed: Array, known: Array,
    starts: Array, limits: Limits, point: bool, most: int, found: Rows,
) -> int:  # fmt: skip
    """found.q[0] ← the configuration inside the limits that comes nearest to a pose, or first to its point.

    At 0.1 m per radian, as `kin.solve_ik` does it: descents from the seed, from the branches (known ``(k, n)`` is
    scratch) and from points spread over the limits ``(m, n)``. Where `point` counts first and can be met, what
    meets it with the smallest rotation error. SOLVED if it meets the pose as exactly as those of `solve`,
    ORIENTATION if it meets the point alone, else UNREACHABLE, or INVALID. most: `Alone.intervals`.
    """
    T = np.empty((4, 4))
    if not _is_valid(target, seed, T):
        return INVALID
    lower, upper, turns, _ = limits
    rows(inner, params, T, math.nan, seed, (lower, upper), np.empty((most, 3)), known)
    n, m = seed.shape[0], starts.shape[0]
    size = 1 + known.shape[0] + m
    q, costs = np.empty((size, n)), np.empty(size)
    for j in range(n):
        q[0, j] = seed[j]
    count = 1
    for i in range(known.shape[0]):
        if not math.isnan(known[i, 0]):
            for j in range(n):
                q[count, j] = known[i, j]
            count += 1
    for i in range(m):
        for j in range(n):
            q[count, j] = starts[i, j]
        count += 1
    task, weight, enough = (POSITION, 1.0, 1e-11) if point else (POSE, WEIGHT, 0.0)
    goal = (T, task, np.zeros(7), weight)
    count = each_of(model, goal, (lower, upper, turns), enough, MEETINGS, q[:count], costs)
    best = 0
    for i in range(count):
        if costs[i] < costs[best] * (1.0 - _SHARE) - _ALIKE:
            best = i
    for j in range(n):
        found.q[0, j] = q[best, j]
    pose = _requirement(model, limits, POSE)
    if point and costs[best] <= _MET:
        _oriented(pose, T, seed, starts[:_SPREAD], (lower, upper, turns), found.q[0])
    measure_rows(pose, T, seed, seed, found.q[:1], found.stats[:1])
    if found.stats[0, 0] <= _POSITION and found.stats[0, 1] <= _ROTATION:
        return SOLVED
    return ORIENTATION if found.stats[0, 0] <= _MET else UNREACHABLE


def _oriented(
    pose: Requirement, T: Array, seed: Array, starts: Array, bounds: tuple[Array, Array, Array], best: Array
) -> None:  # fmt: skip
    """best ``(n,)``, which meets the point ← the configuration that meets it with the smallest rotation error.

    As `kin.ik.nearest.nearest_orientation`: from stage to stage a radian weighs less against a metre, and the
    different minima of each stage are the starts of the next.
    """
    n, m = seed.shape[0], starts.shape[0] + 1
    q, met, costs, mask = np.empty((2 * m, n)), np.empty((m, n)), np.empty(2 * m), np.zeros(7)
    _copy(seed, q[0])
    for i in range(1, m):
        _copy(starts[i - 1], q[i])
    each_of(pose.model, (T, POSITION, mask, 1.0), bounds, -1.0, m + 1, q[:m], costs)
    known = 0
    for i in range(m):
        if costs[i] <= _MET:
            _copy(q[i], met[known])
            known += 1
    count, weight = m, WEIGHT
    for stage in range(4):
        if stage == 1:
            for i in range(known):
                _copy(met[i], q[count + i])
            count += known
        each_of(pose.model, (T, POSE, mask, weight), bounds, -1.0, count + 1, q[:count], costs)
        keep = _SPREAD if stage == 0 else _SPREAD // 4 if stage == 3 else _SPREAD // 2
        count = _different(q, costs, count, _MINIMUM * weight, keep)
        weight *= 0.1
    each_of(pose.model, (T, POSITION, mask, 1.0), bounds, -1.0, count + 1, q[:count], costs)
    for i in range(known):
        _copy(met[i], q[count + i])
        costs[count + i] = 0.0
    count += known
    stats = np.empty((2 * m, 5))
    measure_rows(pose, T, seed, seed, q[:count], stats[:count])
    least = math.inf
    for i in range(count):
        if costs[i] <= _MET and stats[i, 1] < least - _ALIKE:
            least = stats[i, 1]
            _copy(q[i], best)


def _different(q: Array, costs: Array, count: int, same: float, keep: int) -> int:
    """q ← at most `keep` of its rows, the smallest cost first, and of a run of equal costs two; their number."""
    kept = np.empty(q.shape)
    found, last, before = 0, -math.inf, -math.inf
    for _ in range(count):
        i = 0
        for k in range(1, count):
            if costs[k] < costs[i]:
                i = k
        if found < keep and costs[i] > before + same:
            _copy(q[i], kept[found])
            found += 1
        before, last = last, costs[i]
        costs[i] = math.inf
    for i in range(found):
        _copy(kept[i], q[i])
    return found


def _copy(row: Array, to: Array) -> None:
    """to ``(n,)`` ← row."""
    for j in range(row.shape[0]):
        to[j] = row[j]
