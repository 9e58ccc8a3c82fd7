"""How many independent motions of the tool the joints make, also for tables that were typed with a few digits."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from kin import Robot, jacobian
from kin.axes import NEARLY, size
from kin.transforms import Array

_SAMPLES = 8


def rank(robot: Robot, J: Array) -> int:
    """The rank of a Jacobian, or the largest one of a stack ``(..., m, n)``; its upper three rows are velocities.

    What is zero but for the rounding of typed angles counts as zero.
    """
    rows = J.copy()
    rows[..., :3, :] /= size(robot)  # shares of the arm's size: metres and radians compare
    return int(np.linalg.matrix_rank(rows, rtol=NEARLY).max())


@lru_cache(maxsize=64)
def self_motions(robot: Robot) -> int:
    """The dimension of the null space of the Jacobian almost everywhere: joints less rank."""
    return robot.n - rank(robot, _samples(robot))


def point_motions(robot: Robot) -> int:
    """The same for the linear part of the Jacobian: motions that leave the tool point in place."""
    return robot.n - rank(robot, _samples(robot)[:, :3])


def lifts(robot: Robot, J: Array, joint: int) -> bool:
    """Whether a joint changes the tool's height by more than the rounding of a table, for J ``(..., 6, n)``."""
    least = NEARLY * size(robot) if robot.revolute[joint] else NEARLY
    return bool(np.abs(J[..., 2, joint]).max() > least)


def _samples(robot: Robot) -> Array:
    return jacobian(robot, robot.random_q(np.random.default_rng(2), _SAMPLES))
