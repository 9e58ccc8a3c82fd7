"""Vectorised kernels: all branches at one arm angle, without limits, intervals or a choice.

The scheme is that of :mod:`kin.solvers.blocks`. One branch is computed per target. The other seven follow from it:
the sign of θ2 turns θ1 and θ3 by π, that of θ4 turns θ3 and θ5, that of θ6 turns θ5 and θ7.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import inlined, jit
from kin.kernels.simd import WIDE, sin_cos
from kin.solvers.blocks import (
    OWN,
    VALUE,
    Arc,
    Entries,
    Vector,
    canonical_of,
    double,
    elbow_of,
    kernels_in_lanes,
    rows_of,
    zyz_pairs,
)
from kin.solvers.canonical import BASE, FOREARM, OFFSET, TOOL, UPPER_ARM
from kin.solvers.common import shifted
from kin.solvers.srs7.branches import solve
from kin.solvers.srs7.geometry import radial_of
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Rows of a block: OWN + i is y of θ(i + 1), _END + i is x of it, for i < _PAIRS.
_PAIRS, _END, _ROWS = 7, OWN + 7, OWN + 15
_SINGULAR = TOLERANCES.singular
_STRAIGHT = 2e-7  # sine of θ4: of two elbows that differ by less, the careful kernel makes one


@inlined
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _frame(u: Vector) -> tuple[Vector, Vector, float]:
    """e1, e2 of the package docstring, and hypot(ux, uy)."""
    h = math.sqrt(u[0] * u[0] + u[1] * u[1])
    inverse_h = 1.0 / h
    e2x, e2y = u[1] * inverse_h, -u[0] * inverse_h
    return (e2y * u[2], -e2x * u[2], h), (e2x, e2y, 0.0), h


@inlined
def _arm_angle(value: float, r: Vector, e1: Vector, e2: Vector) -> tuple[float, float, bool]:
    """sin ψ, cos ψ of a requested arm angle, of the direction r if that is NaN; whether r has no direction."""
    along1, along2 = _dot(r, e1), r[0] * e2[0] + r[1] * e2[1]
    amplitude = math.sqrt(along1 * along1 + along2 * along2)
    s, c = sin_cos(value)
    requested = c == c
    c = c if requested else along1 / amplitude
    s = s if requested else along2 / amplitude
    return s, c, (not requested) & (amplitude < 1e-12)


@inlined
def _shoulder(W: Vector, r: Vector, lengths: tuple[float, float], b: int, S: Array) -> tuple[
    Vector, Vector, Vector, float, float, bool, bool
]:  # fmt: skip
    """x3, y3, z3, cos θ4, sin θ4, whether W is out of reach, whether the pose is singular; pairs of θ1 … θ4."""
    d3, d5 = lengths
    c4, s4, scale, _ = elbow_of(_dot(W, W), d3, d5)
    inverse_L, lost, straight = math.sqrt(scale), c4 != c4, s4 < _STRAIGHT
    along, rho = (d3 + d5 * c4) * inverse_L, d5 * s4 * inverse_L
    u = (W[0] * inverse_L, W[1] * inverse_L, W[2] * inverse_L)
    e1, e2, h = _frame(u)
    s, c, no_side = _arm_angle(S[VALUE, b], r, e1, e2)
    q = (c * e1[0] + s * e2[0], c * e1[1] + s * e2[1], c * h)
    x = (rho * u[0] - along * q[0], rho * u[1] - along * q[1], rho * u[2] - along * q[2])
    y = (s * e1[0] - c * e2[0], s * e1[1] - c * e2[1], s * h)
    z = (along * u[0] + rho * q[0], along * u[1] + rho * q[1], along * u[2] + rho * q[2])
    sine = zyz_pairs(S, OWN, 1, _PAIRS, b, (x[0], y[0], z[0]), (x[1], y[1], z[1]), z[2])
    S[OWN + 3, b], S[_END + 3, b] = s4, c4
    return x, y, z, c4, s4, lost, (sine < _SINGULAR) | straight | (h < 1e-12) | no_side


@inlined
def _seen(v: Vector, M: Entries) -> Vector:
    """The columns of the target's rotation, along v."""
    return (
        v[0] * M[0] + v[1] * M[4] + v[2] * M[8],
        v[0] * M[1] + v[1] * M[5] + v[2] * M[9],
        v[0] * M[2] + v[1] * M[6] + v[2] * M[10],
    )


