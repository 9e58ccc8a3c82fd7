"""The last joint of an arm, if it turns the tool about its point."""

from __future__ import annotations

import numpy as np

from kin.axes import frame_of, is_zero, lines_of, perpendicular_to
from kin.fk import fk
from kin.robot import Robot
from kin.solvers.reduced import fixed
from kin.transforms import Array


class LastJoint:
    """A last joint that turns the tool about its point.

    Attributes:
        others: the arm of the other joints; the z axis of its tool is the last axis.
        axis: from the tool's frame to that of `others` ``(4, 4)``, a rotation.
        rolls: whether it turns the tool about the tool's z axis.
    """

    def __init__(self, robot: Robot, axis: Array, rolls: bool) -> None:
        self.robot, self.axis, self.rolls = robot, axis, rolls
        others = fixed(robot, {robot.n - 1: 0.0})
        self.others = others.with_tool(others.T_last_tool @ axis)

    def target(self, T: Array) -> Array:
        """The target of the other joints, as far as they decide it."""
        return np.ascontiguousarray(T @ self.axis)

    def to_orientation(self, T: Array, q: Array) -> Array:
        """The last joint ``(k,)`` that brings the tool nearest to an orientation, after q ``(k, n − 1)``."""
        R = np.swapaxes(fk(self.others, q)[:, :3, :3], 1, 2) @ self.target(T)[:3, :3]
        return np.asarray(np.arctan2(R[:, 1, 0] - R[:, 0, 1], R[:, 0, 0] + R[:, 1, 1]))

    def to_direction(self, T: Array, q: Array) -> Array:
        """The last joint ``(k,)`` that brings the tool's z axis nearest to a target's, after q ``(k, n − 1)``."""
        x, y = self.axis[2, :2]
        wanted = np.swapaxes(fk(self.others, q)[:, :3, :3], 1, 2) @ T[:3, 2]
        return np.asarray(np.arctan2(x * wanted[:, 1] - y * wanted[:, 0], x * wanted[:, 0] + y * wanted[:, 1]))


def last_joint(robot: Robot) -> LastJoint | None:
    """The last joint if it turns the tool about its point, else None."""
    if robot.n < 2 or not robot.revolute[-1]:
        return None
    lines = lines_of(robot, as_counted=True)
    z, T = lines.z[-1], lines.T_base_tool
    if not is_zero(*np.cross(T[:3, 3] - lines.points[-1], z)):
        return None
    own = T[:3, :3].T @ z
    axis = frame_of(perpendicular_to(own), own, np.zeros(3))
    return LastJoint(robot, axis, is_zero(*own[:2]))
