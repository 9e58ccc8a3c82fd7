"""The fastest way along a joint path under limits of jerk too.

A motion that keeps the limits, s(u) with a time u of its own, is driven at another pace: x = u̇² is the unknown, a
quadratic spline of u. The square of a velocity, and accelerations, are linear in x and x′. Jerk is √x times
q‴ x + 3/2 q″ x′ + 1/2 q′ x″, so its limit is a bound J / √x on something linear. The tangent of J / √x lies
below it: what keeps the tangent's bound keeps the limit (Debrouwere and others, Time-optimal path following for
robots with convex–concave constraints using sequential convex programming, IEEE Trans. Robotics 29(6), 2013).

The time, the integral of 1 / √x, is minimised by a primal-dual interior-point method whose tangents move with the
solution: all motions on the way keep the limits where they are compared. Rest at both ends is a matter of s(u)
alone, so x is positive everywhere.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.motion.timing.check import evaluate_path
from kin.transforms import Array

_SMOOTH, _STEADY = 1e-6, 10.0  # weights of x′² and x″²: everywhere, where nothing else decides; and at both ends
_SPARE = 0.9  # of the largest even speed, to begin with
_OFF = 0.48  # of an interval: the limits are compared so far from its middle, on both sides
_SHORTER, _BOUNDARY = 0.15, 0.95  # of the gap, in a step; the part of the way to the next limit that a step may go


@jit
def rest_to_rest(t: Array, s: Array, out: Array) -> None:
    """out ← coefficients ``(k, 4)`` of a cubic spline through s ``(k + 1,)`` at t, at rest at both ends, k ≥ 5.

    Its velocity and acceleration are 0 at both ends; so the second point and the last but one are not met exactly.
    """
    k = t.shape[0] - 1
    bend, upper = np.zeros(k + 1), np.zeros(k + 1)
    for i in range(1, k):
        a, b = t[i] - t[i - 1], t[i + 1] - t[i]
        left, middle, right = a / 6.0, (a + b) / 3.0, b / 6.0
        before = s[0] if i == 2 else s[i - 1]
        after = s[k] if i == k - 2 else s[i + 1]
        value = (after - s[i]) / b - (s[i] - before) / a
        if i == 1:
            # s₁ = s₀ + a² bend₁ / 6, so that the velocity at the start is 0.
            value = (s[2] - s[0]) / b
            middle += a * a / (6.0 * b) + a / 6.0
        elif i == 2:
            first = t[1] - t[0]
            left -= first * first / (6.0 * a)
        if i == k - 1:
            value = -(s[k] - s[k - 2]) / a
            middle += b * b / (6.0 * a) + b / 6.0
        elif i == k - 2:
            last = t[k] - t[k - 1]
            right -= last * last / (6.0 * b)
        pivot = middle - left * upper[i - 1]
        upper[i] = right / pivot
        bend[i] = (value - left * bend[i - 1]) / pivot
    for i in range(k - 2, 0, -1):
        bend[i] -= upper[i] * bend[i + 1]
    a, b = t[1] - t[0], t[k] - t[k - 1]
    for i in range(k):
        h = t[i + 1] - t[i]
        low = s[0] + a * a * bend[1] / 6.0 if i == 1 else s[i]
        high = s[0] + a * a * bend[1] / 6.0 if i == 0 else s[i + 1]
        low = s[k] + b * b * bend[k - 1] / 6.0 if i == k - 1 else low
        high = s[k] + b * b * bend[k - 1] / 6.0 if i == k - 2 else high
        out[i, 0], out[i, 2], out[i, 3] = low, 0.5 * bend[i], (bend[i + 1] - bend[i]) / (6.0 * h)
        out[i, 1] = (high - low) / h - h * (2.0 * bend[i] + bend[i + 1]) / 6.0
    out[0, 1] = 0.0


@jit
def conditions(
    knots: Array, joints: Array, limits: Array, most: Array, u: Array, base: Array, slower: Array, rows: Array,
    caps: Array,
) -> float:  # fmt: skip
    """rows, caps ← what `faster` needs; returns an x that keeps all limits with something to spare.

    Args:
        knots, joints, limits, most: the path and its limits, as in `kin.motion.timing.timed.JointPath`.
        u, base: s(u): breaks ``(k + 1,)`` and coefficients ``(k, 4)``.
        slower: the factor by which each interval of u is to be slower than its limits demand ``(k,)``.
        rows, caps: result.
    """
    k, last = base.shape[0], joints.shape[0] - 1
    times, found = np.empty(2 * k), np.empty((4, 2 * k, joints.shape[1]))
    for i in range(2 * k):
        h = u[i // 2 + 1] - u[i // 2]
        times[i] = u[i // 2] + h * (0.5 + _OFF * (2 * (i % 2) - 1))
    evaluate_path(knots, joints, u, base, times, found)
    piece, x = 0, math.inf
    for i in range(2 * k):
        p, r = base[i // 2], times[i] - u[i // 2]
        s, ds = p[0] + r * (p[1] + r * (p[2] + r * p[3])), p[1] + r * (2.0 * p[2] + r * 3.0 * p[3])
        while piece < last and knots[piece + 1] <= s:
            piece += 1
        factor, cap = slower[i // 2], most[piece] / (ds * ds + 1e-30)
        for j in range(joints.shape[1]):
            v, a, b = limits[piece, j, 0], limits[piece, j, 1] / factor**2, limits[piece, j, 2] / factor**3
            d1, d2, d3 = found[1, i, j], found[2, i, j], found[3, i, j]
            cap = min(cap, v * v / (d1 * d1 + 1e-30))
            rows[i, j, 0], rows[i, j, 1] = d2 / a, d1 / a
            rows[i, j, 2], rows[i, j, 3], rows[i, j, 4] = d3 / b, 3.0 * d2 / b, d1 / b
            x = min(x, 1.0 / (abs(rows[i, j, 0]) + 1e-30), (abs(rows[i, j, 2]) + 1e-30) ** (-2.0 / 3.0))
        caps[i] = cap / factor**2
        x = min(x, caps[i])
    return _SPARE * x


@jit
def shapes(u: Array, out: Array) -> None:
    """out ← what three coefficients of a quadratic spline add to x, x′/2 and x″/2 at two points of each interval.

    Args:
        u: knots ``(k + 1,)``.
        out: ``(2k, 3, 3)``, the coefficients last.
    """
    k = u.shape[0] - 1
    for i in range(k):
        h = u[i + 1] - u[i]
        a = h / (h + (u[i] - u[i - 1] if i > 0 else h))
        b = h / (h + (u[i + 2] - u[i + 1] if i < k - 1 else h))
        for side in range(2):
            at = h * _OFF * (2 * side - 1)
            for p in range(3):
                x = 0.25 * a if p == 0 else (1.0 - 0.25 * (a + b) if p == 1 else 0.25 * b)
                d = (-a if p == 0 else (a - b if p == 1 else b)) / (2.0 * h)
                e = (a if p == 0 else (-a - b if p == 1 else b)) / (h * h)
                out[2 * i + side, 0, p] = x + at * (2.0 * d + at * e)
                out[2 * i + side, 1, p] = d + at * e
                out[2 * i + side, 2, p] = e


@jit
def faster(u: Array, rows: Array, caps: Array, begin: float, gap: float, most: int, c: Array) -> int:
    """c ← the spline of x = u̇² ``(k + 2,)`` for which the time is shortest; returns the number of steps.

    Args:
        u: knots ``(k + 1,)``.
        rows: acceleration and jerk at two points of each interval ``(2k, n, 5)``, as parts of their limits:
            that of x and of x′/2 in the acceleration; that of x, x′/2 and x″/2 in the jerk divided by √x.
        caps: the largest x there ``(2k,)``.
        begin, gap: how much longer than necessary the time is, about, and may be at the end, as parts of it.
        most: steps at most.
        c: where to begin: an x that keeps all limits with something to spare.
    """
    k, m = rows.shape[0], 1 + 4 * rows.shape[1]
    slack, dual, change = np.empty((k, m)), np.empty((k, m)), np.empty((k, m))
    shape, weights = np.empty((k, 3, 3)), np.empty((k, 2))
    band, step = np.empty((c.shape[0], 3)), np.empty(c.shape[0])
    shapes(u, shape)
    for i in range(k):
        h = u[i // 2 + 1] - u[i // 2]
        weights[i, 0], weights[i, 1] = 0.5 * h * c.shape[0] / (u[u.shape[0] - 1] - u[0]), h
    seconds = _slacks(shape, weights, rows, caps, c, slack)
    target = begin * seconds / (k * m)
    for i in range(k):
        for r in range(m):
            dual[i, r] = target * slack[i, r]
    for count in range(most):
        _system(shape, weights, rows, caps, c, slack, dual, target, (band, step))
        _solve(band, step)
        primal, dually = _steps(shape, rows, caps, c, step, slack, dual, target, change)
        for i in range(c.shape[0]):
            c[i] += primal * step[i]
        seconds = _slacks(shape, weights, rows, caps, c, slack)
        total = 0.0
        for i in range(k):
            for r in range(m):
                dual[i, r] += dually * change[i, r]
                total += dual[i, r] / slack[i, r]
        if total < gap * seconds and primal > 0.5 and dually > 0.5:
            return count + 1
        shorter = _SHORTER if min(primal, dually) > 0.5 else 0.5
        target = shorter * total / (k * m)
    return most


@jit
def _steps(
    shape: Array, rows: Array, caps: Array, c: Array, step: Array, slack: Array, dual: Array, target: float,
    change: Array,
) -> tuple[float, float]:  # fmt: skip
    """change ← the step of the multipliers; returns the parts of both steps that keep everything positive."""
    back, dually = 0.0, 0.0  # reciprocal
    for i in range(slack.shape[0]):
        x = _local(shape, c, i)[0]
        d0, d1, d2 = _local(shape, step, i)
        bound = -0.5 * d0 * x**-1.5
        back = max(back, -d0 * (_BOUNDARY / 0.7) / x, d0 / caps[i] * slack[i, 0])
        change[i, 0] = target * slack[i, 0] - dual[i, 0] * (1.0 - d0 / caps[i] * slack[i, 0])
        dually = max(dually, -change[i, 0] / dual[i, 0])
        for j in range(rows.shape[1]):
            row, r = rows[i, j], 1 + 4 * j
            f, g = row[0] * d0 + row[1] * d1, row[2] * d0 + row[3] * d1 + row[4] * d2
            for side in range(4):
                own = (f if side == 1 else -f) if side < 2 else bound + (g if side == 3 else -g)
                part = own * slack[i, r + side]
                moved = target * slack[i, r + side] - dual[i, r + side] * (1.0 + part)
                change[i, r + side] = moved
                back, dually = max(back, -part), max(dually, -moved / dual[i, r + side])
    return _BOUNDARY / max(back, _BOUNDARY), _BOUNDARY / max(dually, _BOUNDARY)


@jit
def _local(shape: Array, c: Array, i: int) -> tuple[float, float, float]:
    """x, x′/2 and x″/2 at a point: 2k and 2k + 1 are those of interval k."""
    k, w = i // 2, shape[i]
    a, b, e = c[k], c[k + 1], c[k + 2]
    return (
        w[0, 0] * a + w[0, 1] * b + w[0, 2] * e,
        w[1, 0] * a + w[1, 1] * b + w[1, 2] * e,
        w[2, 0] * a + w[2, 1] * b + w[2, 2] * e,
    )


@jit
def _slacks(shape: Array, weights: Array, rows: Array, caps: Array, c: Array, slack: Array) -> float:
    """slack ← 1 / what is left of each limit: x, acceleration, jerk, both ways; returns the time."""
    total = 0.0
    for i in range(rows.shape[0]):
        x, d, e = _local(shape, c, i)
        root = 1.0 / math.sqrt(x)
        total += weights[i, 0] * root
        slack[i, 0] = 1.0 / (1.0 - x / caps[i])
        for j in range(rows.shape[1]):
            row, r = rows[i, j], 1 + 4 * j
            f, g = row[0] * x + row[1] * d, row[2] * x + row[3] * d + row[4] * e
            slack[i, r], slack[i, r + 1] = 1.0 / (1.0 - f), 1.0 / (1.0 + f)
            slack[i, r + 2], slack[i, r + 3] = 1.0 / (root - g), 1.0 / (root + g)
    return total


@jit
def _system(
    shape: Array, weights: Array, rows: Array, caps: Array, c: Array, slack: Array, dual: Array, target: float,
    system: tuple[Array, Array],
) -> None:  # fmt: skip
    """system ← the equations of a Newton step: the diagonal and the two below it, and the right side."""
    band, right = system
    k = rows.shape[0]
    band[:] = 0.0
    right[:] = 0.0
    for i in range(k):
        x, d, e = _local(shape, c, i)
        power, h = weights[i, 0] * x**-1.5, weights[i, 1] * weights[i, 1]
        stiff = (_STEADY if i < 4 or i >= k - 4 else _SMOOTH) * h
        inverse, cap = slack[i, 0], 1.0 / caps[i]
        r0, r1, r2 = 0.5 * power - target * inverse * cap, -stiff * d, -stiff * h * e
        h00, h01, h02 = 0.75 * power / x + dual[i, 0] * inverse * cap * cap, 0.0, 0.0
        h11, h12, h22, bound = stiff, 0.0, stiff * h, -0.5 * x**-1.5
        for j in range(rows.shape[1]):
            row, r = rows[i, j], 1 + 4 * j
            up, down = slack[i, r], slack[i, r + 1]
            pull, weight = target * (down - up), dual[i, r] * up + dual[i, r + 1] * down
            r0, r1 = r0 + pull * row[0], r1 + pull * row[1]
            h00, h01, h11 = (
                h00 + weight * row[0] * row[0], h01 + weight * row[0] * row[1], h11 + weight * row[1] * row[1],
            )  # fmt: skip
            up, down = slack[i, r + 2], slack[i, r + 3]
            pull, first, second = target * (down - up), dual[i, r + 2] * up, dual[i, r + 3] * down
            weight, cross = first + second, bound * (second - first)
            g0, g1, g2 = row[2], row[3], row[4]
            r0, r1, r2 = r0 + pull * g0 + target * bound * (up + down), r1 + pull * g1, r2 + pull * g2
            h00 += weight * (g0 * g0 + bound * bound) + 2.0 * cross * g0
            h01, h02 = h01 + (weight * g0 + cross) * g1, h02 + (weight * g0 + cross) * g2
            h11, h12, h22 = h11 + weight * g1 * g1, h12 + weight * g1 * g2, h22 + weight * g2 * g2
        _spread(i // 2, shape[i], (r0, r1, r2), (h00, h01, h02, h11, h12, h22), system)


@jit
def _spread(
    k: int,
    w: Array,
    slope: tuple[float, float, float],
    h: tuple[float, float, float, float, float, float],
    system: tuple[Array, Array],
) -> None:
    """Adds what one point says about x, x′/2 and x″/2, as conditions on the three coefficients there."""
    band, right = system
    for p in range(3):
        p0, p1, p2 = w[0, p], w[1, p], w[2, p]
        right[k + p] += p0 * slope[0] + p1 * slope[1] + p2 * slope[2]
        u0 = h[0] * p0 + h[1] * p1 + h[2] * p2
        u1 = h[1] * p0 + h[3] * p1 + h[4] * p2
        u2 = h[2] * p0 + h[4] * p1 + h[5] * p2
        for q in range(p + 1):
            band[k + p, p - q] += u0 * w[0, q] + u1 * w[1, q] + u2 * w[2, q]


@jit
def _solve(band: Array, y: Array) -> None:
    """y ← the solution of a positive definite system with two diagonals beside the main one (L D Lᵀ)."""
    k = y.shape[0]
    for i in range(k):
        d = band[i, 0]
        if i > 1:
            second = band[i, 2]
            band[i, 2] = second / band[i - 2, 0]
            band[i, 1] -= second * band[i - 1, 1]
            d -= second * band[i, 2]
        if i > 0:
            first = band[i, 1]
            band[i, 1] = first / band[i - 1, 0]
            d -= first * band[i, 1]
        band[i, 0] = max(d, 1e-300)
    for i in range(k):
        if i > 0:
            y[i] -= band[i, 1] * y[i - 1]
        if i > 1:
            y[i] -= band[i, 2] * y[i - 2]
    for i in range(k):
        y[i] /= band[i, 0]
    for i in range(k - 1, -1, -1):
        if i + 1 < k:
            y[i] -= band[i + 1, 1] * y[i + 1]
        if i + 2 < k:
            y[i] -= band[i + 2, 2] * y[i + 2]


@jit
def passing(u: Array, c: Array, times: Array) -> None:
    """times ← when the knots of u are passed ``(k + 1,)`` (Gauss, three points)."""
    k = u.shape[0] - 1
    times[0] = 0.0
    for i in range(k):
        h = u[i + 1] - u[i]
        a = h / (h + (u[i] - u[i - 1] if i > 0 else h))
        b = h / (h + (u[i + 2] - u[i + 1] if i < k - 1 else h))
        first, last = a * c[i] + (1.0 - a) * c[i + 1], (1.0 - b) * c[i + 1] + b * c[i + 2]
        total = 0.0
        for weight, at in (
            (5.0 / 18.0, 0.5 - math.sqrt(0.15)),
            (8.0 / 18.0, 0.5),
            (5.0 / 18.0, 0.5 + math.sqrt(0.15)),
        ):
            x = (1.0 - at) ** 2 * first + 2.0 * at * (1.0 - at) * c[i + 1] + at * at * last
            total += weight / math.sqrt(max(x, 1e-9))
        times[i + 1] = times[i] + h * total


@jit
def averaged(times: Array, pieces: Array, window: float, u: Array, s: Array) -> None:
    """s ← s(t), at rest before and after, averaged over the window of time before each of rising u."""
    k = pieces.shape[0]
    sums = np.empty((2, u.shape[0]))
    for side in range(2):
        i, total = 0, 0.0
        for m in range(u.shape[0]):
            t = u[m] - side * window
            while i < k and t >= times[i + 1]:
                total += _area(pieces[i], times[i + 1] - times[i])
                i += 1
            if t < times[0]:
                sums[side, m] = (t - times[0]) * pieces[0, 0]
            elif i < k:
                sums[side, m] = total + _area(pieces[i], t - times[i])
            else:
                r, p = times[k] - times[k - 1], pieces[k - 1]
                end = p[0] + r * (p[1] + r * (p[2] + r * p[3]))
                sums[side, m] = total + (t - times[k]) * end
    for m in range(u.shape[0]):
        s[m] = (sums[0, m] - sums[1, m]) / window


@jit
def _area(p: Array, r: float) -> float:
    """The integral of a cubic from 0 to r."""
    area: float = r * (p[0] + r * (p[1] / 2.0 + r * (p[2] / 3.0 + r * p[3] / 4.0)))
    return area
