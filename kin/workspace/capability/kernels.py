"""Compiled: the best manipulability among the configurations that reach a target inside the limits."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import nearest_image
from kin.ik.candidates import residuals
from kin.kernels.compile import jit
from kin.kernels.jacobian import jacobian_into, manipulability_of
from kin.solvers.contract import APPROACH
from kin.solvers.numeric import solve
from kin.tolerances import TOLERANCES
from kin.transforms import Array
from kin.workspace.region import BoundedArm

# Values less than any manipulability: for a target without configurations, and for one with configurations of
# which none is inside the limits.
NONE, BLOCKED = -2.0, -1.0
_POSITION = TOLERANCES.closure_position
_ROTATION = TOLERANCES.closure_rotation
_LIMIT = TOLERANCES.limit


@jit
def raise_best(arm: BoundedArm, turns: Array, rolls: bool, T: Array, q: Array, best: Array) -> None:
    """Raise best ``(k,)`` to the largest manipulability among the configurations that reach each target.

    A configuration counts if, by forward kinematics, it brings the tool to the target's point and approach
    direction, and a whole-turn image of it is inside the limits. best is raised to `BLOCKED` where there are
    configurations but none of them counts, and stays as it is where there are none.

    Args:
        arm: the arm and its limits, which may be infinite here.
        turns: ``(n,)`` 2π for a revolute joint, else 0.
        rolls: whether the last joint only rolls the tool, so that its value is arbitrary.
        T: targets ``(k, 4, 4)``.
        q: configurations of each target ``(k, rows, n)``, NaN for one that does not exist.
        best: in and out.
    """
    model, lower, upper = arm.model, arm.lower, arm.upper
    n = lower.shape[0]
    tall, wide = max(n, 6), min(n, 6)
    x, e, mask = np.empty(n), np.empty(6), np.empty(7)
    J, P, axes, A = np.empty((6, n)), np.empty((4, 4)), np.empty((n, 7)), np.empty((tall, wide))
    for i in range(T.shape[0]):
        for row in range(q.shape[1]):
            if math.isnan(q[i, row, 0]):
                continue
            best[i] = max(best[i], BLOCKED)
            inside = True
            for j in range(n):
                value, low, high = q[i, row, j], lower[j], upper[j]
                if turns[j] > 0.0:
                    value = nearest_image(value, 0.0, low, high)
                free = rolls and j == n - 1
                if not free and not (low - _LIMIT <= value <= high + _LIMIT):
                    inside = False
                    break
                x[j] = min(max(value, low), high)
            if not inside:
                continue
            jacobian_into(model, x, J, P, axes)
            position, rotation, _ = residuals(P, T[i], APPROACH, mask, e)
            if not (position <= _POSITION and rotation <= _ROTATION):
                continue
            value = manipulability_of(J, 0, 6, A)
            best[i] = max(best[i], value)


@jit
def search_each(
    arm: BoundedArm, turns: Array, T: Array, weight: float, budget: int, enough: float, start: Array, q: Array
) -> None:
    """q ``(k, 1, n)`` ← a configuration that brings the tool to each target's point and approach direction, or
    NaN.

    For arms without a closed form. Each target is searched for by `kin.solvers.numeric.solve`; the first start is
    the configuration found for the nearest direction among the targets before, or `start`.

    Args:
        arm: the arm and its limits.
        turns: ``(n,)`` 2π for a revolute joint, else 0.
        T: targets ``(k, 4, 4)`` that differ in orientation only.
        weight: metres per radian of the orientation error.
        budget: starts per target.
        enough: residual at which a target counts as reached.
        start: ``(n,)``.
        q: result.
    """
    n = start.shape[0]
    mask, out = np.ones(7), np.empty(n)
    for i in range(T.shape[0]):
        near, closest = -1, -2.0
        for j in range(i):
            along = T[i, 0, 2] * T[j, 0, 2] + T[i, 1, 2] * T[j, 1, 2] + T[i, 2, 2] * T[j, 2, 2]
            if along > closest and not math.isnan(q[j, 0, 0]):
                near, closest = j, along
        for j in range(n):
            out[j] = start[j] if near < 0 else q[near, 0, j]
        error, _ = solve(
            arm.model, (T[i], APPROACH, mask, weight), (arm.lower, arm.upper, turns), budget, enough, out
        )
        for j in range(n):
            q[i, 0, j] = out[j] if error <= enough else math.nan
