"""Cubic splines through joint values: the second derivative is continuous."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import jit
from kin.transforms import Array


@jit
def spline_into(s: Array, q: Array, out: Array) -> None:
    """out ← coefficients ``(k, n, 4)`` of the cubic spline through q ``(k + 1, n)`` at s ``(k + 1,)``, k ≥ 3.

    Its slopes at both ends are those of the cubic polynomials through the first and the last four points.
    """
    k, n = q.shape[0] - 1, q.shape[1]
    slopes, upper = np.empty((k + 1, n)), np.empty(k + 1)
    for j in range(n):
        slopes[0, j] = _slope(s[0], s[1], s[2], s[3], q[0, j], q[1, j], q[2, j], q[3, j])
        slopes[k, j] = _slope(s[k], s[k - 1], s[k - 2], s[k - 3], q[k, j], q[k - 1, j], q[k - 2, j], q[k - 3, j])
    # Tridiagonal: the second derivatives of neighbours agree at each inner knot.
    upper[0] = 0.0
    for i in range(1, k):
        a, b = s[i] - s[i - 1], s[i + 1] - s[i]
        pivot = 2.0 * (a + b) - b * upper[i - 1]
        upper[i] = a / pivot
        for j in range(n):
            left, right = (q[i, j] - q[i - 1, j]) / a, (q[i + 1, j] - q[i, j]) / b
            slopes[i, j] = (3.0 * (b * left + a * right) - b * slopes[i - 1, j]) / pivot
    for i in range(k - 1, 0, -1):
        for j in range(n):
            slopes[i, j] -= upper[i] * slopes[i + 1, j]
    for i in range(k):
        h = s[i + 1] - s[i]
        for j in range(n):
            chord, m0, m1 = (q[i + 1, j] - q[i, j]) / h, slopes[i, j], slopes[i + 1, j]
            out[i, j, 0], out[i, j, 1] = q[i, j], m0
            out[i, j, 2] = (3.0 * chord - 2.0 * m0 - m1) / h
            out[i, j, 3] = (m0 + m1 - 2.0 * chord) / (h * h)


@jit
def _slope(x0: float, x1: float, x2: float, x3: float, y0: float, y1: float, y2: float, y3: float) -> float:
    """The slope at x₀ of the cubic polynomial through four points (Newton's divided differences)."""
    d01, d12, d23 = (y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1), (y3 - y2) / (x3 - x2)
    d012, d123 = (d12 - d01) / (x2 - x0), (d23 - d12) / (x3 - x1)
    d0123 = (d123 - d012) / (x3 - x0)
    return d01 + (x0 - x1) * d012 + (x0 - x1) * (x0 - x2) * d0123


def spline(s: Array, q: Array) -> Array:
    """As `spline_into`, into a new array."""
    out: Array = np.empty((len(s) - 1, q.shape[1], 4))
    spline_into(s, np.ascontiguousarray(q), out)
    return out


@jit
def knots_before(knots: Array, s: float, equal: bool) -> int:
    """How many of the ascending knots ``(k,)`` are less than s, or equal to it as well."""
    low, high = 0, knots.shape[0]
    while low < high:
        middle = (low + high) // 2
        if knots[middle] < s or (equal and knots[middle] == s):
            low = middle + 1
        else:
            high = middle
    return low


@jit
def values_into(s: Array, pieces: Array, at: Array, out: Array) -> None:
    """out ← the spline at points ``(m,)``: ``(m, n)``."""
    i, last = 0, pieces.shape[0] - 1
    for m in range(at.shape[0]):
        if i > 0 and at[m] < s[i]:
            i = min(max(knots_before(s, at[m], False) - 1, 0), last)
        while i < last and at[m] >= s[i + 1]:
            i += 1
        d = at[m] - s[i]
        for j in range(pieces.shape[1]):
            p = pieces[i, j]
            out[m, j] = p[0] + d * (p[1] + d * (p[2] + d * p[3]))


def values(s: Array, pieces: Array, at: Array) -> Array:
    """As `values_into`, into a new array."""
    out: Array = np.empty((len(at), pieces.shape[1]))
    values_into(s, pieces, np.ascontiguousarray(at), out)
    return out


def parted(s: Array, pieces: Array, parts: NDArray[np.int64]) -> tuple[Array, Array]:
    """The same spline with each interval cut into equal parts ``(k,)``: knots, coefficients."""
    count = int(parts.sum())
    knots, cut = np.empty(count + 1), np.empty((count, pieces.shape[1], 4))
    _part(s, pieces, parts, knots, cut)
    return knots, cut


@jit
def _part(s: Array, pieces: Array, parts: NDArray[np.int64], knots: Array, cut: Array) -> None:
    """knots, cut ← as in `parted`."""
    k = 0
    for i in range(pieces.shape[0]):
        h = (s[i + 1] - s[i]) / parts[i]
        for m in range(min(parts[i], cut.shape[0] - k)):
            d = h * m
            knots[k] = s[i] + d
            for j in range(pieces.shape[1]):
                p = pieces[i, j]
                cut[k, j, 0] = p[0] + d * (p[1] + d * (p[2] + d * p[3]))
                cut[k, j, 1] = p[1] + d * (2.0 * p[2] + d * 3.0 * p[3])
                cut[k, j, 2] = p[2] + 3.0 * d * p[3]
                cut[k, j, 3] = p[3]
            k += 1
    knots[k] = s[pieces.shape[0]]


def turning_points(s: Array, pieces: Array) -> Array:
    """All places where a value of the spline may be largest or smallest: the knots, and where a slope is 0."""
    h = np.diff(s)[:, None]
    a, b, c = 3.0 * pieces[:, :, 3], pieces[:, :, 2], pieces[:, :, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        # a d² + 2 b d + c = 0, without cancellation
        size = -(b + np.copysign(np.sqrt(b * b - a * c), b))
        roots = np.concatenate([size / a, c / size], axis=1)
    inside = (roots > 0.0) & (roots < h)
    return np.sort(np.concatenate([s, (s[:-1, None] + roots)[inside]]))
