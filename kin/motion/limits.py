"""How fast each joint may move: what its maker states, and an assumption where nothing is stated.

A limit that no robot file states is assumed, and `MotionLimits.assumed` names it:

- velocity: half a turn per second, or one metre per second;
- acceleration: the largest velocity is reached in `ACCELERATION_TIME`;
- jerk: the largest acceleration is reached in `JERK_TIME`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from kin.robot import Joint, Robot
from kin.transforms import Array

TURNING, SLIDING = math.pi, 1.0  # rad/s, m/s
ACCELERATION_TIME, JERK_TIME = 0.25, 0.1  # seconds


@dataclass(frozen=True, slots=True, eq=False)
class MotionLimits:
    """The largest value of each quantity, joint by joint; read-only arrays ``(n,)`` in rad or m and seconds.

    Attributes:
        velocity, acceleration, jerk: in both directions alike.
        effort: torque or force (N·m or N), NaN where none is stated; a motion is not checked against it.
        assumed: for each joint the names of the limits that no robot file states.
    """

    velocity: Array
    acceleration: Array
    jerk: Array
    effort: Array
    assumed: tuple[tuple[str, ...], ...]


@lru_cache(maxsize=256)
def limits_of(robot: Robot) -> MotionLimits:
    """The limits of an arm: stated in its file, or assumed."""
    rows = [_of_joint(joint) for joint in robot.joints]
    values = np.array([row[:4] for row in rows]).T.copy()
    values.flags.writeable = False
    velocity, acceleration, jerk, effort = values
    return MotionLimits(velocity, acceleration, jerk, effort, tuple(row[4] for row in rows))


def _of_joint(joint: Joint) -> tuple[float, float, float, float, tuple[str, ...]]:
    assumed = []
    velocity, acceleration, jerk = joint.velocity, joint.acceleration, joint.jerk
    if velocity is None:
        velocity = TURNING if joint.kind == "revolute" else SLIDING
        assumed.append("velocity")
    if acceleration is None:
        acceleration = velocity / ACCELERATION_TIME
        assumed.append("acceleration")
    if jerk is None:
        jerk = acceleration / JERK_TIME
        assumed.append("jerk")
    effort = math.nan if joint.effort is None else joint.effort
    return velocity, acceleration, jerk, effort, tuple(assumed)
