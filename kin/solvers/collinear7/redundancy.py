"""Kernels for the two redundancy parameters: θ1, and the roll φ about the approach direction."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN
from kin.kernels.compile import jit
from kin.solvers.canonical import OFFSET, canonical_pose
from kin.solvers.common import HIGH, LOW, NEAR, extend_arcs, misfit_of, nearest_in_arcs, zyz
from kin.transforms import Array


@jit
def theta1_intervals(arm: Array, t12: float, box: Array, branch: int, arcs: Array, found: int) -> int:
    """Append the feasible intervals of joint 1 for canonical θ12; returns the new number of intervals.

    They are [low1, high1] ∩ [θ12 + 2πk − high2, θ12 + 2πk − low2] for every whole number k, as joint values.
    """
    first = math.ceil((box[LOW, 0] + box[LOW, 1] - t12) / TURN - 1e-12)
    last = math.floor((box[HIGH, 0] + box[HIGH, 1] - t12) / TURN + 1e-12)
    for turn in range(int(max(first, -8)), int(min(last, 8)) + 1):
        total = t12 + TURN * turn
        a = max(box[LOW, 0], total - box[HIGH, 1])
        b = min(box[HIGH, 0], total - box[LOW, 1])
        if a <= b and found < arcs.shape[0]:
            arcs[found, 0], arcs[found, 1], arcs[found, 2] = branch, a - arm[OFFSET], b - arm[OFFSET]
            found += 1
    return found


@jit
def roll_parts(arm: Array, T: Array, parts: Array) -> None:
    """parts ``(3, 3, 3)`` ← C0, C1, C2 of the canonical rotation C0 + C1 cos φ + C2 sin φ.

    It is that of the target T ``(4, 4)`` turned by φ about its approach direction, the z axis.
    """
    column, M = np.zeros((4, 4)), np.empty((4, 4))
    for part in range(3):
        for r in range(3):
            column[r, 0] = 0.0 if part == 0 else (T[r, 0] if part == 1 else T[r, 1])
            column[r, 1] = 0.0 if part == 0 else (T[r, 1] if part == 1 else -T[r, 0])
            column[r, 2] = T[r, 2] if part == 0 else 0.0
        canonical_pose(arm, column, M)
        for r in range(3):
            for c in range(3):
                parts[part, r, c] = M[r, c]


@jit
def at_roll(parts: Array, phi: float, out: Array) -> None:
    """out ``(3, 3)`` ← parts[0] + parts[1] cos φ + parts[2] sin φ."""
    c, s = math.cos(phi), math.sin(phi)
    for i in range(3):
        for j in range(3):
            out[i, j] = parts[0, i, j] + c * parts[1, i, j] + s * parts[2, i, j]


@jit
def choose_roll(
    parts: Array,
    branch: int,
    requested: float,
    seed_roll: float,
    probes: Array,
    box: Array,
    rolls: Array,
    found: int,
) -> tuple[float, int]:
    """The roll of one branch, and the new number of feasible intervals in rolls ``(n, 3)``.

    parts: R47 as a function of the roll. probes: the rolls at which θ5, θ6 or θ7 meets a limit and the middles
    between them. Without a requested roll, it is the feasible one nearest to the seed's; if none is feasible, the
    tested one with the least excess over the limits.
    """
    given = not math.isnan(requested)
    preferred = requested if given else seed_roll
    R47, angles = np.empty((3, 3)), np.empty(7)
    sign = -1.0 if branch & 1 else 1.0
    n = probes.shape[0]
    first, phi, best = found, preferred, math.inf
    for j in range(n):
        at_roll(parts, probes[j], R47)
        zyz(R47, sign, box[NEAR], box[LOW], box[HIGH], 4, angles)
        misfit = misfit_of(angles, box[LOW], box[HIGH], 4, 7)
        if misfit == 0.0 and found < rolls.shape[0]:
            found = extend_arcs(rolls, first, found, branch, probes, j, n)
        elif misfit < best and found == first and not given:
            best, phi = misfit, probes[j]
    if found > first and not given:
        phi = nearest_in_arcs(rolls, first, found, preferred)
    return phi, found
