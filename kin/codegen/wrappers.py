"""How generated code asks arms whose solver is that of another arm: with other joints, or fewer, or more.

Each kernel here has the arguments of those of :mod:`kin.codegen.families`. What it calls, and the numbers of the
arm, are attributes of its first argument (`kin.codegen.types.Constants`).
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.codegen.types import Constants
from kin.kernels.dense import least_pivot
from kin.kernels.fk import fk_into
from kin.kernels.jacobian import jacobian_one
from kin.solvers.common import UNBOUNDED
from kin.solvers.contract import POSE
from kin.solvers.coupled import APART
from kin.solvers.general6.batch import PROVED
from kin.solvers.general6.closed_form import COPIES, MET, SAME
from kin.solvers.numeric import each_of
from kin.tolerances import TOLERANCES
from kin.transforms import Array

Limits = tuple[Array, Array]  # lower and upper
_AT_ZERO, _CLOSURE = TOLERANCES.near_miss, TOLERANCES.closure_position
_REGULAR = 1e-4  # pivot of the Jacobian of a regular solution


def of_counted(
    other: Constants, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """Joints counted in another direction or unit, lengths in another unit."""
    n = near.shape[0]
    lower, upper = limits
    pose, there, low, high = np.empty((4, 4)), np.empty(n), np.empty(n), np.empty(n)
    for i in range(4):
        for j in range(4):
            pose[i, j] = T[i, j] / other.unit if i < 3 and j == 3 else T[i, j]
    for j in range(n):
        there[j] = near[j] / other.scales[j]
        a, b = lower[j] / other.scales[j], upper[j] / other.scales[j]
        low[j], high[j] = min(a, b), max(a, b)
    count: int = other.rows(other.inner, params, pose, value / other.scale, there, (low, high), arcs, q)
    for i in range(q.shape[0]):
        for j in range(n):
            q[i, j] = q[i, j] * other.scales[j]
    for i in range(count):
        a, b = arcs[i, 1] * other.scale, arcs[i, 2] * other.scale
        arcs[i, 1], arcs[i, 2] = min(a, b), max(a, b)
    return count


def of_order(
    other: Constants, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """Six joints in another order, or from tool to base; their solver reads neither seed nor limits."""
    pose, rows = np.zeros((4, 4)), np.empty((q.shape[0], 6))
    pose[3, 3] = 1.0
    for i in range(3):
        for j in range(3):
            pose[i, j] = T[j, i] if other.inverted else T[i, j]
        pose[i, 3] = T[i, 3]
        if other.inverted:
            pose[i, 3] = 0.0 - pose[i, 0] * T[0, 3] - pose[i, 1] * T[1, 3] - pose[i, 2] * T[2, 3]
    count: int = other.rows(other.inner, params, pose, value, near, limits, arcs, rows)
    for j in range(6):
        column = other.order[j]
        for i in range(q.shape[0]):
            q[i, column] = rows[i, j]
    return count


def of_general6(
    other: Constants, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """What the elimination finds, and unless that is proved to be all, what targets close by lead to.

    As `General6.add_missing`, without what takes singular values: of singular configurations there may be more.
    """
    known: int = other.rows(other.inner, params, T, value, near, limits, arcs, q)
    if known == 0 - PROVED:
        return 0
    _merge_copies(other, T, q, _add_nearby(other, params, T, value, near, limits, arcs, q))
    return 0


def _add_nearby(
    other: Constants, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """Add to q ``(16, 6)`` what targets close by lead to; how many rows there are then."""
    size, step, pose, J = q.shape[0], np.empty((4, 4)), np.empty((4, 4)), np.empty((6, 6))
    rows, costs, mask, turns = np.empty((size, 6)), np.empty(size), np.zeros(7), np.zeros(6)
    low, high = np.full(6, -UNBOUNDED), np.full(6, UNBOUNDED)
    count = _counted(q)
    for k in range(3):
        for i in range(4):
            for j in range(4):
                step[i, j] = other.steps[4 * k + i, j]
        _product(T, step, pose)
        for i in range(3):
            pose[i, 3] = T[i, 3] + other.reach * step[i, 3]
        other.rows(other.inner, params, pose, value, near, limits, arcs, rows)
        found = _counted(rows)
        each_of(other.model, (T, POSE, mask, 1.0), (low, high, turns), -1.0, found + 1, rows[:found], costs)
        for i in range(found):
            if costs[i] < MET and count < size:
                jacobian_one(other.model, rows[i], J)
                for r in range(3):
                    for j in range(6):
                        J[r, j] = J[r, j] / other.size
                if least_pivot(J) > _REGULAR and _is_new(rows[i], q, count, other.turns):
                    for j in range(6):
                        q[count, j] = wrap(rows[i, j]) if other.turns[j] != 0.0 else rows[i, j]
                    count += 1
    return count


def _merge_copies(other: Constants, T: Array, q: Array, count: int) -> None:
    """Make those of the first rows of q into which rounding splits a multiple solution one, as `General6` does."""
    middle, pose = np.empty(6), np.empty((4, 4))
    for k in range(1, count):
        copy, least = -1, _CLOSURE
        for i in range(k):
            apart = 0.0
            for j in range(6):
                off = q[i, j] - q[k, j]
                off = wrap(off) if other.turns[j] != 0.0 else off
                middle[j] = q[k, j] + 0.5 * off
                apart = max(apart, abs(off))
            if apart < COPIES:
                fk_into(other.model, middle, pose)
                miss = 0.0
                for r in range(3):
                    for j in range(4):
                        miss = max(miss, abs(pose[r, j] - T[r, j]))
                if miss < least:
                    copy, least = i, miss
        if copy >= 0:
            for j in range(6):
                q[k, j] = q[copy, j]


def _counted(rows: Array) -> int:
    """How many rows there are before those of NaN."""
    count = 0
    for i in range(rows.shape[0]):
        if not math.isnan(rows[i, 0]):
            count += 1
    return count


def _is_new(row: Array, q: Array, count: int, turns: Array) -> bool:
    """Whether none of the first rows of q is this one, but for whole turns."""
    for i in range(count):
        apart = 0.0
        for j in range(row.shape[0]):
            off = row[j] - q[i, j]
            apart = max(apart, abs(wrap(off) if turns[j] != 0.0 else off))
        if apart < SAME:
            return False
    return True


def of_general7(
    other: Constants, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """The first or last of seven joints is given: its rotation is moved into the target of the other six."""
    lower, upper = limits
    angle = near[other.joint] if math.isnan(value) else value
    turn, part, whole, pose = np.zeros((4, 4)), np.empty((4, 4)), np.empty((4, 4)), np.empty((4, 4))
    turn[0, 0] = math.cos(angle)
    turn[0, 1] = math.sin(angle)
    turn[1, 0] = -turn[0, 1]
    turn[1, 1] = turn[0, 0]
    turn[2, 2] = 1.0
    turn[3, 3] = 1.0
    _product(other.axis, turn, part)
    _product(part, other.back, whole)
    if other.last:
        _product(T, whole, pose)
    else:
        _product(whole, T, pose)
    first, rows = 0 if other.last else 1, np.empty((q.shape[0], 6))
    end = first + 6
    there, low, high = near[first:end], lower[first:end], upper[first:end]
    other.rows(other.inner, params, pose, math.nan, there, (low, high), arcs, rows)
    for i in range(q.shape[0]):
        q[i, other.joint] = math.nan if math.isnan(rows[i, 0]) else angle
        for j in range(6):
            q[i, first + j] = rows[i, j]
    return 0


def of_completed(
    other: Constants, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """The first of six joints; the virtual ones at the tool stay at 0, unless they only roll it."""
    n, rows = near.shape[0], np.empty((q.shape[0], 6))
    _complete(other, params, T, near, limits, arcs, rows)
    for i in range(q.shape[0]):
        off = 0.0
        for j in range(n, 6):
            off = max(off, abs(wrap(rows[i, j])))
        for j in range(n):
            q[i, j] = rows[i, j] if other.rolls or off < _AT_ZERO else math.nan
    return 0


def of_pairs(
    other: Constants, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """Three joints, which meet the point alone: two branches of the completed arm differ in the virtual joints."""
    pose, rows = T.copy(), np.empty((2 * q.shape[0], 6))
    for i in range(3):
        for j in range(3):
            pose[i, j] = other.turn[i, j]
    _complete(other, params, pose, near, limits, arcs, rows)
    for i in range(q.shape[0]):
        row = 2 * i + 1 if math.isnan(rows[2 * i, 0]) else 2 * i
        for j in range(3):
            q[i, j] = rows[row, j]
    return 0


def of_turned(
    other: Constants, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """The last joint turns the tool about its point: it follows from those before it."""
    n = near.shape[0] - 1
    lower, upper = limits
    there, pose, P, rows = np.empty(n), np.empty((4, 4)), np.empty((4, 4)), np.empty((q.shape[0], n))
    for j in range(n):
        there[j] = min(max(near[j], lower[j]), upper[j])
    _product(T, other.axis, pose)
    other.rows(other.inner, params, pose, math.nan, there, (lower[:n], upper[:n]), arcs, rows)
    for i in range(q.shape[0]):
        fk_into(other.model, rows[i], P)
        x = y = 0.0
        for r in range(3):
            x += P[r, 0] * pose[r, 0] + P[r, 1] * pose[r, 1]
            y += P[r, 1] * pose[r, 0] - P[r, 0] * pose[r, 1]
        q[i, n] = math.nan if math.isnan(rows[i, 0]) else math.atan2(y, x)
        for j in range(n):
            q[i, j] = rows[i, j]
    return 0


def of_coupled(
    other: Constants, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """Of an arm in which every row moves by itself, the configurations that the joints can make."""
    n, m = near.shape[0], other.count
    there, low, high, t = np.zeros(m), np.full(m, -UNBOUNDED), np.full(m, UNBOUNDED), np.empty((q.shape[0], m))
    for i in range(m):
        for j in range(n):
            there[i] += other.expansion[i, j] * near[j]
    other.rows(other.inner, params, T, math.nan, there, (low, high), arcs, t)
    for row in range(q.shape[0]):
        for j in range(n):
            q[row, j] = 0.0
            for i in range(m):
                q[row, j] += other.back[j, i] * t[row, i]
        apart = 0.0
        for i in range(m):
            off = t[row, i]
            for j in range(n):
                off -= other.expansion[i, j] * q[row, j]
            apart = max(apart, abs(wrap(off) if other.revolute[i] != 0.0 else off))
        for j in range(n):
            turned = wrap(q[row, j]) if other.turns[j] != 0.0 else q[row, j]
            q[row, j] = turned if apart < APART else math.nan
    return 0


def _complete(
    other: Constants, params: Array, T: Array, near: Array, limits: Limits, arcs: Array, rows: Array
) -> None:
    """rows ``(k, 6)`` ← those of the arm completed to six joints; the virtual ones are at 0, without limits."""
    lower, upper = limits
    there, low, high = np.zeros(6), np.full(6, -UNBOUNDED), np.full(6, UNBOUNDED)
    for j in range(near.shape[0]):
        there[j], low[j], high[j] = near[j], lower[j], upper[j]
    other.rows(other.inner, params, T, math.nan, there, (low, high), arcs, rows)


def _product(A: Array, B: Array, out: Array) -> None:
    """out ← A B, arrays ``(4, 4)``."""
    for i in range(4):
        for j in range(4):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j] + A[i, 3] * B[3, j]
