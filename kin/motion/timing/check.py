"""A timed path evaluated and compared with its limits, point by point: independent of how it was planned."""

from __future__ import annotations

import math

from kin.kernels.compile import jit
from kin.transforms import Array


@jit
def evaluate_path(knots: Array, joints: Array, breaks: Array, clocks: Array, times: Array, out: Array) -> None:
    """out ← joint values and three derivatives ``(4, m, n)`` of a path at times ``(m,)``.

    Args:
        knots, joints: the path q(s): knots ``(k + 1,)`` and coefficients ``(k, n, 4)``.
        breaks, clocks: s(t): breaks ``(c + 1,)`` and coefficients ``(c, 4)``.
        times, out: when, and the result.
    """
    i, c = 0, 0
    last, ends = joints.shape[0] - 1, clocks.shape[0] - 1
    for m in range(times.shape[0]):
        t = times[m]
        if t < breaks[c]:
            c = 0
        while c < ends and t >= breaks[c + 1]:
            c += 1
        r, p = t - breaks[c], clocks[c]
        s = p[0] + r * (p[1] + r * (p[2] + r * p[3]))
        v, a, b = p[1] + r * (2.0 * p[2] + r * 3.0 * p[3]), 2.0 * p[2] + 6.0 * r * p[3], 6.0 * p[3]
        if s < knots[i]:
            i = 0
        while i < last and s >= knots[i + 1]:
            i += 1
        d = min(max(s, knots[0]), knots[last + 1]) - knots[i]
        for j in range(joints.shape[1]):
            f0, f1, f2, f3 = joints[i, j, 0], joints[i, j, 1], joints[i, j, 2], joints[i, j, 3]
            d1, d2, d3 = f1 + d * (2.0 * f2 + d * 3.0 * f3), 2.0 * f2 + 6.0 * d * f3, 6.0 * f3
            out[0, m, j] = f0 + d * (f1 + d * (f2 + d * f3))
            out[1, m, j] = d1 * v
            out[2, m, j] = d2 * v * v + d1 * a
            out[3, m, j] = d3 * v * v * v + 3.0 * d2 * v * a + d1 * b


@jit
def slowdowns(
    knots: Array, joints: Array, limits: Array, most: Array, breaks: Array, clocks: Array, points: int, out: Array
) -> None:
    """out ← the factor by which each piece of s(t) has to be slower ``(c,)``; below 1 it could be faster.

    Args:
        knots, joints, breaks, clocks: as in `evaluate_path`.
        limits: velocity, acceleration and jerk on each interval ``(k, n, 3)``.
        most: the largest ṡ² on each interval ``(k,)``.
        points: at how many points each piece is looked at, its ends included; the path's knots come on top, from
            both sides.
        out: result.
    """
    i, last = 0, joints.shape[0] - 1
    for c in range(clocks.shape[0]):
        worst = 0.0
        p0, p1, p2, p3 = clocks[c, 0], clocks[c, 1], clocks[c, 2], clocks[c, 3]
        r0, s0 = 0.0, p0
        for m in range(points):
            r = (breaks[c + 1] - breaks[c]) * m / (points - 1.0)
            s = p0 + r * (p1 + r * (p2 + r * p3))
            while i > 0 and s < knots[i]:
                i -= 1
            while i < last and s >= knots[i + 1]:
                i += 1
                if m > 0 and s > s0:
                    crossed = min(max(r0 + (r - r0) * (knots[i] - s0) / (s - s0), r0), r)
                    for _ in range(2):
                        v = p1 + crossed * (2.0 * p2 + crossed * 3.0 * p3)
                        ahead = p0 + crossed * (p1 + crossed * (p2 + crossed * p3)) - knots[i]
                        crossed = min(max(crossed - ahead / v, r0), r) if v > 0.0 else crossed
                    h = knots[i] - knots[i - 1]
                    at = (p1 + crossed * (2.0 * p2 + crossed * 3.0 * p3), 2.0 * p2 + 6.0 * crossed * p3, 6.0 * p3)
                    worst = _worst(joints, limits, most, i - 1, h, at, worst)
                    worst = _worst(joints, limits, most, i, 0.0, at, worst)
            d = min(max(s, knots[0]), knots[last + 1]) - knots[i]
            at = (p1 + r * (2.0 * p2 + r * 3.0 * p3), 2.0 * p2 + 6.0 * r * p3, 6.0 * p3)
            worst = _worst(joints, limits, most, i, d, at, worst)
            r0, s0 = r, s
        out[c] = worst


@jit
def _worst(
    joints: Array, limits: Array, most: Array, i: int, d: float, at: tuple[float, float, float], worst: float
) -> float:
    """The larger of `worst` and the factor at one point: on interval i, d from its knot, with ṡ, s̈ and s⃛."""
    v, a, b = at
    worst = max(worst, abs(v) / math.sqrt(most[i]))
    for j in range(joints.shape[1]):
        f1, f2, f3 = joints[i, j, 1], joints[i, j, 2], joints[i, j, 3]
        d1, d2, d3 = f1 + d * (2.0 * f2 + d * 3.0 * f3), 2.0 * f2 + 6.0 * d * f3, 6.0 * f3
        worst = max(worst, abs(d1 * v) / limits[i, j, 0])
        part = abs(d2 * v * v + d1 * a) / limits[i, j, 1]
        if part > worst * worst:
            worst = math.sqrt(part)
        part = abs(d3 * v * v * v + 3.0 * d2 * v * a + d1 * b) / limits[i, j, 2]
        if part > worst * worst * worst:
            worst = part ** (1.0 / 3.0)
    return worst
