"""Kernels: both branches of one target, and of many."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import jit
from kin.kernels.fk import all_finite_pose
from kin.solvers.blocks import one_after_another, unbounded
from kin.solvers.canonical import signed_box
from kin.solvers.common import NEAR, clear
from kin.solvers.contract import POSE
from kin.solvers.planar import LINKS, TOOL_X, TOOL_Y, held, planar_free
from kin.transforms import Array

# Layout of the parameter array: base⁻¹ and the tool, see `kin.solvers.planar`; the three links; signs and offsets
# of the joints.
SIGN, OFFSET, SIZE = LINKS + 3, LINKS + 7, LINKS + 11


@jit
def solve(
    params: Array, T: Array, task: int, value: float, near: Array, lower: Array, upper: Array, arcs: Array,
    out: Array,
) -> tuple[float, int]:  # fmt: skip
    """out ``(2, 4)`` ← both branches, and φ in a fifth column if it has one: (gap in metres, number of arcs of φ).

    φ is `value`, or near the seed's if that is NaN.
    """
    clear(out)
    box, angles = np.empty((3, 4)), np.empty(4)
    signed_box(near, lower, upper, params[SIGN:OFFSET], params[OFFSET:SIZE], box)
    x, y, _, psi = held(params, T, task)
    c, s, p, q = math.cos(psi), math.sin(psi), params[TOOL_X], params[TOOL_Y]
    u, v = x - p * c + q * s, y - p * s - q * c
    a, b, last = params[LINKS], params[LINKS + 1], params[LINKS + 2]
    fixed = not math.isnan(value)
    wanted = value if fixed else box[NEAR, 0] + box[NEAR, 1] + box[NEAR, 2]
    found = 0
    for row in range(2):
        side = (1.0 - 2.0 * row, 1.0, psi)
        phi, found = planar_free((u, v, last, 0.0, a, b), side, (wanted, fixed), row, box, arcs, found, angles)
        if not math.isnan(phi):
            for i in range(4):
                out[row, i] = wrap(params[SIGN + i] * (angles[i] - params[OFFSET + i]))
            if out.shape[1] > 4:
                out[row, 4] = phi
    R = math.hypot(u, v)
    return max(abs(R - last) - a - b, abs(a - b) - R - last), found


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(2, 4)`` ← both branches of the target T ``(4, 4)``; False if T is not finite.

    φ is `value`, or near that of `near` if it is NaN.
    """
    if not all_finite_pose(T):
        clear(out)
        return False
    limits = unbounded(4)
    solve(params, T, POSE, value, near, limits[0], limits[1], np.empty((64, 3)), out)
    return True


branches_many = one_after_another(branches_one)
