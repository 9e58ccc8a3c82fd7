"""Distances between configurations of an arm, in which turns and slides compare."""

from __future__ import annotations

import math

import numpy as np

from kin.axes import size
from kin.robot import Robot
from kin.transforms import Array


def extent(robot: Robot) -> float:
    """The arm's reach in metres, or its size where slides without limits make that infinite; never 0."""
    return robot.reach if 0.0 < robot.reach < math.inf else size(robot)


def weights(robot: Robot) -> Array:
    """What a radian, or a metre, of each joint counts in distances between configurations ``(n,)``.

    A turn counts as it is, a slide as a share of the arm's reach: an arm at another size has the same distances.
    """
    return np.where(robot.revolute, 1.0, 1.0 / extent(robot))
