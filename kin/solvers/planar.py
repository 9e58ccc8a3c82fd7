"""Planar chains: the target in their plane, the elbow of two links, three links whose last direction is free.

A planar arm of three links is a tuple ``(u, v, p, q, a, b)``: links of lengths a and b, then a last link in the
direction ψ whose end, at (p, q) in its own frame, is held at (u, v); so the third axis is at ``(u, v) − Rz(ψ)(p,
q)``. Where its reach ends or a joint meets a limit, the distance of two points is given, of which one goes round a
circle: ``a cos ψ + b sin ψ + c = 0``. Between neighbouring roots nothing changes, so the feasible ψ are exact
arcs.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN, excess, wrap
from kin.kernels.compile import jit
from kin.kernels.simd import atan2
from kin.solvers.common import HIGH, LOW, NEAR, add_roots, extend_arcs, lay_probes, nearest_in_arcs, split_sum
from kin.solvers.contract import APPROACH
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_MERGE = TOLERANCES.merge
_SINGULAR = TOLERANCES.singular
_REACH = TOLERANCES.reach

# The parameter arrays of planar arms begin with the first three rows of base⁻¹ and of the tool; the links follow.
BASE, TOOL, LINKS = 0, 12, 24
TOOL_X, TOOL_Y, TOOL_Z = TOOL + 3, TOOL + 7, TOOL + 11  # where the tool's point is

PlanarArm = tuple[float, float, float, float, float, float]
# The sign of the elbow angle; spin and total of a fourth joint, which is at ``spin (total − ψ)``, or 0 and 0.
LastJoints = tuple[float, float, float]


@jit
def held(params: Array, T: Array, task: int) -> tuple[float, float, float, float]:
    """(x, y, z, ψ) of a target in the canonical base: the tool's point, and its angle about the axes.

    Of all Rz(ψ) it is the one with the least angle to R Rtoolᵀ (largest trace); with an approach direction
    only, the one that brings the tool's z axis nearest to it.
    """
    p = params
    x = p[0] * T[0, 3] + p[1] * T[1, 3] + p[2] * T[2, 3] + p[3]
    y = p[4] * T[0, 3] + p[5] * T[1, 3] + p[6] * T[2, 3] + p[7]
    z = p[8] * T[0, 3] + p[9] * T[1, 3] + p[10] * T[2, 3] + p[11]
    cosine = sine = 0.0
    for j in range(2 if task == APPROACH else 0, 3):
        x_j = p[0] * T[0, j] + p[1] * T[1, j] + p[2] * T[2, j]
        y_j = p[4] * T[0, j] + p[5] * T[1, j] + p[6] * T[2, j]
        cosine += x_j * p[TOOL + j] + y_j * p[TOOL + 4 + j]
        sine += y_j * p[TOOL + j] - x_j * p[TOOL + 4 + j]
    return x, y, z, math.atan2(sine, cosine)


@jit
def two_links(x: float, y: float, a: float, b: float) -> tuple[float, float, float, float, float]:
    """The elbow of a planar arm of links a, b that ends in (x, y): (miss, bend, cos bend, k1, k2).

    With the elbow angle ±bend, ``k1 = a + b cos bend`` and ``k2 = b sin bend ≥ 0``, the first link points along
    ``(x k1 ± y k2, y k1 ∓ x k2)``. The miss is how far the point is out of reach; what is out of reach is taken as
    straight or folded. tan²(bend/2) = ((a+b)² − D²)/(D² − (a−b)²) has no loss of digits at either end.
    """
    D2 = x * x + y * y
    D = math.sqrt(D2)
    far, near_by = max((a + b) ** 2 - D2, 0.0), max(D2 - (a - b) ** 2, 0.0)
    miss = max(D - (a + b), abs(a - b) - D)
    bend = 2.0 * atan2(math.sqrt(far), math.sqrt(near_by))
    if bend < _MERGE:
        return miss, 0.0, 1.0, a + b, 0.0
    total = far + near_by
    c = (near_by - far) / total
    return miss, bend, c, a + b * c, b * 2.0 * math.sqrt(far * near_by) / total


@jit
def planar_free(
    arm: PlanarArm, last: LastJoints, request: tuple[float, bool], branch: int, box: Array, arcs: Array,
    found: int, angles: Array,
) -> tuple[float, int]:  # fmt: skip
    """Choose the direction ψ of the last link, where the task leaves it free: (ψ, number of arcs).

    angles ``(4,)`` ← the three angles of the arm and that of the fourth joint. Of the ψ that reach and limits
    allow (exact arcs, which are appended to `arcs` for this `branch`) it is the one nearest to the requested
    value, or
    that value itself if `request` says that it is fixed. NaN if none is within reach; outside the limits when that
    cannot be helped. box ``(3, ≥ 4)``: seed and limits of the angles.
    """
    _, spin, total = last
    wanted, fixed = request
    low, high = box[LOW], box[HIGH]
    breaks, probes = np.empty(24), np.empty(50)
    count = planar_breaks(arm, box, breaks)
    if spin != 0.0 and high[3] - low[3] < TURN:
        breaks[count], breaks[count + 1] = wrap(total - spin * low[3]), wrap(total - spin * high[3])
        count += 2
    n = lay_probes(breaks, count, probes)
    first = found
    best, psi = math.inf, math.nan
    for k in range(n):
        if planar_angles(arm, last, probes[k], box, angles) > _REACH:
            continue
        misfit = 0.0
        for i in range(3 if spin == 0.0 else 4):
            misfit += excess(angles[i], low[i], high[i])
        if misfit == 0.0 and found < arcs.shape[0]:
            found = extend_arcs(arcs, first, found, branch, probes, k, n)
        elif misfit < best and found == first:
            best, psi = misfit, probes[k]
    found = _without_ends(arcs, first, found)
    if fixed:
        psi = wanted
    elif found > first:
        psi = nearest_in_arcs(arcs, first, found, wanted)
    if planar_angles(arm, last, psi, box, angles) > _REACH:
        psi = math.nan
    return psi, found


@jit
def _without_ends(arcs: Array, first: int, found: int) -> int:
    """Drop those of the arcs first…found−1 that are no more than an end of another one; returns the new number.

    The end of the reach may be its own arc: where the circle closes, and where a joint meets its limit there too.
    """
    kept = first
    for i in range(first, found):
        end = False
        for k in range(first, found):
            if arcs[i, 2] - arcs[i, 1] < _MERGE <= arcs[k, 2] - arcs[k, 1]:
                for side in range(1, 3):
                    end = end or abs(wrap(arcs[i, 1] - arcs[k, side])) < _MERGE
        if not end:
            for j in range(3):
                arcs[kept, j] = arcs[i, j]
            kept += 1
    return kept


@jit
def planar_angles(arm: PlanarArm, last: LastJoints, psi: float, box: Array, angles: Array) -> float:
    """angles ``(4,)`` ← those of `planar_free` at one ψ; returns by how much the third axis is out of reach."""
    u, v, p, q, a, b = arm
    up, spin, total = last
    c, s = math.cos(psi), math.sin(psi)
    x, y = u - p * c + q * s, v - p * s - q * c
    miss, bend, _, k1, k2 = two_links(x, y, a, b)
    angles[1] = up * bend
    if math.hypot(x, y) < _SINGULAR:
        # The third axis on the first: links of one length, folded. Only the sum of the two angles counts.
        near, low, high = box[NEAR], box[LOW], box[HIGH]
        angles[0] = split_sum(psi - angles[1], near[0], low[0], high[0], near[2], low[2], high[2])
    else:
        angles[0] = math.atan2(y, x) - up * math.atan2(k2, k1)
    angles[2] = psi - angles[0] - angles[1]
    angles[3] = spin * (total - psi)
    return miss


@jit
def planar_breaks(arm: PlanarArm, box: Array, breaks: Array) -> int:
    """Every ψ where a planar arm reaches the end of its reach or a limit of its three angles; returns how many."""
    u, v, p, q, a, b = arm
    low, high = box[LOW], box[HIGH]
    count = distance_roots(u, v, p, q, (a + b) ** 2, breaks, 0)
    count = distance_roots(u, v, p, q, (a - b) ** 2, breaks, count)
    for side in range(2):
        if high[0] - low[0] < TURN:
            t = low[0] if side == 0 else high[0]
            count = distance_roots(u - a * math.cos(t), v - a * math.sin(t), p, q, b * b, breaks, count)
        if high[1] - low[1] < TURN:
            t = low[1] if side == 0 else high[1]
            count = distance_roots(u, v, p, q, a * a + b * b + 2.0 * a * b * math.cos(t), breaks, count)
        if high[2] - low[2] < TURN:
            t = low[2] if side == 0 else high[2]
            count = distance_roots(u, v, p + b * math.cos(t), q - b * math.sin(t), a * a, breaks, count)
    return count


@jit
def distance_roots(u: float, v: float, p: float, q: float, square: float, breaks: Array, count: int) -> int:
    """Append the ψ at which ``|(u, v) − Rz(ψ)(p, q)|² = square``; returns the new count."""
    constant = u * u + v * v + p * p + q * q - square
    return int(add_roots(-2.0 * (u * p + v * q), -2.0 * (v * p - u * q), constant, breaks, count))
