"""Kernels that find the feasible intervals of the arm angle ψ and choose a value of it.

A finite set of arm angles decides everything: those where a joint meets a limit, the middles between neighbours
of these, those at which some joint keeps its seed value, and a grid. `lay_out` collects them, `weigh` finds for
each how far the joints are outside their limits and how far they move, `intervals` and
:mod:`kin.solvers.srs7.nearest` use that. All of it is
one workspace array W ``(ROWS, COLUMNS)``, a column per arm angle, so that the loops are vectorised.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN
from kin.kernels.compile import inlined, jit
from kin.kernels.simd import atan2, rounded, sin_cos, wrapped
from kin.solvers.common import (
    HIGH,
    LOW,
    NEAR,
    UNBOUNDED,
    add_extremes,
    lay_probes,
    nearest_in_arcs,
    zyz,
    zyz_conditions,
)
from kin.solvers.srs7.geometry import STAY
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Rows of the workspace W: the arm angle, then for either sign of sin θ2 and of sin θ6 how far the shoulder or the
# wrist is outside its limits and its squared step from the seed, then the Z-Y-Z angles of one spherical joint, and
# the cell of the grid that the arm angle is in.
PSI, SHOULDER_MISFIT, WRIST_MISFIT, SHOULDER_STEP, WRIST_STEP, FIRST = 0, 1, 3, 5, 7, 9
CELL, ROWS, COLUMNS = 12, 13, 160
GRID = 24  # arm angles of the grid, a whole number of vectors
_CONDITIONS, _VECTOR = 24, 8  # at most 18 of the first; values in a vector of the processor
_SINGULAR = TOLERANCES.singular
_LIMIT = TOLERANCES.limit
_INSET = TOLERANCES.interval_inset
_PER_TURN = 1.0 / TURN


@jit
def lay_out(parts: Array, box: Array, respect_limits: bool, start: float, W: Array) -> tuple[int, int]:
    """W[PSI] ← the arm angles to test. Returns how many come from limits, and how many columns are filled: whole
    vectors, the last ones before the grid with copies.

    parts ``(2, 3, 3, 3)``: as from `affine`. Those from limits alternate between limit and middle. Unless `start`
    is NaN, others are added: those at which a joint keeps its seed value, those on either side of where the image
    of a joint jumps by a turn, at a limit, and a grid that begins with `start`.
    """
    psi, rows, breaks, ends = W[PSI], np.zeros((3, _CONDITIONS)), np.empty(64), np.empty((2, 7))
    bounds, held = (box[LOW], box[HIGH]), (box[NEAR], box[STAY])
    first = last = 0
    keep = not math.isnan(start)
    if respect_limits:
        first = zyz_conditions(parts[0], bounds, 0, rows, 0)
        first = last = zyz_conditions(parts[1], bounds, 4, rows, first)
    wide = last
    if keep:
        last = zyz_conditions(parts[0], held, 0, rows, last)
        wide = last = zyz_conditions(parts[1], held, 4, rows, last)
        for side in range(2 if respect_limits else 0):
            if _ends_of_wide(box, side, ends):
                wide = zyz_conditions(parts[0], (ends[0], ends[1]), 0, rows, wide)
                wide = zyz_conditions(parts[1], (ends[0], ends[1]), 4, rows, wide)
    _roots(rows)
    limits = count = 0
    if respect_limits:
        count = _those_that_are(rows, 0, first, breaks, 0)
        count = add_extremes(parts[0], breaks, count)
        limits = count = lay_probes(breaks, add_extremes(parts[1], breaks, count), psi)
    if keep:
        count = _those_that_are(rows, first, last, psi, count)
        count = add_extremes(parts[0], psi, count)
        count = add_extremes(parts[1], psi, count)
        after = _those_that_are(rows, last, wide, psi, count)
        for j in range(after - count):
            psi[after + j] = psi[count + j] + _INSET
            psi[count + j] -= _INSET
        count = 2 * after - count
    filled = (count + _VECTOR - 1) // _VECTOR * _VECTOR
    for j in range(count, filled):
        psi[j] = psi[0]
    if keep:
        for j in range(filled):
            past = (psi[j] - start) * _PER_TURN
            W[CELL, j] = min(math.floor((past - math.floor(past)) * GRID), GRID - 1.0)
        for j in range(GRID):
            psi[filled + j] = start + j * (TURN / GRID)
        filled += GRID
    return limits, filled


@jit
def _ends_of_wide(box: Array, side: int, ends: Array) -> bool:
    """ends ``(2, 7)`` ← the lower (side 0) or upper limits of the joints that have a turn or more, for
    `zyz_conditions`, if the image nearest to the seed may be beyond; returns whether there is any.
    """
    found = False
    for i in range(7):
        width, beyond = box[HIGH, i] - box[LOW, i], abs(box[LOW + side, i] - box[NEAR, i])
        wide = (TURN <= width < UNBOUNDED) & (beyond < math.pi)
        ends[0, i] = box[LOW + side, i] if wide else 0.0
        ends[1, i] = ends[0, i] if wide else 2.0 * TURN
        found = found or wide
    return found


@jit
def _roots(rows: Array) -> None:
    """rows[0], rows[1] ← the two roots of each condition in rows ``(3, _CONDITIONS)``, NaN if there is none.

    Does the same as `kin.solvers.common.add_roots`, to all at once, as vectors.
    """
    for k in range(_CONDITIONS):
        a, b, c = rows[0, k], rows[1, k], rows[2, k]
        amplitude = math.sqrt(a * a + b * b)
        none = (amplitude < 1e-15) | (abs(c) > amplitude * (1.0 + 1e-9))
        square = (amplitude - c) * (amplitude + c)
        centre = atan2(b, a)
        offset = atan2(math.sqrt(square if square > 0.0 else 0.0), -c)
        rows[0, k] = math.nan if none else wrapped(centre + offset)
        rows[1, k] = wrapped(centre - offset)


@jit
def _those_that_are(rows: Array, first: int, last: int, out: Array, count: int) -> int:
    """Append the roots of the conditions first…last−1; returns the new count."""
    for k in range(first, last):
        if not math.isnan(rows[0, k]):
            out[count], out[count + 1] = rows[0, k], rows[1, k]
            count += 2
    return count


@inlined
def image_of(x: float, near: float, low: float, high: float) -> tuple[float, float]:
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
    M0, M1, M2 = parts[joint, 0], parts[joint, 1], parts[joint, 2]
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
    M0, M1, M2 = parts[joint, 0], parts[joint, 1], parts[joint, 2]
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
def weigh(parts: Array, joint: int, moving: int, count: int, box: Array, W: Array) -> int:
    """Weigh a spherical joint (0 shoulder, 1 wrist) at `count` arm angles, for either sign of sin B.

    Rows SHOULDER_… or WRIST_… of W ← how far its angles are outside the limits, and the squared steps from the
    seed of its first `moving` angles. ``Rz(A) Ry(B) Rz(C) = M0 + M1 cos ψ + M2 sin ψ``; the solution with the
    other sign is A + π, −B, C + π. Every operation is applied to all arm angles at once, as vectors. Returns at
    how many of them sin B vanishes.
    """
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
                outside, way = image_of(sign * W[FIRST + i, j] + turn, near, low, high)
                W[misfit + side, j] += outside
                W[step + side, j] += weight * (way * way)
    if singular > 0:
        for j in range(count):
            if abs(math.sin(W[FIRST + 1, j])) < _SINGULAR:  # both signs are the same solution
                W[misfit + 1, j] = W[misfit, j]
                W[step + 1, j] = W[step, j]
    return singular


@jit
def intervals(
    branch: int, elbow_misfit: float, limits: int, preferred: float, W: Array, arcs: Array, found: int
) -> tuple[float, int]:
    """Append the feasible intervals of one branch: (arm angle, new number of intervals).

    arcs ``(n, 3)`` ← rows (branch, low, high). The arm angle is the feasible one nearest to `preferred`; if none
    is feasible, the tested one with the least excess over the limits.
    """
    shoulder, wrist = W[SHOULDER_MISFIT + (branch >> 2)], W[WRIST_MISFIT + (branch & 1)]
    first, changes, inside, turns = found, 0, False, W[FIRST]
    if elbow_misfit == 0.0:
        # Where the arm angles that are inside begin and end: without a jump, as nothing foretells it.
        for j in range(limits):
            now = shoulder[j] + wrist[j] == 0.0
            turns[changes] = j
            changes += 1 if now != inside else 0
            inside = now
    if changes > 0:
        turns[changes] = limits
        for k in range(0, changes, 2):
            found = _with_run(arcs, first, found, branch, W[PSI], (int(turns[k]), int(turns[k + 1]), limits))
        return nearest_in_arcs(arcs, first, found, preferred), found
    psi, best = preferred, math.inf
    for j in range(limits):
        misfit = elbow_misfit + shoulder[j] + wrist[j]
        if misfit < best:
            best, psi = misfit, W[PSI, j]
    return psi, found


@jit
def _with_run(arcs: Array, first: int, found: int, branch: int, psi: Array, run: tuple[int, int, int]) -> int:
    """Append the arc of the arm angles psi[begin:end], or join it to the last one; returns the number of arcs.

    run: begin, end, and how many arm angles there are; those at even places are limits, the others middles.
    """
    begin, end, count = run
    low = psi[begin - begin % 2]
    last = end - end % 2
    high = psi[last] if last < count else psi[0] + TURN
    if end % 2 == 1:
        high = psi[end - 1]
    if count == 1:
        low, high = -math.pi, math.pi
    if found > first and low <= arcs[found - 1, 2]:
        arcs[found - 1, 2] = max(high, arcs[found - 1, 2])
    elif found < arcs.shape[0]:
        arcs[found, 0], arcs[found, 1], arcs[found, 2] = branch, low, high
        found += 1
    return found
