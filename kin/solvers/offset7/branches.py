"""Kernels for all branches of one target at one value of the given joint.

With O where chain axes 2 and 3 meet, W the wrist centre and y the vector from O to W before axis 3 turns:

- |W − O| = |y| depends on t4 only: ``A cos t4 + B sin t4 = D``, the two elbows;
- the height of W along axis 2 depends on t3 then: the two sides of the plane of axes 2 and 3;
- t2 turns W into place, and the rotation that is left is ``Rz(t5) Ry(t6) Rz(t7)``, the two signs of sin t6.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import jit
from kin.kernels.fk import all_finite_pose
from kin.solvers.blocks import one_after_another
from kin.solvers.canonical import canonical_pose, inverse_into
from kin.solvers.common import UNBOUNDED, clear, zyz
from kin.solvers.offset7.geometry import (
    A1,
    A3,
    COS1,
    COS2,
    COS3,
    COS4,
    D1,
    D2,
    D3,
    OFFSET,
    REACH,
    REVERSED,
    SIGN,
    SIN1,
    SIN2,
    SIN3,
    SIN4,
    X4,
    Y4,
    Z4,
)
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_SINGULAR = TOLERANCES.singular


@jit
def chain_values(params: Array, q: Array, t: Array) -> None:
    """t ``(7,)`` ← the chain's angles of a configuration q ``(7,)``."""
    for i in range(7):
        j = 6 - i if params[REVERSED] > 0.0 else i
        t[i] = params[SIGN + i] * q[j] + params[OFFSET + i]


@jit
def chain_pose(params: Array, T: Array, N: Array) -> None:
    """The first three rows of N ← the canonical pose of the chain, which is reversed for T⁻¹; T ``(4, 4)``."""
    if params[REVERSED] > 0.0:
        X = np.empty((3, 4))
        inverse_into(T, X)
        canonical_pose(params, X, N)
    else:
        canonical_pose(params, T, N)


@jit
def seen(params: Array, T: Array, t1: float, M: Array) -> None:
    """M ``(3, 4)`` ← the wrist of the target T ``(4, 4)`` as seen from O, z along axis 2, with joint 1 at t1."""
    p = params
    N = np.empty((3, 4))
    chain_pose(p, T, N)
    c, s = math.cos(t1), math.sin(t1)
    for k in range(4):
        last = 1.0 if k == 3 else 0.0
        x, y = c * N[0, k] + s * N[1, k] - last * p[A1], c * N[1, k] - s * N[0, k]
        z = N[2, k] - last * p[D1]
        M[0, k] = x
        M[1, k] = p[COS1] * y + p[SIN1] * z
        M[2, k] = p[COS1] * z - p[SIN1] * y - last * p[D2]


@jit
def two_roots(a: float, b: float, rest: float, slack: float, out: Array) -> float:
    """out ``(2,)`` ← the roots of ``a cos t + b sin t = rest``, φ + δ and φ − δ with δ in [0, π].

    Returns how far `rest` is inside the amplitude, as a share of it: negative where there is no root. Up to
    `slack` outside, both roots are φ or φ + π. Where the amplitude is 0 the roots are NaN, if `rest` is 0 too.
    A negative slack is what `rest` has to be inside the amplitude at least.
    """
    size = math.sqrt(a * a + b * b)
    if size < _SINGULAR:
        out[0] = out[1] = math.nan
        return 1.0 if abs(rest) <= slack else -1.0
    margin = size - abs(rest)
    if slack < 0.0 and margin < -slack:
        return (margin + slack) / size
    if margin < 0.0 and margin >= -slack:
        margin = 0.0
    middle = math.atan2(b, a)
    side = math.atan2(math.sqrt(max(margin * (size + abs(rest)), 0.0)), rest)
    out[0], out[1] = middle + side, middle - side
    return margin / size


