"""Sign and zero of each motor, from the readings in a few poses.

In pose i, where the joint value is qᵢ, a motor reads ``rᵢ = offset + sign · scale · qᵢ``. For either sign, the
differences ``rᵢ / scale − sign · qᵢ`` would all be the zero. It is their mean (least squares), on the circle where
readings begin again after a turn. With the right sign they agree, but for the care with which the arm was put into
the poses; with the wrong one they are as far apart as twice the way that the joint has moved. Where they agree for
both signs, the joint has moved too little, or half a turn. If they agree for none, something else is wrong. The
most frequent faults are tried: another unit, the motor of another joint, one pose or reading, a gear.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kin.angles import TURN, images_near
from kin.errors import InputError
from kin.motor import Motor, MotorUnit
from kin.motors.findings import MotorFinding, MotorMatch
from kin.motors.joints import moving_motors, of_moving
from kin.motors.words import sentence
from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import Array, finite_array

TOLERANCE = math.radians(10.0)  # of a joint that is put into a pose by hand
_SLIDE = 0.15  # the same for a slide, relative to the way that it moves
_CLEARER = 2.0  # times as far from the right zero are the readings with the wrong sign, or more
_SAME_SCALE = 0.1  # relative difference of two scales that may be the same one
_STILL = 0.2  # share of the joint's way below which a reading has not changed
_OTHER_UNITS: tuple[MotorUnit, ...] = ("deg", "rad", "ticks")


def match_motors(
    robot: Robot | str,
    q: ArrayLike,
    readings: ArrayLike,
    motors: Sequence[Motor] | None = None,
    tolerance: float = TOLERANCE,
) -> MotorMatch:
    """Sign and zero of the motors of an arm, from what they read in two poses or more.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(k, n)`` joint values of the poses, radians (metres). `motor_poses` proposes some.
        readings: ``(k, m)`` in these poses, of each motor that moves a joint, or of every motor, in their order
            and units. Those that begin again after a turn may have done so.
        motors: whose signs and zeros are not known; by default those of the arm.
        tolerance: how far from a pose, in radians, the arm may have been put. Of a slide, its share of what the
            slide moves counts, 15 % for 10°.

    Returns:
        The motors with their signs and zeros, and what is wrong with those that contradict themselves.

    Raises:
        InputError: arrays of another shape or that are not finite, fewer than two poses, or no motors.

    Examples:
        >>> import kin, numpy as np
        >>> arm = kin.get_robot("planar2r")
        >>> motors = [kin.motors.Motor("shoulder", 1), kin.motors.Motor("elbow", 2)]
        >>> found = kin.motors.match_motors(arm, np.radians([[0, 0], [40, 60]]), [[91, 10], [50, 71]], motors)
        >>> print(found.findings[0].text)
        Motor 1, shoulder, counts backwards, its zero is at 90.5°.
    """
    robot = robot_of(robot)
    if not isinstance(tolerance, int | float) or not 0.0 < tolerance < 0.25 * math.pi:
        raise InputError("tolerance", tolerance, "radians above 0 and below π/4")
    moving = moving_motors(robot, motors)
    given = robot.motors if motors is None else tuple(motors)
    poses, values = finite_array("q", q, (None, robot.n)), of_moving(given, readings)
    for name, array in (("q", poses), ("readings", values)):
        if array.ndim != 2 or len(array) < 2 or len(array) != len(poses):
            wanted = f"two poses or more, and readings in each of them: ({max(len(poses), 2)}, {array.shape[-1]})"
            raise InputError(name, f"shape {array.shape}", wanted)
    look = _Look(robot, poses, values, moving, tolerance)
    found = [look.finding(k) for k in range(len(moving))]
    findings = tuple(replace(each, text=sentence(each)) for each in found)
    solved = {each.motor.id: each.motor for each in findings}
    return MotorMatch(findings, tuple(solved.get(motor.id, motor) for motor in given))


@dataclass(frozen=True, eq=False)
class _Fit:
    """One sign: the zero in the joint's unit, and how far the poses are from it ``(k,)``."""

    sign: int
    zero: float
    error: Array

    @property
    def worst(self) -> float:
        return float(np.abs(self.error).max())


