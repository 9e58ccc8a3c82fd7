"""The kernel that finds all branches for a tool point and an approach direction, also at singular poses."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import jit
from kin.kernels.simd import atan2
from kin.solvers.canonical import canonical_box
from kin.solvers.common import clear, copy_row
from kin.solvers.planar import two_links
from kin.solvers.wrist5.geometry import A1, A2, D4, D6, OFFSET, REACH, SINGULAR, wrist_angles
from kin.solvers.wrist5.redundancy import choose_theta1
from kin.transforms import Array

_GIVEN = 5  # column of out: θ1 where it is a redundancy parameter


@jit
def _wrist_centre(arm: Array, T: Array, a: Array) -> tuple[float, float, float]:
    """wx, wy and h = −wz in the canonical base frame; a ``(3,)`` ← the approach direction."""
    for i in range(3):
        a[i] = arm[4 * i] * T[0, 2] + arm[4 * i + 1] * T[1, 2] + arm[4 * i + 2] * T[2, 2]
    x = arm[0] * T[0, 3] + arm[1] * T[1, 3] + arm[2] * T[2, 3] + arm[3]
    y = arm[4] * T[0, 3] + arm[5] * T[1, 3] + arm[6] * T[2, 3] + arm[7]
    z = arm[8] * T[0, 3] + arm[9] * T[1, 3] + arm[10] * T[2, 3] + arm[11]
    d6 = arm[D6]
    return x - d6 * a[0], y - d6 * a[1], d6 * a[2] - z


@jit
def solve(
    arm: Array, T: Array, value: float, seed: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> tuple[float, int]:
    """All branches for the tool point and approach direction of T ``(4, 4)``: (gap in metres, number of
    intervals of θ1 or −1 if it is fixed).

    out ``(8, 5)`` ← five joint values of each branch; two that have merged are both there. A sixth column, if out
    has one, ← θ1 where it is a redundancy parameter, else NaN. arcs ``(n, 3)`` ← its feasible intervals, rows
    (branch, low, high), canonical; none are computed if `arcs` has no rows, and θ1 is then the seed's.
    value: the requested θ1, NaN for a feasible one near the seed. seed, lower, upper ``(5,)``: joint values.
    """
    clear(out)
    a, box = np.empty(3), np.empty((3, 5))
    canonical_box(arm[OFFSET:A1], seed, lower, upper, box)
    wx, wy, h = _wrist_centre(arm, T, a)
    r = math.sqrt(wx * wx + wy * wy)
    on_axis = r < SINGULAR
    gap, found = math.inf, 0 if on_axis else -1
    for side in range(1 if on_axis else 2):
        shoulder = 1.0 if side == 0 else -1.0
        rho = shoulder * r - arm[A1]
        miss, bend, _, k1, k2 = two_links(rho, h, arm[A2], arm[D4])
        gap = min(gap, miss)
        if miss > REACH:
            continue
        azimuth, climb, spread = atan2(shoulder * wy, shoulder * wx), atan2(h, rho), atan2(k2, k1)
        for i in range(4 if bend > 0.0 else 2):
            branch = 4 * side + i
            row = out[branch]
            t1 = azimuth
            t2, t3 = (climb - spread, bend) if i < 2 else (climb + spread, -bend)
            if on_axis:
                given = value if math.isnan(value) else value + arm[OFFSET]
                t1, found = choose_theta1(t2 + t3, a, branch, given, box, arcs, found)
                if out.shape[1] > _GIVEN:
                    row[_GIVEN] = wrap(t1 - arm[OFFSET])
            row[0], row[1], row[2] = t1, t2, t3
            wrist_angles(t1, t2 + t3, a, branch, box, row)
            for joint in range(5):
                row[joint] = wrap(row[joint] - arm[OFFSET + joint])
        if bend == 0.0:
            copy_row(out, 4 * side, 4 * side + 2)
            copy_row(out, 4 * side + 1, 4 * side + 3)
    if on_axis:
        for branch in range(4):
            copy_row(out, branch, branch + 4)
    return gap, found
