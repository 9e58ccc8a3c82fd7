"""Curves of configurations that meet one target.

Where a task leaves an arm no motion, its configurations are isolated points, except at special targets. At a
singular wrist joints 4 and 6 turn about one line, and every split of their sum meets the pose. The tangent of such
a curve is a null vector of the Jacobian at each of its points, so only singular configurations are looked at. The
opposite does not hold: where two solutions merge the configuration is singular, and nothing moves.

A configuration is on a curve if steps along the null vector, each corrected back onto the target, go on for a
radian on both sides, and the arm stays singular. On a table that is rounded the arm may move far while the tool
moves by next to nothing; a residual far below the tolerance of solutions tells such *near-curves*, which are
isolated solutions.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.angles import wrap, wrapped
from kin.axes import size
from kin.kernels.compile import jit
from kin.kernels.dense import least_pivot, singular_values
from kin.kernels.jacobian import jacobian_into
from kin.robot import Robot
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION
from kin.solvers.numeric.error import relative_pose
from kin.transforms import Array

Whole = NDArray[np.int64]
_RANK = {POSE: 6, APPROACH: 5, POSITION: 3}  # coordinates of each task
_SUSPECT = 1e-4  # pivot below which a row is looked at; it is less than 80 times the smallest singular value
_SINGULAR = 1e-12  # square of a singular value (lengths in arm sizes) that counts as none
_WEAK = 1e-6  # square of a singular value: directions in which steps are not corrected
_MET = 1e-11  # radians, shares of the arm's size: the target is met
_STRIDE = 0.1  # rad or m along the curve
_FAR = 10  # strides that a curve goes on at least, if it does not close
_MOST = 400  # strides of the longest curve
_CORRECTIONS = 8
_BESIDE = 0.03  # rad: a singular solution so near to a curve is on it
_BITS = 62  # of a whole number
_FAN = 12  # directions that are tried in a plane of null vectors


class Curve(NamedTuple):
    """A curve of configurations.

    Attributes:
        row: which of the given configurations stands for it.
        direction: ``(n,)`` the unit null vector there.
    """

    row: int
    direction: Array


@jit
def _columns(whole: Array, at: Array, task: int, size: float, free: Whole, J: Array) -> None:
    """J ``(6, k)`` ← rows of a task and columns of the free joints of a Jacobian ``(6, n)`` at pose `at`."""
    turns = 0.0 if task == POSITION else 1.0
    ax, ay, az = at[0, 2], at[1, 2], at[2, 2]
    for k in range(free.shape[0]):
        j = free[k]
        x, y, z = whole[3, j] * turns, whole[4, j] * turns, whole[5, j] * turns
        roll = x * ax + y * ay + z * az if task == APPROACH else 0.0
        J[3, k], J[4, k], J[5, k] = x - roll * ax, y - roll * ay, z - roll * az
        for r in range(3):
            J[r, k] = whole[r, j] / size


@jit
def _linear(model: Array, T: Array, task: int, size: float, free: Whole, q: Array, J: Array, e: Array) -> float:
    """J ``(6, k)`` ← the Jacobian of the task for the free joints, e ``(6,)`` ← its error; returns the norm of e.

    Both in the base frame, lengths in arm sizes.
    """
    n = q.shape[0]
    whole, at, axes = np.empty((6, n)), np.empty((4, 4)), np.empty((n, 7))
    jacobian_into(model, q, whole, at, axes)
    relative_pose(at, T, False, e)
    turns = 0.0 if task == POSITION else 1.0
    if task == APPROACH:
        ax, ay, az = at[0, 2], at[1, 2], at[2, 2]
        bx, by, bz = T[0, 2], T[1, 2], T[2, 2]
        e[3], e[4], e[5] = by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax
    total = 0.0
    for r in range(3):
        e[r] /= size
        e[3 + r] *= turns
        total += e[r] * e[r] + e[3 + r] * e[3 + r]
    _columns(whole, at, task, size, free, J)
    return math.sqrt(total)


@jit
def nearly_singular(model: Array, task: int, size: float, free: Whole, q: Array) -> int:
    """A number whose bit k says whether row k of q ``(m, n)`` is nearly singular, m ≤ 62; NaN rows are not.

    This is all that regular targets pay.
    """
    n = q.shape[1]
    J, whole, at, axes = np.empty((6, free.shape[0])), np.empty((6, n)), np.empty((4, 4)), np.empty((n, 7))
    found = 0
    for k in range(q.shape[0]):
        if math.isnan(q[k, 0]):
            continue
        jacobian_into(model, q[k], whole, at, axes)
        _columns(whole, at, task, size, free, J)
        if least_pivot(J) < _SUSPECT:
            found |= 1 << k
    return found


@jit
def null_vectors(model: Array, T: Array, task: int, size: float, free: Whole, q: Array, out: Array) -> int:
    """out ``(k, k)`` ← rows: the null vectors at q ``(n,)``; returns how many there are."""
    k = free.shape[0]
    J, e, V, w = np.empty((6, k)), np.empty(6), np.empty((k, k)), np.empty(k)
    _linear(model, T, task, size, free, q, J, e)
    singular_values(J, V, w)
    count = 0
    for i in range(k):
        if w[i] < _SINGULAR:
            for r in range(k):
                out[count, r] = V[r, i]
            count += 1
    return count


@jit
def _settle(
    model: Array, T: Array, task: int, size: float, free: Whole, q: Array, tangent: Array
) -> tuple[float, bool]:
    """Move q ``(n,)``, in place, onto the target but along weak directions; (the error, whether q is singular).

    tangent ``(k,)`` ← its part along the weak directions there, a unit vector.
    """
    k = free.shape[0]
    J, e, V, w = np.empty((6, k)), np.empty(6), np.empty((k, k)), np.empty(k)
    miss = math.inf
    for _ in range(_CORRECTIONS):
        miss = _linear(model, T, task, size, free, q, J, e)
        singular_values(J, V, w)
        if miss < 0.01 * _MET:
            break
        for i in range(k):
            if w[i] < _WEAK:
                continue
            # Column i of the rotated J is σ u.
            step = 0.0
            for r in range(6):
                step += J[r, i] * e[r]
            step /= w[i]
            for r in range(k):
                q[free[r]] -= step * V[r, i]
    least, total = math.inf, 0.0
    kept = np.zeros(k)
    for i in range(k):
        least = min(least, w[i])
        if w[i] < _WEAK:
            dot = 0.0
            for r in range(k):
                dot += V[r, i] * tangent[r]
            for r in range(k):
                kept[r] += dot * V[r, i]
    for r in range(k):
        total += kept[r] * kept[r]
    total = math.sqrt(total)
    for r in range(k):
        tangent[r] = kept[r] / total if total > 0.5 else 0.0
    return miss, least < _SINGULAR and total > 0.5


@jit
def follow(
    model: Array, T: Array, task: int, size: float, free: Whole, q: Array, direction: Array, out: Array
) -> tuple[int, bool]:
    """out ``(m, n)`` ← points of a curve from q ``(n,)`` along a null vector ``(k,)``; (number, it closes)."""
    n, k = q.shape[0], free.shape[0]
    at, trial, tangent = q.copy(), np.empty(n), direction.copy()
    for step in range(out.shape[0]):
        for i in range(n):
            trial[i] = at[i]
        for r in range(k):
            trial[free[r]] += _STRIDE * tangent[r]
        miss, singular = _settle(model, T, task, size, free, trial, tangent)
        moved = back = 0.0
        for i in range(n):
            moved += (trial[i] - at[i]) ** 2
            back += wrap(trial[i] - q[i]) ** 2
        if not (miss < _MET and singular and 0.3 * _STRIDE < math.sqrt(moved) < 2.0 * _STRIDE):
            return step, False
        for i in range(n):
            at[i] = out[step, i] = trial[i]
        if step > 2 and math.sqrt(back) < 0.75 * _STRIDE:
            return step + 1, True
    return out.shape[0], False


@lru_cache(maxsize=256)
def _size(robot: Robot) -> float:
    """The arm's size, which takes longer to compute than all else that a regular target needs."""
    return size(robot)


