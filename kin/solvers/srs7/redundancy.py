"""Kernels that find the feasible intervals of the arm angle ψ and choose a value of it.

A finite set of arm angles decides everything: those where a joint meets a limit, the middles between neighbours
of these, and those at which some joint keeps its seed value. `lay_out` collects them, `weigh` finds for each how
far the joints are outside their limits and how far they move, `intervals` and `shorter_way` use that. All of it is
one workspace array W ``(ROWS, COLUMNS)``, a column per arm angle, so that the loops are vectorised.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import inlined, jit
from kin.kernels.simd import TURN, atan2, rounded, sin_cos, widest
from kin.solvers.common import (
    HIGH,
    LOW,
    NEAR,
    extend_arcs,
    lay_probes,
    nearest_image,
    nearest_in_arcs,
    zyz,
    zyz_breaks,
)
from kin.solvers.srs7.geometry import STAY
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Rows of the workspace W: the arm angle, then for either sign of sin θ2 and of sin θ6 how far the shoulder or the
# wrist is outside its limits and its squared step from the seed, then the Z-Y-Z angles of one spherical joint.
PSI, SHOULDER_MISFIT, WRIST_MISFIT, SHOULDER_STEP, WRIST_STEP, FIRST = 0, 1, 3, 5, 7, 9
ROWS, COLUMNS = 12, 160
_SINGULAR = TOLERANCES.singular
_LIMIT = TOLERANCES.limit
_PER_TURN = 1.0 / TURN


@jit
def lay_out(parts: Array, box: Array, respect_limits: bool, keep: bool, W: Array) -> tuple[int, int]:
    """W[PSI] ← the arm angles to test. Returns how many come from limits, and how many there are.

    parts ``(3, 2, 3, 3)``: M0, M1, M2 of R03 and R47. Those from limits alternate between limit and middle. `keep`
    adds those at which a joint keeps its seed value.
    """
    psi = W[PSI]
    limits = 0
    if respect_limits:
        breaks = np.empty(64)
        count = zyz_breaks(parts[0, 0], parts[1, 0], parts[2, 0], box[LOW], box[HIGH], 0, breaks, 0)
        count = zyz_breaks(parts[0, 1], parts[1, 1], parts[2, 1], box[LOW], box[HIGH], 4, breaks, count)
        limits = lay_probes(breaks, count, psi)
    count = limits
    if keep:
        count = zyz_breaks(parts[0, 0], parts[1, 0], parts[2, 0], box[NEAR], box[STAY], 0, psi, count)
        count = zyz_breaks(parts[0, 1], parts[1, 1], parts[2, 1], box[NEAR], box[STAY], 4, psi, count)
    return limits, count


@inlined
def _image(x: float, near: float, low: float, high: float) -> tuple[float, float]:
    """How far the angle x is outside [low, high] at its best whole turn, and its step from `near`.

    The step is that of the image inside the limits, if there is one. Does the same as `kin.solvers.common.excess`
    and `nearest_image`, without a jump.
    """
    least, most = low - _LIMIT, high + _LIMIT
    y = x + TURN * rounded((near - x) * _PER_TURN)
    turns = (least - x) * _PER_TURN
    up = rounded(turns)
    above = x + TURN * (up + 1.0 if up < turns else up)
    turns = (most - x) * _PER_TURN
    down = rounded(turns)
    below = x + TURN * (down - 1.0 if down > turns else down)
    y = below if y > most else y
    y = above if y < least else y
    under, over = low - (above - TURN), above - high
    outside = under if under < over else over
    return outside if above > most else 0.0, y - near


@jit
def _split(parts: Array, joint: int, count: int, box: Array, W: Array) -> int:
    """W[FIRST:FIRST+3] ← the Z-Y-Z angles of a spherical joint, sin B ≥ 0, at `count` arm angles.

    Returns for how many of these sin B vanishes.
    """
    widest()
    M0, M1, M2 = parts[0, joint], parts[1, joint], parts[2, joint]
    singular = 0
    for j in range(count):
        s, c = sin_cos(W[PSI, j])
        x = M0[0, 2] + c * M1[0, 2] + s * M2[0, 2]
        y = M0[1, 2] + c * M1[1, 2] + s * M2[1, 2]
        z = M0[2, 2] + c * M1[2, 2] + s * M2[2, 2]
        xx = M0[0, 0] + c * M1[0, 0] + s * M2[0, 0]
        yx = M0[1, 0] + c * M1[1, 0] + s * M2[1, 0]
        xy = M0[0, 1] + c * M1[0, 1] + s * M2[0, 1]
        yy = M0[1, 1] + c * M1[1, 1] + s * M2[1, 1]
        h = math.sqrt(x * x + y * y)
        singular += 1 if h < _SINGULAR else 0
        ca, sa = x / h, y / h
        W[FIRST, j] = atan2(y, x)
        W[FIRST + 1, j] = atan2(h, z)
        W[FIRST + 2, j] = atan2(ca * yx - sa * xx, ca * yy - sa * xy)
    if singular > 0:
        _split_singular(parts, joint, count, box, W)
    return singular


@jit
def _split_singular(parts: Array, joint: int, count: int, box: Array, W: Array) -> None:
    """W[FIRST:FIRST+3] ← the Z-Y-Z angles where sin B vanishes and only A ± C is determined."""
    M0, M1, M2 = parts[0, joint], parts[1, joint], parts[2, joint]
    R, angles = np.empty((3, 3)), np.empty(7)
    for j in range(count):
        s, c = sin_cos(W[PSI, j])
        for r in range(3):
            for q in range(3):
                R[r, q] = M0[r, q] + c * M1[r, q] + s * M2[r, q]
        if math.sqrt(R[0, 2] * R[0, 2] + R[1, 2] * R[1, 2]) < _SINGULAR:
            zyz(R, 1.0, box[NEAR], box[LOW], box[HIGH], 4 * joint, angles)
            for i in range(3):
                W[FIRST + i, j] = angles[4 * joint + i]


@jit
def weigh(parts: Array, joint: int, moving: int, count: int, box: Array, W: Array) -> None:
    """Weigh a spherical joint (0 shoulder, 1 wrist) at `count` arm angles, for either sign of sin B.

    Rows SHOULDER_… or WRIST_… of W ← how far its angles are outside the limits, and the squared steps from the
    seed of its first `moving` angles. ``Rz(A) Ry(B) Rz(C) = M0 + M1 cos ψ + M2 sin ψ``; the solution with the
    other sign is A + π, −B, C + π. Every operation is applied to all arm angles at once, as vectors.
    """
    widest()
    singular = _split(parts, joint, count, box, W)
    misfit, step = SHOULDER_MISFIT + 2 * joint, SHOULDER_STEP + 2 * joint
    for side in range(2):
        for j in range(count):
            W[misfit + side, j] = 0.0
            W[step + side, j] = 0.0
        for i in range(3):
            k = 4 * joint + i
            near, low, high = box[NEAR, k], box[LOW, k], box[HIGH, k]
            weight = 1.0 if i < moving else 0.0
            sign = -1.0 if i == 1 and side == 1 else 1.0
            turn = math.pi if i != 1 and side == 1 else 0.0
            for j in range(count):
                outside, way = _image(sign * W[FIRST + i, j] + turn, near, low, high)
                W[misfit + side, j] += outside
                W[step + side, j] += weight * (way * way)
    if singular > 0:
        for j in range(count):
            if abs(math.sin(W[FIRST + 1, j])) < _SINGULAR:  # both signs are the same solution
                W[misfit + 1, j] = W[misfit, j]
                W[step + 1, j] = W[step, j]


@jit
def intervals(
    branch: int, elbow_misfit: float, limits: int, preferred: float, W: Array, arcs: Array, found: int
) -> tuple[float, int]:
    """Append the feasible intervals of one branch: (arm angle, new number of intervals).

    arcs ``(n, 3)`` ← rows (branch, low, high). The arm angle is the feasible one nearest to `preferred`; if none
    is feasible, the tested one with the least excess over the limits.
    """
    shoulder, wrist = SHOULDER_MISFIT + (branch >> 2), WRIST_MISFIT + (branch & 1)
    psi = preferred
    first = found
    best = math.inf
    for j in range(limits):
        misfit = elbow_misfit + W[shoulder, j] + W[wrist, j]
        if misfit == 0.0 and found < arcs.shape[0]:
            found = extend_arcs(arcs, first, found, branch, W[PSI], j, limits)
        elif misfit < best and found == first:
            best = misfit
            psi = W[PSI, j]
    if found > first:
        psi = nearest_in_arcs(arcs, first, found, preferred)
    return psi, found


@jit
def shorter_way(
    branch: int, elbow: tuple[float, float], limits: int, count: int, respect_limits: bool, least: float, W: Array
) -> int:
    """The tested arm angle at which the joints move least, if the squared step is below `least`; else −1.

    elbow: how far θ4 is outside its limits, and its squared step. The middles between limits do not count.
    """
    elbow_misfit, elbow_step = elbow
    side, flip = branch >> 2, branch & 1
    best = -1
    for j in range(count):
        middle = j % 2 == 1 and j < limits
        misfit = elbow_misfit + W[SHOULDER_MISFIT + side, j] + W[WRIST_MISFIT + flip, j]
        way = elbow_step + W[SHOULDER_STEP + side, j] + W[WRIST_STEP + flip, j]
        if way < least and not middle and not (respect_limits and misfit > 0.0):
            least, best = way, j
    return best


@jit
def squared_step(angles: Array, box: Array, joints: int) -> float:
    """Sum of the squared steps of the first `joints` angles from the seed, each at its best whole turn."""
    total = 0.0
    for i in range(joints):
        total += (nearest_image(angles[i], box[NEAR, i], box[LOW, i], box[HIGH, i]) - box[NEAR, i]) ** 2
    return total