@dataclass(frozen=True, eq=False)
class _Look:
    robot: Robot
    poses: Array
    values: Array
    motors: tuple[Motor, ...]
    tolerance: float

    def finding(self, k: int) -> MotorFinding:
        """What the readings say of motor k."""
        motor, q, r = self.motors[k], self._q(self.motors[k]), self.values[:, k]
        better, worse = _fits(motor, q, r)
        i, j = np.unravel_index(int(np.abs(q[:, None] - q[None]).argmax()), (len(q), len(q)))
        moved, read = abs(float(q[j] - q[i])), abs(float(_wrapped(motor, (r[j] - r[i]) / motor.scale)))
        made = MotorFinding(motor, "matched", None, tuple(better.error.tolist()), moved, read)
        slack = self._slack(motor, q)
        if worse.worst <= slack or (better.worst <= slack and worse.worst < _CLEARER * better.worst):
            half = moved > 0.25 * TURN and motor.lead is None
            return replace(made, status="undecided", cause="half turn" if half else "still")
        if better.worst <= slack:
            zero = _tidy(motor, better.zero * motor.scale)
            return replace(made, motor=replace(motor, sign=better.sign, offset=zero))
        return replace(made, status="contradiction", **self._cause(k, moved, read))

    def _cause(self, k: int, moved: float, read: float) -> dict[str, Any]:
        """Why the readings of motor k fit neither sign."""
        motor, q, r = self.motors[k], self._q(self.motors[k]), self.values[:, k]
        slope = _slope(q, r / motor.scale)
        for unit in _OTHER_UNITS:
            other = replace(motor, unit=unit)
            ratio = other.scale / motor.scale
            alike = abs(abs(slope) / ratio - 1.0) < _SAME_SCALE
            if (
                unit != motor.unit
                and abs(ratio - 1.0) > 2.0 * _SAME_SCALE
                and alike
                and self._decided(other, q, r)
            ):
                return {"cause": "unit", "unit": unit}
        spread = float(np.abs(_wrapped(motor, (r - r[0]) / motor.scale)).max())
        if spread <= _STILL * moved:
            return {"cause": "no change"}
        others = [
            each
            for each in self.motors
            if each.joint != motor.joint
            and (each.lead is None) == (motor.lead is None)
            and self._decided(motor, self._q(each), r)
        ]
        if len(others) == 1:
            return {"cause": "other motor", "other": others[0]}
        if len(q) > 2:
            fine = [i for i in range(len(q)) if self._decided(motor, np.delete(q, i), np.delete(r, i))]
            if len(fine) == 1:
                return {"cause": "pose", "pose": fine[0]}
            line = r / motor.scale - slope * q
            if np.abs(line - line.mean()).max() <= self._slack(motor, q) and abs(slope) > _STILL:
                return {"cause": "gear", "gear": abs(slope)}
        return {"cause": "readings"}

    def _decided(self, motor: Motor, q: Array, r: Array) -> bool:
        """Whether exactly one sign fits."""
        better, worse = _fits(motor, q, r)
        slack = self._slack(motor, q)
        return better.worst <= slack < worse.worst and worse.worst >= _CLEARER * better.worst

    def _q(self, motor: Motor) -> Array:
        return self.poses[:, [joint.name for joint in self.robot.joints].index(motor.joint)]

    def _slack(self, motor: Motor, q: Array) -> float:
        if motor.lead is None:
            return self.tolerance
        return max(_SLIDE * self.tolerance / TOLERANCE * float(np.ptp(q)), 1e-4)


def _fits(motor: Motor, q: Array, r: Array) -> tuple[_Fit, _Fit]:
    """The sign that fits better, and the other one."""
    fits = [_fit(motor, sign, r / motor.scale - sign * q) for sign in (1, -1)]
    better, worse = sorted(fits, key=lambda fit: fit.worst)
    return better, worse


def _fit(motor: Motor, sign: int, differences: Array) -> _Fit:
    """The mean of the differences; on the circle, if they do not agree without it and readings begin again."""
    zero = float(differences.mean())
    error = differences - zero
    if motor.begins_again and np.abs(error).max() > TOLERANCE:
        about = float(np.angle(np.exp(1j * differences).mean()))
        away = _wrapped(motor, differences - about)
        zero = about + float(away.mean())
        error = _wrapped(motor, differences - zero)
    return _Fit(sign, zero, error * sign)


def _wrapped(motor: Motor, values: Array) -> Array:
    """Differences without whole turns, where readings begin again."""
    return images_near(values) if motor.begins_again else values


def _slope(q: Array, r: Array) -> float:
    """The slope of the line through these points with the least squares."""
    away = q - q.mean()
    return float(away @ (r - r.mean())) / max(float(away @ away), 1e-12)


def _tidy(motor: Motor, zero: float) -> float:
    """A zero without rounding errors, of ticks as a servo counts them."""
    zero = float(f"{zero:.10g}")
    return zero % motor.ticks if motor.unit == "ticks" and motor.begins_again else zero
