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


def values(s: Array, pieces: Array, at: Array) -> Array:
    """The spline at points ``(m,)``: ``(m, n)``."""
    i = np.clip(np.searchsorted(s, at, side="right") - 1, 0, len(pieces) - 1)
    r, p = (at - s[i])[:, None], np.moveaxis(pieces[i], -1, 0)
    return np.asarray(p[0] + r * (p[1] + r * (p[2] + r * p[3])))


def parted(s: Array, pieces: Array, parts: NDArray[np.int64]) -> tuple[Array, Array]:
    """The same spline with each interval cut into equal parts ``(k,)``: knots, coefficients."""
    old = np.repeat(np.arange(len(parts)), parts)
    step = np.arange(len(old)) - np.repeat(np.cumsum(parts) - parts, parts)
    r = (np.diff(s) / parts)[old] * step
    p, d = np.moveaxis(pieces[old], -1, 0), r[:, None]
    cut = np.stack(
        [
            p[0] + d * (p[1] + d * (p[2] + d * p[3])),
            p[1] + d * (2 * p[2] + 3 * d * p[3]),
            p[2] + 3 * d * p[3],
            p[3],
        ],
        axis=-1,
    )
    return np.append(s[old] + r, s[-1]), np.ascontiguousarray(cut)