@jit
def distances(params: Array) -> tuple[float, float, float]:
    """(constant, A, B) of ``|W − O|² = constant + 2 (A cos t4 + B sin t4)``."""
    p = params
    square = p[X4] * p[X4] + p[Y4] * p[Y4] + p[Z4] * p[Z4]
    constant = p[A3] * p[A3] + p[D3] * p[D3] + square + 2.0 * p[D3] * p[COS3] * p[Z4]
    a = p[A3] * p[X4] + p[D3] * p[SIN3] * p[Y4]
    return constant, a, p[D3] * p[SIN3] * p[X4] - p[A3] * p[Y4]


@jit
def forearm(params: Array, t4: float) -> tuple[float, float, float]:
    """The vector from O to W before axis 3 turns."""
    p = params
    c, s = math.cos(t4), math.sin(t4)
    x, y = c * p[X4] - s * p[Y4], s * p[X4] + c * p[Y4]
    return p[A3] + x, p[COS3] * y - p[SIN3] * p[Z4], p[D3] + p[SIN3] * y + p[COS3] * p[Z4]


@jit
def all_branches(params: Array, T: Array, near: Array, t: Array, only: int, rows: Array, margin: Array) -> None:
    """All branches with the first chain angle in t ``(7,)``, as chain angles; `near` ``(7,)`` decides what is
    free. With `only` ≥ 0 the row of that branch alone is written.

    rows ``(8, 7)`` ← angles, NaN where the branch does not exist; margin ``(8,)`` ← how far inside the arm's reach
    the branch is, as a share: negative where it does not exist, 0 where two branches merge.
    """
    p = params
    M, R, roots, sides = np.empty((3, 4)), np.empty((3, 3)), np.empty(2), np.empty(2)
    low, high = np.full(7, -UNBOUNDED), np.full(7, UNBOUNDED)
    clear(rows)
    seen(p, T, t[0], M)
    wx, wy, wz = M[0, 3], M[1, 3], M[2, 3]
    square = wx * wx + wy * wy + wz * wz
    constant, a, b = distances(p)
    bent = two_roots(a, b, 0.5 * (square - constant), p[REACH] * math.sqrt(square), roots)
    for k in range(8):
        margin[k] = bent
    if bent < 0.0:
        return
    for elbow in range(2):
        if only >= 0 and only >> 2 != elbow:
            continue
        t[3] = roots[elbow]
        y0, y1, y2 = forearm(p, t[3])
        level = two_roots(p[SIN2] * y1, p[SIN2] * y0, wz - p[COS2] * y2, p[REACH], sides)
        for k in range(4):
            margin[4 * elbow + k] = min(bent, level) if level >= 0.0 else level
        if level < 0.0:
            continue
        for side in range(2):
            if only >= 0 and (only >> 1) & 1 != side:
                continue
            t[2] = near[2] if math.isnan(sides[side]) else sides[side]
            _finish(p, M, (wx, wy), (y0, y1, y2), t, R)
            for wrist in range(2):
                if only >= 0 and only & 1 != wrist:
                    continue
                zyz(R, 1.0 - 2.0 * wrist, near, low, high, 4, t)
                row = 4 * elbow + 2 * side + wrist
                for i in range(7):
                    rows[row, i] = t[i]
                if math.isnan(t[1]):
                    rows[row, 1] = near[1]


