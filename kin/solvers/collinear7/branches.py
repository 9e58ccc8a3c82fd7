"""The kernel that finds all branches of one target: joint limits, feasible intervals, singular poses."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import jit
from kin.solvers.blocks import each_solved
from kin.solvers.canonical import FOREARM, OFFSET, UPPER_ARM, canonical_box, canonical_pose
from kin.solvers.collinear7.redundancy import at_roll, choose_roll, roll_parts, theta1_intervals
from kin.solvers.common import (
    HIGH,
    LOW,
    NEAR,
    clear,
    copy_row,
    lay_probes,
    misfit_of,
    split_sum,
    zyz,
    zyz_breaks,
)
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# After what `Geometry7.params` has: metres by which the forearm may miss the wrist centre and still close.
SLACK = FOREARM + 1
REACH = TOLERANCES.reach
_MERGE = TOLERANCES.merge
# How the forearm lies to the upper arm.
_BENT, _STRAIGHT, _FOLDED = range(3)
# (the requested θ1 and roll, NaN where they are free; the roll at the seed; whether the roll is chosen so that the
# joint limits hold where that is possible; whether the task is a point and an approach direction).
Options = tuple[float, float, float, bool, bool]


@jit
def _azimuths(arm: Array, M: Array, box: Array) -> tuple[float, float, float]:
    """The azimuth of u as middle ± spread, and the gap in metres by which the forearm misses W."""
    d3, d5 = arm[UPPER_ARM], arm[FOREARM]
    x, y, z = M[0, 3], M[1, 3], M[2, 3]
    h = math.hypot(x, y)
    k = (x * x + y * y + z * z + d3 * d3 - d5 * d5) / (2.0 * d3)
    if h < 1e-12 and abs(k) < 1e-12:
        return box[NEAR, 0] + box[NEAR, 1] + 0.5 * math.pi, 0.0, 0.0
    if abs(k) - h > arm[SLACK]:
        return 0.0, 0.0, abs(k) - h
    spread = math.atan2(math.sqrt(max((h - k) * (h + k), 0.0)), k)
    return math.atan2(y, x), spread if spread >= _MERGE else 0.0, 0.0


@jit
def _merged_sum(M: Array, t12: float, box: Array) -> float:
    """θ12 where its two solutions have merged: between them everything closes within the merging tolerance.

    Near a straight elbow that holds for every θ3, and the seed's is taken; the height of the forearm,
    −z = d5 sin θ3 sin θ4, is given by the target.
    """
    x, y, z = M[0, 3], M[1, 3], M[2, 3]
    h = math.hypot(x, y)
    v1 = math.cos(t12) * x + math.sin(t12) * y
    if math.hypot(v1, z) < 100.0 * _MERGE * h and abs(math.sin(box[NEAR, 2])) > 0.0:
        wanted = -z * math.cos(box[NEAR, 2]) / math.sin(box[NEAR, 2])
        t12 += min(max((wanted - v1) / h, -_MERGE), _MERGE)
    return t12


@jit
def _forearm(arm: Array, M: Array, t12: float, theta1: float, box: Array, R02: Array, elbows: Array) -> int:
    """R02 ``(3, 3)`` and elbows ``(2, 4)`` ← θ1 … θ4 of both elbow branches, for given θ12; see `_BENT` for the
    code.

    theta1: the requested joint value, NaN to split θ12 as near the seed as the limits allow.
    """
    x, y, z = M[0, 3], M[1, 3], M[2, 3]
    c, s = math.cos(t12), math.sin(t12)
    R02[0, 0], R02[0, 1], R02[0, 2] = c, 0.0, -s
    R02[1, 0], R02[1, 1], R02[1, 2] = s, 0.0, c
    R02[2, 0], R02[2, 1], R02[2, 2] = 0.0, -1.0, 0.0
    v1, v2, v3 = c * x + s * y, -z, c * y - s * x - arm[UPPER_ARM]
    side = math.hypot(v1, v2)
    aligned = side < 1e-11 * arm[FOREARM]
    t1 = split_sum(t12, box[NEAR, 0], box[LOW, 0], box[HIGH, 0], box[NEAR, 1], box[LOW, 1], box[HIGH, 1])
    if not math.isnan(theta1):
        t1 = theta1 + arm[OFFSET]
    for elbow in range(2):
        sign = 1.0 if elbow == 0 else -1.0
        elbows[elbow, 0], elbows[elbow, 1] = t1, t12 - t1
        elbows[elbow, 2] = box[NEAR, 2] if aligned else math.atan2(sign * v2, sign * v1)
        elbows[elbow, 3] = math.atan2(sign * side, v3)
    if aligned:
        return _STRAIGHT if v3 > 0.0 else _FOLDED
    return _BENT


@jit
def _seen_from_forearm(R02: Array, t3: float, t4: float, R: Array, out: Array) -> None:
    """out ``(3, 3)`` ← R04ᵀ R with R04 = R02 Rz(θ3) Ry(θ4), of the first three rows and columns of R."""
    c3, s3, c4, s4 = math.cos(t3), math.sin(t3), math.cos(t4), math.sin(t4)
    for j in range(3):
        a = R02[0, 0] * R[0, j] + R02[1, 0] * R[1, j] + R02[2, 0] * R[2, j]
        b = R02[0, 1] * R[0, j] + R02[1, 1] * R[1, j] + R02[2, 1] * R[2, j]
        z = R02[0, 2] * R[0, j] + R02[1, 2] * R[1, j] + R02[2, 2] * R[2, j]
        x = c3 * a + s3 * b
        out[0, j] = c4 * x - s4 * z
        out[1, j] = c3 * b - s3 * a
        out[2, j] = s4 * x + c4 * z


@jit
def _wrist(R47: Array, branch: int, box: Array, angles: Array) -> None:
    """angles[4:7] ← θ5, θ6, θ7 from R47, with the sign of sin θ6 that the branch stands for."""
    zyz(R47, -1.0 if branch & 1 else 1.0, box[NEAR], box[LOW], box[HIGH], 4, angles)


@jit
def _straight_theta3(R02: Array, M: Array, branch: int, box: Array, angles: Array) -> float:
    """θ3 with the elbow straight: θ3 and θ5 then turn about one line, so θ5 can be kept inside its limits."""
    R47 = np.empty((3, 3))
    _seen_from_forearm(R02, 0.0, 0.0, M, R47)
    _wrist(R47, branch, box, angles)
    return float(
        split_sum(angles[4], box[NEAR, 2], box[LOW, 2], box[HIGH, 2], box[NEAR, 4], box[LOW, 4], box[HIGH, 4])
    )


@jit
def _roll_probes(bent: Array, box: Array, respect_limits: bool, probes: Array) -> int:
    """probes ← the rolls at which θ5, θ6, θ7 meet a limit, and the middles between them; returns their number."""
    if not respect_limits:
        return 0
    breaks = np.empty(64)
    count = zyz_breaks(bent, (box[LOW], box[HIGH]), 4, breaks, 0)
    return int(lay_probes(breaks, count, probes))


@jit
def solve(
    arm: Array, T: Array, options: Options, seed: Array, lower: Array, upper: Array, arcs: Array, rolls: Array,
    out: Array,
) -> tuple[float, int, int]:  # fmt: skip
    """All branches of a target T ``(4, 4)``: (gap in metres, number of intervals of θ1, number of those of the
    roll).

    out ``(8, 9)`` ← seven joint values, θ1 and the roll of each branch, NaN where there is none; two that have
    merged are both there. arcs, rolls ``(n, 3)`` ← the feasible intervals, rows (branch, low, high). seed, lower,
    upper ``(7,)``: joint values.
    """
    theta1, roll, seed_roll, respect_limits, free_roll = options
    clear(out)
    M, R02, R47 = np.empty((4, 4)), np.empty((3, 3)), np.empty((3, 3))
    parts, bent, probes = np.empty((3, 3, 3)), np.empty((3, 3, 3)), np.empty(130)
    box, elbows = np.empty((3, 7)), np.empty((2, 4))
    canonical_box(arm[OFFSET:UPPER_ARM], seed, lower, upper, box)
    canonical_pose(arm, T, M)
    middle, spread, gap = _azimuths(arm, M, box)
    if gap > 0.0:
        return gap, 0, 0
    if free_roll:
        roll_parts(arm, T, parts)
    found, rolls_found, n_probes = 0, 0, 0
    for side in range(1 if spread == 0.0 else 2):
        t12 = middle + (spread if side == 0 else -spread) - 0.5 * math.pi
        if spread == 0.0:
            t12 = _merged_sum(M, t12, box)
        shape = _forearm(arm, M, t12, theta1, box, R02, elbows)
        for i in range(4 if shape == _BENT else 2):
            branch = 4 * side + i
            row, elbow = out[branch], elbows[i // 2]
            for joint in range(4):
                row[joint] = elbow[joint]
            if free_roll:
                if i % 2 == 0:
                    for part in range(3):
                        _seen_from_forearm(R02, row[2], row[3], parts[part], bent[part])
                    n_probes = _roll_probes(bent, box, respect_limits, probes)
                row[8], rolls_found = choose_roll(
                    bent, branch, roll, seed_roll, probes[:n_probes], box, rolls, rolls_found
                )
                at_roll(bent, row[8], R47)
            else:
                if shape == _STRAIGHT:
                    row[2] = elbow[2] = _straight_theta3(R02, M, branch, box, row)
                _seen_from_forearm(R02, row[2], row[3], M, R47)
            _wrist(R47, branch, box, row)
            if misfit_of(row, box[LOW], box[HIGH], 2, 7) == 0.0:
                found = theta1_intervals(arm, t12, box, branch, arcs, found)
            _as_joint_values(arm, row)
        if shape != _BENT:
            copy_row(out, 4 * side, 4 * side + 2)
            copy_row(out, 4 * side + 1, 4 * side + 3)
    if spread == 0.0:
        for branch in range(4):
            copy_row(out, branch, branch + 4)
    return 0.0, found, rolls_found


@jit
def _as_joint_values(arm: Array, row: Array) -> None:
    """Turn a row of `solve`, in place, from canonical angles into joint values.

    θ1 may span more than a turn: it keeps its own.
    """
    theta1 = row[0] - arm[OFFSET]
    for i in range(7):
        row[i] = wrap(row[i] - arm[OFFSET + i])
    row[0] = row[7] = theta1
    row[8] = wrap(row[8])


@jit
def _pose(
    arm: Array, T: Array, value: float, seed: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> None:
    """`solve` for a pose inside the limits, with θ1 as requested, or NaN."""
    solve(arm, T, (value, math.nan, 0.0, True, False), seed, lower, upper, arcs, arcs, out)


solve_many = each_solved(_pose, math.nan, 64, more=2)
