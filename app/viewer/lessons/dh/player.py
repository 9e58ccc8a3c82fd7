"""How the walk through a DH table goes on by itself. Time is `time.perf_counter`'s."""

from __future__ import annotations

import math

from app.viewer.lessons.dh.steps import MOTIONS, ORDERS, length, value
from kin import Robot
from kin.transforms import Array

MOTION_TIME = 1.3  # s for one motion at speed 1
REST = 0.5  # s of rest after each motion; a motion by zero takes only this time
SPEEDS = {"Half": 0.5, "Normal": 1.0, "Double": 2.0}


class Player:
    """Goes on from now on, until it is dropped. It rests at the end of each motion, to let it be read."""

    def __init__(self, now: float) -> None:
        self._last = self._rest_until = now

    def advance(self, robot: Robot, q: Array, at: float, speed: str, now: float) -> float:
        """The place, in motions, after the time since the last frame, for the arm at ``(n,)``.

        Args:
            at: the place before.
            speed: one of `SPEEDS`.
        """
        # After a long pause it continues where it was, without a jump.
        passed = min(now - self._last, 0.1)
        self._last = now
        if now < self._rest_until or at >= length(robot):
            return at
        number = math.floor(at)
        row, motion = divmod(number, MOTIONS)
        nothing = value(robot, row, ORDERS[robot.convention][motion], q) == 0.0
        at = number + 1.0 if nothing else min(at + passed * SPEEDS[speed] / MOTION_TIME, number + 1.0)
        if at == number + 1.0:
            self._rest_until = now + REST / SPEEDS[speed]
        return at