@jit
def _finish(
    p: Array, M: Array, wrist: tuple[float, float], y: tuple[float, float, float], t: Array, R: Array
) -> None:
    """t[1] ← the angle that turns the vector y into place; R ``(3, 3)`` ← the rotation left for the wrist.

    With W on axis 2 its angle is kept as it is in t.
    """
    c3, s3 = math.cos(t[2]), math.sin(t[2])
    vx, vy = c3 * y[0] - s3 * y[1], p[COS2] * (s3 * y[0] + c3 * y[1]) - p[SIN2] * y[2]
    cosine, sine = wrist[0] * vx + wrist[1] * vy, wrist[1] * vx - wrist[0] * vy
    size = math.sqrt(cosine * cosine + sine * sine)
    if size > _SINGULAR:
        t[1] = math.atan2(sine, cosine)
        c2, s2 = cosine / size, sine / size
    else:
        c2, s2 = math.cos(t[1]), math.sin(t[1])
    c4, s4 = math.cos(t[3]), math.sin(t[3])
    for k in range(3):
        x, y_, z = c2 * M[0, k] + s2 * M[1, k], c2 * M[1, k] - s2 * M[0, k], M[2, k]
        y_, z = p[COS2] * y_ + p[SIN2] * z, p[COS2] * z - p[SIN2] * y_
        x, y_ = c3 * x + s3 * y_, c3 * y_ - s3 * x
        y_, z = p[COS3] * y_ + p[SIN3] * z, p[COS3] * z - p[SIN3] * y_
        x, y_ = c4 * x + s4 * y_, c4 * y_ - s4 * x
        R[0, k], R[1, k], R[2, k] = x, p[COS4] * y_ + p[SIN4] * z, p[COS4] * z - p[SIN4] * y_


@jit
def gap_of(params: Array, T: Array, value: float) -> tuple[int, float, float]:
    """Why no branch exists at this value: (code, metres by which it fails, metres that |W − O| has to keep to).

    Code 0: a branch exists; 1: W too far from O; 2: too near; 3: W cannot get to its height along axis 2.
    """
    p = params
    M, roots, sides = np.empty((3, 4)), np.empty(2), np.empty(2)
    seen(p, T, p[SIGN] * value + p[OFFSET], M)
    square = M[0, 3] * M[0, 3] + M[1, 3] * M[1, 3] + M[2, 3] * M[2, 3]
    constant, a, b = distances(p)
    far = math.sqrt(square)
    if two_roots(a, b, 0.5 * (square - constant), p[REACH] * far, roots) < 0.0:
        most = math.sqrt(constant + 2.0 * math.sqrt(a * a + b * b))
        least = math.sqrt(max(constant - 2.0 * math.sqrt(a * a + b * b), 0.0))
        return (1, far - most, most) if far > most else (2, least - far, least)
    gap = math.inf
    for elbow in range(2):
        y0, y1, y2 = forearm(p, roots[elbow])
        rest = M[2, 3] - p[COS2] * y2
        if two_roots(p[SIN2] * y1, p[SIN2] * y0, rest, p[REACH], sides) >= 0.0:
            return 0, 0.0, 0.0
        gap = min(gap, abs(rest) - abs(p[SIN2]) * math.sqrt(y0 * y0 + y1 * y1))
    return 3, gap, math.nan


@jit
def joints_of(params: Array, rows: Array, value: float, out: Array) -> None:
    """out ``(8, 7)`` ← the arm's joint values of chain angles rows ``(8, 7)``, the given joint's unchanged."""
    for k in range(8):
        for i in range(7):
            j = 6 - i if params[REVERSED] > 0.0 else i
            x = params[SIGN + i] * (rows[k, i] - params[OFFSET + i])
            out[k, j] = wrap(x) if i > 0 else (value if not math.isnan(x) else x)


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(8, 7)`` ← all branches of the target T ``(4, 4)``; False if T is not finite.

    value: that of the given joint, NaN for its value in `near` ``(7,)``.
    """
    if not all_finite_pose(T):
        clear(out)
        return False
    t, close, rows, margin = np.empty(7), np.empty(7), np.empty((8, 7)), np.empty(8)
    given = 6 if params[REVERSED] > 0.0 else 0
    if math.isnan(value):
        value = near[given]
    chain_values(params, near, close)
    for i in range(7):
        t[i] = close[i]
    t[0] = params[SIGN] * value + params[OFFSET]
    all_branches(params, T, close, t, -1, rows, margin)
    joints_of(params, rows, value, out)
    return True


branches_many = one_after_another(branches_one)
