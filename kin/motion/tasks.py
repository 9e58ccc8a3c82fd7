"""What the tool can keep of a pose: as much as the joints of the arm allow."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from kin.differential.task import Task
from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.solvers.contract import APPROACH, POSE, POSITION
from kin.transforms import Array

CODES: dict[Task, int] = {"pose": POSE, "approach": APPROACH, "position": POSITION}

_DEPENDENT = 1e-6  # a twist that adds less than this to those before it (unit size) depends on them


@lru_cache(maxsize=256)
def most_kept(robot: Robot) -> Task:
    """What the tool keeps by default.

    The joints of an arm generate a group of motions; its dimension is 3 for arms in a plane, 4 for a SCARA and 6
    in general. An arm with at least as many joints can keep whole poses of its group. Other arms keep point and
    approach direction from five joints on, else the point.
    """
    if motion_dimension(robot) <= robot.n:
        return "pose"
    return "approach" if robot.n >= 5 else "position"


def motion_dimension(robot: Robot) -> int:
    """The dimension of the smallest group that contains all motions of the tool, 0 to 6.

    It is that of the Lie algebra which the twists of the joints generate; it is the same at every configuration.
    """
    q = robot.q_home
    tool = fk(robot, q)[:3, 3]
    columns = jacobian(robot, q).T
    size = max(float(np.abs(columns[:, :3]).max()), 1e-9) if robot.revolute.any() else 1.0
    twists = [np.concatenate([(row[:3] - np.cross(row[3:], tool)) / size, row[3:]]) for row in columns]
    basis = np.empty((0, 6))
    while twists:
        twist = twists.pop()
        length = float(np.linalg.norm(twist))
        if length > _DEPENDENT:
            twist = twist / length
            rest = twist - basis.T @ (basis @ twist)
            if (added := float(np.linalg.norm(rest))) > _DEPENDENT:
                twists.extend(_bracket(other, twist) for other in basis)
                basis = np.concatenate([basis, rest[None] / added])
    return len(basis)


def _bracket(a: Array, b: Array) -> Array:
    """The Lie bracket of two twists (velocity of the origin, angular velocity)."""
    return np.concatenate([np.cross(a[3:], b[:3]) - np.cross(b[3:], a[:3]), np.cross(a[3:], b[3:])])
