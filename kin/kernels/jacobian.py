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
from kin.kernels.dense import volume
from kin.kernels.fk import advance, apply_tool, base_rows, kind_of, sine_cosine, x_part, z_row
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
        theta, d, j, turn, slide = z_row(model, i)
        kind = kind_of(model, i)
        if kind > 2.0:
            follows = True
        elif kind > 0.0:
            axes[j, 0], axes[j, 1], axes[j, 2] = z0, z1, z2
            axes[j, 3], axes[j, 4], axes[j, 5] = p0, p1, p2
            axes[j, 6] = kind
        s, c = sine_cosine(theta + turn * q[j])
        d += slide * q[j]
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
        theta, d, j, turn, slide = z_row(model, i)
        if kind_of(model, i) > 2.0:
            rx, ry, rz = T[0, 3] - p0, T[1, 3] - p1, T[2, 3] - p2
            J[0, j] += turn * (z1 * rz - z2 * ry) + slide * z0
            J[1, j] += turn * (z2 * rx - z0 * rz) + slide * z1
            J[2, j] += turn * (z0 * ry - z1 * rx) + slide * z2
            J[3, j] += turn * z0
            J[4, j] += turn * z1
            J[5, j] += turn * z2
        s, c = sine_cosine(theta + turn * q[j])
        d += slide * q[j]
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
def manipulability_of(J: Array, first: int, last: int, A: Array) -> float:
    """Product of the singular values of rows first…last−1 of J ``(6, n)``; A ``(larger, smaller)`` is scratch."""
    n = J.shape[1]
    for r in range(last - first):
        for c in range(n):
            if last - first > n:
                A[r, c] = J[first + r, c]
            else:
                A[c, r] = J[first + r, c]
    return volume(A)


@jit
def manipulability_many(J: Array, first: int, last: int) -> Array:
    """Product of the singular values of rows first…last−1 of Jacobians ``(k, 6, n)``: ``(k,)``."""
    rows, n = last - first, J.shape[2]
    out, A = np.empty(J.shape[0]), np.empty((max(rows, n), min(rows, n)))
    for i in range(J.shape[0]):
        out[i] = manipulability_of(J[i], first, last, A)
    return out
