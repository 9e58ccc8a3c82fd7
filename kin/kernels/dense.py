"""Dense linear algebra of matrices with a few rows, for kernels: Cholesky, elimination, QR and singular values.

NumPy's functions call LAPACK, whose calls take longer than all the work on a 6×6 matrix, and make new arrays.
These overwrite their arguments instead (Golub and Van Loan, Matrix Computations, 4th edition, sections 3.4, 4.2,
5.2 and 8.6).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import jit
from kin.transforms import Array


@jit
def packed(H: Array, free: Array | NDArray[np.bool_], A: Array) -> int:
    """A ← the lower triangle of a symmetric H ``(n, n)`` over its free indices; returns how many these are."""
    m = 0
    for i in range(free.shape[0]):
        if free[i]:
            k = 0
            for j in range(i + 1):
                if free[j]:
                    A[m, k] = H[i, j]
                    k += 1
            m += 1
    return m


@jit
def cholesky(A: Array, m: int, damping: float, share: float) -> bool:
    """The lower triangle of the leading m rows of A ← L with ``L Lᵀ = A + damping · I``.

    False if a pivot is no more than a share of its diagonal entry: A is not positive definite, or hardly.
    """
    for i in range(m):
        for j in range(i):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            A[i, j] = total / A[j, j]
        least = share * (abs(A[i, i]) + damping) + 1e-300
        total = A[i, i] + damping
        for k in range(i):
            total -= A[i, k] * A[i, k]
        if not total > least:
            return False
        A[i, i] = math.sqrt(total)
    return True


@jit
def solve_positive(A: Array, m: int, damping: float, share: float, x: Array) -> bool:
    """x ``(m,)`` ← (A + damping · I)⁻¹ x; A ← as by `cholesky`, whose result is returned."""
    if not cholesky(A, m, damping, share):
        return False
    for i in range(m):
        total = x[i]
        for k in range(i):
            total -= A[i, k] * x[k]
        x[i] = total / A[i, i]
    for i in range(m - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, m):
            total -= A[k, i] * x[k]
        x[i] = total / A[i, i]
    return True


@jit
def gram(J: Array, rows: int, damping: float, A: Array) -> None:
    """A ← J Jᵀ + damping · I of the leading rows of J, both triangles."""
    for r in range(rows):
        for c in range(rows):
            total = damping if r == c else 0.0
            for j in range(J.shape[1]):
                total += J[r, j] * J[c, j]
            A[r, c] = total


@jit
def shortest_and_null(J: Array, e: Array, A: Array, n: Array, x: Array) -> bool:
    """n ``(7,)`` ← unit null vector of J ``(6, 7)``, x ``(7,)`` ← the shortest vector with ``J x = e``.

    Gaussian elimination with the largest entry of each row as its pivot; A ``(7, 8)`` is scratch. The determinant
    of J with n as a last row is positive, so that n changes along a curve without a jump. False if rank J < 6.
    """
    sense = 1.0
    for c in range(7):
        A[6, c] = c  # which column of J this one is
        for r in range(6):
            A[r, c] = J[r, c]
    for r in range(6):
        A[r, 7] = e[r]
    for k in range(6):
        best, column = abs(A[k, k]), k
        for c in range(k + 1, 7):
            if abs(A[k, c]) > best:
                best, column = abs(A[k, c]), c
        if not best > 1e-14:
            return False
        if column != k:
            sense = -sense
            for r in range(7):
                A[r, k], A[r, column] = A[r, column], A[r, k]
        inverse = 1.0 / A[k, k]
        sense = math.copysign(sense, sense * inverse)
        for r in range(k + 1, 6):
            factor = A[r, k] * inverse
            for c in range(k + 1, 8):
                A[r, c] -= factor * A[k, c]
    free = int(A[6, 6])
    n[free], x[free] = sense, 0.0
    length, dot = 1.0, 0.0
    for k in range(5, -1, -1):
        along, step = -A[k, 6] * sense, A[k, 7]
        for c in range(k + 1, 6):
            i = int(A[6, c])
            along -= A[k, c] * n[i]
            step -= A[k, c] * x[i]
        i, inverse = int(A[6, k]), 1.0 / A[k, k]
        n[i], x[i] = along * inverse, step * inverse
        length += n[i] * n[i]
        dot += n[i] * x[i]
    dot /= length
    length = 1.0 / math.sqrt(length)
    for i in range(7):
        x[i] -= dot * n[i]
        n[i] *= length
    return True


@jit
def volume(A: Array) -> float:
    """Product of the singular values of A ``(m, k)``, m ≥ k, by Householder QR."""
    m, k = A.shape
    product = 1.0
    for j in range(k):
        scale = 0.0
        for i in range(j, m):
            scale = max(scale, abs(A[i, j]))
        if scale == 0.0:
            return 0.0
        norm2 = 0.0
        for i in range(j, m):
            A[i, j] /= scale
            norm2 += A[i, j] * A[i, j]
        norm = math.sqrt(norm2)
        product *= norm * scale
        head = A[j, j]
        pivot = head + math.copysign(norm, head)
        A[j, j] = pivot
        half = norm2 + abs(head) * norm
        for c in range(j + 1, k):
            dot = 0.0
            for i in range(j, m):
                dot += A[i, j] * A[i, c]
            dot /= half
            for i in range(j, m):
                A[i, c] -= dot * A[i, j]
    return product


@jit
def least_pivot(A: Array) -> float:
    """The last pivot of A ``(m, k)`` by orthogonalisation with column pivoting: about its least singular value."""
    m, k = A.shape
    least = math.inf
    for i in range(k):
        best, largest = i, -1.0
        for j in range(i, k):
            square = 0.0
            for r in range(m):
                square += A[r, j] * A[r, j]
            if square > largest:
                best, largest = j, square
        if largest == 0.0:
            return 0.0
        least = math.sqrt(largest)
        for r in range(m):
            A[r, i], A[r, best] = A[r, best], A[r, i]
            A[r, i] /= least
        for j in range(i + 1, k):
            dot = 0.0
            for r in range(m):
                dot += A[r, i] * A[r, j]
            for r in range(m):
                A[r, j] -= dot * A[r, i]
    return least


@jit
def singular_values(A: Array, V: Array, w: Array) -> None:
    """w ``(k,)`` ← squares of the singular values of A ``(m, k)``, V ``(k, k)`` ← columns: their right vectors.

    One-sided Jacobi rotations, which are exact for small singular values too. The columns of A ← σ u.
    """
    m, k = A.shape
    for i in range(k):
        for j in range(k):
            V[i, j] = 1.0 if i == j else 0.0
    for _ in range(30):
        turned = False
        for i in range(k - 1):
            for j in range(i + 1, k):
                a = b = c = 0.0
                for r in range(m):
                    a += A[r, i] * A[r, i]
                    b += A[r, j] * A[r, j]
                    c += A[r, i] * A[r, j]
                if abs(c) <= 1e-16 * math.sqrt(a * b) or abs(c) < 1e-40:
                    continue
                turned = True
                zeta = (b - a) / (2.0 * c)
                t = math.copysign(1.0, zeta) / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
                cosine = 1.0 / math.sqrt(1.0 + t * t)
                sine = cosine * t
                for r in range(m):
                    x, y = A[r, i], A[r, j]
                    A[r, i], A[r, j] = cosine * x - sine * y, sine * x + cosine * y
                for r in range(k):
                    x, y = V[r, i], V[r, j]
                    V[r, i], V[r, j] = cosine * x - sine * y, sine * x + cosine * y
        if not turned:
            break
    for i in range(k):
        w[i] = 0.0
        for r in range(m):
            w[i] += A[r, i] * A[r, i]
