"""The Jacobian of a task, and its rank.

A task is what matters about the tool: its pose, its point and the direction in which it points, or its point. Each
has its rows of the Jacobian. Their rank is how many of its motions the joints control.

Two things spoil a rank that is counted from singular values alone. Metres and radians do not compare, so lengths
are taken as shares of the arm's size. And a table typed with three or four digits is never exactly planar or
decoupled, so the rank *almost everywhere* counts as zero what is zero but for such digits.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np

from kin.axes import NEARLY, size
from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.transforms import Array

Task = Literal["pose", "approach", "position"]
LOST = 1e-9  # of the largest singular value; below this a motion is lost at a configuration
_SAMPLES = 8


def task_rows(robot: Robot, q: Array, task: Task) -> Array:
    """The rows of the Jacobian that a task is about ``(..., m, n)``, in the base frame, at ``(..., n)``.

    All six; the velocity of the tool point alone; or this and the turning about the tool's x and y.
    """
    J = jacobian(robot, q)
    if task == "pose":
        return J
    if task == "position":
        return J[..., :3, :]
    R_T = np.swapaxes(fk(robot, q)[..., :3, :2], -1, -2)
    return np.concatenate([J[..., :3, :], R_T @ J[..., 3:, :]], axis=-2)


def natural_task(robot: Robot) -> Task:
    """The task that `n` joints can control: six or more the pose, five the approach, fewer the point."""
    if robot.n >= 6:
        return "pose"
    return "approach" if robot.n == 5 else "position"


def task_jacobian(robot: Robot, q: Array) -> Array:
    """The rows of the Jacobian that `n` joints can control ``(..., m, n)``, at ``(..., n)``: of `natural_task`."""
    return task_rows(robot, q, natural_task(robot))


def weight(robot: Robot, rows: int) -> Array:
    """Factors of the rows ``(m,)``: lengths as shares of the arm's size, so that metres and radians compare."""
    factors = np.ones(rows)
    factors[:3] = 1.0 / size(robot)
    return factors


def rank(robot: Robot, J: Array, share: float = LOST) -> int:
    """The rank of rows of a Jacobian ``(m, n)``, or the largest of a stack; the upper three are velocities.

    Singular values up to a share of the largest one of the same matrix count as zero.
    """
    values = np.linalg.svd(weight(robot, J.shape[-2])[:, None] * J, compute_uv=False)
    return int((values > share * values[..., :1]).sum(axis=-1).max())


@lru_cache(maxsize=256)
def usual_rank(robot: Robot, task: Task, locked: tuple[int, ...] = ()) -> int:
    """The rank of the task's Jacobian almost everywhere; what is zero but for typed digits counts as zero."""
    J = task_rows(robot, robot.random_q(np.random.default_rng(2), _SAMPLES), task)
    J[..., list(locked)] = 0.0
    return rank(robot, J, NEARLY)


def free_motions(robot: Robot, task: Task, locked: tuple[int, ...] = ()) -> int:
    """The dimension of the null space almost everywhere: motions of the joints that leave the task in place."""
    return robot.n - len(locked) - usual_rank(robot, task, locked)


def lifts(robot: Robot, J: Array, joint: int) -> bool:
    """Whether a joint changes the tool's height by more than the rounding of a table, for J ``(..., 6, n)``."""
    least = NEARLY * size(robot) if robot.revolute[joint] else NEARLY
    return bool(np.abs(J[..., 2, joint]).max() > least)
