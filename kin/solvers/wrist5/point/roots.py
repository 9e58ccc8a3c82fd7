"""Real roots of polynomials, by brackets from the derivatives: kernels without allocation in loops."""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.transforms import Array


@jit
def _root_between(p: Array, degree: int, a: float, b: float, fa: float) -> float:
    """The root of Σ p[i] xⁱ between a and b, of opposite signs there, by Newton steps inside the bracket."""
    x = 0.5 * (a + b)
    for _ in range(80):
        f, slope = p[degree], 0.0
        for i in range(degree - 1, -1, -1):
            slope = slope * x + f
            f = f * x + p[i]
        if f == 0.0:
            return x
        if (f < 0.0) == (fa < 0.0):
            a = x
        else:
            b = x
        nearer = x - f / slope if slope != 0.0 else math.inf
        if not a < nearer < b:
            nearer = 0.5 * (a + b)
        if abs(nearer - x) <= 1e-16 * abs(x) or not a < nearer < b:
            return nearer
        x = nearer
    return x


@jit
def real_roots(p: Array, low: float, high: float, out: Array) -> int:
    """out ← the real roots of Σ p[i] xⁱ in [low, high], ascending; returns their number.

    Points at which the graph touches zero up to rounding count as roots. Between two roots of the derivative there
    is at most one root: so, from degree one up, the roots of each derivative bracket those of the next. `p`
    ``(degree + 1,)``, `out` ``(2·degree,)``.
    """
    degree = p.shape[0] - 1
    size = 0.0
    for i in range(degree + 1):
        size = max(size, abs(p[i]))
    if size == 0.0:
        return 0
    ladder = np.empty(16)
    marks = np.empty(16)
    n_marks = 0
    count = 0
    for d in range(1, degree + 1):
        lift = degree - d
        scale = 0.0
        for i in range(d + 1):
            factor = 1.0
            for j in range(lift):
                factor *= i + lift - j
            ladder[i] = p[i + lift] * factor / size
            scale += abs(ladder[i])
        count = 0
        left = low
        f_left = 0.0
        for i in range(d, -1, -1):
            f_left = f_left * left + ladder[i]
        for k in range(n_marks + 1):
            right = marks[k] if k < n_marks else high
            f_right = 0.0
            for i in range(d, -1, -1):
                f_right = f_right * right + ladder[i]
            if (f_left < 0.0) != (f_right < 0.0):
                out[count] = _root_between(ladder, d, left, right, f_left)
                count += 1
            if d == degree and k < n_marks:
                weight = max(1.0, abs(right)) ** d
                if abs(f_right) < 1e-10 * scale * weight:
                    out[count] = right
                    count += 1
            left, f_left = right, f_right
        if d < degree:
            n_marks = count
            for k in range(count):
                marks[k] = out[k]
    return count


@jit
def quadratic(a: float, b: float, c: float, out: Array) -> int:
    """out ← the real roots of a x² + b x + c; returns their number. A double root lost to rounding is kept."""
    inner = b * b - 4.0 * a * c
    scale = b * b + abs(4.0 * a * c)
    half = -0.5 * (b + math.copysign(math.sqrt(max(inner, 0.0)), b))
    if half == 0.0 or inner < -1e-12 * scale:
        return 0
    out[0] = c / half
    if abs(half) >= 1e9 * abs(a):
        return 1
    out[1] = half / a
    return 2
