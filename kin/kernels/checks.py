"""Compiled validation of targets; faster than a single numpy call."""

from __future__ import annotations

from kin.kernels.compile import jit
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_SLACK = TOLERANCES.rotation_matrix


@jit
def straighten(T: Array, far: float, out: Array) -> float:
    """out ← the rigid transform T ``(4, 4)`` with its rotation re-orthonormalised.

    Returns the largest entry of RᵀR − I, or −1 if T is not a rigid transform or has an entry larger than `far`.
    The compiled counterpart of `kin.transforms.as_transform`, which names the error.
    """
    error = 0.0
    for r in range(4):
        for c in range(4):
            out[r, c] = T[r, c]
            if not abs(T[r, c]) <= far or (r < 3 and c < 3 and abs(T[r, c]) > 2.0):
                return -1.0
            if r == 3 and abs(T[r, c] - (1.0 if c == 3 else 0.0)) > _SLACK:
                return -1.0
    if out[3, 3] != 1.0 or out[3, 0] != 0.0 or out[3, 1] != 0.0 or out[3, 2] != 0.0:
        out[3, 0], out[3, 1], out[3, 2], out[3, 3] = 0.0, 0.0, 0.0, 1.0
    for step in range(2):
        # The Gram matrix RᵀR of the columns, then one Newton step of the polar decomposition: R (3 − RᵀR)/2.
        xx = out[0, 0] * out[0, 0] + out[1, 0] * out[1, 0] + out[2, 0] * out[2, 0]
        yy = out[0, 1] * out[0, 1] + out[1, 1] * out[1, 1] + out[2, 1] * out[2, 1]
        zz = out[0, 2] * out[0, 2] + out[1, 2] * out[1, 2] + out[2, 2] * out[2, 2]
        xy = out[0, 0] * out[0, 1] + out[1, 0] * out[1, 1] + out[2, 0] * out[2, 1]
        xz = out[0, 0] * out[0, 2] + out[1, 0] * out[1, 2] + out[2, 0] * out[2, 2]
        yz = out[0, 1] * out[0, 2] + out[1, 1] * out[1, 2] + out[2, 1] * out[2, 2]
        if step == 0:
            error = max(abs(xx - 1.0), abs(yy - 1.0), abs(zz - 1.0), abs(xy), abs(xz), abs(yz))
            if error > _SLACK:
                return -1.0
        for r in range(3):
            x, y, z = out[r, 0], out[r, 1], out[r, 2]
            out[r, 0] = 1.5 * x - 0.5 * (x * xx + y * xy + z * xz)
            out[r, 1] = 1.5 * y - 0.5 * (x * xy + y * yy + z * yz)
            out[r, 2] = 1.5 * z - 0.5 * (x * xz + y * yz + z * zz)
    x = out[1, 1] * out[2, 2] - out[2, 1] * out[1, 2]
    y = out[1, 0] * out[2, 2] - out[2, 0] * out[1, 2]
    z = out[1, 0] * out[2, 1] - out[2, 0] * out[1, 1]
    return error if out[0, 0] * x - out[0, 1] * y + out[0, 2] * z > 0.0 else -1.0


@jit
def straighten_many(T: Array, far: float, out: Array, errors: Array) -> None:
    """`straighten` of each of the targets T ``(N, 4, 4)``: errors ``(N,)`` ← what it returns."""
    for i in range(T.shape[0]):
        errors[i] = straighten(T[i], far, out[i])
