"""The θ5 of a given θ4 at which a plane is met, or at which the arm is stretched or folded."""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.common import add_roots
from kin.solvers.wrist5.point.constants import A1, A2, D4, D6, KAY, RAD
from kin.solvers.wrist5.point.roots import real_roots
from kin.transforms import Array

Level = tuple[float, float, float, float]


@jit
def _polished(level: Level, r: float, lever: float, side: float, t: float) -> float:
    """A root of `level_roots` near t, by Newton steps on the equation before squaring, with the sign `side`."""
    g0, g1, g2, g3 = level
    for _ in range(4):
        c, s = math.cos(t), math.sin(t)
        R = side * math.sqrt(max(r * r - (lever * s) ** 2, 0.0))
        f = g0 + g1 * c + g2 * s + g3 * R
        slope = g2 * c - g1 * s
        if R != 0.0:
            slope -= g3 * lever * lever * s * c / R
        if abs(f) > 0.01 * abs(slope) or abs(f) < 1e-16 * abs(slope):
            break
        t -= f / slope
    return t


@jit
def level_roots(level: Level, r: float, lever: float, start: float, end: float, breaks: Array, count: int) -> int:
    """Append the θ in [start, end] with g0 + g1 cos θ + g2 sin θ ± g3 √(r² − (lever sin θ)²) = 0.

    level: (g0, g1, g2, g3). Squared, the equation is a quartic in tan((θ − θ0)/2), half a turn at a time. The
    equation before squaring then polishes the roots, also those that squaring has merged.
    """
    g0, g1, g2, g3 = level
    reach = abs(g3) * r
    size = max(abs(g0) + reach, math.hypot(g1, g2))
    if reach <= 1e-13 * size:
        return int(add_roots(g1, g2, g0, breaks, count))
    w = (g3 * lever) ** 2
    a0 = g0 * g0 + 0.5 * (g1 * g1 + g2 * g2) - reach * reach + 0.5 * w
    p, roots = np.empty(5), np.empty(8)
    pieces = math.ceil((end - start) / math.pi - 1e-9)
    for piece in range(pieces):
        width = (end - start) / pieces
        middle = start + (piece + 0.5) * width
        c, s = math.cos(middle), math.sin(middle)
        u, v = g1 * c + g2 * s, g2 * c - g1 * s
        a1, b1 = 2.0 * g0 * u, 2.0 * g0 * v
        c2, s2 = c * c - s * s, 2.0 * c * s
        a2 = 0.5 * (u * u - v * v - w * c2)
        b2 = u * v + 0.5 * w * s2
        p[0] = a0 + a1 + a2
        p[1] = 2.0 * b1 + 4.0 * b2
        p[2] = 2.0 * a0 - 6.0 * a2
        p[3] = 2.0 * b1 - 4.0 * b2
        p[4] = a0 - a1 + a2
        bound = math.tan(0.25 * width) * (1.0 + 1e-9)
        for k in range(real_roots(p, -bound, bound, roots)):
            found = middle + 2.0 * math.atan(roots[k])
            smooth = g0 + g1 * math.cos(found) + g2 * math.sin(found)
            for side in (-1.0, 1.0):
                # Where the square root vanishes, either sign is possible.
                if smooth * side * g3 > 1e-5 * size * abs(g3):
                    continue
                breaks[count] = _polished(level, r, lever, side, found)
                count += 1
    return count


@jit
def _polished_stretch(
    gw: tuple[float, float], squares: tuple[float, float], K: float, a2: float, side: float, c: float
) -> float:
    """A root of `stretched` near c = cos θ5, by Newton steps on the equation before squaring.

    gw: (g, w). squares: R² − w c² and L² − g c − w c². side: ±2 a1, with the sign of R.
    """
    g, w = gw
    rest, l0 = squares
    fold = 0.0
    for _ in range(4):
        R = math.sqrt(max(rest + w * c * c, 0.0))
        L = math.sqrt(max(l0 + c * (g + w * c), 0.0))
        f = K - g * c - side * R
        if fold == 0.0:
            fold = math.copysign(2.0 * a2, f)
        f -= fold * L
        slope = -g - side * w * c / R - 0.5 * fold * (g + 2.0 * w * c) / L
        if not 1e-16 * abs(slope) < abs(f) < 0.01 * abs(slope):
            break
        c -= f / slope
    return c


@jit
def stretched(k: Array, lever: float, breaks: Array, count: int) -> int:
    """Append the θ5 at which the arm is stretched or folded; lever = d6 sin θ4.

    With c = cos θ5, K − g c − 2 a1 R = ±2 a2 L, where R² = r² − w s² and L² = d4² + d6² + g c − w s², is squared
    twice: with A = K − g c and U = A² + 4 a1² R² − 4 a2² L² the first square is U = 4 a1 A R.
    """
    a1, a2, K, r2 = k[A1], k[A2], k[KAY], k[RAD] * k[RAD]
    g, w = 2.0 * k[D4] * k[D6], lever * lever
    rest, l0 = r2 - w, k[D4] * k[D4] + k[D6] * k[D6] - w
    u0 = K * K + 4.0 * a1 * a1 * rest - 4.0 * a2 * a2 * l0
    u1 = -2.0 * (K + 2.0 * a2 * a2) * g
    u2 = g * g + 4.0 * (a1 * a1 - a2 * a2) * w
    p, roots = np.zeros(5), np.empty(8)
    v = 16.0 * a1 * a1
    if v * r2 > 1e-26:
        p[0] = u0 * u0 - v * K * K * rest
        p[1] = 2.0 * u0 * u1 + v * 2.0 * K * g * rest
        p[2] = u1 * u1 + 2.0 * u0 * u2 - v * (g * g * rest + K * K * w)
        p[3] = 2.0 * u1 * u2 + v * 2.0 * K * g * w
        p[4] = u2 * u2 - v * g * g * w
    else:
        p[0] = u0
        p[1] = u1
        p[2] = u2
    for i in range(real_roots(p, -1.0, 1.0, roots)):
        U = u0 + roots[i] * (u1 + roots[i] * u2)
        for side in (-2.0 * a1, 2.0 * a1):
            # Where U vanishes up to rounding, either sign of R is possible.
            if U * (K - g * roots[i]) * side < -1e-5 * abs(u0 * K * side):
                continue
            c = _polished_stretch((g, w), (rest, l0), K, a2, side, roots[i])
            breaks[count] = math.acos(min(max(c, -1.0), 1.0))
            breaks[count + 1] = -breaks[count]
            count += 2
    return count
