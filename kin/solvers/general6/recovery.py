"""From one angle to the whole configuration: null vector, back substitution, and least squares.

A vector of monomials here is (x_d, x_d²) × (1, x_e, x_e²), with x_d and x_e the tangents of half of d and e, or
the travel of a joint that slides.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import jit
from kin.kernels.dense import solve_positive
from kin.solvers.general6.elimination import QUANTITIES, SCALARS, UNKNOWN, moved, quantities
from kin.transforms import Array

_FLAT = 1e-7  # of the largest entry: a pivot that leaves a second null vector
_STEPS = 10
_ARRIVED = 1e-14
_THERE = 1e-11  # radians, shares of the arm's size: the loop is closed


@jit
def null_vectors(W: Array, out: Array, least: int) -> int:
    """out ``(2, 6)`` ← one or two null vectors of W ``(6, 6)``, which is overwritten; returns how many.

    `least` = 2 returns two in any case: the second belongs to the second smallest pivot.
    """
    order = np.arange(6)
    largest = 0.0
    rank = 6
    for k in range(6):
        pr, pc, best = k, k, -1.0
        for n in range(k, 6):
            for m in range(k, 6):
                if abs(W[n, m]) > best:
                    pr, pc, best = n, m, abs(W[n, m])
        if k == 0:
            largest = best
        if k == 6 - least or best <= _FLAT * largest:
            rank = max(k, 4)
            break
        for m in range(6):
            W[k, m], W[pr, m] = W[pr, m], W[k, m]
        for n in range(6):
            W[n, k], W[n, pc] = W[n, pc], W[n, k]
        order[k], order[pc] = order[pc], order[k]
        for n in range(k + 1, 6):
            factor = W[n, k] / W[k, k]
            for m in range(k, 6):
                W[n, m] -= factor * W[k, m]
    x = np.zeros(6)
    for free in range(rank, 6):
        for m in range(rank, 6):
            x[m] = 1.0 if m == free else 0.0
        for k in range(rank - 1, -1, -1):
            total = 0.0
            for m in range(k + 1, 6):
                total -= W[k, m] * x[m]
            x[k] = total / W[k, k] if W[k, k] != 0.0 else 0.0
        for m in range(6):
            out[free - rank, order[m]] = x[m]
    return 6 - rank


@jit
def _best_minor(u: Array, w: Array, pairs: Array) -> tuple[float, float, float]:
    """Coefficients of αα, αβ, ββ in the largest 2×2 minor of ``α u + β w``, read as (1, x_d) × (1, x_e, x_e²)."""
    best = (0.0, 0.0, 0.0)
    size = -1.0
    for k in range(pairs.shape[0]):
        i, j, m, n = pairs[k, 0], pairs[k, 1], pairs[k, 2], pairs[k, 3]
        p = u[i] * u[j] - u[m] * u[n]
        q = u[i] * w[j] + w[i] * u[j] - u[m] * w[n] - w[m] * u[n]
        r = w[i] * w[j] - w[m] * w[n]
        if abs(p) + abs(q) + abs(r) > size:
            best, size = (p, q, r), abs(p) + abs(q) + abs(r)
    return best


# Entries (i, j, m, n) with v_i v_j = v_m v_n for a vector of monomials (1, x_d) × (1, x_e, x_e²).
_MINORS = np.array([(0, 4, 1, 3), (1, 5, 2, 4), (0, 5, 2, 3), (0, 2, 1, 1), (3, 5, 4, 4)])


@jit
def monomials(vectors: Array, count: int) -> int:
    """vectors ``(2, 6)`` ← the vectors of monomials that the null vectors span; returns how many there are.

    Two null vectors stand for two solutions with the same angle c: the combinations of rank one.
    """
    if count == 1:
        return 1
    u, w = vectors[0].copy(), vectors[1].copy()
    p, q, r = _best_minor(u, w, _MINORS)
    root = math.sqrt(max(q * q - 4.0 * p * r, 0.0))
    # Roots (α, β) of p αα + q αβ + r ββ, without cancellation.
    half = -0.5 * (q + (root if q > 0.0 else -root))
    for m in range(6):
        vectors[0, m] = half * u[m] + p * w[m]
        vectors[1, m] = r * u[m] + half * w[m]
    return 2


@jit
def values_of(v: Array, slides: Array) -> tuple[float, float]:
    """d and e of a vector of monomials (x_d, x_d²) × (1, x_e, x_e²), with any factor."""
    j = 0
    for k in range(1, 3):
        if abs(v[k]) + abs(v[3 + k]) > abs(v[j]) + abs(v[3 + j]):
            j = k
    d = _value(v[3 + j], v[j], slides[3])
    first = 0 if abs(v[0]) + abs(v[1]) + abs(v[2]) > abs(v[3]) + abs(v[4]) + abs(v[5]) else 3
    if abs(v[first]) + abs(v[first + 1]) < abs(v[first + 1]) + abs(v[first + 2]):
        first += 1
    return d, _value(v[first + 1], v[first], slides[4])


@jit
def _value(x: float, one: float, slides: float) -> float:
    """A joint's value from x and 1 times the same factor."""
    if slides != 0.0:
        return x / one if one != 0.0 else math.inf
    return 2.0 * math.atan2(x, one)


