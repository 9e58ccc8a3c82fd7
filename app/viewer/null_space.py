"""The null space of an arm's task at one configuration, and motions in it, by the Jacobian alone.

The joints follow ``q̇ = J⁺v + (I − J⁺J) z``: the first part moves the task, the second only the joints (Liégeois,
IEEE Trans. Systems, Man, and Cybernetics 7(12), 1977). Newton's method corrects what a finite step misses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from kin.differential.error import task_error
from kin.differential.task import LOST, Task, task_rows, usual_rank, weight
from kin.robot import Robot
from kin.transforms import Array

Goal = Literal["limits", "manipulability"]
TOLERANCE = 1e-10  # m and rad; how exactly the task is held
SMOOTH = 0.6  # rad or m of a joint; a larger correction is a jump
FAST = 0.08  # rad or m of any joint in one step
_ITERATIONS = 12
_STEP = 1e-5  # rad or m, for the gradient
_TAKES_PART = 1e-6  # least share of a joint in the null space to be led


@dataclass(frozen=True, eq=False)
class NullSpace:
    """Task Jacobian ``(m, n)`` at a configuration, and what follows from its singular values.

    Attributes:
        rank: singular values that are zero for the rounding of a table only count as zero, see `usual_rank`.
        pinv: pseudoinverse J⁺ ``(n, m)``.
        basis: ``(n, n − rank)`` joint speeds that do not move the task, orthonormal columns.
    """

    J: Array
    rank: int
    pinv: Array
    basis: Array

    def project(self, z: Array) -> Array:
        """``(I − J⁺J) z``: the part of joint speeds ``(n,)`` that does not move the task."""
        return np.asarray(self.basis @ (self.basis.T @ z))


def null_space(robot: Robot, q: Array, task: Task, locked: Sequence[int] = ()) -> NullSpace:
    """The null space of a task at q ``(n,)``, of the joints that are not locked."""
    J = task_rows(robot, q, task)
    J[:, list(locked)] = 0.0
    factors = weight(robot, len(J))
    U, s, Vt = np.linalg.svd(factors[:, None] * J)
    rank = min(int((s > LOST * s[:1]).sum()), usual_rank(robot, task, tuple(locked)))
    pinv = (Vt[:rank].T / s[:rank]) @ U[:, :rank].T * factors
    basis = Vt[rank:].T
    if locked:
        still = np.eye(robot.n)[:, list(locked)]
        basis = np.linalg.svd(np.concatenate([Vt[:rank], still.T]))[2][rank + len(locked) :].T
    return NullSpace(J, rank, pinv, basis)


def measure(robot: Robot, q: Array, task: Task, rank: int) -> Array:
    """Manipulability of a task ``(...)`` at ``(..., n)``: the product of its largest `rank` singular values."""
    values = np.linalg.svd(task_rows(robot, q, task), compute_uv=False)
    return np.asarray(np.prod(values[..., :rank], axis=-1))


def secondary(robot: Robot, q: Array, task: Task, goal: Goal) -> Array:
    """Joint speeds z ``(n,)`` that serve a goal: the direction of steepest improvement, not yet projected.

    ``limits``: −∇ ½Σ((q − middle)/half range)². ``manipulability``: ∇ ln w, with w of the task.
    """
    if goal == "limits":
        half = 0.5 * (robot.upper - robot.lower)
        bounded = np.isfinite(half)
        middle = 0.5 * (np.where(bounded, robot.lower, 0.0) + np.where(bounded, robot.upper, 0.0))
        return np.asarray(np.where(bounded, (middle - q) / np.where(bounded, half, 1.0) ** 2, 0.0))
    rank = null_space(robot, q, task).rank
    near = q + _STEP * np.concatenate([np.eye(robot.n), -np.eye(robot.n)])
    w = np.log(np.maximum(measure(robot, near, task, rank), 1e-300))
    return np.asarray((w[: robot.n] - w[robot.n :]) / (2.0 * _STEP))


def margin(robot: Robot, q: Array) -> float:
    """The smallest distance to a joint limit as a share of half the range, 0 to 1; 1 without limits."""
    half = 0.5 * (robot.upper - robot.lower)
    room = np.minimum(q - robot.lower, robot.upper - q)
    shares = [r / h for r, h in zip(room.tolist(), half.tolist(), strict=True) if math.isfinite(h) and h > 0.0]
    return float(min(shares, default=1.0))


def hold(robot: Robot, q: Array, T_held: Array, task: Task, locked: Sequence[int] = ()) -> Array | None:
    """The configuration near q ``(n,)`` that holds the task exactly; None if Newton's method finds none nearby."""
    return _newton(robot, q, T_held, task, locked, None)


def lead(
    robot: Robot, q: Array, T_held: Array, task: Task, joint: int, value: float, locked: Sequence[int] = ()
) -> Array | None:
    """The configuration near q ``(n,)`` that holds the task with one joint at a value; None if none is nearby.

    Configurations outside the limits of the joints are none.
    """
    found = _newton(robot, q, T_held, task, locked, (joint, value))
    if found is None or (found < robot.lower - 1e-9).any() or (found > robot.upper + 1e-9).any():
        return None
    return np.clip(found, robot.lower, robot.upper)


def within(robot: Robot, q: Array, task: Task, joint: int, value: float, locked: Sequence[int] = ()) -> float:
    """The value nearest to the wanted one to which a joint leads while no joint moves more than `FAST`."""
    basis = null_space(robot, q, task, locked).basis
    along = basis @ basis[joint]
    share = float(along[joint])
    if share < _TAKES_PART:
        return float(q[joint])
    most = FAST * share / float(np.abs(along).max())
    return float(q[joint] + min(max(value - q[joint], -most), most))


def _newton(
    robot: Robot,
    q: Array,
    T_held: Array,
    task: Task,
    locked: Sequence[int],
    given: tuple[int, float] | None,
) -> Array | None:
    """Minimum-norm Newton steps for the task and, if one is given, the value of a joint."""
    start, q = q, q.copy()
    for _ in range(_ITERATIONS):
        missing = task_error(robot, q, T_held, task)
        apart = 0.0 if given is None else given[1] - q[given[0]]
        if max(float(np.abs(missing).max()), abs(apart)) < TOLERANCE:
            return q if float(np.abs(q - start).max()) < SMOOTH else None
        space = null_space(robot, q, task, locked)
        step = space.pinv @ missing
        if given is not None:
            along = space.basis @ space.basis[given[0]]
            share = float(along[given[0]])
            if share < _TAKES_PART:
                return None
            step = step + along * (apart - step[given[0]]) / share
        q = q + step
        if float(np.abs(q - start).max()) > 4.0 * SMOOTH:
            return None
    return None
