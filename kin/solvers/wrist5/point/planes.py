"""Joint limits as planes in the coordinates (C, tx, R)."""

from __future__ import annotations

import math

from kin.angles import TURN, excess
from kin.kernels.compile import jit
from kin.solvers.wrist5.point.constants import A1, A2, D4, D6, JOINT, KAY, P0, PC, PR, PT, RAD, H, M, S, X, Y
from kin.transforms import Array


@jit
def _add_plane(
    planes: Array, count: int, joint: float, pc: float, pt: float, pr: float, p0: float, m: float, s: float
) -> int:
    """Append a plane, scaled to a normal of length one, unless it has none."""
    norm = math.sqrt(pc * pc + pt * pt + pr * pr)
    if norm > 1e-12:
        row = planes[count]
        row[JOINT], row[M], row[S] = joint, m, s
        row[PC], row[PT] = pc / norm, pt / norm
        row[PR], row[P0] = pr / norm, p0 / norm
        count += 1
    return count


@jit
def _angle_of(k: Array, i: int, low: Array, high: Array) -> tuple[int, float]:
    """Joint and angle of plane number i, joint −1 if it cannot bind.

    0 … 5: limits of θ1, θ2, θ3; 6, 7: of θ5; 8, 9: θ3 with the elbow straight; 10 … 13: θ3 with the wrist centre
    on axis 1, at two heights at most. In the last two cases a branch changes its name.
    """
    if i < 8:
        joint = i // 2 if i < 6 else 4
        if high[joint] - low[joint] >= TURN or (i % 2 == 1 and high[joint] == low[joint]):
            return -1, 0.0
        return joint, low[joint] if i % 2 == 0 else high[joint]
    if i < 10:
        t = 0.0 if i == 8 else math.pi
    else:
        a1, a2, d4, d6 = k[A1], k[A2], k[D4], k[D6]
        rise = math.sqrt(max((d6 - k[RAD]) * (d6 + k[RAD]), 0.0))
        h = k[H] + (rise if i < 12 else -rise)
        c = (a1 * a1 + h * h - a2 * a2 - d4 * d4) / (2.0 * a2 * d4)
        if abs(c) > 1.0 or k[RAD] > abs(d6):
            return -1, 0.0
        t = math.acos(c) if i % 2 == 0 else -math.acos(c)
    if high[2] - low[2] < TURN and excess(t, low[2] + 2e-9, high[2] - 2e-9) > 0.0:
        return -1, 0.0
    return 2, t


@jit
def planes_of(k: Array, low: Array, high: Array, planes: Array) -> int:
    """planes ``(16, 7)`` ← the limits that can bind, and θ3 where a branch changes its name; returns their number.

    R = 0, with m = ±r, is among them as joint −1.
    """
    a1, a2, d4, d6 = k[A1], k[A2], k[D4], k[D6]
    count = _add_plane(planes, 0, -1.0, 0.0, 0.0, 1.0, 0.0, k[RAD], 0.0)
    count = _add_plane(planes, count, -1.0, 0.0, 0.0, 1.0, 0.0, -k[RAD], 0.0)
    for i in range(14):
        joint, t = _angle_of(k, i, low, high)
        c, s = math.cos(t), math.sin(t)
        if joint == 0:
            count = _add_plane(planes, count, 0.0, 0.0, 0.0, 1.0, -c * k[X] - s * k[Y], c * k[Y] - s * k[X], 0.0)
        elif joint == 1:
            e, f = a1 + a2 * c, k[H] - a2 * s
            p0 = d4 * d4 + d6 * d6 - k[RAD] * k[RAD] - e * e - f * f
            count = _add_plane(planes, count, 1.0, 2.0 * d4, 0.0, 2.0 * e, p0, 0.0, 0.0)
        elif joint == 2:
            p0 = 2.0 * a2 * d4 * c - k[KAY]
            count = _add_plane(planes, count, 2.0, 2.0 * d4 + 2.0 * a2 * c, 2.0 * a2 * s, 2.0 * a1, p0, 0.0, 0.0)
        elif joint == 4:
            count = _add_plane(planes, count, 4.0, 1.0, 0.0, 0.0, -d6 * c, 0.0, s)
    return count
