"""The fastest way along a joint path under limits of velocity and acceleration.

After Pham and Pham, A new approach to time-optimal path parameterization based on reachability analysis, IEEE
Trans. Robotics 34(3), 2018. The path q(s) is piecewise cubic, and x = ṡ² is piecewise linear in s, so s̈ is
constant on each interval. Acceleration there is q″ x + q′ s̈, a quadratic in s. Its Bernstein coefficients are
linear in the values of x at both ends of the interval, and the quadratic lies between the smallest and the
largest of them. So the limits are kept between the knots too, not only at them.

A backward pass finds the largest x from which the end can be reached, a forward pass takes the largest x that is
allowed. Rest (x = 0) keeps every limit, so a solution always exists.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.transforms import Array

ROUNDING = 1e-7  # part of each limit that is left for rounding errors


@jit
def fastest(h: Array, pieces: Array, limits: Array, most: Array, x: Array) -> None:
    """x ← ṡ² at the knots ``(k + 1,)`` of the fastest motion from rest to rest.

    Args:
        h: lengths of the intervals ``(k,)``.
        pieces: coefficients of the joints on each, the constant one first ``(k, n, 4)``.
        limits: velocity and acceleration, and anything after them, on each interval ``(k, n, 2)``.
        most: the largest x on each interval ``(k,)`` that other limits allow.
        x: result.
    """
    k, n = pieces.shape[0], pieces.shape[1]
    rows = np.empty((k, 3 * n, 3))
    cap = np.full(k + 1, math.inf)
    for i in range(k):
        before, after = _conditions(h[i], pieces[i], limits[i], rows[i])
        cap[i] = min(cap[i], min(before, most[i]) * (1.0 - ROUNDING))
        cap[i + 1] = min(after, most[i]) * (1.0 - ROUNDING)
    x[k] = 0.0
    for i in range(k - 1, -1, -1):
        x[i] = _largest_start(rows[i], cap[i], x[i + 1])
    x[0] = 0.0
    for i in range(k):
        x[i + 1] = _largest_end(rows[i], x[i], x[i + 1])
    x[k] = 0.0


@jit
def _conditions(h: float, pieces: Array, limits: Array, rows: Array) -> tuple[float, float]:
    """rows ← (α, β, a) with |α x₀ + β x₁| ≤ a ``(3n, 3)``; returns the largest x₀ and x₁ for the velocities."""
    before = after = math.inf
    for j in range(pieces.shape[0]):
        c1, c2, c3 = pieces[j, 1], pieces[j, 2], pieces[j, 3]
        b0, b1, b2 = c1, c1 + c2 * h, c1 + h * (2.0 * c2 + 3.0 * c3 * h)
        e0, e1 = 2.0 * c2, 2.0 * c2 + 6.0 * c3 * h
        p, q = _speeds(b0, b1, b2)
        square = limits[j, 0] * limits[j, 0]
        before, after = min(before, square / p), min(after, square / q)
        f, a, r = 0.5 / h, limits[j, 1] * (1.0 - ROUNDING), 3 * j
        rows[r, 0], rows[r, 1], rows[r, 2] = e0 - f * b0, f * b0, a
        rows[r + 1, 0], rows[r + 1, 1], rows[r + 1, 2] = 0.5 * e1 - f * b1, 0.5 * e0 + f * b1, a
        rows[r + 2, 0], rows[r + 2, 1], rows[r + 2, 2] = -f * b2, e1 + f * b2, a
    return before, after


@jit
def _speeds(b0: float, b1: float, b2: float) -> tuple[float, float]:
    """(p, q) such that q′² x ≤ 1 on an interval if x₀ ≤ 1/p and x₁ ≤ 1/q; q′ has these Bernstein coefficients."""
    g0, g1 = b0 * b0, b2 * b2
    # q′² lies below the line from g₀ to g₁ raised by `bulge`.
    bulge = max(0.0, b0 * b1 - 0.75 * g0 - 0.25 * g1)
    bulge = max(bulge, (2.0 * b1 * b1 + b0 * b2) / 3.0 - 0.5 * (g0 + g1))
    bulge = max(bulge, b1 * b2 - 0.25 * g0 - 0.75 * g1)
    p, q = g0 + bulge + 1e-30, g1 + bulge + 1e-30
    # The product of the line and of a line from 1/p to 1/q is largest in the middle.
    excess = (p + q) * (p + q) / (4.0 * p * q)
    size = max(g0, max(b1 * b1, g1)) + 1e-30
    if excess * max(p, q) <= 1.01 * size:
        return p * excess, q * excess
    return size, size


@jit
def _largest_start(rows: Array, most: float, end: float) -> float:
    """The largest x₀ ≤ `most` for which some x₁ in [0, end] keeps the conditions.

    A linear program in two variables, by adding one condition after the other (Seidel).
    """
    x0, x1 = most, end
    for i in range(2 * rows.shape[0]):
        sign = 1.0 if i % 2 == 0 else -1.0
        p, q, c = sign * rows[i // 2, 0], sign * rows[i // 2, 1], rows[i // 2, 2]
        if p * x0 + q * x1 <= c * (1.0 + 1e-12):
            continue
        # The new optimum lies on the line p x₀ + q x₁ = c: (x₀, x₁) = (a₀, a₁) + t (d₀, d₁), d₀ ≥ 0.
        size = p * p + q * q
        a0, a1 = c * p / size, c * q / size
        root = math.sqrt(size)
        d0, d1 = q / root, -p / root
        if d0 < 0.0:
            d0, d1 = -d0, -d1
        low, high = -math.inf, math.inf
        low, high = _cut(low, high, d0, most - a0)
        low, high = _cut(low, high, -d0, a0)
        low, high = _cut(low, high, d1, end - a1)
        low, high = _cut(low, high, -d1, a1)
        for k in range(i):
            other = 1.0 if k % 2 == 0 else -1.0
            u, v, w = other * rows[k // 2, 0], other * rows[k // 2, 1], rows[k // 2, 2]
            low, high = _cut(low, high, u * d0 + v * d1, w - u * a0 - v * a1)
        t = high if high < math.inf else 0.0
        x0, x1 = a0 + t * d0, a1 + t * d1
    return min(max(x0, 0.0), most)


@jit
def _cut(low: float, high: float, slope: float, rest: float) -> tuple[float, float]:
    """The part of [low, high] with slope · t ≤ rest."""
    if slope > 1e-300:
        high = min(high, rest / slope)
    elif slope < -1e-300:
        low = max(low, rest / slope)
    return low, high


@jit
def _largest_end(rows: Array, start: float, most: float) -> float:
    """The largest x₁ ≤ `most` that keeps the conditions from x₀ = start."""
    best = most
    for r in range(rows.shape[0]):
        alpha, beta, a = rows[r, 0], rows[r, 1], rows[r, 2]
        if beta > 1e-300:
            best = min(best, (a - alpha * start) / beta)
        elif beta < -1e-300:
            best = min(best, (-a - alpha * start) / beta)
    return max(best, 0.0)


@jit
def clock(h: Array, x: Array, times: Array, pieces: Array) -> None:
    """When the knots are passed.

    Args:
        h, x: lengths of the intervals ``(k,)`` and ṡ² at the knots ``(k + 1,)``.
        times: ← when each knot is passed ``(k + 1,)``.
        pieces: ← s on each interval as a cubic of the time since its knot, from s = 0 at the first ``(k, 4)``.
    """
    s = 0.0
    times[0] = 0.0
    for i in range(h.shape[0]):
        before, after = math.sqrt(x[i]), math.sqrt(x[i + 1])
        times[i + 1] = times[i] + 2.0 * h[i] / (before + after)
        pieces[i, 0], pieces[i, 1], pieces[i, 2], pieces[i, 3] = s, before, 0.25 * (x[i + 1] - x[i]) / h[i], 0.0
        s += h[i]