@jit
def _power(t: float, k: int, slides: float) -> float:
    """Of (1, cos t, sin t) the k-th; of a joint that slides, of (1, t, t²)."""
    if k == 0:
        return 1.0
    if slides != 0.0:
        return t if k == 1 else t * t
    return math.cos(t) if k == 1 else math.sin(t)


@jit
def others(F: Array, slides: Array, B: Array, Q: Array, diagonal: Array, t: Array) -> None:
    """t[0], t[1], t[5] ← a, b, f for the c, d, e in t ``(6,)``; the others as `eliminate` left them."""
    m = np.empty(9)
    for i in range(3):
        for j in range(3):
            m[3 * i + j] = _power(t[3], i, slides[3]) * _power(t[4], j, slides[4])
    right = np.zeros(QUANTITIES)
    for r in range(QUANTITIES):
        for k in range(9):
            right[r] += B[r, k] * m[k]
    if slides[2] != 0.0:
        s = right.copy()
        quantities(s[0], s[1], s[2], s[3], s[4], s[5] + t[2], right)
    else:
        cosine, sine = math.cos(t[2]), math.sin(t[2])
        for v in range(0, SCALARS, 3):
            x, y = right[v], right[v + 1]
            right[v], right[v + 1] = cosine * x - sine * y, sine * x + cosine * y
    for r in range(QUANTITIES):
        right[r] -= Q[r, 0]
    for k in range(UNKNOWN):
        dot = 0.0
        for r in range(k, QUANTITIES):
            dot += Q[r, k + 1] * right[r]
        for r in range(k, QUANTITIES):
            right[r] -= dot * Q[r, k + 1]
    for k in range(UNKNOWN - 1, -1, -1):
        for j in range(k + 1, UNKNOWN):
            right[k] -= Q[k, j + 1] * right[j]
        right[k] = right[k] / diagonal[k] if diagonal[k] != 0.0 else 0.0
    # Columns 1… of Q: cos b, sin b, cos a, cos a cos b, cos a sin b, sin a, …, or b, b², a, …
    t[1] = right[0] if slides[1] != 0.0 else math.atan2(right[1], right[0])
    t[0] = right[2] if slides[0] != 0.0 else math.atan2(right[5], right[2])
    t[5] = 0.0
    T = np.empty((3, 4))
    axes = np.empty((6, 6))
    close(F, slides, t, T, axes)
    # The loop without f is M F6, and F6 M = Rz(−f): its first column.
    x, y, z = moved(T, F[5, 0, 0], F[5, 0, 1], F[5, 0, 2], 0.0)
    cosine, sine, _ = moved(F[5], x, y, z, 0.0)
    t[5] = -math.atan2(sine, cosine)


