"""Where the walk through a DH table is, and how it goes on by itself. Time is `time.perf_counter`'s."""

from __future__ import annotations

import math

from app.viewer.lessons.dh.steps import MOTIONS, ORDERS, length, value
from kin import InputError, Robot
from kin.transforms import Array

MOTION_TIME = 1.3  # s for one motion at speed 1
REST = 0.5  # s of rest after each motion; a motion by zero takes only this time
SPEEDS = {"Half": 0.5, "Normal": 1.0, "Double": 2.0}


class Player:
    """The walk through the table of a robot.

    Attributes:
        robot: whose table it is.
        at: motions that are complete, with the part of the next one.
        playing: whether it goes on by itself.
        speed: one of `SPEEDS`.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.at = 0.0
        self.playing = False
        self.speed = "Normal"
        self._last = self._rest_until = 0.0

    @property
    def rows(self) -> float:
        """Rows that are complete, with the part of the next one."""
        return self.at / MOTIONS

    def go(self, at: float) -> None:
        """Go to a number of motions, or to the end of the walk that is nearer."""
        self.at = min(max(float(at), 0.0), float(length(self.robot)))

    def go_to_rows(self, rows: object) -> None:
        """Go to a number of rows; raises `kin.InputError` for anything but a number."""
        if not isinstance(rows, int | float) or not math.isfinite(rows):
            raise InputError("row", rows, "a finite number")
        # Rounded, so that 1.25 rows are not slightly more than five motions.
        self.go(round(float(rows) * MOTIONS, 6))

    def play(self, now: float) -> None:
        """Go on by itself from now on, from the beginning if it was at the end."""
        if self.at >= length(self.robot):
            self.at = 0.0
        self.playing = True
        self._last = self._rest_until = now

    def advance(self, now: float, q: Array) -> bool:
        """Advance by the time since the last frame, for the arm at ``(n,)``; returns whether the end is reached.

        It rests at the end of each motion, to let it be read.
        """
        # After a long pause it continues where it was, without a jump.
        passed = min(now - self._last, 0.1)
        self._last = now
        if now < self._rest_until:
            return False
        robot, speed = self.robot, SPEEDS[self.speed]
        number = math.floor(self.at)
        row, motion = divmod(number, MOTIONS)
        nothing = value(robot, row, ORDERS[robot.convention][motion], q) == 0.0
        self.at = number + 1.0 if nothing else min(self.at + passed * speed / MOTION_TIME, number + 1.0)
        if self.at == number + 1.0:
            self._rest_until = now + REST / speed
        return self.at >= length(robot)
