"""Along the configurations that meet a task towards a seed, where the task leaves the joints a motion.

The nearest configuration inside the limits has the least |w (x − seed)|² of all that meet the task. Near a
configuration q the task is J (x − q) = e, and the answer is x = clamp(seed + Jᵀ λ / w²), whose multipliers λ
follow by Newton steps on the dual problem, halved where limits that switch lead a whole one away. The
configuration moves there, or as far towards it as the distance falls, and back onto the task. What is found is a
local minimum.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.contract import POSITION
from kin.solvers.numeric.error import Goal, look, quadratic_model
from kin.solvers.numeric.step import solve_free
from kin.transforms import Array

_DUAL, _HALVED, _BACK, _STEPS = 40, 6, 8, 60
_STRIDE = 0.5  # weighted radians of one joint in one step
_FLOOR = 1e-12  # of the dual problem's matrix, as a share of its largest entry
_TIGHT, _MET = 1e-13, 1e-11  # what steps back aim for, and what counts as met; of E, metres
_SHORTEST, _GAIN = 1e-3, 1e-10  # a share of a step; a share of the squared distance that is worth another step


@jit
def _linear(model: Array, goal: Goal, q: Array, J: Array, e: Array) -> float:
    """J ``(rows, n)``, e ``(6,)`` ← the task ``J step = e`` around q ``(n,)``; returns E."""
    n = q.shape[0]
    whole, T, axes = np.empty((6, n)), np.empty((4, 4)), np.empty((n, 7))
    error = look(model, q, goal, (whole, T, axes), e)
    quadratic_model(goal, False, whole, T, e, np.empty(6), np.empty((n, n)), np.empty(n))
    for r in range(J.shape[0]):
        for i in range(n):
            J[r, i] = whole[r, i]
    return math.sqrt(2.0 * error)


@jit
def _foot(J: Array, e: Array, q: Array, aim: Array, scale: Array, low: Array, high: Array, x: Array) -> None:
    """x ``(n,)`` ← the point nearest to `aim` inside [low, high] with J (x − q) = e; scale: 1/w² of the joints."""
    m, n = J.shape
    multipliers, left, move = np.zeros(m), np.empty(m), np.empty(m)
    H, L, free = np.empty((m, m)), np.empty((m, m)), np.ones(m, dtype=np.bool_)
    before, halved = math.inf, 0
    for _ in range(_DUAL):
        for r in range(m):
            left[r] = e[r]
            for k in range(m):
                H[r, k] = 0.0
        for i in range(n):
            wanted = aim[i]
            for r in range(m):
                wanted += scale[i] * J[r, i] * multipliers[r]
            x[i] = min(max(wanted, low[i]), high[i])
            for r in range(m):
                left[r] -= J[r, i] * (x[i] - q[i])
                for k in range(r + 1 if x[i] == wanted else 0):
                    H[r, k] += scale[i] * J[r, i] * J[k, i]
        missed = largest = 0.0
        for r in range(m):
            missed, largest = max(missed, abs(left[r])), max(largest, H[r, r])
        if missed < 1e-15:
            break
        if missed > before and halved < _HALVED:
            halved += 1
            for r in range(m):
                move[r] *= 0.5
                multipliers[r] -= move[r]
            continue
        before, halved = missed, 0
        if not solve_free(H, left, free, _FLOOR * largest, L, move):
            break
        for r in range(m):
            multipliers[r] += move[r]


@jit
def move_nearer(
    model: Array, goal: Goal, low: Array, high: Array, seed: Array, scale: Array, q: Array
) -> bool:  # fmt: skip
    """Move q ``(n,)``, in place, along the configurations inside [low, high] that meet a task towards the seed.

    q is inside the limits. scale ``(n,)``: 1/w² of the joints. Returns whether q meets the task.
    """
    n = q.shape[0]
    rows = 3 if goal[1] == POSITION else 6
    J, e, x, y = np.empty((rows, n)), np.empty(6), np.empty(n), np.empty(n)
    if _linear(model, goal, q, J, e) > _MET:
        return False
    share = 1.0
    for _ in range(_STEPS):
        now = farthest = 0.0
        _foot(J, e, q, seed, scale, low, high, x)
        for i in range(n):
            now += (q[i] - seed[i]) ** 2 / scale[i]
            farthest = max(farthest, (x[i] - q[i]) ** 2 / scale[i])
        farthest = math.sqrt(farthest)
        share, nearer = min(1.0, 4.0 * share), False
        while share >= _SHORTEST and not nearer:
            part = min(share, _STRIDE / farthest) if farthest > 0.0 else share
            for i in range(n):
                y[i] = q[i] + part * (x[i] - q[i])
            error = _linear(model, goal, y, J, e)
            for _ in range(_BACK):
                if error < _TIGHT:
                    break
                _foot(J, e, y, y, scale, low, high, x)
                for i in range(n):
                    y[i] = x[i]
                error = _linear(model, goal, y, J, e)
            after = 0.0
            for i in range(n):
                after += (y[i] - seed[i]) ** 2 / scale[i]
            nearer = error <= _MET and after < now * (1.0 - _GAIN)
            if not nearer:
                share *= 0.25
                _linear(model, goal, q, J, e)
                _foot(J, e, q, seed, scale, low, high, x)
        if not nearer:
            break
        for i in range(n):
            q[i] = y[i]
    return True
