"""Compiled geometric Jacobian and manipulability.

Column j of the Jacobian is the twist of the tool point for a unit speed of joint j. For a revolute joint with
the unit axis z through the point o it is (z × (p − o), z), for a prismatic joint (z, 0), with p the tool point.
The axes are collected in the same pass that computes the pose of the tool. A row that follows a joint adds the
same for its own axis, times its ratio; arms with such rows take a second pass for them.

The layout of an arm's array is described in :mod:`kin.kernels.fk`.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.kernels.fk import HEADER, WIDTH, advance, apply_tool, base_rows, x_part, z_part
from kin.transforms import Array


@jit
def jacobian_into(model: Array, q: Array, J: Array, T: Array, axes: Array) -> None:
    """J ← geometric Jacobian ``(6, n)`` in the base frame, T ← T_base_tool; `axes` ``(n, 7)`` is scratch.

    The joint axis is the z axis of the frame in which Rz/Tz of its row acts; Rz and Tz leave that line unchanged.
    """
    ahead = 0 if model[2] == 0.0 else 1
    follows = False
    x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2 = base_rows(model, ahead)
    for i in range(int(model[0])):
        k = HEADER + WIDTH * i
        j = int(model[k + 6])
        if model[k + 5] > 2.0:
            follows = True
        elif j >= 0:
            axes[j, 0], axes[j, 1], axes[j, 2] = z0, z1, z2
            axes[j, 3], axes[j, 4], axes[j, 5] = p0, p1, p2
            axes[j, 6] = model[k + 5]
        s, c, d = z_part(model, i, q)
        a, ca, sa = x_part(model, i + ahead)
        x0, y0, z0, p0 = advance((x0, y0, z0, p0), s, c, d, a, ca, sa)
        x1, y1, z1, p1 = advance((x1, y1, z1, p1), s, c, d, a, ca, sa)
        x2, y2, z2, p2 = advance((x2, y2, z2, p2), s, c, d, a, ca, sa)
    apply_tool(model, (x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2), T)
    for j in range(int(model[1])):
        zx, zy, zz = axes[j, 0], axes[j, 1], axes[j, 2]
        if axes[j, 6] == 1.0:
            rx, ry, rz = T[0, 3] - axes[j, 3], T[1, 3] - axes[j, 4], T[2, 3] - axes[j, 5]
            J[0, j] = zy * rz - zz * ry
            J[1, j] = zz * rx - zx * rz
            J[2, j] = zx * ry - zy * rx
            J[3, j] = zx
            J[4, j] = zy
            J[5, j] = zz
        else:
            J[0, j] = zx
            J[1, j] = zy
            J[2, j] = zz
            J[3, j] = 0.0
            J[4, j] = 0.0
            J[5, j] = 0.0
    if follows:
        _add_followers(model, q, J, T)


@jit
def _add_followers(model: Array, q: Array, J: Array, T: Array) -> None:
    """J ← J + what the rows that follow joints add; T is T_base_tool(q)."""
    ahead = 0 if model[2] == 0.0 else 1
    x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2 = base_rows(model, ahead)
    for i in range(int(model[0])):
        k = HEADER + WIDTH * i
        j, ratio = int(model[k + 6]), model[k + 7]
        if model[k + 5] == 3.0:
            rx, ry, rz = T[0, 3] - p0, T[1, 3] - p1, T[2, 3] - p2
            J[0, j] += ratio * (z1 * rz - z2 * ry)
            J[1, j] += ratio * (z2 * rx - z0 * rz)
            J[2, j] += ratio * (z0 * ry - z1 * rx)
            J[3, j] += ratio * z0
            J[4, j] += ratio * z1
            J[5, j] += ratio * z2
        elif model[k + 5] == 4.0:
            J[0, j] += ratio * z0
            J[1, j] += ratio * z1
            J[2, j] += ratio * z2
        s, c, d = z_part(model, i, q)
        a, ca, sa = x_part(model, i + ahead)
        x0, y0, z0, p0 = advance((x0, y0, z0, p0), s, c, d, a, ca, sa)
        x1, y1, z1, p1 = advance((x1, y1, z1, p1), s, c, d, a, ca, sa)
        x2, y2, z2, p2 = advance((x2, y2, z2, p2), s, c, d, a, ca, sa)


@jit
def jacobian_one(model: Array, q: Array, J: Array) -> bool:
    """J ← geometric Jacobian ``(6, n)`` in the base frame; False if q is not n finite numbers."""
    if q.shape[0] != int(model[1]):
        return False
    T = np.empty((4, 4))
    jacobian_into(model, q, J, T, np.empty((q.shape[0], 7)))
    return math.isfinite(T[0, 3])  # as in `fk_one`


@jit
def jacobian_many(model: Array, q: Array) -> Array:
    """Geometric Jacobians ``(k, 6, n)`` in the base frame of configurations ``(k, n)``."""
    n = int(model[1])
    out = np.empty((q.shape[0], 6, n))
    T = np.empty((4, 4))
    axes = np.empty((n, 7))
    for i in range(q.shape[0]):
        jacobian_into(model, q[i], out[i], T, axes)
    return out


@jit
def volume_of(A: Array) -> float:
    """Product of the singular values of A ``(m, k)``, m ≥ k, by Householder QR; A is overwritten."""
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
def manipulability_many(J: Array, first: int, last: int) -> Array:
    """Product of the singular values of rows first…last−1 of Jacobians ``(k, 6, n)``: ``(k,)``."""
    rows = last - first
    n = J.shape[2]
    out = np.empty(J.shape[0])
    tall = np.empty((max(rows, n), min(rows, n)))
    for i in range(J.shape[0]):
        for r in range(rows):
            for c in range(n):
                if rows > n:
                    tall[r, c] = J[i, first + r, c]
                else:
                    tall[c, r] = J[i, first + r, c]
        out[i] = volume_of(tall)
    return out
