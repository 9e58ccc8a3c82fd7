"""Kernels: all branches of one target, of a point alone, and of many targets."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import jit
from kin.kernels.fk import all_finite_pose
from kin.solvers.blocks import each_solved, one_after_another, unbounded
from kin.solvers.canonical import canonical_pose, signed_box
from kin.solvers.common import HIGH, LOW, NEAR, clear, copy_row, split_sum
from kin.solvers.contract import POSE, POSITION
from kin.solvers.parallel5.geometry import A1, A2, A3, ALONG, BESIDE, OFFSET, ROLLS, SIGN, TOOL_Z, P, Q
from kin.solvers.planar import planar_angles, planar_free
from kin.tolerances import TOLERANCES
from kin.transforms import Array

ROWS = 4
_SINGULAR = TOLERANCES.singular
_REACH = TOLERANCES.reach
_ROUNDING = 1e-15  # of the target's coordinates


@jit
def _held(arm: Array, T: Array, M: Array) -> None:
    """M ``(3, 4)`` ← the rotation of the last frame that the target asks for, and C, in the canonical base."""
    canonical_pose(arm, T, M)
    for r in range(3):
        if arm[ROLLS] != 0.0:
            M[r, 3] += arm[ALONG] * M[r, 2]
        else:
            M[r, 3] = arm[4 * r] * T[0, 3] + arm[4 * r + 1] * T[1, 3] + arm[4 * r + 2] * T[2, 3] + arm[4 * r + 3]


@jit
def _theta1_on_axis(arm: Array, M: Array, task: int, side: float, box: Array) -> tuple[float, bool]:
    """θ1 with C on axis 1, and whether the other shoulder side is another posture."""
    near, low, high = box[NEAR], box[LOW], box[HIGH]
    stay = min(max(near[0], low[0]), high[0])
    if task == POSITION:
        return stay, False
    x, y, beside = M[0, 2], M[1, 2], 0.0
    if arm[ROLLS] == 0.0 and task == POSE:
        x, y = M[1, 2], -M[0, 2]  # n is (−sin θ1, cos θ1, 0)
        return (math.atan2(y, x), False) if math.hypot(x, y) > _SINGULAR else (stay, False)
    if arm[ROLLS] == 0.0:
        u, v, w = arm[TOOL_Z], arm[TOOL_Z + 1], arm[TOOL_Z + 2]
        x, y, beside = M[0, 0] * u + M[0, 1] * v + M[0, 2] * w, M[1, 0] * u + M[1, 1] * v + M[1, 2] * w, w
    square = x * x + y * y - beside * beside
    if square > _SINGULAR * _SINGULAR:
        return math.atan2(y, x) - math.atan2(beside, side * math.sqrt(square)), True
    if task != POSE:
        return stay, False
    # Axis 5 on axis 1: only θ1 + θ5 counts, or θ1 − θ5 where it points down.
    if M[2, 2] > 0.0:
        total = math.atan2(-M[1, 0], -M[0, 0])
        return split_sum(total, near[0], low[0], high[0], near[4], low[4], high[4]), False
    total = math.atan2(M[1, 0], M[0, 0])
    return split_sum(total, near[0], low[0], high[0], -near[4], -high[4], -low[4]), False


@jit
def _in_plane(arm: Array, M: Array, t1: float, task: int) -> tuple[float, float]:
    """ψ and θ5 of the rotation nearest to the target's, with θ1 given."""
    c, s = math.cos(t1), math.sin(t1)
    if arm[ROLLS] != 0.0:
        psi = math.atan2(-(c * M[0, 2] + s * M[1, 2]), -M[2, 2])
        return psi, math.atan2(-(c * M[1, 0] - s * M[0, 0]), -(c * M[1, 1] - s * M[0, 1]))
    u, v, w = arm[TOOL_Z], arm[TOOL_Z + 1], arm[TOOL_Z + 2]
    if task == POSE:
        sine = -M[2, 0] - (c * M[0, 1] + s * M[1, 1])
        return math.atan2(sine, c * M[0, 0] + s * M[1, 0] - M[2, 1]), 0.0
    x = c * (M[0, 0] * u + M[0, 1] * v + M[0, 2] * w) + s * (M[1, 0] * u + M[1, 1] * v + M[1, 2] * w)
    y = -(M[2, 0] * u + M[2, 1] * v + M[2, 2] * w)
    return math.atan2(y * u - x * v, x * u + y * v), 0.0


