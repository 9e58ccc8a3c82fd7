"""Joint values that follow poses of the tool, by continuation: each begins where the ones before point to.

Newton steps with damping that vanishes with the error (Levenberg–Marquardt): they converge quadratically, and pass
singularities at which the motion continues. Redundant joints move as little as possible, and away from limits.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.kernels.dense import gram, solve_positive
from kin.kernels.jacobian import jacobian_into
from kin.transforms import Array

MET = 1e-10  # metres and radians
_TRIES = 40
_AWAY = 0.5  # how strongly redundant joints move away from their limits, per metre


@jit
def miss(T: Array, target: Array, rows: int, e: Array) -> float:
    """e ← from T to the target ``(6,)``: rows 3 (point), 5 (point, approach direction) or 6; returns its size."""
    for r in range(3):
        e[r] = target[r, 3] - T[r, 3]
    # Twice the sine of the angle, along the axis of rotation in the base frame.
    x = y = z = 0.0
    first = 2 if rows == 5 else 0
    if rows > 3:
        for c in range(first, 3):
            x += T[1, c] * target[2, c] - T[2, c] * target[1, c]
            y += T[2, c] * target[0, c] - T[0, c] * target[2, c]
            z += T[0, c] * target[1, c] - T[1, c] * target[0, c]
    scale = 1.0 if rows == 5 else 0.5
    x, y, z = scale * x, scale * y, scale * z
    if rows == 5:
        e[3] = T[0, 0] * x + T[1, 0] * y + T[2, 0] * z
        e[4] = T[0, 1] * x + T[1, 1] * y + T[2, 1] * z
        e[5] = 0.0
    else:
        e[3], e[4], e[5] = x, y, z
    total = 0.0
    for r in range(6):
        total += e[r] * e[r]
    return math.sqrt(total)


@jit
def approach(model: Array, target: Array, rows: int, q: Array) -> float:
    """q ← a configuration near q that meets the target; returns what is missed."""
    n = q.shape[0]
    J, T, axes, e = np.empty((6, n)), np.empty((4, 4)), np.empty((n, 7)), np.empty(6)
    best, last = np.empty(n), math.inf
    least = math.inf
    for _ in range(_TRIES):
        jacobian_into(model, q, J, T, axes)
        size = miss(T, target, rows, e)
        if size < least:
            least = size
            for j in range(n):
                best[j] = q[j]
        if size < 1e-14 or (size < MET and size > 0.25 * last):
            break
        last = size
        to_tool(J, T, rows)
        if not _step(J, e, rows, min(size * size, 1e-2) + 1e-20, q):
            break
    for j in range(n):
        q[j] = best[j]
    return least


@jit
def to_tool(J: Array, T: Array, rows: int) -> None:
    """For an approach direction: the turning about the tool's x and y axes instead of the base's."""
    if rows != 5:
        return
    for j in range(J.shape[1]):
        a, b, c = J[3, j], J[4, j], J[5, j]
        J[3, j] = T[0, 0] * a + T[1, 0] * b + T[2, 0] * c
        J[4, j] = T[0, 1] * a + T[1, 1] * b + T[2, 1] * c
        J[5, j] = 0.0


@jit
def _step(J: Array, e: Array, rows: int, damping: float, q: Array) -> bool:
    """q ← q + the damped least-squares step for e; False if rounding errors leave none."""
    n = q.shape[0]
    if n >= rows:
        A, y = np.empty((rows, rows)), np.empty(rows)
        gram(J, rows, damping, A)
        for r in range(rows):
            y[r] = e[r]
        if not solve_positive(A, rows, 0.0, 0.0, y):
            return False
        for j in range(n):
            for r in range(rows):
                q[j] += J[r, j] * y[r]
        return True
    B, z = np.empty((n, n)), np.empty(n)
    for i in range(n):
        z[i] = 0.0
        for r in range(rows):
            z[i] += J[r, i] * e[r]
        for j in range(n):
            total = damping if i == j else 0.0
            for r in range(rows):
                total += J[r, i] * J[r, j]
            B[i, j] = total
    if not solve_positive(B, n, 0.0, 0.0, z):
        return False
    for i in range(n):
        q[i] += z[i]
    return True


@jit
def follow(
    model: Array, targets: Array, s: Array, rows: int, bounds: Array, most: float, first: int, q: Array
) -> int:
    """q[i] ← configurations that meet the targets, from `first` on; returns how many there are now.

    Args:
        model: the arm.
        targets: poses ``(k, 4, 4)`` at rising s ``(k,)``.
        s: where they are.
        rows: what is kept, as in `miss`.
        bounds: lower and upper limits ``(2, n)``; redundant joints stay away from them.
        most: the largest motion of a joint between neighbours.
        first: how many configurations are given, at least one.
        q: configurations ``(k, n)``.
    """
    n = q.shape[1]
    for i in range(first, targets.shape[0]):
        for j in range(n):
            q[i, j] = q[i - 1, j]
            if i > 1:
                q[i, j] += (q[i - 1, j] - q[i - 2, j]) * (s[i] - s[i - 1]) / (s[i - 1] - s[i - 2])
        if n > rows:
            for j in range(n):
                half = 0.5 * (bounds[1, j] - bounds[0, j])
                if half < 1e6:
                    off = (q[i - 1, j] - 0.5 * (bounds[0, j] + bounds[1, j])) / half
                    q[i, j] -= _AWAY * (s[i] - s[i - 1]) * off**7
        error = approach(model, targets[i], rows, q[i])
        far = 0.0
        for j in range(n):
            far = max(far, abs(q[i, j] - q[i - 1, j]))
        if not error < MET * 10.0 or far > most:
            return i
    return len(targets)


@jit
def settle(model: Array, targets: Array, rows: int, q: Array, errors: Array) -> None:
    """q[i] ← configurations near q[i] that meet the targets ``(k, 4, 4)``; errors ← what is missed ``(k,)``."""
    for i in range(targets.shape[0]):
        errors[i] = approach(model, targets[i], rows, q[i])
