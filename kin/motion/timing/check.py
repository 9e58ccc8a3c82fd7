"""A timed path evaluated and compared with its limits: independent of how it was planned.

Between two breaks, of s(t) or of q(s), velocity, acceleration and jerk are polynomials of time. They lie between
the smallest and the largest of their Bernstein coefficients, so limits that these keep are kept everywhere.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.motion.geometry.splines import knots_before
from kin.transforms import Array

BACK = 1e6  # the factor where s(t) would go back
_SAME = 1e-12  # of the path: a break of s(t) that is so close to a knot of the path is at the knot


def _bernstein(degree: int) -> Array:
    """Bernstein coefficients of a degree from those of the powers, which may be fewer."""
    out = np.zeros((degree + 1, degree + 1))
    for i in range(degree + 1):
        for k in range(i + 1):
            out[i, k] = math.comb(i, k) / math.comb(degree, k)
    return out


_TO_EIGHT, _TO_SEVEN, _TO_SIX = _bernstein(8), _bernstein(7), _bernstein(6)


@jit
def _met(knots: Array, clocks: Array, c: int) -> tuple[int, int]:
    """The first and the last interval of the path that a piece of s(t) meets.

    It follows from where the piece begins and ends, not from a time: at a break that is at a knot, rounding would
    take the jerk of s(t) before the break for that of the path after the knot.
    """
    last, close = knots.shape[0] - 2, _SAME * knots[knots.shape[0] - 1]
    end = clocks[c + 1, 0] if c + 1 < clocks.shape[0] else knots[last + 1]
    first = min(max(knots_before(knots, clocks[c, 0] + close, True) - 1, 0), last)
    return first, min(max(knots_before(knots, end - close, False) - 1, first), last)


@jit
def evaluate_path(knots: Array, joints: Array, breaks: Array, clocks: Array, times: Array, out: Array) -> None:
    """out ← joint values and three derivatives ``(4, m, n)`` of a path at times ``(m,)``.

    Args:
        knots, joints: the path q(s): knots ``(k + 1,)`` and coefficients ``(k, n, 4)``.
        breaks, clocks: s(t): breaks ``(c + 1,)`` and coefficients ``(c, 4)``.
        times, out: when, and the result.
    """
    c, ends = 0, clocks.shape[0] - 1
    first, last = _met(knots, clocks, 0)
    i = first
    for m in range(times.shape[0]):
        t, before = times[m], c
        if t < breaks[c]:
            c = 0
        while c < ends and t >= breaks[c + 1]:
            c += 1
        if c != before:
            first, last = _met(knots, clocks, c)
            i = first
        r, p = t - breaks[c], clocks[c]
        s = p[0] + r * (p[1] + r * (p[2] + r * p[3]))
        v, a, b = p[1] + r * (2.0 * p[2] + r * 3.0 * p[3]), 2.0 * p[2] + 6.0 * r * p[3], 6.0 * p[3]
        if s < knots[i]:
            i = first
        while i < last and s >= knots[i + 1]:
            i += 1
        d = min(max(s, knots[0]), knots[knots.shape[0] - 1]) - knots[i]
        for j in range(joints.shape[1]):
            f0, f1, f2, f3 = joints[i, j, 0], joints[i, j, 1], joints[i, j, 2], joints[i, j, 3]
            d1, d2, d3 = f1 + d * (2.0 * f2 + d * 3.0 * f3), 2.0 * f2 + 6.0 * d * f3, 6.0 * f3
            out[0, m, j] = f0 + d * (f1 + d * (f2 + d * f3))
            out[1, m, j] = d1 * v
            out[2, m, j] = d2 * v * v + d1 * a
            out[3, m, j] = d3 * v * v * v + 3.0 * d2 * v * a + d1 * b


@jit
def slowdowns(
    knots: Array, joints: Array, limits: Array, most: Array, breaks: Array, clocks: Array, out: Array
) -> None:
    """out ← the factor by which each piece of s(t) has to be slower ``(c,)``; below 1 it could be faster.

    Args:
        knots, joints, breaks, clocks: as in `evaluate_path`.
        limits: velocity, acceleration and jerk on each interval ``(k, n, 3)``.
        most: the largest ṡ² on each interval ``(k,)``.
        out: result.
    """
    shares = np.empty((3, 3, 9))
    for c in range(clocks.shape[0]):
        out[c] = 0.0
        p, begin, end = clocks[c], 0.0, breaks[c + 1] - breaks[c]
        first, last = _met(knots, clocks, c)
        for i in range(first, last + 1):
            until = _crossing(p, knots[i + 1], begin, end) if i < last else end
            if until > begin:
                factor = _between(p, begin, until, knots[i], shares, joints[i], limits[i], most[i])
                out[c] = max(out[c], factor)
            begin = until


@jit
def _crossing(p: Array, knot: float, low: float, high: float) -> float:
    """When s(t) meets a knot, between two times."""
    t = 0.5 * (low + high)
    for _ in range(80):
        ahead = p[0] + t * (p[1] + t * (p[2] + t * p[3])) - knot
        if ahead > 0.0:
            high = t
        else:
            low = t
        v = p[1] + t * (2.0 * p[2] + t * 3.0 * p[3])
        new = t - ahead / v if v > 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if new == t or high - low < 1e-15 * high:
            break
        t = new
    return high


@jit
def _between(
    p: Array, begin: float, end: float, knot: float, shares: Array, joints: Array, limits: Array, most: float
) -> float:
    """The factor on one interval of the path, while one piece of s(t) lasts."""
    h = end - begin
    d0 = p[0] + begin * (p[1] + begin * (p[2] + begin * p[3])) - knot
    d1 = h * (p[1] + begin * (2.0 * p[2] + begin * 3.0 * p[3]))
    d2, d3 = h * h * (p[2] + 3.0 * begin * p[3]), h * h * h * p[3]
    low, high = min(d1, d1 + d2, d1 + 2.0 * d2 + 3.0 * d3), max(d1, d1 + d2, d1 + 2.0 * d2 + 3.0 * d3)
    if low < -1e-7 * high - 1e-13:
        return BACK
    worst: float = high / h / math.sqrt(most)
    _shares(d0, d1, d2, d3, shares)
    for j in range(joints.shape[0]):
        f1, f2, f3 = joints[j, 1], joints[j, 2], joints[j, 3]
        v = a = b = 0.0
        for k in range(9):
            v = max(v, abs(f1 * shares[0, 0, k] + f2 * shares[0, 1, k] + f3 * shares[0, 2, k]))
        for k in range(8):
            a = max(a, abs(f1 * shares[1, 0, k] + f2 * shares[1, 1, k] + f3 * shares[1, 2, k]))
        for k in range(7):
            b = max(b, abs(f1 * shares[2, 0, k] + f2 * shares[2, 1, k] + f3 * shares[2, 2, k]))
        worst = max(worst, v / (h * limits[j, 0]))
        a /= h * h * limits[j, 1]
        if a > worst * worst:
            worst = math.sqrt(a)
        b /= h * h * h * limits[j, 2]
        if b > worst * worst * worst:
            worst = b ** (1.0 / 3.0)
    return worst


@jit
def _shares(d0: float, d1: float, d2: float, d3: float, out: Array) -> None:
    """out ← Bernstein coefficients of the derivatives, the first three, of d, d² and d³ ``(3, 3, 9)``.

    d is a cubic with these coefficients of a time from 0 to 1.
    """
    d, square, cube = (d0, d1, d2, d3), np.zeros(7), np.zeros(10)
    for i in range(4):
        for k in range(4):
            square[i + k] += d[i] * d[k]
    for i in range(7):
        for k in range(4):
            cube[i + k] += square[i] * d[k]
    powers = np.zeros((3, 10))
    for k in range(10):
        powers[0, k] = d[k] if k < 4 else 0.0
        powers[1, k] = square[k] if k < 7 else 0.0
        powers[2, k] = cube[k]
    for order in range(3):
        top = 9 - order
        matrix = _TO_EIGHT if order == 0 else (_TO_SEVEN if order == 1 else _TO_SIX)
        for row in range(3):
            for k in range(top):
                powers[row, k] = (k + 1) * powers[row, k + 1]
            for i in range(top):
                total = 0.0
                for k in range(min(i + 1, 3 * row + 3 - order)):
                    total += matrix[i, k] * powers[row, k]
                out[order, row, i] = total


@jit
def reached(breaks: Array, clocks: Array, places: Array, out: Array) -> None:
    """out ← the times at which s(t) reaches rising places ``(m,)``."""
    c, last = 0, clocks.shape[0] - 1
    for m in range(places.shape[0]):
        while c < last and clocks[c + 1, 0] <= places[m]:
            c += 1
        out[m] = breaks[c] + _crossing(clocks[c], places[m], 0.0, breaks[c + 1] - breaks[c])