@jit
def _put(arm: Array, t1: float, t5: float, angles: Array, row: Array) -> None:
    """row ← joint values of canonical angles; angles ``(4,)`` are those of joints 2, 3 and 4."""
    for i in range(5 if arm[ROLLS] != 0.0 else 4):
        t = t1 if i == 0 else (t5 if i == 4 else angles[i - 1])
        row[i] = wrap(arm[SIGN + i] * (t - arm[OFFSET + i]))


@jit
def solve(
    arm: Array, T: Array, request: tuple[int, float], near: Array, lower: Array, upper: Array, arcs: Array,
    out: Array,
) -> tuple[float, int]:  # fmt: skip
    """out ``(4, n + 1)`` ← the branches and ψ: (gap in metres, number of arcs of ψ).

    request: the task, and ψ for a point alone; if that is NaN, ψ is a feasible one near the seed's. Joint 5 is at
    0 unless the task is a pose.
    """
    task, psi = request
    clear(out)
    n = near.shape[0]
    M, box, planar, angles = np.empty((3, 4)), np.zeros((3, 5)), np.zeros((3, 4)), np.empty(4)
    _held(arm, T, M)
    signed_box(near, lower, upper, arm[SIGN : SIGN + n], arm[OFFSET : OFFSET + n], box)
    for k in range(3):
        for i in range(3):
            planar[k, i] = box[k, i + 1]
    cx, cy, beside = M[0, 3], M[1, 3], arm[BESIDE]
    r = math.hypot(cx, cy)
    rounding = _ROUNDING * (abs(T[0, 3]) + abs(T[1, 3]) + abs(T[2, 3]))
    on_axis = r < _SINGULAR + rounding and beside == 0.0
    if r < abs(beside) - _REACH:
        return abs(beside) - r, 0
    across = math.sqrt(max(r * r - beside * beside, 0.0))
    gap, found = math.inf, 0
    fixed = not math.isnan(psi)
    wanted = psi if fixed else planar[NEAR, 0] + planar[NEAR, 1] + planar[NEAR, 2]
    for side in range(2):
        x = across if side == 0 else -across
        t1 = math.atan2(cy, cx) - math.atan2(beside, x)
        if on_axis:
            t1, other = _theta1_on_axis(arm, M, task, 1.0 - 2.0 * side, box)
            if side == 1 and not other:
                copy_row(out, 0, 2)
                copy_row(out, 1, 3)
                break
        held, t5 = _in_plane(arm, M, t1, task)
        if task != POSE:
            t5 = arm[OFFSET + 4]
        chain = (x - arm[A1], -M[2, 3], arm[P], arm[Q], arm[A2], arm[A3])
        for elbow in range(2):
            row = 2 * side + elbow
            last = (1.0 - 2.0 * elbow, 0.0, 0.0)
            if task == POSITION:
                held, found = planar_free(chain, last, (wanted, fixed), row, planar, arcs, found, angles)
            else:
                miss = planar_angles(chain, last, held, planar, angles)
                gap = min(gap, miss)
                if miss > _REACH:
                    continue
            if not math.isnan(held):
                _put(arm, t1, t5, angles, out[row])
                out[row, n] = wrap(held)
    if task == POSITION:
        for side in range(2):
            R = math.hypot((1.0 - 2.0 * side) * across - arm[A1], M[2, 3])
            rho, longest, shortest = math.hypot(arm[P], arm[Q]), arm[A2] + arm[A3], abs(arm[A2] - arm[A3])
            gap = min(gap, max(abs(R - rho) - longest, shortest - R - rho))
    return gap, found


@jit
def branches_one(arm: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(4, n)`` ← all branches of the target T ``(4, 4)``, NaN where there is none; False if T is not finite.

    `value` is not used: a pose leaves nothing free, but for joint 1 where axis 5 is on axis 1. It then stays near.
    """
    if not all_finite_pose(T):
        clear(out)
        return False
    n = near.shape[0]
    limits, rows = unbounded(n), np.empty((ROWS, n + 1))
    solve(arm, T, (POSE, math.nan), near, limits[0], limits[1], rows[:0], rows)
    for k in range(ROWS):
        for i in range(n):
            out[k, i] = rows[k, i]
    return True


branches_many = one_after_another(branches_one)


solve_many = each_solved(solve, (POSE, math.nan), 0, more=1)
