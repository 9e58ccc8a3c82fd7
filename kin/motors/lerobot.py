"""LeRobot's calibration files: for each motor of a bus its id, drive mode, homing offset and calibrated range.

LeRobot writes one JSON file for each arm, such as ``calibration/robots/so101_follower/my_arm.json``. It states
where the range of each motor begins and ends in ticks, and nothing about the zero of a model.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from kin.errors import InputError
from kin.motor import Motor, MotorUnit, checked_motors, fit_joints
from kin.named import robot_of
from kin.parsing import Limits, TextError, read_json
from kin.robot import Robot

_FIELDS = ("id", "drive_mode", "homing_offset", "range_min", "range_max")
_OLDER = {"motor_names", "calib_mode", "start_pos", "end_pos"}
_MOST = 64  # motors
_GRIPPER = "gripper"
_LIMITS = Limits(100_000, 2000, 4)  # of a file


def motors_from_lerobot(
    robot: Robot | str, calibration: str | Mapping[str, Any], unit: MotorUnit = "deg"
) -> tuple[Motor, ...]:
    """The motors that a calibration of LeRobot describes.

    A motor belongs to the joint of its name; capitals, spaces and ``_`` do not count. Otherwise it belongs to the
    joint named like its id. One without a joint, such as that of a gripper, moves nothing. If the arm already has
    a motor of that name, it keeps its joint, sign, zero and unit. The reading of a gripper is from 0 to 100 in any
    case: LeRobot normalises it so whatever the unit of the others.

    Args:
        robot: the arm, or the id of a built-in one.
        calibration: the text of the JSON file, or what it says.
        unit: of the readings of new motors, as LeRobot's configuration sets it: "deg" with ``use_degrees``.

    Returns:
        The motors, in the order of the file.

    Raises:
        InputError: no calibration of LeRobot's, none of its motors is named like a joint, or one that is named
            like none while a joint has no motor.

    Examples:
        >>> import kin
        >>> pan = {"id": 1, "drive_mode": 0, "homing_offset": -12, "range_min": 740, "range_max": 3331}
        >>> motors = kin.motors.motors_from_lerobot("so101", {"shoulder_pan": pan})
        >>> motors[0].joint, motors[0].range
        ('shoulder pan', (740, 3331))
    """
    robot = robot_of(robot)
    table = _table(calibration)
    joints = {_plain(joint.name): joint for joint in robot.joints}
    known = {_plain(motor.name): motor for motor in robot.motors}
    motors = []
    for name, entry in table.items():
        given = _entry(name, entry)
        low, high = given.pop("range_min"), given.pop("range_max")
        given["range"] = (low, high)
        try:
            motor = known.get(_plain(name))
            if motor is None:
                joint = joints.get(_plain(name)) or joints.get(str(given["id"]))
                motor = Motor(joint.name if joint else "", given["id"], name, unit=unit, range=given["range"])
            if not motor.joint and _plain(name) == _GRIPPER:
                given["unit"] = "range_0_100"
            motors.append(replace(motor, name=name, **given))
        except InputError as error:
            raise error.within(f"calibration.{name}") from None
    if not any(motor.joint for motor in motors):
        names = "one motor at least that is named like a joint: " + ", ".join(joint.name for joint in robot.joints)
        raise InputError("calibration", list(table), names)
    found = checked_motors(motors)
    _refuse_unknown(found, robot)
    fit_joints(found, {joint.name: joint.kind == "prismatic" for joint in robot.joints})
    return found


def _refuse_unknown(motors: Sequence[Motor], robot: Robot) -> None:
    """Raises `InputError` for a motor that is named like no joint while a joint has no motor."""
    moved = {motor.joint for motor in motors}
    missing = [joint.name for joint in robot.joints if joint.name not in moved]
    for motor in motors:
        if missing and not motor.joint and _plain(motor.name) != _GRIPPER:
            near = difflib.get_close_matches(motor.name, missing, 1)
            expected = f"the name of a joint that has no motor: {', '.join(missing)}"
            meant = f"; perhaps {near[0]}" if near else ""
            raise InputError(f"calibration.{motor.name}", motor.name, expected + meant)


def motors_to_lerobot(robot: Robot | str) -> dict[str, dict[str, int]]:
    """The calibration of an arm's motors, as LeRobot reads it.

    Args:
        robot: the arm, or the id of a built-in one; its motors have a calibrated `range`.

    Returns:
        A dict from the motor's name to the fields of LeRobot's ``MotorCalibration``; ``json.dumps(…, indent=4)``
        gives LeRobot's file.

    Raises:
        InputError: no motors, one without a range, or two of one name.

    Examples:
        >>> import dataclasses, kin
        >>> motor = kin.motors.Motor("shoulder pan", 1, "shoulder_pan", range=(740, 3331))
        >>> arm = dataclasses.replace(kin.get_robot("so101"), motors=[motor])
        >>> kin.motors.motors_to_lerobot(arm)["shoulder_pan"]
        {'id': 1, 'drive_mode': 0, 'homing_offset': 0, 'range_min': 740, 'range_max': 3331}
    """
    robot = robot_of(robot)
    if not robot.motors:
        raise InputError("motors", "none", "an arm with motors")
    table: dict[str, dict[str, int]] = {}
    for i, motor in enumerate(robot.motors):
        if motor.range is None:
            raise InputError(f"motors[{i}].range", None, "the two ends of the calibrated range in ticks")
        if motor.name in table:
            raise InputError(f"motors[{i}].name", motor.name, "a name that no other motor has")
        values = (motor.id, motor.drive_mode, motor.homing_offset, *motor.range)
        table[motor.name] = dict(zip(_FIELDS, values, strict=True))
    return table


def _table(calibration: str | Mapping[str, Any]) -> Mapping[str, Any]:
    expected = "LeRobot's calibration: for each motor the fields " + ", ".join(_FIELDS)
    if isinstance(calibration, str):
        try:
            calibration = read_json(calibration, _LIMITS)
        except TextError as error:
            given, valid = (calibration, expected) if error.syntax else (error.value, error.expected)
            raise InputError("calibration", given, valid) from None
    if not isinstance(calibration, Mapping) or not calibration:
        raise InputError("calibration", calibration, expected)
    if _OLDER & set(calibration):
        newer = "; this is an older format of LeRobot: calibrate the arm again with a newer version"
        raise InputError("calibration", list(calibration), expected + newer)
    if len(calibration) > _MOST:
        raise InputError("calibration", f"{len(calibration)} motors", f"at most {_MOST}")
    return calibration


def _entry(name: object, entry: object) -> dict[str, Any]:
    if not isinstance(name, str) or not name.strip():
        raise InputError("calibration", name, "the name of a motor")
    where = f"calibration.{name}"
    if not isinstance(entry, Mapping):
        raise InputError(where, entry, "a table with " + ", ".join(_FIELDS))
    for key in entry:
        if key not in _FIELDS:
            raise InputError(f"{where}.{key}", entry[key], "only the fields " + ", ".join(_FIELDS))
    for key in _FIELDS:
        value = entry.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value % 1:
            raise InputError(f"{where}.{key}", value, "a whole number")
    return {key: int(entry[key]) for key in _FIELDS}


def _plain(name: str) -> str:
    """A name as it is compared."""
    return re.sub(r"[\W_]+", "", name).casefold()