def isolated(task: int, free: Whole) -> bool:
    """Whether the configurations that meet a task are isolated in general: only then curves are looked for."""
    return task != MASK and 0 < len(free) <= _RANK[task]


def curves_among(
    robot: Robot, T: Array, task: int, free: Whole, q: Array, rows: list[int]
) -> tuple[list[Curve], list[int]]:
    """The curves on which configurations are, and the rows that remain if one row stands for each curve.

    Args:
        T: target ``(4, 4)``, which the configurations meet.
        free: ``(k,)`` indices of the joints that may move.
        q: ``(m, n)`` configurations.
        rows: those that count, the first ones preferred; at most 62 are looked at.
    """
    if not rows or not isolated(task, free):
        return [], rows
    near = nearly_singular(robot.model, task, _size(robot), free, q[rows[:_BITS]])
    singular = [row for i, row in enumerate(rows[:_BITS]) if near >> i & 1] if near else []
    curves: list[Curve] = []
    gone: set[int] = set()
    for row in singular:
        if row in gone:
            continue
        found = curve_through(robot, T, task, free, q[row])
        if found is None:
            continue
        direction, points = found
        curves.append(Curve(row, direction))
        standing = {curve.row for curve in curves}  # where curves cross, a row may be on several
        gone |= {other for other in singular if other not in standing and _beside(robot, points, q[other])}
    return curves, [row for row in rows if row not in gone]


