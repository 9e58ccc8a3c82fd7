"""One configuration: angles from θ4, θ5 and a sheet, whether it is feasible, its branch, the best of each branch.

A box ``(3, 5)`` has the seed and the joint limits as rows NEAR, LOW, HIGH, canonical angles.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN, excess, nearest_image
from kin.kernels.compile import jit
from kin.solvers.common import HIGH, LOW, NEAR
from kin.solvers.wrist5.point.constants import A1, A2, AMBIGUOUS, D4, D6, PHI, RAD, REACH, SLACK, H
from kin.solvers.wrist5.point.newton import closes
from kin.transforms import Array

_OVER = 1e6  # a radian beyond a limit weighs more than any distance to the seed


@jit
def _angles(k: Array, t4: float, t5: float, sheet: int, box: Array, q: Array) -> float:
    """q ``(5,)`` ← the configuration on a sheet. Returns the distance from the point, 0.0 if it is reached."""
    side, elbow = 1.0 - 2.0 * (sheet // 2), 1.0 - 2.0 * (sheet % 2)
    r, a2 = k[RAD], k[A2]
    c5, s5 = math.cos(t5), math.sin(t5)
    m = k[D6] * math.sin(t4) * s5
    tx, tz = -k[D6] * math.cos(t4) * s5, k[D4] + k[D6] * c5
    if abs(m) - r > REACH:
        return float(abs(m) - r)
    R = side * math.sqrt(max((r - m) * (r + m), 0.0))
    L, D = math.hypot(tx, tz), math.hypot(R - k[A1], k[H])
    miss = max(D - (a2 + L), abs(a2 - L) - D)
    if miss > REACH:
        return float(miss)
    far, nearby = (a2 + L - D) * (a2 + L + D), (D - a2 + L) * (D + a2 - L)
    w = elbow * 2.0 * math.atan2(math.sqrt(max(far, 0.0)), math.sqrt(max(nearby, 0.0)))
    # With the point on axis 1, θ1 is arbitrary: the seed's is taken.
    q[0] = min(max(box[NEAR, 0], box[LOW, 0]), box[HIGH, 0]) if r < REACH else k[PHI] - math.atan2(m, R)
    q[1] = math.atan2(k[H], R - k[A1]) - math.atan2(L * math.sin(w), a2 + L * math.cos(w))
    q[2] = w + math.atan2(tx, tz)
    q[3] = t4
    q[4] = t5
    return 0.0


@jit
def fits(k: Array, t4: float, t5: float, sheet: int, box: Array, q: Array) -> bool:
    """q ``(5,)`` ← the configuration on a sheet; whether it exists and is inside all limits.

    With the arm stretched or R = 0, a rounding error of 1e-16 in the point is 1e-8 in the angles. So a
    configuration less than `AMBIGUOUS` outside its limits is moved to the nearest one inside, if there is one.
    """
    low, high = box[LOW], box[HIGH]
    if excess(t5, low[4], high[4]) > 0.0 or excess(t4, low[3], high[3]) > 0.0:
        return False
    if _angles(k, t4, t5, sheet, box, q) > 0.0:
        return False
    over = 0.0
    for i in range(3):
        if high[i] - low[i] < TURN:
            over += excess(q[i], low[i], high[i])
    if 0.0 < over < AMBIGUOUS:
        floor, ceiling = np.empty(5), np.empty(5)
        for i in range(5):
            x = nearest_image(q[i], q[i], low[i], high[i])
            slack = AMBIGUOUS if i < 3 else SLACK
            floor[i], ceiling[i] = max(low[i], x - slack), min(high[i], x + slack)
            q[i] = min(max(x, floor[i]), ceiling[i])
        return closes(k, floor, ceiling, q)
    return over == 0.0


@jit
def branch_at(k: Array, q: Array) -> int:
    """The branch of canonical angles ``(5,)``; 8 is added where one of its signs is a matter of rounding."""
    radial = k[A1] + k[A2] * math.cos(q[1]) + k[D4] * math.cos(q[1] + q[2])
    bend, flip = math.sin(q[2]), math.sin(q[4])
    branch = 0
    if radial < 0.0:
        branch += 4
    if bend < 0.0:
        branch += 2
    if flip < 0.0:
        branch += 1
    if min(abs(radial), abs(bend), abs(flip)) < AMBIGUOUS:
        branch += 8
    return branch


@jit
def keep_best(k: Array, q: Array, near: Array, limits: Array, best: Array) -> None:
    """Copy q, at its whole-turn images nearest to the seed, into best if it is the best of its branch so far.

    best ``(8, 6)``: five angles and the cost, which is the excess over `limits` ``(2, 5)`` first and the distance
    to the seed second.
    """
    row = branch_at(k, q) % 8
    cost = 0.0
    for i in range(5):
        x = nearest_image(q[i], near[i], limits[0, i], limits[1, i])
        cost += (x - near[i]) ** 2 + _OVER * excess(x, limits[0, i], limits[1, i])
    if not cost >= best[row, 5]:
        for i in range(5):
            best[row, i] = nearest_image(q[i], near[i], limits[0, i], limits[1, i])
        best[row, 5] = cost
