"""Configurations that reach the point: their linearisation, and Newton steps along them within joint limits."""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.wrist5.point.constants import A1, A2, D4, D6, H, X, Y
from kin.transforms import Array

# Metres: what a Newton step aims for, and what still counts as closed.
_TIGHT, _CLOSED = 1e-13, 1e-12


@jit
def _linearise(k: Array, q: Array, J: Array, e: Array) -> float:
    """e ``(3,)`` ← the error (R, h, m) of the tool point, J ``(3, 5)`` ← ∂(R, h, m)/∂q; returns |e| in metres."""
    c1, s1, c4, s4 = math.cos(q[0]), math.sin(q[0]), math.cos(q[3]), math.sin(q[3])
    c5, s5, c23, s23 = math.cos(q[4]), math.sin(q[4]), math.cos(q[1] + q[2]), math.sin(q[1] + q[2])
    d6 = k[D6]
    tx, m, tz = -d6 * c4 * s5, d6 * s4 * s5, k[D4] + d6 * c5
    level, drop = tz * c23 + tx * s23, tz * s23 - tx * c23
    R = k[A1] + k[A2] * math.cos(q[1]) + level
    h = k[A2] * math.sin(q[1]) + drop
    e[0], e[1], e[2] = c1 * k[X] + s1 * k[Y] - R, k[H] - h, c1 * k[Y] - s1 * k[X] - m
    J[0, 0], J[1, 0], J[2, 0] = -m, 0.0, R
    J[0, 1], J[1, 1], J[2, 1] = -h, R - k[A1], 0.0
    J[0, 2], J[1, 2], J[2, 2] = -drop, level, 0.0
    J[0, 3], J[1, 3], J[2, 3] = m * s23, -m * c23, -tx
    x5, z5 = -d6 * c4 * c5, -d6 * s5
    J[0, 4], J[1, 4], J[2, 4] = z5 * c23 + x5 * s23, z5 * s23 - x5 * c23, d6 * s4 * c5
    return math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])


@jit
def _foot(q: Array, J: Array, e: Array, aim: Array, low: Array, high: Array, x: Array) -> None:
    """x ← the point nearest to `aim` with low ≤ x ≤ high and J (x − q) = e.

    By Newton steps on the dual problem, x = clamp(aim + Jᵀ λ), halved where clamps that switch lead a whole one
    away. All vectors ``(5,)``, e ``(3,)``, J ``(3, 5)``.
    """
    u = v = w = du = dv = dw = 0.0
    before, halved = math.inf, 0
    for _ in range(40):
        # e − J (x − q), and H = J Jᵀ over the joints that are not clamped.
        gu, gv, gw = e[0], e[1], e[2]
        uu = vv = ww = 1e-12
        uv = uw = vw = 0.0
        for i in range(5):
            a, b, c = J[0, i], J[1, i], J[2, i]
            free = aim[i] + a * u + b * v + c * w
            x[i] = min(max(free, low[i]), high[i])
            step = x[i] - q[i]
            gu -= a * step
            gv -= b * step
            gw -= c * step
            if x[i] == free:
                uu += a * a
                vv += b * b
                ww += c * c
                uv += a * b
                uw += a * c
                vw += b * c
        missed = abs(gu) + abs(gv) + abs(gw)
        if missed < 1e-15:
            break
        if missed > before and halved < 6:
            halved += 1
            du, dv, dw = 0.5 * du, 0.5 * dv, 0.5 * dw
            u, v, w = u - du, v - dv, w - dw
            continue
        before, halved = missed, 0
        # The adjugate of H, row by row, over its determinant.
        au, av, aw = vv * ww - vw * vw, vw * uw - uv * ww, uv * vw - vv * uw
        det = uu * au + uv * av + uw * aw
        if not det > 0.0:
            break
        bv, bw, cw = uu * ww - uw * uw, uv * uw - uu * vw, uu * vv - uv * uv
        du = (au * gu + av * gv + aw * gw) / det
        dv = (av * gu + bv * gv + bw * gw) / det
        dw = (aw * gu + bw * gv + cw * gw) / det
        u, v, w = u + du, v + dv, w + dw


@jit
def closes(k: Array, low: Array, high: Array, J: Array, e: Array, x: Array, q: Array) -> bool:
    """Move q ``(5,)``, in place, within [low, high] by Newton steps until it reaches the point; whether it does.

    J ``(3, 5)``, e ``(3,)`` and x ``(5,)`` are scratch.
    """
    for _ in range(8):
        if _linearise(k, q, J, e) < _TIGHT:
            return True
        _foot(q, J, e, q, low, high, x)
        for i in range(5):
            q[i] = x[i]
    return _linearise(k, q, J, e) < _CLOSED


@jit
def move_near(k: Array, near: Array, low: Array, high: Array, q: Array) -> bool:
    """Move q, in place, towards a box, along the configurations inside [low, high] that reach the point.

    near ``(2, 5)``: lower and upper corner of that box. Each step goes to the projection of the nearest point of
    the box onto the tangent space, or as far towards it as the distance decreases. Returns whether q reaches the
    point.
    """
    J, e, x, y, aim, foot = np.empty((3, 5)), np.empty(3), np.empty(5), np.empty(5), np.empty(5), np.empty(5)
    if not closes(k, low, high, J, e, x, q):
        return False
    distance = math.inf
    share = 1.0
    for _ in range(60):
        _linearise(k, q, J, e)
        now = 0.0
        for i in range(5):
            aim[i] = min(max(q[i], near[0, i]), near[1, i])
            now += (q[i] - aim[i]) ** 2
        if now > distance * (1.0 - 1e-7) or share < 1e-3:
            break
        distance = now
        _foot(q, J, e, aim, low, high, foot)
        share = min(1.0, 4.0 * share)
        while share >= 1e-3:
            after = 0.0
            for i in range(5):
                y[i] = q[i] + share * (foot[i] - q[i])
            closed = closes(k, low, high, J, e, x, y)
            for i in range(5):
                after += (y[i] - min(max(y[i], near[0, i]), near[1, i])) ** 2
            if closed and after < now:
                for i in range(5):
                    q[i] = y[i]
                break
            share *= 0.25
            _linearise(k, q, J, e)
    return True
