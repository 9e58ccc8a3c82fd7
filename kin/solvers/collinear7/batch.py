"""Vectorised kernels: all branches at one θ1, without limits, intervals or a choice.

The scheme is that of :mod:`kin.solvers.blocks`. Two branches are computed per target, one per shoulder solution.
The other six follow from them: the sign of θ4 turns θ3 and θ5 by π, that of θ6 turns θ5 and θ7.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import inlined, jit
from kin.kernels.simd import wrapped
from kin.solvers.blocks import OWN, VALUE, Arc, Entries, canonical_of, double, kernels_in_lanes, rows_of, zyz_pairs
from kin.solvers.canonical import BASE, FOREARM, OFFSET, TOOL, UPPER_ARM
from kin.solvers.collinear7.branches import SLACK, solve
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Rows of a block: OWN + 2 i + k is y of angle i on shoulder k, _END + 2 i + k is x of it, for θ12, θ3, … θ7. Then
# θ1 and θ2 on either shoulder.
_PAIRS, _END = 12, OWN + 12
_FIRST, _SECOND, _ROWS = _END + _PAIRS, _END + _PAIRS + 2, _END + _PAIRS + 5
_SINGULAR = TOLERANCES.singular


@inlined
def _column(
    c: float, s: float, c3: float, s3: float, c4: float, s4: float, m0: float, m1: float, m2: float
) -> tuple[float, float, float]:
    """R04ᵀ · (m0, m1, m2) with c, s of θ12."""
    a, z = c * m0 + s * m1, c * m1 - s * m0
    x = c3 * a - s3 * m2
    return c4 * x - s4 * z, -c3 * m2 - s3 * a, s4 * x + c4 * z


@inlined
def _shoulder(c: float, s: float, M: Entries, lengths: tuple[float, float], first: int, b: int, S: Array) -> bool:
    """The pairs of one shoulder solution with cos θ12 = c, sin θ12 = s; whether the pose is singular."""
    d3, d5 = lengths
    x, y, z = M[3], M[7], M[11]
    S[first, b], S[_PAIRS + first, b] = s, c
    # The forearm seen from the upper arm.
    v1, v2, v3 = c * x + s * y, -z, c * y - s * x - d3
    side = math.sqrt(v1 * v1 + v2 * v2)
    inverse_side, inverse_v = 1.0 / side, 1.0 / math.sqrt(side * side + v3 * v3)
    S[first + 2, b], S[_PAIRS + first + 2, b] = v2, v1
    S[first + 4, b], S[_PAIRS + first + 4, b] = side, v3
    c3, s3, c4, s4 = v1 * inverse_side, v2 * inverse_side, v3 * inverse_v, side * inverse_v
    f0, g0, _ = _column(c, s, c3, s3, c4, s4, M[0], M[4], M[8])
    f1, g1, _ = _column(c, s, c3, s3, c4, s4, M[1], M[5], M[9])
    f2, g2, q2 = _column(c, s, c3, s3, c4, s4, M[2], M[6], M[10])
    tilt = zyz_pairs(S, first + 6, 2, _PAIRS, b, (f0, f1, f2), (g0, g1, g2), q2)
    return (side < 1e-11 * d5) | (tilt < _SINGULAR)


@inlined
def _pairs(arm: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets; S[-1] ← 1.0 at singular poses. Returns how many these are."""
    d3, d5 = arm[UPPER_ARM], arm[FOREARM]
    base, tool = rows_of(arm, BASE), rows_of(arm, TOOL)
    found = 0
    for b in range(count):
        M = canonical_of(base, tool, S, b)
        px, py, pz = M[3], M[7], M[11]
        h2 = px * px + py * py
        h = math.sqrt(h2)
        k = (h2 + pz * pz + d3 * d3 - d5 * d5) / (2.0 * d3)
        lost = abs(k) - h > arm[SLACK]
        across = (h - k) * (h + k)
        across = math.sqrt(across if across > 0.0 else 0.0)
        across = math.nan if lost else across
        inverse_h2 = 1.0 / h2
        # cos θ12 = sin(azimuth ± spread), sin θ12 = −cos(azimuth ± spread).
        c, s = (py * k + px * across) * inverse_h2, (py * across - px * k) * inverse_h2
        singular0 = _shoulder(c, s, M, (d3, d5), OWN, b, S)
        c, s = (py * k - px * across) * inverse_h2, (-py * across - px * k) * inverse_h2
        singular1 = _shoulder(c, s, M, (d3, d5), OWN + 1, b, S)
        special = (singular0 | singular1 | (h - k < 1e-13 * h) | (h < 1e-12)) & ((not lost) | (h < 1e-12))
        S[-1, b] = 1.0 if special else 0.0
        found += 1 if special else 0
    return found


@inlined
def _angles(arc: Arc, arm: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs.

    Without a requested θ1, joints 1 and 2 move by equal amounts from near ``(7,)``.
    """
    for joint in range(1, 7):
        # The second solution: half a turn on for θ3, θ5, θ7, the other sign for θ4, θ6; θ12 has none.
        offset = arm[OFFSET + joint] if joint > 1 else 0.0
        first = OWN + 2 * joint - 2
        double(arc, S, first, first + 2, _PAIRS, count, 1.0, offset, joint % 2 == 0)
    near1 = near[0] + arm[OFFSET]
    near2 = near[1] + arm[OFFSET + 1]
    both = wrap(near1 + near2)
    middle = wrap(near2 - arm[OFFSET + 1])
    for b in range(count):
        value = S[VALUE, b]
        requested = wrap(value + arm[OFFSET])
        for shoulder in range(2):
            t12 = S[OWN + shoulder, b]
            half = 0.5 * wrapped(t12 - both)
            t1 = value if value == value else near[0] + half
            rest = wrapped(wrapped(t12 - requested) - arm[OFFSET + 1])
            t2 = rest if value == value else wrapped(middle + half)
            S[_FIRST + shoulder, b] = t1 + 0.0 * t12
            S[_SECOND + shoulder, b] = t2


@inlined
def _store(arm: Array, S: Array, b: int, out: Array) -> None:
    """out ``(8, 7)`` ← the branches of target b."""
    for row in range(8):
        shoulder, elbow, wrist = row >> 2, (row >> 1) & 1, row & 1
        out[row, 0] = S[_FIRST + shoulder, b]
        out[row, 1] = S[_SECOND + shoulder, b]
        out[row, 2] = S[_PAIRS * elbow + OWN + 2 + shoulder, b]
        out[row, 3] = S[_PAIRS * elbow + OWN + 4 + shoulder, b]
        out[row, 4] = S[_PAIRS * (elbow ^ wrist) + OWN + 6 + shoulder, b]
        out[row, 5] = S[_PAIRS * wrist + OWN + 8 + shoulder, b]
        out[row, 6] = S[_PAIRS * wrist + OWN + 10 + shoulder, b]


@jit
def _robust(
    arm: Array, T: Array, value: float, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> tuple[float, int]:
    """out ``(8, 7)`` ← all branches, by the kernel that also handles singular poses."""
    found, rows = np.empty((1, 3)), np.empty((8, 9))
    gap, count, _ = solve(arm, T, (value, math.nan, 0.0, False, False), near, lower, upper, found, found, rows)
    for i in range(8):
        for j in range(7):
            out[i, j] = rows[i, j]
    return gap, count


branches_one, branches_many = kernels_in_lanes(__name__, _pairs, _angles, _store, _robust, _ROWS, _PAIRS)[:2]
