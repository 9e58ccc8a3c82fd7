"""The pose of a target and the joint values of a seed, in the canonical frames and angles of a closed form."""

from __future__ import annotations

import math

import numpy as np

from kin.axes import inverse, screw_z
from kin.kernels.compile import jit
from kin.solvers.common import HIGH, LOW, NEAR
from kin.solvers.contract import SolverInput
from kin.transforms import Array


def pose_params(base: Array, tool: Array) -> list[float]:
    """What `canonical` reads ``(24,)``: the first three rows of base⁻¹ and of tool⁻¹."""
    return [*inverse(base)[:3].ravel().tolist(), *inverse(tool)[:3].ravel().tolist()]


@jit
def canonical(
    params: Array, T: Array
) -> tuple[float, float, float, float, float, float, float, float, float, float, float, float]:
    """base⁻¹ · T · tool⁻¹ as twelve numbers, row after row; params[0:24] as from `pose_params`."""
    p = params
    a0 = p[0] * T[0, 0] + p[1] * T[1, 0] + p[2] * T[2, 0]
    a1 = p[0] * T[0, 1] + p[1] * T[1, 1] + p[2] * T[2, 1]
    a2 = p[0] * T[0, 2] + p[1] * T[1, 2] + p[2] * T[2, 2]
    a3 = p[0] * T[0, 3] + p[1] * T[1, 3] + p[2] * T[2, 3] + p[3]
    b0 = p[4] * T[0, 0] + p[5] * T[1, 0] + p[6] * T[2, 0]
    b1 = p[4] * T[0, 1] + p[5] * T[1, 1] + p[6] * T[2, 1]
    b2 = p[4] * T[0, 2] + p[5] * T[1, 2] + p[6] * T[2, 2]
    b3 = p[4] * T[0, 3] + p[5] * T[1, 3] + p[6] * T[2, 3] + p[7]
    c0 = p[8] * T[0, 0] + p[9] * T[1, 0] + p[10] * T[2, 0]
    c1 = p[8] * T[0, 1] + p[9] * T[1, 1] + p[10] * T[2, 1]
    c2 = p[8] * T[0, 2] + p[9] * T[1, 2] + p[10] * T[2, 2]
    c3 = p[8] * T[0, 3] + p[9] * T[1, 3] + p[10] * T[2, 3] + p[11]
    return (
        a0 * p[12] + a1 * p[16] + a2 * p[20],
        a0 * p[13] + a1 * p[17] + a2 * p[21],
        a0 * p[14] + a1 * p[18] + a2 * p[22],
        a0 * p[15] + a1 * p[19] + a2 * p[23] + a3,
        b0 * p[12] + b1 * p[16] + b2 * p[20],
        b0 * p[13] + b1 * p[17] + b2 * p[21],
        b0 * p[14] + b1 * p[18] + b2 * p[22],
        b0 * p[15] + b1 * p[19] + b2 * p[23] + b3,
        c0 * p[12] + c1 * p[16] + c2 * p[20],
        c0 * p[13] + c1 * p[17] + c2 * p[21],
        c0 * p[14] + c1 * p[18] + c2 * p[22],
        c0 * p[15] + c1 * p[19] + c2 * p[23] + c3,
    )


@jit
def signed_box(near: Array, lower: Array, upper: Array, sign: Array, offset: Array, box: Array) -> None:
    """box ``(3, ≥ n)``, rows NEAR, LOW, HIGH ← seed and limits ``(n,)`` as angles ``sign q + offset``."""
    for i in range(sign.shape[0]):
        box[NEAR, i] = sign[i] * near[i] + offset[i]
        a, b = sign[i] * lower[i] + offset[i], sign[i] * upper[i] + offset[i]
        box[LOW, i], box[HIGH, i] = min(a, b), max(a, b)


def rolled(T: Array, angle: float) -> Array:
    """The pose T ``(4, 4)`` turned about its own z axis."""
    return T @ screw_z(angle, 0.0)


def free_last(problem: SolverInput, out: Array) -> Array:
    """Put a last joint that only rolls the tool where it may be, in place; returns its arcs ``(k, 3)``.

    It stays at the seed's value, inside the limits, or takes the last of the requested values.
    """
    there = ~np.isnan(out[:, -1])
    low, high, requested = problem.lower[-1], problem.upper[-1], problem.values[-1]
    out[there, -1] = min(max(problem.seed[-1], low), high) if math.isnan(requested) else requested
    return np.array([(i, low, high) for i in np.flatnonzero(there)], dtype=np.float64).reshape(-1, 3)


@jit
def relative_pose(T: Array, target: Array, in_tool: bool, e: Array) -> None:
    """e ← (Δp, φ) ``(6,)``: where T is, seen from the target, in the target's frame or in the base frame.

    φ is the rotation vector of Rₜᵀ R (target's frame) or R Rₜᵀ (base frame), |φ| ≤ π.
    """
    for i in range(3):
        if in_tool:
            e[i] = 0.0
            for r in range(3):
                e[i] += target[r, i] * (T[r, 3] - target[r, 3])
        else:
            e[i] = T[i, 3] - target[i, 3]
    # Twice the vector part of R Rₜᵀ, in the base frame; Rₜᵀ carries it over into the target's frame.
    x = y = z = trace = 0.0
    for c in range(3):
        x += T[2, c] * target[1, c] - T[1, c] * target[2, c]
        y += T[0, c] * target[2, c] - T[2, c] * target[0, c]
        z += T[1, c] * target[0, c] - T[0, c] * target[1, c]
        trace += T[0, c] * target[0, c] + T[1, c] * target[1, c] + T[2, c] * target[2, c]
    sine = math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(sine, trace - 1.0)
    k = angle / sine if sine > 1e-14 else 0.5
    if sine <= 1e-14 and trace < 0.0:
        # Exactly opposite: any axis is as good, the target's own x axis is turned about.
        x, y, z, k = target[0, 0], target[1, 0], target[2, 0], math.pi
    for i in range(3):
        if in_tool:
            e[3 + i] = k * (target[0, i] * x + target[1, i] * y + target[2, i] * z)
        else:
            e[3 + i] = k * (x if i == 0 else (y if i == 1 else z))
