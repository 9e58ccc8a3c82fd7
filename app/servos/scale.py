"""Joint values of a driven arm by the ticks of its servos."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

import kin
from app.servos.bus import named

TAU: Final = 2.0 * np.pi
# Ticks (2°) outside its range at which a servo may be switched on: it moves to the range itself.
MARGIN: Final = 23

Array = NDArray[np.float64]


class Scale:
    """Joint values of a driven arm by the ticks of its servos, in a straight line over their calibrated ranges.

    A reading tells a joint value only up to whole turns, and `q_from_readings` chooses the one that fits the
    limits best. Two ticks side by side may then be a turn apart, and the ends of a full turn, 0 and 4095, may
    both become 180°. To a servo its goals are numbers on one line: it goes from 4095 to 0 all the way back. So
    the turn is chosen once here, for all readings, goals and limits.

    Args:
        robot: the arm with its motors.
        motors: those that move a joint.
        ticks: where they are ``(m,)``. If that is inside the limits on some turn, that turn is chosen; otherwise
            the one on which the middle of the range is.

    Attributes:
        limits: the configurations ``(n,)`` at the ends of the calibrated ranges: lower and upper ones.

    Raises:
        KinematicsError: a servo is outside its calibrated range.
    """

    def __init__(self, robot: kin.Robot, motors: Sequence[kin.motors.Motor], ticks: Array) -> None:
        self._low, self._high = np.array([motor.range or (0, motor.ticks - 1) for motor in motors], dtype=float).T
        for motor, tick, low, high in zip(motors, ticks, self._low, self._high, strict=True):
            if not low - MARGIN <= tick <= high + MARGIN:
                raise kin.KinematicsError(
                    f"{named(motor)} is at {tick:.0f} ticks, outside its calibrated range from {low:.0f} to "
                    f"{high:.0f}: is the calibration of another arm, or older? Nothing was moved"
                )
        self._ends = np.minimum(self._low, ticks), np.maximum(self._high, ticks)
        self._middle = 0.5 * (self._low + self._high)
        first, last = kin.motors.readings_from_ticks(motors, np.array([self._low, self._high]))
        scale = [motor.sign * motor.scale for motor in motors]
        self._slope = scale * (self._high - self._low) / (last - first)  # ticks of a radian (metre)
        names = [joint.name for joint in robot.joints]
        self._joints = np.array([names.index(motor.joint) for motor in motors])
        self._n = robot.n
        self._zero = kin.motors.q_from_readings(robot, 0.5 * (first + last))
        q = kin.motors.q_from_readings(robot, kin.motors.readings_from_ticks(motors, ticks))
        turns = np.round((q - self.q(ticks)) / TAU)
        self._zero += TAU * np.where(robot.revolute & (q >= robot.lower) & (q <= robot.upper), turns, 0.0)
        ends = [self._each(end) for end in (self._low, self._high)]
        self.limits = (
            np.array([np.minimum(*ends)[self._joints == j].max() for j in range(self._n)]),
            np.array([np.maximum(*ends)[self._joints == j].min() for j in range(self._n)]),
        )

    def _each(self, ticks: Array) -> Array:
        """What each motor says of its joint ``(m,)``."""
        found: Array = self._zero[self._joints] + (ticks - self._middle) / self._slope
        return found

    def q(self, ticks: Array) -> Array:
        """The configuration ``(n,)`` at these ticks ``(m,)``; a joint with two motors has the mean of both."""
        each = self._each(ticks)
        return np.array([each[self._joints == j].mean() for j in range(self._n)])

    def ticks(self, q: Array) -> Array:
        """The goals of the servos ``(m,)`` for a configuration ``(n,)``, whole numbers within their ranges."""
        goals = self._middle + self._slope * (q - self._zero)[self._joints]
        found: Array = np.rint(np.clip(goals, *self._ends))
        return found
