"""Along the configurations that meet a task towards a box, where the task leaves the joints a motion.

The nearest configuration inside the limits has the least |w (x − aim)|² of all that meet the task, where the aim
is the seed, or the point of a box that is nearest. Near a configuration q the task is J (x − q) = e, and the
answer is x = clamp(aim + Jᵀ λ / w²), whose multipliers λ follow by Newton steps on the dual problem, halved where
limits that switch lead a whole one away. The configuration moves there, or as far towards it as the distance
falls, and back onto the task. What is found is a local minimum.

A task is what its function `linear` takes: ``linear(task, q, J, e)`` writes J ``(rows, n)`` and e of the task
around q and returns the error in metres.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from kin.kernels.compile import inlined, jit
from kin.kernels.dense import solve_positive
from kin.solvers.contract import POSITION
from kin.solvers.numeric.error import Goal, look, quadratic_model
from kin.transforms import Array

_DUAL, _HALVED, _BACK, _STEPS = 40, 6, 8, 60
_STRIDE = 0.5  # weighted radians of one joint in one step
_FLOOR = 1e-12  # of the dual problem's matrix, as a share of its largest entry
_TIGHT, _MET = 1e-13, 1e-11  # what steps back aim for, and what counts as met; of E, metres
_SHORTEST, _GAIN = 1e-3, 1e-10  # a share of a step; a share of the squared distance that is worth another step

_Task = TypeVar("_Task")
Linear = Callable[[_Task, Array, Array, Array], float]


@jit
def _linear(task: tuple[Array, Goal], q: Array, J: Array, e: Array) -> float:
    """J ``(rows, n)``, e ``(6,)`` ← the task ``J step = e`` of an arm around q ``(n,)``; returns E."""
    model, goal = task
    n = q.shape[0]
    whole, T, axes = np.empty((6, n)), np.empty((4, 4)), np.empty((n, 7))
    error = look(model, q, goal, (whole, T, axes), e)
    quadratic_model(goal, False, whole, T, e, np.empty(6), np.empty((n, n)), np.empty(n))
    for r in range(J.shape[0]):
        for i in range(n):
            J[r, i] = whole[r, i]
    return math.sqrt(2.0 * error)


@inlined
def _foot(J: Array, e: Array, q: Array, aim: Array, scale: Array, low: Array, high: Array, x: Array) -> None:
    """x ``(n,)`` ← the point nearest to `aim` inside [low, high] with J (x − q) = e; scale: 1/w² of the joints."""
    m, n = J.shape
    multipliers, left, move = np.zeros(m), np.empty(m), np.empty(m)
    H, before, halved = np.empty((m, m)), math.inf, 0
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
        for r in range(m):
            move[r] = left[r]
        if not solve_positive(H, m, _FLOOR * largest, 0.0, move):
            break
        for r in range(m):
            multipliers[r] += move[r]


@inlined
def back_onto(
    linear: Linear[_Task], task: _Task, bounds: tuple[Array, Array], scale: Array,
    work: tuple[Array, Array, Array], q: Array,
) -> float:  # fmt: skip
    """Move q ``(n,)``, in place, by shortest steps inside its bounds onto a task; returns the error that is left.

    scale ``(n,)``: 1/w² of the joints. work ← J ``(rows, n)`` and e there; its third array ``(n,)`` is scratch.
    """
    low, high = bounds
    J, e, x = work
    error = linear(task, q, J, e)
    for _ in range(_BACK):
        if error < _TIGHT:
            break
        _foot(J, e, q, q, scale, low, high, x)
        for i in range(q.shape[0]):
            q[i] = x[i]
        error = linear(task, q, J, e)
    return error


@inlined
def move_towards(
    linear: Linear[_Task], task: _Task, rows: int, near: tuple[Array, Array], bounds: tuple[Array, Array],
    scale: Array, q: Array,
) -> bool:  # fmt: skip
    """Move q ``(n,)``, in place, along the configurations inside its bounds that meet a task towards a box.

    rows: how many equations the task is. near: lower and upper corner of that box ``(n,)``. Returns whether q
    meets the task.
    """
    n = q.shape[0]
    J, e, x, y, aim = np.empty((rows, n)), np.empty(6), np.empty(n), np.empty(n), np.empty(n)
    if linear(task, q, J, e) > _MET:
        return False
    low, high = bounds
    share = 1.0
    for _ in range(_STEPS):
        now = farthest = 0.0
        for i in range(n):
            aim[i] = min(max(q[i], near[0][i]), near[1][i])
            now += (q[i] - aim[i]) ** 2 / scale[i]
        _foot(J, e, q, aim, scale, low, high, x)
        for i in range(n):
            farthest = max(farthest, (x[i] - q[i]) ** 2 / scale[i])
        farthest = math.sqrt(farthest)
        share, nearer = min(1.0, 4.0 * share), False
        while share >= _SHORTEST and not nearer:
            part = min(share, _STRIDE / farthest) if farthest > 0.0 else share
            for i in range(n):
                y[i] = q[i] + part * (x[i] - q[i])
            error = back_onto(linear, task, bounds, scale, (J, e, x), y)
            after = 0.0
            for i in range(n):
                after += (y[i] - min(max(y[i], near[0][i]), near[1][i])) ** 2 / scale[i]
            nearer = error <= _MET and after < now * (1.0 - _GAIN)
            if not nearer:
                share *= 0.25
                linear(task, q, J, e)
                _foot(J, e, q, aim, scale, low, high, x)
        if not nearer:
            break
        for i in range(n):
            q[i] = y[i]
    return True


@jit
def move_nearer(
    model: Array, goal: Goal, low: Array, high: Array, seed: Array, scale: Array, q: Array
) -> bool:  # fmt: skip
    """Move q ``(n,)``, in place, along the configurations inside [low, high] that meet a task towards the seed.

    q is inside the limits. scale ``(n,)``: 1/w² of the joints. Returns whether q meets the task.
    """
    rows = 3 if goal[1] == POSITION else 6
    return move_towards(_linear, (model, goal), rows, (seed, seed), (low, high), scale, q)
