"""What is missing to a pose, in the rows of a task."""

from __future__ import annotations

import numpy as np

from kin.differential.task import Task
from kin.fk import fk
from kin.robot import Robot
from kin.transforms import Array, rotation_vector


def task_error(robot: Robot, q: Array, T_held: Array, task: Task) -> Array:
    """What is missing to a pose ``(4, 4)`` at ``(..., n)``, in the rows of `task_rows` ``(..., m)``: m and rad."""
    T = fk(robot, q)
    move = T_held[:3, 3] - T[..., :3, 3]
    if task == "position":
        return np.asarray(move)
    if task == "approach":
        axis = np.cross(T[..., :3, 2], T_held[:3, 2])
        sine, cosine = np.linalg.norm(axis, axis=-1), T[..., :3, 2] @ T_held[:3, 2]
        share = np.divide(np.arctan2(sine, cosine), sine, out=np.ones_like(sine), where=sine > 0.0)
        turn = (axis[..., None, :] @ T[..., :3, :2])[..., 0, :] * share[..., None]
    else:
        turn = rotation_vector(T_held[:3, :3] @ np.swapaxes(T[..., :3, :3], -1, -2))
    return np.concatenate([move, turn], axis=-1)
