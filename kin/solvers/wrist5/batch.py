"""The kernels in lanes: all branches for a tool point and an approach direction, where they are not singular.

The scheme is that of :mod:`kin.solvers.blocks`; no sine or cosine of an angle is computed. Of each target the four
combinations of shoulder and elbow are computed; the other wrist is −θ5 and half a turn on in θ4.
"""

from __future__ import annotations

import math

from kin.kernels.compile import inlined
from kin.solvers.blocks import (
    NEARLY,
    OWN,
    Arc,
    double,
    elbow_of,
    in_base,
    kernels_in_lanes,
    rows_of,
    single,
)
from kin.solvers.wrist5.branches import solve
from kin.solvers.wrist5.geometry import A1, A2, BASE, D4, D6, OFFSET
from kin.transforms import Array

# Rows of a block: y of θ1 (front), θ3 (two shoulders), θ2, θ4 and θ5 (shoulder and elbow); x is _PAIRS rows on.
# The other shoulder is half a turn on in θ1, the other elbow is −θ3.
_FRONT, _BEND, _UPPER, _ROLL, _TILT, _END = (OWN + i for i in (0, 1, 3, 7, 11, 15))
_PAIRS, _ROWS = _END - OWN, _END + _END - OWN + 1
Pair = tuple[float, float]
Vector = tuple[float, float, float]


@inlined
def _hand(wrist: Pair, elbow: Vector, links: Pair, a: Vector, k: int, b: int, S: Array) -> bool:
    """The pairs of θ2, θ4, θ5 of shoulder and elbow k; whether sin θ5 vanishes.

    wrist: (ρ, h). elbow: cos θ3, sin θ3, 1/D². links: a2, d4. a: the approach direction in the arm's plane, across
    it, and along z.
    """
    rho, h = wrist
    c3, s3, scale = elbow
    level, u2, az = a
    A, B = links[0] + links[1] * c3, links[1] * s3
    s2, c2 = (h * A - rho * B) * scale, (rho * A + h * B) * scale
    c23, s23 = c2 * c3 - s2 * s3, s2 * c3 + c2 * s3
    u1 = s23 * level + c23 * az
    w = math.sqrt(u1 * u1 + u2 * u2)
    S[_UPPER + k, b], S[_PAIRS + _UPPER + k, b] = s2, c2
    S[_ROLL + k, b], S[_PAIRS + _ROLL + k, b] = -u2, -u1
    S[_TILT + k, b], S[_PAIRS + _TILT + k, b] = w, c23 * level - s23 * az
    return w < NEARLY


@inlined
def _shoulder(wrist: Pair, links: Pair, a: Vector, side: int, b: int, S: Array) -> bool:
    """The pairs of one shoulder side (0 front, 1 back) with either elbow; whether the pose is singular."""
    c3, s3, scale, aligned = elbow_of(wrist[0] * wrist[0] + wrist[1] * wrist[1], links[0], links[1])
    S[_BEND + side, b], S[_PAIRS + _BEND + side, b] = s3, c3
    up = _hand(wrist, (c3, s3, scale), links, a, 2 * side, b, S)
    down = _hand(wrist, (c3, -s3, scale), links, a, 2 * side + 1, b, S)
    return aligned | up | down


@inlined
def _pairs(arm: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets; S[-1] ← 1.0 at singular poses. Returns how many these are."""
    a1, d6 = arm[A1], arm[D6]
    links = arm[A2], arm[D4]
    base = rows_of(arm, BASE)
    found = 0
    for b in range(count):
        ax, ay, az = in_base(base, S, 2, b)
        x, y, z = in_base(base, S, 3, b)
        wx, wy, h = x + base[3] - d6 * ax, y + base[7] - d6 * ay, d6 * az - (z + base[11])
        r = math.sqrt(wx * wx + wy * wy)
        inverse_r = 1.0 / r
        level, u2 = (wx * ax + wy * ay) * inverse_r, (wy * ax - wx * ay) * inverse_r
        S[_FRONT, b], S[_PAIRS + _FRONT, b] = wy, wx
        front = _shoulder((r - a1, h), links, (level, u2, az), 0, b, S)
        back = _shoulder((-r - a1, h), links, (-level, -u2, az), 1, b, S)
        special = front | back | (r < NEARLY)
        S[-1, b] = 1.0 if special else 0.0
        found += 1 if special else 0
    return found


@inlined
def _angles(arc: Arc, arm: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs."""
    double(arc, S, _FRONT, _BEND, _PAIRS, count, 1.0, arm[OFFSET], True)
    double(arc, S, _BEND, _UPPER, _PAIRS, count, 1.0, arm[OFFSET + 2], False)
    single(arc, S, _UPPER, _ROLL, _PAIRS, count, 1.0, arm[OFFSET + 1])
    double(arc, S, _ROLL, _TILT, _PAIRS, count, 1.0, arm[OFFSET + 3], True)
    double(arc, S, _TILT, _END, _PAIRS, count, 1.0, arm[OFFSET + 4], False)
    for b in range(count):
        # θ1 is NaN, too, on the side where the arm does not reach.
        S[_FRONT, b] += 0.0 * S[_BEND, b]
        S[_PAIRS + _FRONT, b] += 0.0 * S[_BEND + 1, b]


@inlined
def _store(arm: Array, S: Array, b: int, out: Array) -> None:
    """out ``(8, 5)`` ← the branches of target b."""
    for row in range(8):
        back, down, flip = row >> 2, (row >> 1) & 1, row & 1
        upper = row >> 1
        out[row, 0] = S[_PAIRS * back + _FRONT, b]
        out[row, 1] = S[_UPPER + upper, b]
        out[row, 2] = S[_PAIRS * down + _BEND + back, b]
        out[row, 3] = S[_PAIRS * flip + _ROLL + upper, b]
        out[row, 4] = S[_PAIRS * flip + _TILT + upper, b]


branches_one, branches_many, solve_one, solve_many = kernels_in_lanes(
    __name__, _pairs, _angles, _store, solve, _ROWS, _PAIRS
)
