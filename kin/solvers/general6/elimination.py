"""From a loop of six joints to one angle: Raghavan and Roth's elimination.

With the target moved into the last transform, the arm is the loop ``Rz(a) F1 Rz(b) F2 … Rz(f) F6 = I``, which may
be cut at any joint. Written as

    Rz(c) F3 Rz(d) F4 Rz(e) F5 = F2⁻¹ Rz(−b) F1⁻¹ Rz(−a) F6⁻¹ Rz(−f)

the third column l and the position p of both sides do not contain f. The fourteen quantities l, p, p×l,
(p·p) l − 2 (l·p) p, p·p and l·p are linear in the products of (1, cos d, sin d) and (1, cos e, sin e) on the left,
and of the same of a and b on the right (Raghavan and Roth, J. Mechanical Design 115(3), 1993). The left null space
of the right-hand matrix removes a and b. With half-angle tangents of d and e six equations in nine monomials are
left; multiplied by the tangent of d once more they are the twelve rows of a square matrix Z(c), which is singular
where the loop closes.

**Slides.** A joint that slides by s puts Tz(s) in the place of its turn. The fourteen quantities are quadratic in
s, so (1, s, s²) takes the place of (1, cos, sin), and s that of the half tangent. For c, s = tan(φ/2) makes the
equations linear in (1, cos φ, sin φ) once they are multiplied by cos²(φ/2): the rest of the method does not see
the difference, but for a factor cos⁸(φ/2) of the determinant (:mod:`kin.solvers.general6.roots`). f must turn.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import inlined, jit
from kin.transforms import Array

Numbers = Array | NDArray[np.complex128]

# The fourteen quantities are four vectors, of which Rz(c) turns x and y, and from row 12 two scalars. The
# right-hand side has eight monomials of a and b besides the constant one.
SCALARS, QUANTITIES, UNKNOWN = 12, 14, 8
_THIRD = 2.0 * math.pi / 3.0
COS3 = np.array([math.cos(k * _THIRD) for k in range(3)])
SIN3 = np.array([math.sin(k * _THIRD) for k in range(3)])


@jit
def quantities(l0: float, l1: float, l2: float, p0: float, p1: float, p2: float, out: Array) -> None:
    """out ``(14,)`` ← l, p, p×l, (p·p) l − 2 (l·p) p, p·p, l·p."""
    pp = p0 * p0 + p1 * p1 + p2 * p2
    lp = l0 * p0 + l1 * p1 + l2 * p2
    out[0], out[1], out[2] = l0, l1, l2
    out[3], out[4], out[5] = p0, p1, p2
    out[6], out[7], out[8] = p1 * l2 - p2 * l1, p2 * l0 - p0 * l2, p0 * l1 - p1 * l0
    out[9], out[10], out[11] = pp * l0 - 2.0 * lp * p0, pp * l1 - 2.0 * lp * p1, pp * l2 - 2.0 * lp * p2
    out[12], out[13] = pp, lp


@jit
def moved(F: Array, x: float, y: float, z: float, w: float) -> tuple[float, float, float]:
    """The first three rows F ``(3, 4)`` of a transform applied to (x, y, z, w)."""
    return (
        F[0, 0] * x + F[0, 1] * y + F[0, 2] * z + F[0, 3] * w,
        F[1, 0] * x + F[1, 1] * y + F[1, 2] * z + F[1, 3] * w,
        F[2, 0] * x + F[2, 1] * y + F[2, 2] * z + F[2, 3] * w,
    )


@jit
def moved_back(F: Array, x: float, y: float, z: float, w: float) -> tuple[float, float, float]:
    """The inverse of F ``(3, 4)`` applied to (x, y, z, w)."""
    x, y, z = x - w * F[0, 3], y - w * F[1, 3], z - w * F[2, 3]
    return (
        F[0, 0] * x + F[1, 0] * y + F[2, 0] * z,
        F[0, 1] * x + F[1, 1] * y + F[2, 1] * z,
        F[0, 2] * x + F[1, 2] * y + F[2, 2] * z,
    )


@jit
def _sample(slides: float, k: int) -> tuple[float, float, float]:
    """(cos, sin, travel) of the k-th of the three values at which a joint is sampled."""
    if slides != 0.0:
        return 1.0, 0.0, k - 1.0
    return COS3[k], SIN3[k], 0.0


@jit
def _fourier(G: Array, first: float, second: float) -> None:
    """G ``(14, 9)``: values at three by three samples → coefficients of (1, cos, sin) × (1, cos, sin), in place.

    Of a joint that slides, of (1, s, s²).
    """
    for r in range(QUANTITIES):
        for part in range(2):
            stride, step = (1, 3) if part == 0 else (3, 1)
            slides = (second if part == 0 else first) != 0.0
            for k in range(3):
                i = k * step
                u, v, w = G[r, i], G[r, i + stride], G[r, i + 2 * stride]
                if slides:
                    G[r, i], G[r, i + stride], G[r, i + 2 * stride] = v, 0.5 * (w - u), 0.5 * (u + w) - v
                    continue
                G[r, i] = (u + v + w) / 3.0
                G[r, i + stride] = (2.0 * u - v - w) / 3.0
                G[r, i + 2 * stride] = (v - w) / math.sqrt(3.0)


@jit
def _left(F: Array, slides: Array, B: Array) -> None:
    """B ``(14, 9)`` ← the quantities of F3 Rz(d) F4 Rz(e) F5 as coefficients of (d) × (e)."""
    col = np.empty(QUANTITIES)
    lx, ly, lz = F[4, 0, 2], F[4, 1, 2], F[4, 2, 2]
    px, py, pz = F[4, 0, 3], F[4, 1, 3], F[4, 2, 3]
    for j in range(3):
        c, s, z = _sample(slides[4], j)
        l0, l1, l2 = moved(F[3], c * lx - s * ly, s * lx + c * ly, lz, 0.0)
        p0, p1, p2 = moved(F[3], c * px - s * py, s * px + c * py, pz + z, 1.0)
        for i in range(3):
            c, s, z = _sample(slides[3], i)
            u0, u1, u2 = moved(F[2], c * l0 - s * l1, s * l0 + c * l1, l2, 0.0)
            v0, v1, v2 = moved(F[2], c * p0 - s * p1, s * p0 + c * p1, p2 + z, 1.0)
            quantities(u0, u1, u2, v0, v1, v2, col)
            for r in range(QUANTITIES):
                B[r, 3 * i + j] = col[r]
    _fourier(B, slides[3], slides[4])


@jit
def _right(F: Array, slides: Array, Q: Array) -> None:
    """Q ``(14, 9)`` ← the quantities of F2⁻¹ Rz(−b) F1⁻¹ Rz(−a) F6⁻¹ as coefficients of (a) × (b)."""
    col = np.empty(QUANTITIES)
    lx, ly, lz = moved_back(F[5], 0.0, 0.0, 1.0, 0.0)
    px, py, pz = moved_back(F[5], 0.0, 0.0, 0.0, 1.0)
    for i in range(3):
        c, s, z = _sample(slides[0], i)
        l0, l1, l2 = moved_back(F[0], c * lx + s * ly, c * ly - s * lx, lz, 0.0)
        p0, p1, p2 = moved_back(F[0], c * px + s * py, c * py - s * px, pz - z, 1.0)
        for j in range(3):
            c, s, z = _sample(slides[1], j)
            u0, u1, u2 = moved_back(F[1], c * l0 + s * l1, c * l1 - s * l0, l2, 0.0)
            v0, v1, v2 = moved_back(F[1], c * p0 + s * p1, c * p1 - s * p0, p2 - z, 1.0)
            quantities(u0, u1, u2, v0, v1, v2, col)
            for r in range(QUANTITIES):
                Q[r, 3 * i + j] = col[r]
    _fourier(Q, slides[0], slides[1])


@jit
def _householder(Q: Array, diagonal: Array) -> None:
    """Q ``(14, 9)``: columns 1…8 ← R above, reflectors v below (|v|² = 2); diagonal ← that of R."""
    for k in range(UNKNOWN):
        norm = 0.0
        for r in range(k, QUANTITIES):
            norm += Q[r, k + 1] * Q[r, k + 1]
        norm = math.sqrt(norm)
        head = Q[k, k + 1]
        diagonal[k] = -norm if head > 0.0 else norm
        scale = norm * (norm + abs(head))
        if scale == 0.0:
            for r in range(k, QUANTITIES):
                Q[r, k + 1] = 0.0
            continue
        Q[k, k + 1] = head - diagonal[k]
        scale = 1.0 / math.sqrt(scale)
        for r in range(k, QUANTITIES):
            Q[r, k + 1] *= scale
        for j in range(k + 2, UNKNOWN + 1):
            dot = 0.0
            for r in range(k, QUANTITIES):
                dot += Q[r, k + 1] * Q[r, j]
            for r in range(k, QUANTITIES):
                Q[r, j] -= dot * Q[r, k + 1]


@jit
def _half_angles(E: Array, slides: Array) -> None:
    """E ``(6, 9)``: coefficients of (1, cos, sin) of d and of e → those of powers 0…2 of their half tangents.

    Those of a joint that slides are powers already.
    """
    for r in range(6):
        for part in range(2):
            stride, step = (1, 3) if part == 0 else (3, 1)
            if slides[4 - part] != 0.0:
                continue
            for k in range(3):
                i = k * step
                one, cosine, sine = E[r, i], E[r, i + stride], E[r, i + 2 * stride]
                E[r, i], E[r, i + stride], E[r, i + 2 * stride] = one + cosine, 2.0 * sine, one - cosine


@jit
def eliminate(F: Array, slides: Array, B: Array, Q: Array, diagonal: Array, E: Array) -> None:
    """The six equations that are left of the loop F ``(6, 3, 4)``; joints with slides ``(6,)`` ≠ 0 slide.

    B, Q ``(14, 9)`` ← both sides (Q as `_householder` leaves it, its first column being the constant), diagonal
    ``(8,)``, E ``(3, 6, 9)`` ← the parts of the equations that go with 1, cos c and sin c.
    """
    _left(F, slides, B)
    _right(F, slides, Q)
    _householder(Q, diagonal)
    row = np.empty(QUANTITIES)
    for n in range(6):
        for r in range(QUANTITIES):
            row[r] = 1.0 if r == UNKNOWN + n else 0.0
        for k in range(UNKNOWN - 1, -1, -1):
            dot = 0.0
            for r in range(k, QUANTITIES):
                dot += Q[r, k + 1] * row[r]
            for r in range(k, QUANTITIES):
                row[r] -= dot * Q[r, k + 1]
        if slides[2] != 0.0:
            _slide_of_c(B, row, E[0, n], E[1, n], E[2, n])
        for m in range(9):
            if slides[2] != 0.0:
                break
            constant = row[12] * B[12, m] + row[13] * B[13, m]
            cosine = sine = 0.0
            for v in range(0, SCALARS, 3):
                constant += row[v + 2] * B[v + 2, m]
                cosine += row[v] * B[v, m] + row[v + 1] * B[v + 1, m]
                sine += row[v + 1] * B[v, m] - row[v] * B[v + 1, m]
            E[0, n, m], E[1, n, m], E[2, n, m] = constant, cosine, sine
        for r in range(QUANTITIES):
            shift = row[r] * Q[r, 0]
            # cos² = ½ + ½ cos φ
            E[0, n, 0] -= shift if slides[2] == 0.0 else 0.5 * shift
            E[1, n, 0] -= 0.0 if slides[2] == 0.0 else 0.5 * shift
    for part in range(3):
        _half_angles(E[part], slides)


@jit
def _slide_of_c(B: Array, row: Array, one: Array, cosine: Array, sine: Array) -> None:
    """One equation where c slides: one, cosine, sine ``(9,)`` ← its parts with 1, cos φ, sin φ, by cos²(φ/2).

    p + s z for p in the fourteen quantities: l stays, the others get parts with s and s².
    """
    for m in range(9):
        unit = 1.0 if m == 0 else 0.0
        constant = 0.0
        for r in range(QUANTITIES):
            constant += row[r] * B[r, m]
        linear = row[5] * unit - row[6] * B[1, m] + row[7] * B[0, m] + row[13] * B[2, m]
        linear += 2.0 * (row[9] * B[7, m] - row[10] * B[6, m] - row[11] * B[13, m] + row[12] * B[5, m])
        square = row[9] * B[0, m] + row[10] * B[1, m] - row[11] * B[2, m] + row[12] * unit
        one[m], cosine[m], sine[m] = 0.5 * (constant + square), 0.5 * (constant - square), 0.5 * linear


@inlined
def _square(x: complex) -> float:
    """|x|², which costs no root as |x| does."""
    return x.real * x.real + x.imag * x.imag


@jit
def condense(E: Array, c: complex, s: complex, A: Numbers, W: Numbers) -> complex:
    """W ``(6, 6)`` ← what is left of Z(c) once its first and last three columns are eliminated; product of pivots.

    A ``(2, 6, 9)`` is scratch. The determinant of Z is the result times that of W, up to a constant sign.
    """
    for n in range(6):
        for m in range(9):
            A[0, n, m] = A[1, n, m] = E[0, n, m] + c * E[1, n, m] + s * E[2, n, m]
    product = 1.0 + 0.0 * c
    for half in range(2):
        U = A[half]
        first = 0 if half == 0 else 6
        # Columns that stay: those after the first three, or those before the last three.
        start = 3 if half == 0 else 0
        for k in range(3):
            pivot = k
            for n in range(k + 1, 6):
                if _square(U[n, first + k]) > _square(U[pivot, first + k]):
                    pivot = n
            if pivot != k:
                product = -product
                for m in range(9):
                    U[k, m], U[pivot, m] = U[pivot, m], U[k, m]
            value = U[k, first + k]
            product *= value
            if value == 0.0:
                continue
            back = 1.0 / value
            for n in range(k + 1, 6):
                factor = U[n, first + k] * back
                for j in range(k + 1, 3):
                    U[n, first + j] -= factor * U[k, first + j]
                for m in range(start, start + 6):
                    U[n, m] -= factor * U[k, m]
        for n in range(3):
            for m in range(6):
                W[3 * half + n, m] = U[3 + n, start + m]
    return product


@jit
def times_determinant(product: complex, W: Numbers) -> complex:
    """`product` times the determinant of W ``(6, 6)``, which is overwritten."""
    for k in range(6):
        pivot = k
        for n in range(k + 1, 6):
            if _square(W[n, k]) > _square(W[pivot, k]):
                pivot = n
        if pivot != k:
            product = -product
            for m in range(k, 6):
                W[k, m], W[pivot, m] = W[pivot, m], W[k, m]
        value = W[k, k]
        product *= value
        if value == 0.0:
            return product
        back = 1.0 / value
        for n in range(k + 1, 6):
            factor = W[n, k] * back
            for m in range(k + 1, 6):
                W[n, m] -= factor * W[k, m]
    return product
