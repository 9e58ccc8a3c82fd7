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
from numpy.typing import ArrayLike

from kin.errors import InputError
from kin.named import robot_of
from kin.robot import Joint, Robot
from kin.transforms import Array

TURNING, SLIDING = math.pi, 1.0  # rad/s, m/s
ACCELERATION_TIME, JERK_TIME = 0.25, 0.1  # seconds
LEAST, MOST = 1e-9, 1e12  # of any limit, so that times are finite numbers


@dataclass(frozen=True, slots=True, eq=False)
class MotionLimits:
    """The largest value of each quantity, joint by joint; read-only arrays ``(n,)`` in rad or m and seconds.

    Attributes:
        velocity, acceleration, jerk: in both directions alike.
        effort: torque or force (N·m or N), NaN where none is stated; a motion is not checked against it.
        assumed: for each joint the names of the limits that no robot file states.

    Raises:
        InputError: a limit that is not a number from `LEAST` to `MOST`, or not as many as rows of `assumed`.
    """

    velocity: Array
    acceleration: Array
    jerk: Array
    effort: Array
    assumed: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        """Check the values; they become read-only arrays of floats."""
        n = len(self.assumed)
        for key in ("velocity", "acceleration", "jerk"):
            values = _checked(key, getattr(self, key), n, f"numbers from {LEAST:g} to {MOST:g}")
            for i in np.flatnonzero(~((values >= LEAST) & (values <= MOST))).tolist():
                raise InputError(
                    f"motion_limits.{key}[{i}]", float(values[i]), f"a number from {LEAST:g} to {MOST:g}"
                )
            object.__setattr__(self, key, values)
        efforts = _checked("effort", self.effort, n, f"numbers from 0 to {MOST:g} or NaN")
        for i in np.flatnonzero(~(((efforts >= 0.0) & (efforts <= MOST)) | np.isnan(efforts))).tolist():
            raise InputError(
                f"motion_limits.effort[{i}]", float(efforts[i]), f"a number from 0 to {MOST:g}, or NaN"
            )
        object.__setattr__(self, "effort", efforts)


def _checked(key: str, values: ArrayLike, n: int, expected: str) -> Array:
    """A limit of all joints as a read-only array ``(n,)``."""
    try:
        found = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        found = np.empty(0)
    if found.shape != (n,):
        raise InputError(f"motion_limits.{key}", values, f"{n} {expected}, one for each joint")
    found.flags.writeable = False
    return found


@lru_cache(maxsize=256)
def motion_limits(robot: Robot | str) -> MotionLimits:
    """The limits of an arm: stated in its file, or assumed.

    Args:
        robot: the arm, or the id of a built-in one.

    Returns:
        Velocity, acceleration and jerk of each joint, in radians (metres) and seconds.

    Raises:
        UnknownRobotError: no built-in arm has this id.

    Examples:
        >>> import kin
        >>> kin.motion.motion_limits("ur5").velocity.round(3)
        array([3.142, 3.142, 3.142, 3.142, 3.142, 3.142])
    """
    robot = robot_of(robot)
    rows = [_of_joint(joint) for joint in robot.joints]
    velocity, acceleration, jerk, effort = np.array([row[:4] for row in rows]).T
    return MotionLimits(velocity, acceleration, jerk, effort, tuple(row[4] for row in rows))


def _of_joint(joint: Joint) -> tuple[float, float, float, float, tuple[str, ...]]:
    assumed = []
    velocity, acceleration, jerk = joint.velocity, joint.acceleration, joint.jerk
    if velocity is None:
        velocity = TURNING if joint.kind == "revolute" else SLIDING
        assumed.append("velocity")
    if acceleration is None:
        acceleration = min(velocity / ACCELERATION_TIME, MOST)
        assumed.append("acceleration")
    if jerk is None:
        jerk = min(acceleration / JERK_TIME, MOST)
        assumed.append("jerk")
    effort = math.nan if joint.effort is None else joint.effort
    return velocity, acceleration, jerk, effort, tuple(assumed)
