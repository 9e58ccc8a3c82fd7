"""Readings of motors as joint values, joint values as readings, and ticks as LeRobot normalises them.

Ticks, degrees and radians begin again after a turn: an encoder on the shaft cannot tell how often the joint has
turned. A reading may mean several joint values. The one inside the limits counts. If none or several are inside,
it is the one nearest to the middle of the limits, or to zero without limits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from kin.angles import images_near
from kin.errors import InputError
from kin.motor import CALIBRATED, Motor, checked_motors, fit_joints
from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import Array, finite_array


def moving_motors(robot: Robot, motors: Sequence[Motor] | None = None) -> tuple[Motor, ...]:
    """The motors that move a joint of the arm, in their order; by default those of the arm itself.

    Raises:
        InputError: there is none, two have one id, or one does not fit its joint.
    """
    found = robot.motors if motors is None else checked_motors(motors)
    fit_joints(found, {joint.name: joint.kind == "prismatic" for joint in robot.joints})
    moving = tuple(motor for motor in found if motor.joint)
    if not moving:
        raise InputError(
            "motors", "none", "an arm with motors; a robot file states them, one table [[motors]] each"
        )
    return moving


def of_moving(motors: Sequence[Motor], readings: ArrayLike, field: str = "readings") -> Array:
    """Readings ``(..., m)`` of the motors that move a joint, from theirs alone or from those of all motors.

    What reads a bus has all of them: LeRobot gives six numbers of an SO-101, the last one of its gripper.

    Raises:
        InputError: naming `field`, for another number of readings, or what is not finite numbers.
    """
    try:
        values = finite_array(field, readings, (None,))
    except InputError as error:
        if error.field != field:
            raise
        raise InputError(field, readings, f"finite numbers: {counted(motors)}") from None
    moving = [k for k, motor in enumerate(motors) if motor.joint]
    if values.shape[-1] not in (len(moving), len(motors)):
        raise InputError(field, f"{values.shape[-1]} values", counted(motors))
    return values if values.shape[-1] == len(moving) else np.ascontiguousarray(values[..., moving])


def counted(motors: Sequence[Motor]) -> str:
    """How many readings these motors have, for an error: of those that move a joint, or of all."""
    moving = ", ".join(f"{motor.id} {motor.joint}" for motor in motors if motor.joint)
    others = ", ".join(f"{motor.id} {motor.name}".strip() for motor in motors if not motor.joint)
    count = sum(bool(motor.joint) for motor in motors)
    words = f"1 value, of motor {moving}" if count == 1 else f"{count} values, of motors {moving}"
    return f"{words}, or {len(motors)}, with {others} in its place" if others else words


def q_from_readings(robot: Robot | str, readings: ArrayLike) -> Array:
    """The configurations in which the motors of an arm have these readings.

    Args:
        robot: the arm, or the id of a built-in one; each of its joints has a motor.
        readings: ``(..., m)``, one of each motor that moves a joint, or of every motor, in the order of
            `Robot.motors` and in the motor's own unit.

    Returns:
        ``(..., n)`` joint values, radians (metres): the whole turn inside the limits is chosen. A joint with two
        motors has the mean of what they say.

    Raises:
        InputError: a joint without a motor, or readings of another shape or that are not finite.

    Examples:
        >>> import dataclasses, kin, numpy as np
        >>> shoulder = kin.motors.Motor("shoulder", 1, sign=-1, offset=90.0)
        >>> elbow = kin.motors.Motor("elbow", 2, offset=1024, unit="ticks")
        >>> arm = dataclasses.replace(kin.get_robot("planar2r"), motors=(shoulder, elbow))
        >>> np.degrees(kin.motors.q_from_readings(arm, [60.0, 2048])).round(3).tolist()
        [30.0, 90.0]
    """
    robot = robot_of(robot)
    motors = moving_motors(robot)
    values = of_moving(robot.motors, readings)
    names = [motor.joint for motor in motors]
    q = np.empty((*values.shape[:-1], robot.n))
    for j, joint in enumerate(robot.joints):
        columns = [k for k, name in enumerate(names) if name == joint.name]
        if not columns:
            raise InputError("motors", names, f"a motor of {joint.name}, too")
        q[..., j] = np.mean([joint_values(robot, j, motors[k], values[..., k]) for k in columns], axis=0)
    return q


def joint_values(robot: Robot, j: int, motor: Motor, readings: Array) -> Array:
    """Values ``(...)`` of joint j at readings ``(...)`` of its motor."""
    values: Array = motor.sign * (readings - motor.offset) / motor.scale
    if not motor.begins_again:
        return values
    low, high = robot.lower[j], robot.upper[j]
    middle = 0.5 * (low + high) if math.isfinite(low + high) else 0.0
    nearest = images_near(values, middle)
    return np.where((values >= low) & (values <= high) & np.isfinite(low + high), values, nearest)


def readings_from_q(robot: Robot | str, q: ArrayLike) -> Array:
    """What the motors of an arm read in configurations.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(..., n)`` radians (metres).

    Returns:
        ``(..., m)``, one of each motor that moves a joint, in the order of `Robot.motors` and in the motor's own
        unit. Ticks are whole numbers from 0 to one less than a turn has.

    Raises:
        InputError: an arm without motors, or values of another shape or that are not finite.

    Examples:
        >>> import dataclasses, kin, numpy as np
        >>> shoulder = kin.motors.Motor("shoulder", 1, sign=-1, offset=90.0)
        >>> elbow = kin.motors.Motor("elbow", 2, offset=1024, unit="ticks")
        >>> arm = dataclasses.replace(kin.get_robot("planar2r"), motors=(shoulder, elbow))
        >>> kin.motors.readings_from_q(arm, np.radians([30.0, 90.0])).round(9).tolist()
        [60.0, 2048.0]
    """
    robot = robot_of(robot)
    motors, q = moving_motors(robot), robot.check_q(q)
    names = [joint.name for joint in robot.joints]
    readings = np.empty((*q.shape[:-1], len(motors)))
    for k, motor in enumerate(motors):
        values = motor.offset + motor.sign * motor.scale * q[..., names.index(motor.joint)]
        readings[..., k] = (
            np.round(values) % motor.ticks if motor.unit == "ticks" and motor.begins_again else values
        )
    return readings


def readings_from_ticks(motors: Sequence[Motor], ticks: ArrayLike) -> Array:
    """The ticks of servos as readings, as LeRobot normalises them.

    Ticks are those that a servo sends: it has subtracted its homing offset. LeRobot's degrees begin in the middle
    of the calibrated range, and it counts 4095 ticks to their turn, so that they are a tick too large after one.

    Args:
        motors: with a calibrated `range`, unless they read ticks or radians.
        ticks: ``(..., m)``, one of each of these motors.

    Returns:
        ``(..., m)`` in the unit of each motor. A calibrated range ends at its ends.

    Raises:
        InputError: a motor without a range, or ticks of another shape or that are not finite.

    Examples:
        >>> import kin
        >>> motor = kin.motors.Motor("elbow", 3, unit="range_m100_100", range=(1000, 3000))
        >>> kin.motors.readings_from_ticks([motor], [[1000], [2500], [3900]]).tolist()
        [[-100.0], [50.0], [100.0]]
    """
    motors = checked_motors(motors)
    values = finite_array("ticks", ticks, (len(motors),))
    readings = np.empty_like(values)
    for k, motor in enumerate(motors):
        raw = values[..., k]
        if motor.unit == "ticks":
            readings[..., k] = raw
            continue
        low, high = _calibrated(k, motor)
        if span := CALIBRATED.get(motor.unit):
            part = (np.clip(raw, low, high) - low) / (high - low) * span
            readings[..., k] = (span - part if motor.drive_mode else part) - (100.0 if span > 100.0 else 0.0)
        else:
            readings[..., k] = (raw - 0.5 * (low + high)) * motor.turn / (motor.ticks - 1)
    return readings


def ticks_from_readings(motors: Sequence[Motor], readings: ArrayLike) -> Array:
    """The ticks that LeRobot sends to servos for these readings; for the reverse, see `readings_from_ticks`.

    Args:
        motors: with a calibrated `range`, unless they read ticks.
        readings: ``(..., m)``, one of each of these motors, in its unit.

    Returns:
        ``(..., m)`` whole numbers, rounded towards zero as LeRobot does; inside the range where the unit is one.
        In other units they may be outside it, or a turn away from where the servo is: what drives an arm compares
        them with both before it sends them.

    Raises:
        InputError: a motor without a range, or readings of another shape or that are not finite.

    Examples:
        >>> import kin
        >>> motor = kin.motors.Motor("elbow", 3, unit="range_m100_100", range=(1000, 3000))
        >>> kin.motors.ticks_from_readings([motor], [[-100.0], [50.0], [170.0]]).tolist()
        [[1000.0], [2500.0], [3000.0]]
    """
    motors = checked_motors(motors)
    values = finite_array("readings", readings, (len(motors),))
    ticks = np.empty_like(values)
    for k, motor in enumerate(motors):
        given = values[..., k]
        if motor.unit == "ticks":
            ticks[..., k] = np.trunc(given)
            continue
        low, high = _calibrated(k, motor)
        if span := CALIBRATED.get(motor.unit):
            part = np.clip(given + (100.0 if span > 100.0 else 0.0), 0.0, span)
            ticks[..., k] = np.trunc((span - part if motor.drive_mode else part) / span * (high - low) + low)
        else:
            ticks[..., k] = np.trunc(given * (motor.ticks - 1) / motor.turn + 0.5 * (low + high))
    return ticks


def _calibrated(k: int, motor: Motor) -> tuple[int, int]:
    if motor.range is None:
        raise InputError(f"motors[{k}].range", None, f"the calibrated range of motor {motor.id}, {motor.name}")
    return motor.range
