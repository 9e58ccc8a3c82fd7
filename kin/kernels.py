"""Compiled loops on plain arrays: forward kinematics, link frames, Jacobian, manipulability.

Every kernel is serial, releases the GIL, keeps no state and caches its machine code on disk, so any number of
threads may call at once. The arm comes as one flat float64 array (`Robot.model`):

====================  =======================================================================
``model[0:3]``        number of rows, number of joints, 1.0 if the convention is modified
``model[3:15]``       base transform, three rows of four
``model[15:27]``      tool transform, three rows of four
``model[27+8i: …]``   row i: θ, d, a, cos α, sin α, kind (0 fixed, 1 revolute, 2 prismatic), index into q, 0
====================  =======================================================================

One row costs two plane rotations of the running rotation matrix's columns instead of a 4×4 product: rotating
about z mixes the x and y columns, rotating about x mixes y and z, translations add a multiple of a column.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from kin.transforms import Array

_HEADER = 27
_WIDTH = 8
_EPS = 2.220446049250313e-16

jit = njit(cache=True, nogil=True, error_model="numpy")


@jit
def _turn_z(T: Array, theta: float, d: float) -> None:
    """T ← T · Rz(θ) Tz(d), on the three rows that move."""
    c = math.cos(theta)
    s = math.sin(theta)
    for r in range(3):
        x = T[r, 0]
        y = T[r, 1]
        T[r, 0] = c * x + s * y
        T[r, 1] = c * y - s * x
        T[r, 3] += d * T[r, 2]


@jit
def _turn_x(T: Array, a: float, ca: float, sa: float) -> None:
    """T ← T · Tx(a) Rx(α), on the three rows that move."""
    for r in range(3):
        y = T[r, 1]
        z = T[r, 2]
        T[r, 1] = ca * y + sa * z
        T[r, 2] = ca * z - sa * y
        T[r, 3] += a * T[r, 0]


@jit
def _load(T: Array, model: Array, start: int) -> None:
    for r in range(3):
        for c in range(4):
            T[r, c] = model[start + 4 * r + c]
    T[3, 0] = 0.0
    T[3, 1] = 0.0
    T[3, 2] = 0.0
    T[3, 3] = 1.0


@jit
def copy_pose(T: Array, out: Array) -> None:
    """out ← T for 4×4 arrays; written out, as numba takes seconds to compile an array assignment."""
    for r in range(4):
        for c in range(4):
            out[r, c] = T[r, c]


@jit
def _apply_row(T: Array, model: Array, i: int, q: Array) -> None:
    k = _HEADER + _WIDTH * i
    theta = model[k]
    d = model[k + 1]
    kind = model[k + 5]
    if kind == 1.0:
        theta += q[int(model[k + 6])]
    elif kind == 2.0:
        d += q[int(model[k + 6])]
    if model[2] == 0.0:
        _turn_z(T, theta, d)
        _turn_x(T, model[k + 2], model[k + 3], model[k + 4])
    else:
        _turn_x(T, model[k + 2], model[k + 3], model[k + 4])
        _turn_z(T, theta, d)


@jit
def _apply_tool(T: Array, model: Array) -> None:
    """T ← T · tool."""
    for r in range(3):
        x = T[r, 0]
        y = T[r, 1]
        z = T[r, 2]
        for c in range(3):
            T[r, c] = x * model[15 + c] + y * model[19 + c] + z * model[23 + c]
        T[r, 3] += x * model[18] + y * model[22] + z * model[26]


@jit
def fk_into(model: Array, q: Array, T: Array) -> None:
    """T ← T_base_tool(q) for one configuration ``(n,)``; T is ``(4, 4)``."""
    _load(T, model, 3)
    for i in range(int(model[0])):
        _apply_row(T, model, i, q)
    _apply_tool(T, model)


@jit
def fk_one(model: Array, q: Array) -> Array:
    """T_base_tool ``(4, 4)`` of one configuration ``(n,)``."""
    T = np.empty((4, 4))
    fk_into(model, q, T)
    return T


@jit
def fk_many(model: Array, q: Array) -> Array:
    """T_base_tool ``(k, 4, 4)`` of configurations ``(k, n)``."""
    T = np.empty((q.shape[0], 4, 4))
    for i in range(q.shape[0]):
        fk_into(model, q[i], T[i])
    return T


@jit
def frames_many(model: Array, q: Array) -> Array:
    """Frames after each row ``(k, rows, 4, 4)`` of configurations ``(k, n)``; the tool is not applied."""
    rows = int(model[0])
    out = np.empty((q.shape[0], rows, 4, 4))
    T = np.empty((4, 4))
    for j in range(q.shape[0]):
        _load(T, model, 3)
        for i in range(rows):
            _apply_row(T, model, i, q[j])
            copy_pose(T, out[j, i])
    return out


@jit
def jacobian_into(model: Array, q: Array, J: Array, T: Array, axes: Array) -> None:
    """J ← geometric Jacobian ``(6, n)`` in the base frame, T ← T_base_tool; `axes` ``(n, 7)`` is scratch.

    A joint's z axis is the one its own Rz/Tz acts along: in the standard convention z *before* the row, in the
    modified one z *after* it (the same line, since Rz and Tz leave z alone).
    """
    _load(T, model, 3)
    for i in range(int(model[0])):
        k = _HEADER + _WIDTH * i
        j = int(model[k + 6])
        if j >= 0 and model[2] == 0.0:
            for r in range(3):
                axes[j, r] = T[r, 2]
                axes[j, 3 + r] = T[r, 3]
        _apply_row(T, model, i, q)
        if j >= 0:
            axes[j, 6] = model[k + 5]
            if model[2] == 1.0:
                for r in range(3):
                    axes[j, r] = T[r, 2]
                    axes[j, 3 + r] = T[r, 3]
    _apply_tool(T, model)
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
