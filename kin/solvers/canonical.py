"""Targets, seeds and limits in the canonical frames and angles of a closed form.

Canonical angles are θ = sign q + offset, and the canonical target is ``base⁻¹ · T · tool⁻¹``. In these, the
formulas of a family have no constants but the lengths of its links.

The kernels of a seven-joint arm read it from one float64 array, and all its signs are +1:

======================  =================================
``arm[BASE:TOOL]``      first three rows of base⁻¹
``arm[TOOL:OFFSET]``    first three rows of tool⁻¹
``arm[OFFSET:+7]``      joint offsets, radians
``arm[UPPER_ARM]``      length of the upper arm d3, metres
``arm[FOREARM]``        length of the forearm d5, metres
======================  =================================
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from kin.angles import TURN
from kin.axes import inverse, screw_z
from kin.kernels.compile import jit
from kin.solvers.blocks import Entries, product_of, rows_of
from kin.solvers.common import HIGH, LOW, NEAR, UNBOUNDED
from kin.solvers.contract import SolverInput
from kin.transforms import Array

Arc = tuple[float, float, float]  # branch, low, high
BASE, TOOL, OFFSET, UPPER_ARM, FOREARM = 0, 12, 24, 31, 32


class Geometry7(NamedTuple):
    """A seven-joint arm in canonical form.

    Attributes:
        inverse_base, inverse_tool: base⁻¹ and tool⁻¹ ``(4, 4)``.
        offset: ``(7,)`` joint offsets, radians.
        d3, d5: lengths of upper arm and forearm, metres.
        tool_on_axis: whether an approach direction can be solved: the last joint or the roll is then free.
    """

    inverse_base: Array
    inverse_tool: Array
    offset: Array
    d3: float
    d5: float
    tool_on_axis: bool

    @property
    def params(self) -> Array:
        """The array ``(33,)`` that the kernels read."""
        poses = [*self.inverse_base[:3].ravel(), *self.inverse_tool[:3].ravel()]
        return np.array([*poses, *self.offset, self.d3, self.d5])


def pose_params(base: Array, tool: Array) -> list[float]:
    """What `canonical` reads ``(24,)``: the first three rows of base⁻¹ and of tool⁻¹."""
    return [*inverse(base)[:3].ravel().tolist(), *inverse(tool)[:3].ravel().tolist()]


@jit
def canonical(params: Array, T: Array) -> Entries:
    """base⁻¹ · T · tool⁻¹ as twelve numbers, row after row; params[0:24] as from `pose_params`."""
    x, y, z = T[0], T[1], T[2]
    entries = (x[0], x[1], x[2], x[3], y[0], y[1], y[2], y[3], z[0], z[1], z[2], z[3])
    return product_of(rows_of(params, BASE), entries, rows_of(params, TOOL))


@jit
def canonical_pose(arm: Array, T: Array, M: Array) -> None:
    """M ← the first three rows of base⁻¹ · T · tool⁻¹, for ``(4, 4)`` arrays."""
    (
        M[0, 0], M[0, 1], M[0, 2], M[0, 3], M[1, 0], M[1, 1], M[1, 2], M[1, 3], M[2, 0], M[2, 1], M[2, 2], M[2, 3]
    ) = canonical(arm, T)  # fmt: skip


@jit
def inverse_into(T: Array, X: Array) -> None:
    """The first three rows of X ← those of T⁻¹, of a pose T ``(4, 4)``."""
    for r in range(3):
        shift = 0.0
        for k in range(3):
            X[r, k] = T[k, r]
            shift -= T[k, r] * T[k, 3]
        X[r, 3] = shift


@jit
def signed_box(near: Array, lower: Array, upper: Array, sign: Array, offset: Array, box: Array) -> None:
    """box ``(3, ≥ n)``, rows NEAR, LOW, HIGH ← seed and limits ``(n,)`` as angles ``sign q + offset``."""
    for i in range(sign.shape[0]):
        box[NEAR, i] = sign[i] * near[i] + offset[i]
        a, b = sign[i] * lower[i] + offset[i], sign[i] * upper[i] + offset[i]
        box[LOW, i], box[HIGH, i] = min(a, b), max(a, b)


@jit
def canonical_box(offsets: Array, seed: Array, lower: Array, upper: Array, box: Array) -> None:
    """Rows NEAR, LOW, HIGH of box ``(≥ 3, n)`` ← seed and joint limits ``(n,)`` as canonical angles."""
    for i in range(offsets.shape[0]):
        box[NEAR, i], box[LOW, i], box[HIGH, i] = (
            seed[i] + offsets[i],
            lower[i] + offsets[i],
            upper[i] + offsets[i],
        )


def without_last(problem: SolverInput) -> tuple[Array, Array, Array]:
    """Target pose and limits for an approach direction along the last axis: (T, lower, upper).

    The last joint only rolls the tool. T has the seed tool's roll, and the limits of that joint never bind;
    `free_last` sets its value.
    """
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[-1], upper[-1] = -UNBOUNDED, UNBOUNDED
    return problem.T @ screw_z(problem.seed_roll, 0.0), lower, upper


def free_last(problem: SolverInput, out: Array) -> Array:
    """Set the value of a last joint that only rolls the tool, in place; returns its arcs ``(k, 3)``.

    The value is the last of the requested ones, or else the seed's, moved inside the limits.
    """
    there = ~np.isnan(out[:, -1])
    low, high, requested = problem.lower[-1], problem.upper[-1], problem.values[-1]
    out[there, -1] = min(max(problem.seed[-1], low), high) if math.isnan(requested) else requested
    return np.array([(i, low, high) for i in np.flatnonzero(there)], dtype=np.float64).reshape(-1, 3)


@jit
def turn_around(low: float, high: float, wanted: float) -> tuple[float, float]:
    """The range of a joint with these limits, at most one turn around `wanted`."""
    if high - low < TURN:
        return low, high
    if high - low < UNBOUNDED:
        start = min(max(wanted - math.pi, low), high - TURN)
        return start, start + TURN
    return wanted - math.pi, wanted + math.pi


def merged(arcs: Iterable[Arc], slack: float) -> list[Arc]:
    """Intervals (branch, low, high), sorted; those of a branch that overlap, or nearly touch, become one."""
    found: list[Arc] = []
    for branch, low, high in sorted(arcs):
        if found and found[-1][0] == branch and low <= found[-1][2] + slack:
            found[-1] = (branch, found[-1][1], max(found[-1][2], high))
        else:
            found.append((branch, low, high))
    return found


@jit
def at_every_turn(arcs: Array, low: float, high: float) -> Array:
    """Intervals ``(k, 3)`` of one turn at all whole turns inside the limits of a joint, copied."""
    if not TURN < high - low < UNBOUNDED:
        return arcs.copy()
    most = math.ceil((high - low) / TURN)
    out = np.empty(((2 * most + 1) * arcs.shape[0], 3))
    n = 0
    for turn in range(-most, most + 1):
        for i in range(arcs.shape[0]):
            first, last = max(arcs[i, 1] + TURN * turn, low), min(arcs[i, 2] + TURN * turn, high)
            if first <= last:
                out[n, 0], out[n, 1], out[n, 2] = arcs[i, 0], first, last
                n += 1
    return out[:n].copy()
