"""Kernels for the triangle shoulder–elbow–wrist, the two spherical joints, and the arm angle of a configuration.

Angles, targets and the array that describes an arm are those of :mod:`kin.solvers.canonical`; lengths are metres.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.kernels.fk import sine_cosine
from kin.solvers.canonical import FOREARM, OFFSET, UPPER_ARM, canonical_pose
from kin.solvers.common import HIGH, LOW, NEAR, shifted, zyz
from kin.solvers.planar import two_links
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Rows of a triangle (4, 3): the unit vectors of the package docstring, then (A, ρ, |θ4|).
U, E1, E2, SHAPE = range(4)
# A fourth row of a box: the values at which a joint stays where it is. A joint with lower limit NEAR and upper
# limit STAY meets a limit exactly at its seed value.
STAY = 3
# Codes of `triangle_of`.
FITS, TOO_FAR, TOO_NEAR = range(3)
REACH = TOLERANCES.reach


@jit
def triangle_of(arm: Array, M: Array, triangle: Array) -> tuple[int, float]:
    """Solve the triangle S–E–W for a canonical target M ``(4, 4)``: (code, gap in metres).

    triangle ``(4, 3)`` ← u, e1, e2 and (A, ρ, |θ4|) of the package docstring. The gap is the distance by which W
    is too far from S (code TOO_FAR) or too near to it (TOO_NEAR).
    """
    d3, d5 = arm[UPPER_ARM], arm[FOREARM]
    x, y, z = M[0, 3], M[1, 3], M[2, 3]
    L = math.sqrt(x * x + y * y + z * z)
    miss, bend, _, k1, k2 = two_links(L, 0.0, d3, d5)
    if miss > REACH or L < 1e-12:
        return TOO_NEAR if abs(d3 - d5) > L or L < 1e-12 else TOO_FAR, miss
    ux, uy, uz = x / L, y / L, z / L
    h = math.hypot(ux, uy)
    if h > 1e-12:
        e2x, e2y = uy / h, -ux / h
    else:
        # With W on axis 1 no elbow is the highest: the reference plane then contains the x axis of the base.
        e2x, e2y = 0.0, -1.0 if uz > 0 else 1.0
    triangle[U, 0], triangle[U, 1], triangle[U, 2] = ux, uy, uz
    triangle[E1, 0], triangle[E1, 1], triangle[E1, 2] = e2y * uz, -e2x * uz, e2x * uy - e2y * ux
    triangle[E2, 0], triangle[E2, 1], triangle[E2, 2] = e2x, e2y, 0.0
    triangle[SHAPE, 0], triangle[SHAPE, 1] = d3 * k1 / L, d3 * k2 / L
    triangle[SHAPE, 2] = bend
    return FITS, 0.0


@jit
def rotations(arm: Array, M: Array, triangle: Array, sign: float, c: float, s: float, k: float, R: Array) -> None:
    """R ``(2, 3, 3)`` ← R03 and R47 at cos ψ = c, sin ψ = s, with the part that is constant in ψ weighted by k.

    `sign` is that of θ4. With (c, s, k) = (0, 0, 1), (1, 0, 0), (0, 1, 0) this gives M0, M1, M2 of
    ``M0 + M1 cos ψ + M2 sin ψ``.
    """
    d3, A, rho, theta4 = arm[UPPER_ARM], triangle[SHAPE, 0], triangle[SHAPE, 1], sign * triangle[SHAPE, 2]
    c4, s4 = math.cos(theta4), math.sin(theta4)
    for i in range(3):
        u = triangle[U, i]
        radial = c * triangle[E1, i] + s * triangle[E2, i]
        R[0, i, 0] = -sign * (A * radial - k * rho * u) / d3
        R[0, i, 1] = -sign * (c * triangle[E2, i] - s * triangle[E1, i])
        R[0, i, 2] = (k * A * u + rho * radial) / d3
    for j in range(3):
        x = R[0, 0, 0] * M[0, j] + R[0, 1, 0] * M[1, j] + R[0, 2, 0] * M[2, j]
        z = R[0, 0, 2] * M[0, j] + R[0, 1, 2] * M[1, j] + R[0, 2, 2] * M[2, j]
        R[1, 0, j] = c4 * x - s4 * z
        R[1, 1, j] = R[0, 0, 1] * M[0, j] + R[0, 1, 1] * M[1, j] + R[0, 2, 1] * M[2, j]
        R[1, 2, j] = s4 * x + c4 * z


@jit
def sign_of(branch: int, bit: int) -> float:
    """The sign that a bit of a branch number stands for: bit 2 that of sin θ2, 1 of sin θ4, 0 of sin θ6."""
    return -1.0 if (branch >> bit) & 1 else 1.0


@jit
def affine(arm: Array, M: Array, triangle: Array, sign: float, parts: Array) -> None:
    """parts ``(2, 3, 3, 3)`` ← M0, M1, M2 of R03 and of R47 ``= M0 + M1 cos ψ + M2 sin ψ``, for a sign of θ4."""
    R = np.empty((2, 3, 3))
    for part in range(3):
        c, s, k = (1.0 if part == 1 else 0.0), (1.0 if part == 2 else 0.0), (1.0 if part == 0 else 0.0)
        rotations(arm, M, triangle, sign, c, s, k, R)
        for joint in range(2):
            for i in range(3):
                for j in range(3):
                    parts[joint, part, i, j] = R[joint, i, j]


@jit
def angles_at(parts: Array, theta4: float, branch: int, psi: float, box: Array, out: Array) -> None:
    """out ``(7,)`` ← the canonical angles of one branch at arm angle ψ; parts: as from `affine`.

    The box ``(4, 7)`` decides where a spherical joint is singular, see `kin.solvers.common.zyz`.
    """
    R = np.empty((3, 3))
    s, c = sine_cosine(psi)
    for joint in range(2):
        for i in range(3):
            for j in range(3):
                R[i, j] = parts[joint, 0, i, j] + c * parts[joint, 1, i, j] + s * parts[joint, 2, i, j]
        zyz(R, sign_of(branch, 2 - 2 * joint), box[NEAR], box[LOW], box[HIGH], 4 * joint, out)
    out[3] = theta4


@jit
def radial_of(theta: Array, d3: float, d5: float) -> tuple[float, float, float]:
    """Unit vector from the line SW to the elbow at canonical angles ``(7,)``.

    It is z3 sin β − sign(θ4) x3 cos β with β the angle of the triangle at S, which also holds for a straight arm.
    """
    s1, c1 = sine_cosine(theta[0])
    s2, c2 = sine_cosine(theta[1])
    s3, c3 = sine_cosine(theta[2])
    s4, c4 = sine_cosine(theta[3])
    along, m = d3 + d5 * c4, d5 * abs(s4)
    length = math.sqrt(along * along + m * m)
    along, m = (along / length, m / length) if length > 0.0 else (1.0, 0.0)
    k = -along if s4 >= 0.0 else along
    return (
        k * (c1 * c2 * c3 - s1 * s3) + m * c1 * s2,
        k * (s1 * c2 * c3 + c1 * s3) + m * s1 * s2,
        m * c2 - k * s2 * c3,
    )


@jit
def seed_arm_angle(arm: Array, theta: Array, triangle: Array) -> float:
    """ψ at the target for which the elbow keeps its direction at the canonical seed angles ``(7,)``.

    Directions in space are compared, not two values of ψ: so the elbow does not jump when W passes over axis 1,
    where the reference direction of ψ reverses. A straight arm has no elbow side; where the seed's θ4 is negative,
    half a turn of ψ keeps θ3 and θ5.
    """
    rx, ry, rz = radial_of(theta, arm[UPPER_ARM], arm[FOREARM])
    along1 = rx * triangle[E1, 0] + ry * triangle[E1, 1] + rz * triangle[E1, 2]
    along2 = rx * triangle[E2, 0] + ry * triangle[E2, 1] + rz * triangle[E2, 2]
    psi = 0.0 if math.hypot(along1, along2) < 1e-12 else math.atan2(along2, along1)
    if triangle[SHAPE, 2] == 0.0 and math.sin(theta[3]) < 0.0:
        psi += math.pi
    return psi


@jit
def arm_angle(arm: Array, T: Array, q: Array) -> float:
    """ψ of a configuration q ``(7,)`` that meets the target T ``(4, 4)``; NaN if the target is out of reach."""
    M, triangle = np.empty((4, 4)), np.empty((4, 3))
    canonical_pose(arm, T, M)
    code, _ = triangle_of(arm, M, triangle)
    return seed_arm_angle(arm, shifted(q, arm[OFFSET:UPPER_ARM]), triangle) if code == FITS else math.nan
