"""The joint axes of an arm in a posture, as the lessons draw them."""

from __future__ import annotations

import numpy as np

from kin import Robot, link_frames
from kin.transforms import Array


def axes_at(robot: Robot, q: Array) -> tuple[Array, Array]:
    """A point of each joint's axis, where the joint is, and the axis' direction, ``(n, 3)`` each."""
    frames = np.concatenate([robot.T_world_base[None], link_frames(robot, q)])
    # In the standard convention a joint turns about z of the frame before its row, in the modified one of its own.
    rows = np.array(robot.joint_rows) + (robot.convention == "modified")
    return frames[rows, :3, 3], frames[rows, :3, 2]
