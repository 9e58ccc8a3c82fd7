"""Measuring candidates: one compiled pass over the raw rows of a solver.

Each row is moved to its best whole-turn image and measured by forward kinematics. The rows that meet the task are
then sorted, without duplicates. Solvers do none of this.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.angles import TURN, nearest_image, wrap
from kin.kernels.compile import inlined, jit
from kin.kernels.fk import fk_into, fk_many
from kin.solvers.contract import APPROACH, MASK, POSE
from kin.solvers.numeric.error import relative_pose
from kin.tolerances import TOLERANCES
from kin.transforms import Array

Flags = NDArray[np.bool_]
Whole = NDArray[np.int64]
_POSITION = TOLERANCES.closure_position
_ROTATION = TOLERANCES.closure_rotation
_LIMIT = TOLERANCES.limit
_MERGE = TOLERANCES.merge
# Columns of the statistics of a row: errors (m, rad), distance to the seed, sum of what is outside the limits,
# roll.
POSITION_ERROR, ROTATION_ERROR, DISTANCE, OVERRUN, ROLL = range(5)


class Requirement(NamedTuple):
    """What rows are measured against, but for the target; arrays are C-contiguous float64.

    Attributes:
        model: the arm, as in `kin.kernels.fk`.
        mask: ``(7,)`` weights of the six error coordinates, and 1.0 if they are in the base frame.
        lower, upper: ``(n,)`` joint limits.
        turns: ``(n,)`` 2π for a joint with whole-turn images, else 0.0.
        weights: ``(n,)`` what a motion of each joint counts, see `kin.differential.metric.weights`.
        task: code of the task.
        respect: whether rows outside the limits are refused.
        position, rotation: errors that count as none, metres and radians.
    """

    model: Array
    mask: Array
    lower: Array
    upper: Array
    turns: Array
    weights: Array
    task: int
    respect: bool
    position: float = _POSITION
    rotation: float = _ROTATION


class Rows(NamedTuple):
    """Candidates of one target, written by `measure_and_sort`.

    Attributes:
        q: ``(k, n)``, NaN rows stay NaN.
        stats: ``(k, 5)`` statistics.
        closed, good: ``(k,)`` which rows meet the task, and which of them are accepted.
        order: ``(k,)`` accepted rows, nearest to the seed first.
    """

    q: Array
    stats: Array
    closed: Flags
    good: Flags
    order: Whole


@jit
def residuals(T: Array, target: Array, task: int, mask: Array, e: Array) -> tuple[float, float, float]:
    """(position error, rotation error of the task, roll about the target's approach axis), m and rad.

    Of a mask only its coordinates count; e ``(6,)`` is scratch.
    """
    if task == MASK:
        relative_pose(T, target, mask[6] == 0.0, e)
        for i in range(6):
            e[i] *= mask[i]
        position = math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
        return position, math.sqrt(e[3] * e[3] + e[4] * e[4] + e[5] * e[5]), 0.0
    p = 0.0
    for r in range(3):
        p += (T[r, 3] - target[r, 3]) ** 2
    nx, ny, nz = target[0, 0], target[1, 0], target[2, 0]
    bx, by, bz = target[0, 2], target[1, 2], target[2, 2]
    across = T[0, 0] * (by * nz - bz * ny) + T[1, 0] * (bz * nx - bx * nz) + T[2, 0] * (bx * ny - by * nx)
    roll = math.atan2(across, T[0, 0] * nx + T[1, 0] * ny + T[2, 0] * nz)
    return math.sqrt(p), turned_from(T, target, task), roll


@jit
def turned_from(T: Array, target: Array, task: int) -> float:
    """The rotation error of a task that is no mask, radians."""
    if task == POSE:
        chord = 0.0
        trace = 0.0
        for r in range(3):
            for c in range(3):
                chord += (T[r, c] - target[r, c]) ** 2
                trace += T[r, c] * target[r, c]
        # |R − S|_F = 2√2 sin(θ/2) and 1 + tr = 4 cos²(θ/2): exact from 0 to π.
        return 2.0 * math.atan2(math.sqrt(chord / 8.0), 0.5 * math.sqrt(max(0.0, 1.0 + trace)))
    if task == APPROACH:
        ax, ay, az = T[0, 2], T[1, 2], T[2, 2]
        bx, by, bz = target[0, 2], target[1, 2], target[2, 2]
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        return math.atan2(math.sqrt(x * x + y * y + z * z), ax * bx + ay * by + az * bz)
    return 0.0


@jit
def to_image(requirement: Requirement, near: Array, seed: Array, q: Array) -> tuple[float, float]:
    """Bring q ``(n,)`` to its best image, in place: (distance to the seed, sum of what is outside the limits)."""
    lower, upper, turns, respect = requirement.lower, requirement.upper, requirement.turns, requirement.respect
    distance = 0.0
    overrun = 0.0
    for i in range(q.shape[0]):
        q[i], outside = image_inside(q[i], near[i], turns[i], lower[i], upper[i], respect)
        overrun += outside
        distance += (requirement.weights[i] * (q[i] - seed[i])) ** 2
    return math.sqrt(distance), overrun


@inlined
def image_inside(
    x: float, near: float, turn: float, lower: float, upper: float, respect: bool
) -> tuple[float, float]:
    """The best image of a joint value, and how far it is outside the limits."""
    if turn > 0.0:
        x = nearest_image(x, near, lower if respect else -math.inf, upper if respect else math.inf)
    if x < lower:
        return (lower, 0.0) if lower - x <= _LIMIT else (x, lower - x)
    if x > upper:
        return (upper, 0.0) if x - upper <= _LIMIT else (x, x - upper)
    return x, 0.0


@jit
def measure_rows(
    requirement: Requirement, target: Array, near: Array, seed: Array, q: Array, stats: Array
) -> None:
    """Bring each row of q ``(k, n)`` to its best image, in place, and fill stats ``(k, 5)``; NaN rows stay NaN.

    The best image is inside the limits and nearest to `near`; the distance is that to `seed`.
    """
    T = np.empty((4, 4))
    e = np.empty(6)
    for k in range(q.shape[0]):
        if math.isnan(q[k, 0]):
            for i in range(stats.shape[1]):
                stats[k, i] = math.nan
            continue
        stats[k, 2], stats[k, 3] = to_image(requirement, near, seed, q[k])
        fk_into(requirement.model, q[k], T)
        stats[k, 0], stats[k, 1], stats[k, 4] = residuals(T, target, requirement.task, requirement.mask, e)


@jit
def accept(requirement: Requirement, stats: Array, respect: bool, closed: Flags, good: Flags) -> int:
    """closed, good ``(k,)`` ← which rows meet the task, and which of them the limits allow; how many those are."""
    count = 0
    for k in range(stats.shape[0]):
        close, turned = stats[k, POSITION_ERROR], stats[k, ROTATION_ERROR]
        closed[k] = close <= requirement.position and turned <= requirement.rotation
        good[k] = closed[k] and (stats[k, OVERRUN] == 0.0 or not respect)
        if good[k]:
            count += 1
    return count


@jit
def ranges(arcs: Array, rows: Whole, together: Flags, circular: bool, out: Array) -> int:
    """out ``(m, 3)`` ← rows (k, low, high): the intervals of branch rows[k], sorted and joined, then those of all
    branches in `together` (k = len(rows)); returns their number, or −1 if an end is not finite.

    On a circle they are in (−π, π]: one across ±π is given as two, the whole circle as one.
    """
    n = rows.shape[0]
    total = 0
    for k in range(n + 1):
        first = total
        for i in range(arcs.shape[0]):
            branch = int(arcs[i, 0])
            if (k < n and branch != rows[k]) or (k == n and not together[branch]):
                continue
            low, high = arcs[i, 1], arcs[i, 2]
            if not (math.isfinite(low) and math.isfinite(high)):
                return -1
            if not circular:
                total = _put(out, k, first, total, low, high)
            elif high - low >= TURN - 1e-12:
                total = _put(out, k, first, total, -math.pi, math.pi)
            else:
                start = wrap(low)
                end = start + (high - low)
                total = _put(out, k, first, total, start, min(end, math.pi))
                if end > math.pi:
                    total = _put(out, k, first, total, -math.pi, end - TURN)
    return total


@jit
def _put(out: Array, k: int, first: int, total: int, low: float, high: float) -> int:
    """Insert an interval into the sorted, disjoint ones out[first:total] and join those that it touches.

    Without room for it, it is left out.
    """
    i = first
    while i < total and out[i, 2] < low - 1e-12:
        i += 1
    j = i
    while j < total and out[j, 1] <= high + 1e-12:
        low, high = min(low, out[j, 1]), max(high, out[j, 2])
        j += 1
    if j == i:
        if total == out.shape[0]:
            return total
        for r in range(total, i, -1):
            out[r, 1], out[r, 2] = out[r - 1, 1], out[r - 1, 2]
        out[total, 0] = k
        total += 1
    else:
        for r in range(j, total):
            out[r - (j - i - 1), 1], out[r - (j - i - 1), 2] = out[r, 1], out[r, 2]
        total -= j - i - 1
    out[i, 0], out[i, 1], out[i, 2] = k, low, high
    return total


@jit
def select(q: Array, key: Array) -> tuple[Whole, int]:
    """Rows of q ``(k, n)`` with a finite key, by rising key, equal rows once: (rows, count); overwrites `key`."""
    kept = np.zeros(q.shape[0], dtype=np.int64)
    count = 0
    for _ in range(q.shape[0]):
        i = -1
        for k in range(q.shape[0]):
            if math.isfinite(key[k]) and (i < 0 or key[k] < key[i]):
                i = k
        if i < 0:
            break
        key[i] = math.inf
        new = True
        for k in range(count):
            gap = 0.0
            for j in range(q.shape[1]):
                gap = max(gap, abs(q[i, j] - q[kept[k], j]))
            if gap <= _MERGE:
                new = False
                break
        if new:
            kept[count] = i
            count += 1
    return kept, count


@jit
def meets_exactly(requirement: Requirement, q: Array, at: Array, target: Array, e: Array) -> bool:
    """Whether q ``(n,)``, whose tool is at `at` ``(4, 4)``, is inside the limits and meets the target.

    Larger tolerances than those of exact answers do not count. e ``(6,)`` is scratch.
    """
    if requirement.respect:
        for i in range(q.shape[0]):
            if not requirement.lower[i] - _LIMIT <= q[i] <= requirement.upper[i] + _LIMIT:
                return False
    close, turned, _ = residuals(at, target, requirement.task, requirement.mask, e)
    return bool(close <= min(requirement.position, _POSITION) and turned <= min(requirement.rotation, _ROTATION))


@jit
def measure_and_sort(requirement: Requirement, target: Array, near: Array, seed: Array, rows: Rows) -> int:
    """`measure_rows`, `accept`, and `select` of the accepted rows by distance to the seed; returns their number.

    −1 − their number if the seed itself meets the target: then it is a solution, whether or not it is among them.
    One kernel, since every target passes through it and a call from Python costs as much as a row.
    """
    count = _sorted(requirement, target, near, seed, rows)
    T = np.empty((4, 4))
    fk_into(requirement.model, seed, T)
    return -1 - count if meets_exactly(requirement, seed, T, target, np.empty(6)) else count


@jit
def _sorted(requirement: Requirement, target: Array, near: Array, seed: Array, rows: Rows) -> int:
    """`measure_and_sort` but for the seed."""
    measure_rows(requirement, target, near, seed, rows.q, rows.stats)
    if accept(requirement, rows.stats, requirement.respect, rows.closed, rows.good) == 0:
        return 0
    key = np.empty(rows.q.shape[0])
    for k in range(rows.q.shape[0]):
        key[k] = rows.stats[k, DISTANCE] if rows.good[k] else math.inf
    kept, count = select(rows.q, key)
    for k in range(count):
        rows.order[k] = kept[k]
    return count


@jit
def nearest_rows(requirement: Requirement, T: Array, seeds: Array, rows: Array, q: Array) -> None:
    """q ``(N, n)`` ← of the rows ``(N, k, n)`` of each target the one that `measure_and_sort` puts first, or NaN.

    seeds ``(N, n)``, or ``(1, n)`` for all. Rows are brought to their best images, but for those that are too far
    before their last joint; those that are nearer than the answer and do not meet the task become NaN.
    """
    last = seeds.shape[0] - 1
    chosen = np.empty(T.shape[0], dtype=np.int64)
    for i in range(T.shape[0]):
        chosen[i] = _nearest_row(requirement, seeds, min(i, last), rows, i, q)
    at, e = np.empty(T.shape), np.empty(6)
    fk_many(requirement.model, q, at)
    for i in range(T.shape[0]):
        while chosen[i] >= 0 and not _meets(requirement, at, T, i, e):
            rows[i, chosen[i], 0] = math.nan
            chosen[i] = _nearest_row(requirement, seeds, min(i, last), rows, i, q)
            fk_into(requirement.model, q[i], at[i])


@jit
def take_seeds(requirement: Requirement, T: Array, seeds: Array, q: Array) -> None:
    """q ``(N, n)`` ← the seed of each target T ``(N, 4, 4)`` that its own seed meets, see `meets_exactly`.

    seeds ``(N, n)``, or ``(1, n)`` for all.
    """
    at, e, last = np.empty((seeds.shape[0], 4, 4)), np.empty(6), seeds.shape[0] - 1
    fk_many(requirement.model, seeds, at)
    for i in range(T.shape[0]):
        k = min(i, last)
        if meets_exactly(requirement, seeds[k], at[k], T[i], e):
            for j in range(q.shape[1]):
                q[i, j] = min(max(seeds[k, j], requirement.lower[j]), requirement.upper[j])
                if not requirement.respect:
                    q[i, j] = seeds[k, j]


@inlined
def _nearest_row(requirement: Requirement, seeds: Array, which: int, rows: Array, i: int, q: Array) -> int:
    """q[i] ``(n,)`` ← the row of rows[i] ``(k, n)`` nearest to seeds[which] inside the limits, or NaN.

    Returns which row it is, −1 if there is none.
    """
    best, least = -1, math.inf
    for k in range(rows.shape[1]):
        distance = _squared_distance(requirement, seeds, which, rows, i, k, least)
        # Not of the squares: `measure_and_sort` takes the first of rows whose rounded distances are equal.
        if math.sqrt(distance) < math.sqrt(least):
            best, least = k, distance
    for j in range(q.shape[1]):
        q[i, j] = rows[i, best, j] if best >= 0 else math.nan
    return best


@inlined
def _squared_distance(
    requirement: Requirement, seeds: Array, which: int, rows: Array, i: int, k: int, most: float
) -> float:
    """Bring rows[i, k] ``(n,)`` to its best image, in place: its squared distance to seeds[which].

    Infinity, with the row only partly there, if it is `most` or more, outside the limits that count, or NaN. Whole
    arrays are passed since a view costs as much as a joint.
    """
    lower, upper, turns, respect = requirement.lower, requirement.upper, requirement.turns, requirement.respect
    total = 0.0
    for j in range(rows.shape[2]):
        seed = seeds[which, j]
        value, outside = image_inside(rows[i, k, j], seed, turns[j], lower[j], upper[j], respect)
        rows[i, k, j] = value
        total += (requirement.weights[j] * (value - seed)) ** 2
        if not total < most or (respect and outside > 0.0):
            return math.inf
    return total


@inlined
def _meets(requirement: Requirement, at: Array, targets: Array, i: int, e: Array) -> bool:
    """Whether at[i] ``(4, 4)`` meets the task at targets[i]; e ``(6,)`` is scratch."""
    if requirement.task == MASK:
        close, turned, _ = residuals(at[i], targets[i], requirement.task, requirement.mask, e)
        return bool(close <= requirement.position and turned <= requirement.rotation)
    p = 0.0
    for r in range(3):
        p += (at[i, r, 3] - targets[i, r, 3]) ** 2
    if not math.sqrt(p) <= requirement.position:  # as where there is no pose, but NaN
        return False
    chord = 0.0
    for r in range(3):
        for c in range(3):
            chord += (at[i, r, c] - targets[i, r, c]) ** 2
    # The angle between them is √(chord / 2), or a little more, and that of their z axes is no larger.
    if chord <= requirement.rotation * requirement.rotation:
        return True
    return bool(turned_from(at[i], targets[i], requirement.task) <= requirement.rotation)
