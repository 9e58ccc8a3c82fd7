"""Compiled: which targets are met by which of their configurations inside the limits, and how well."""

from __future__ import annotations

import math

import numpy as np

from kin.ik.candidates import residuals
from kin.kernels.compile import jit
from kin.kernels.jacobian import jacobian_into, volume_of
from kin.solvers.common import nearest_image
from kin.solvers.contract import APPROACH
from kin.solvers.numeric import solve
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# What is told of a target that nothing meets; less than any manipulability.
NONE, BLOCKED = -2.0, -1.0
_POSITION = TOLERANCES.closure_position
_ROTATION = TOLERANCES.closure_rotation
_LIMIT = TOLERANCES.limit


@jit
def gauge(
    model: Array, T: Array, q: Array, lower: Array, upper: Array, turns: Array, rolls: bool, best: Array
) -> None:
    """Raise best ``(k,)`` to the largest manipulability among the configurations that meet each target.

    A configuration counts if forward kinematics says that it brings the tool to the target's point and approach
    direction, and a whole-turn image of it is inside the limits. `BLOCKED` is told where there are configurations,
    but none that counts; best stays where there are none.

    Args:
        model: the arm.
        T: targets ``(k, 4, 4)``.
        q: configurations of each ``(k, rows, n)``, NaN for one that does not exist.
        lower, upper, turns: ``(n,)``; turns is 2π for a joint that turns, else 0.
        rolls: whether the last joint does nothing but roll the tool, so that its value is free.
        best: in and out.
    """
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
            for r in range(6):
                for j in range(n):
                    if n < 6:
                        A[r, j] = J[r, j]
                    else:
                        A[j, r] = J[r, j]
            best[i] = max(best[i], volume_of(A))


@jit
def seek(
    model: Array, T: Array, lower: Array, upper: Array, turns: Array, weight: float, budget: int, enough: float,
    start: Array, q: Array,
) -> None:  # fmt: skip
    """q ``(k, 1, n)`` ← a configuration that brings the tool to each target's point and approach direction.

    For arms without a closed form: `kin.solvers.numeric.solve` with `budget` starts, of which the first is what
    was found for the nearest direction among the targets before, or `start` ``(n,)``. NaN where nothing was found.
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
        error, _ = solve(model, (T[i], APPROACH, mask, weight), (lower, upper, turns), budget, enough, out)
        for j in range(n):
            q[i, 0, j] = out[j] if error <= enough else math.nan