def curve_through(robot: Robot, T: Array, task: int, free: Whole, q: Array) -> tuple[Array, Array] | None:
    """The null vector ``(n,)`` and points ``(m, n)`` of the curve through a configuration, None if none.

    The first joint that moves has a positive share of the null vector.
    """
    k, goal = len(free), (robot.model, np.ascontiguousarray(T), task, _size(robot), free)
    null = np.empty((k, k))
    q = np.ascontiguousarray(q)
    count = null_vectors(*goal, q, null)
    if count == 0:
        return None
    fan = null[:1] if count == 1 else _fan(null[:count])
    for direction in fan:
        ahead, back = np.empty((_MOST, robot.n)), np.empty((_MOST, robot.n))
        length, closes = follow(*goal, q, direction, ahead)
        behind = 0 if closes else follow(*goal, q, -direction, back)[0]
        if closes or min(length, behind) >= _FAR:
            whole = np.zeros(robot.n)
            first = direction[np.flatnonzero(np.abs(direction) > 1e-9)[0]]
            whole[free] = math.copysign(1.0, first) * direction
            return whole, np.concatenate([back[:behind][::-1], q[None], ahead[:length], q[None][: int(closes)]])
    return None


def _fan(null: Array) -> Array:
    """Directions ``(m, k)`` in the space of several null vectors ``(c, k)``: each, and turned to the next."""
    turns = np.linspace(0.0, math.pi, _FAN, endpoint=False)
    return np.concatenate([
        np.cos(turns)[:, None] * a + np.sin(turns)[:, None] * b
        for i, a in enumerate(null) for b in null[i + 1 :]
    ])  # fmt: skip


def _beside(robot: Robot, points: Array, q: Array) -> bool:
    """Whether a configuration is on the polyline through points ``(m, n)``, whole turns aside."""
    gap = points - q
    gap = np.where(robot.whole_turns, wrapped(gap), gap)
    along = gap[1:] - gap[:-1]
    lengths = (along * along).sum(axis=1)
    share = np.clip(-(gap[:-1] * along).sum(axis=1) / np.maximum(lengths, 1e-30), 0.0, 1.0)
    off = np.linalg.norm(gap[:-1] + share[:, None] * along, axis=1)
    off = np.where(lengths < 1.0, off, math.inf)  # the two ends are on either side of ±π
    return bool(min(off.min(initial=math.inf), np.linalg.norm(gap, axis=1).min()) < _BESIDE)