@inlined
def _pairs(arm: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets; S[-1] ← 1.0 at singular poses. Returns how many these are.

    A requested arm angle of NaN stands for the elbow's direction at near ``(7,)``.
    """
    lengths = arm[UPPER_ARM], arm[FOREARM]
    base, tool = rows_of(arm, BASE), rows_of(arm, TOOL)
    r = _seed_direction(arm, near, count, S)
    found = 0
    for b in range(count):
        M = canonical_of(base, tool, S, b)
        x, y, z, c4, s4, lost, singular = _shoulder((M[3], M[7], M[11]), r, lengths, b, S)
        # R47 = R04ᵀ R, but for the first two entries of its third row.
        f = _seen((c4 * x[0] - s4 * z[0], c4 * x[1] - s4 * z[1], c4 * x[2] - s4 * z[2]), M)
        cosine = (s4 * x[0] + c4 * z[0]) * M[2] + (s4 * x[1] + c4 * z[1]) * M[6] + (s4 * x[2] + c4 * z[2]) * M[10]
        aligned = zyz_pairs(S, OWN + 4, 1, _PAIRS, b, f, _seen(y, M), cosine) < _SINGULAR
        special = (singular | aligned) & (not lost)
        S[-1, b] = 1.0 if special else 0.0
        found += 1 if special else 0
    return found


@inlined
def _seed_direction(arm: Array, near: Array, count: int, S: Array) -> Vector:
    """The elbow's direction at near ``(7,)``, zero if every target requests ψ; wraps large requested values."""
    free, wide = 0, 0
    for b in range(count):
        value = S[VALUE, b]
        free += 0 if value == value else 1
        wide += 1 if abs(value) > WIDE else 0
    if wide > 0:
        for b in range(count):
            S[VALUE, b] = wrap(S[VALUE, b]) if abs(S[VALUE, b]) > WIDE else S[VALUE, b]
    if free > 0:
        return radial_of(shifted(near, arm[OFFSET:UPPER_ARM]), arm[UPPER_ARM], arm[FOREARM])
    return 0.0, 0.0, 0.0


@jit
def _robust(
    arm: Array, T: Array, value: float, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> tuple[float, int]:
    """out ``(8, 7)`` ← all branches, by the kernel that also handles singular poses."""
    found, rows = np.empty((1, 3)), np.empty((8, 8))
    _, gap, count = solve(arm, T, (value, False, False, False), near, lower, upper, found, rows)
    for i in range(8):
        for j in range(7):
            out[i, j] = rows[i, j]
    return gap, count


@inlined
def _angles(arc: Arc, arm: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs."""
    for k in range(_PAIRS):
        # The second solution: half a turn on for even k (θ1, θ3, θ5, θ7), the other sign for odd k.
        double(arc, S, OWN + k, OWN + k + 1, _PAIRS, count, 1.0, arm[OFFSET + k], k % 2 == 0)


@inlined
def _store(arm: Array, S: Array, b: int, out: Array) -> None:
    """out ``(8, 7)`` ← the branches of target b."""
    for row in range(8):
        shoulder, elbow, wrist = row >> 2, (row >> 1) & 1, row & 1
        out[row, 0] = S[_PAIRS * shoulder + OWN, b]
        out[row, 1] = S[_PAIRS * shoulder + OWN + 1, b]
        out[row, 2] = S[_PAIRS * (shoulder ^ elbow) + OWN + 2, b]
        out[row, 3] = S[_PAIRS * elbow + OWN + 3, b]
        out[row, 4] = S[_PAIRS * (elbow ^ wrist) + OWN + 4, b]
        out[row, 5] = S[_PAIRS * wrist + OWN + 5, b]
        out[row, 6] = S[_PAIRS * wrist + OWN + 6, b]


branches_one, branches_many = kernels_in_lanes(__name__, _pairs, _angles, _store, _robust, _ROWS, _PAIRS)[:2]
