"""How the walk through a DH table goes on by itself."""

from __future__ import annotations

import math

from app.viewer.lessons.dh.steps import MOTIONS, ORDERS, length, value
from kin import Robot
from kin.transforms import Array

MOTION_TIME = 1.3  # s for one motion at speed 1
REST = 0.5  # s of rest after each motion, to let it be read; a motion by zero takes only this time
SPEEDS = {"Half": 0.5, "Normal": 1.0, "Double": 2.0}


def walked(robot: Robot, q: Array, at: float, rest: float, speed: str, seconds: float) -> tuple[float, float]:
    """The place, in motions, and how long it rests there (s), so many seconds later, for the arm at ``(n,)``.

    Args:
        at, rest: the same before.
        speed: one of `SPEEDS`.
    """
    if rest > 0.0 or at >= length(robot):
        return at, rest - seconds
    number = math.floor(at)
    row, motion = divmod(number, MOTIONS)
    nothing = value(robot, row, ORDERS[robot.convention][motion], q) == 0.0
    at = number + 1.0 if nothing else min(at + seconds * SPEEDS[speed] / MOTION_TIME, number + 1.0)
    return at, REST / SPEEDS[speed] if at == number + 1.0 else 0.0