@jit
def close(F: Array, slides: Array, t: Array, T: Array, axes: Array) -> None:
    """T ``(3, 4)`` ← the product around the loop, axes ``(6, 6)`` ← rows (direction, moment) of the joint axes.

    Of a joint that slides, the row is (0, direction).
    """
    for r in range(3):
        for k in range(4):
            T[r, k] = 1.0 if r == k else 0.0
    for i in range(6):
        zx, zy, zz = T[0, 2], T[1, 2], T[2, 2]
        ox, oy, oz = T[0, 3], T[1, 3], T[2, 3]
        axes[i, 0], axes[i, 1], axes[i, 2] = zx, zy, zz
        axes[i, 3], axes[i, 4], axes[i, 5] = oy * zz - oz * zy, oz * zx - ox * zz, ox * zy - oy * zx
        c, s = math.cos(t[i]), math.sin(t[i])
        if slides[i] != 0.0:
            c, s = 1.0, 0.0
            for r in range(3):
                axes[i, r], axes[i, 3 + r] = 0.0, T[r, 2]
                T[r, 3] += t[i] * T[r, 2]
        for r in range(3):
            x = c * T[r, 0] + s * T[r, 1]
            y = c * T[r, 1] - s * T[r, 0]
            z, p = T[r, 2], T[r, 3]
            for k in range(3):
                T[r, k] = x * F[i, 0, k] + y * F[i, 1, k] + z * F[i, 2, k]
            T[r, 3] = x * F[i, 0, 3] + y * F[i, 1, 3] + z * F[i, 2, 3] + p


@jit
def _miss(T: Array, e: Array) -> float:
    """e ``(6,)`` ← (rotation vector, translation) of T, which should be the identity; returns its square."""
    x, y, z = T[2, 1] - T[1, 2], T[0, 2] - T[2, 0], T[1, 0] - T[0, 1]
    sine = math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(sine, T[0, 0] + T[1, 1] + T[2, 2] - 1.0)
    k = angle / sine if sine > 1e-12 else 0.5
    e[0], e[1], e[2] = k * x, k * y, k * z
    e[3], e[4], e[5] = T[0, 3], T[1, 3], T[2, 3]
    total = angle * angle
    for r in range(3):
        total += T[r, 3] * T[r, 3]
    return total


@jit
def polish(F: Array, slides: Array, t: Array) -> bool:
    """Move t ``(6,)`` onto a solution of the loop, in place; False if none is near (Levenberg and Marquardt)."""
    T, axes, e, step = np.empty((3, 4)), np.empty((6, 6)), np.empty(6), np.empty(6)
    H, L, g, trial = np.empty((6, 6)), np.empty((6, 6)), np.empty(6), np.empty(6)
    close(F, slides, t, T, axes)
    cost = _miss(T, e)
    damping = 1e-3
    left = _STEPS
    while cost >= _ARRIVED * _ARRIVED and left > 0:
        for i in range(6):
            total = 0.0
            for r in range(6):
                total += axes[i, r] * e[r]
            g[i] = -total
            for j in range(i + 1):
                total = 0.0
                for r in range(6):
                    total += axes[i, r] * axes[j, r]
                H[i, j] = total
        better = math.inf
        while left > 0:
            left -= 1
            for i in range(6):
                step[i] = g[i]
                for j in range(i + 1):
                    L[i, j] = H[i, j]
            if solve_positive(L, 6, damping * cost + 1e-16, 0.0, step):
                for i in range(6):
                    trial[i] = t[i] + step[i]
                close(F, slides, trial, T, axes)
                better = _miss(T, e)
                if better < cost:
                    break
            damping = damping * 10.0 + 1e-9 / (cost + 1e-300)
        if not better < cost:
            break
        slow = better > 0.25 * cost
        for i in range(6):
            t[i] = trial[i]
        damping *= 1.0 if slow else 0.1
        if slow and cost < 1e-26:
            cost = better
            break
        cost = better
    for i in range(6):
        t[i] = wrap(t[i]) if slides[i] == 0.0 else t[i]
    return cost < _THERE * _THERE
