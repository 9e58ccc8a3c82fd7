"""Configurations that reach the point: their linearisation, and steps along them within joint limits."""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.numeric.nearby import back_onto, move_towards
from kin.solvers.wrist5.point.constants import A1, A2, D4, D6, H, X, Y
from kin.transforms import Array

_CLOSED = 1e-12  # metres: the point is reached


@jit
def _linearise(k: Array, q: Array, J: Array, e: Array) -> float:
    """e ``(3,)`` ← the error (R, h, m) of the tool point, J ``(3, 5)`` ← ∂(R, h, m)/∂q; returns |e| in metres."""
    c1, s1, c4, s4 = math.cos(q[0]), math.sin(q[0]), math.cos(q[3]), math.sin(q[3])
    c5, s5, c23, s23 = math.cos(q[4]), math.sin(q[4]), math.cos(q[1] + q[2]), math.sin(q[1] + q[2])
    d6 = k[D6]
    tx, m, tz = -d6 * c4 * s5, d6 * s4 * s5, k[D4] + d6 * c5
    level, drop = tz * c23 + tx * s23, tz * s23 - tx * c23
    R = k[A1] + k[A2] * math.cos(q[1]) + level
    h = k[A2] * math.sin(q[1]) + drop
    e[0], e[1], e[2] = c1 * k[X] + s1 * k[Y] - R, k[H] - h, c1 * k[Y] - s1 * k[X] - m
    J[0, 0], J[1, 0], J[2, 0] = -m, 0.0, R
    J[0, 1], J[1, 1], J[2, 1] = -h, R - k[A1], 0.0
    J[0, 2], J[1, 2], J[2, 2] = -drop, level, 0.0
    J[0, 3], J[1, 3], J[2, 3] = m * s23, -m * c23, -tx
    x5, z5 = -d6 * c4 * c5, -d6 * s5
    J[0, 4], J[1, 4], J[2, 4] = z5 * c23 + x5 * s23, z5 * s23 - x5 * c23, d6 * s4 * c5
    return math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])


@jit
def closes(k: Array, low: Array, high: Array, q: Array) -> bool:
    """Move q ``(5,)``, in place, within its limits by shortest steps until it reaches the point; if it does."""
    work = np.empty((3, 5)), np.empty(3), np.empty(5)
    return back_onto(_linearise, k, (low, high), np.ones(5), work, q) < _CLOSED


@jit
def move_near(k: Array, near: Array, low: Array, high: Array, q: Array) -> bool:
    """Move q, in place, towards a box, along the configurations inside [low, high] that reach the point.

    near ``(2, 5)``: lower and upper corner of that box. Returns whether q reaches the point.
    """
    if not closes(k, low, high, q):
        return False
    return move_towards(_linearise, k, 3, (near[0], near[1]), (low, high), np.ones(5), q)
