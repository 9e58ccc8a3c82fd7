"""Writes robots: `Robot` → the fields of a robot file as a dict → TOML.

Reading what was written gives an equal robot, bit by bit; what could not be read is not written. Not every number
has a decimal that becomes exactly it when it is multiplied by π/180; such a value is written with its own unit,
``"2.8973 rad"``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from kin.errors import InputError
from kin.files.numbers import scaled
from kin.files.read import ANGLES, PER, UNLIMITED, Reader
from kin.frames import matrix_of
from kin.joint import Shown
from kin.motor import STS3215, Motor
from kin.named import robot_of
from kin.parsing import to_toml
from kin.robot import IDENTITY, LENGTHS, Capsule, Joint, Matrix, Robot, exact_cos_sin
from kin.transforms import Array
from kin.units import Length

Angle = Literal["deg", "rad"]
Value = int | float | str
_DIGITS = (12, 15, 16, 17)  # tried in this order


def robot_to_dict(robot: Robot | str, length: Length | None = None, angle: Angle = "deg") -> dict[str, Any]:
    """The robot as the fields of a robot file; `robot_from_dict` reads them.

    Args:
        robot: the arm, or the id of a built-in one.
        length: the unit of lengths; by default that of the robot. Read again, the robot has this unit.
        angle: the unit of angles.

    Returns:
        A dict of plain values, as TOML and JSON have them.

    Raises:
        InputError: an unknown unit, or an arm that no robot file may describe, such as one with a slide without
            limits or two rows of one name; the field is that of the file, e.g. ``rows[2].limits``.

    Examples:
        >>> import kin
        >>> kin.robot_to_dict("ur5")["convention"]
        'standard'
    """
    robot = robot_of(robot)
    length = length or robot.units  # type: ignore[assignment]  # checked by Robot
    for field, unit, valid in (("length", length, LENGTHS), ("angle", angle, ANGLES)):
        if unit not in valid:
            raise InputError(field, unit, "one of " + ", ".join(valid))
    data = _Writer(str(length), angle).robot(robot)
    _Proof("robot").robot(data)
    return data


def robot_to_toml(robot: Robot | str, length: Length | None = None, angle: Angle | None = None) -> str:
    """The robot as the text of a robot file; see `robot_to_dict`. By default angles are in the shorter unit.

    Args:
        robot: the arm, or the id of a built-in one.
        length: unit of lengths, ``"m"`` or ``"mm"``; by default that of the robot.
        angle: unit of angles, ``"deg"`` or ``"rad"``; by default the one that needs fewer digits.

    Returns:
        The text; `load_robot` reads it.

    Raises:
        InputError: as in `robot_to_dict`.

    Examples:
        >>> import kin
        >>> print(kin.robot_to_toml("planar2r").splitlines()[0])
        id = "planar2r"
    """
    if angle is None:
        in_degrees, in_radians = (robot_to_toml(robot, length, unit) for unit in get_args(Angle))
        return in_degrees if len(in_degrees) <= len(in_radians) else in_radians
    return to_toml(robot_to_dict(robot, length, angle))


def save_robot(robot: Robot | str, path: Path | str) -> None:
    """Write a robot file; an existing file is replaced.

    Args:
        robot: the arm, or the id of a built-in one.
        path: of the file to write.

    Raises:
        InputError: as in `robot_to_dict`, or `path` is no path.
        OSError: the file cannot be written.

    Examples:
        >>> import kin, tempfile, pathlib
        >>> kin.save_robot("scara", pathlib.Path(tempfile.mkdtemp()) / "scara.toml")
    """
    Path(path).write_text(robot_to_toml(robot), encoding="utf-8")


class _Proof(Reader):
    """Reads what was written, so that nothing is written that cannot be read."""

    def refuse(self, field: str, value: object, expected: str) -> InputError:
        return InputError(field, value, expected)

    def text(self, data: dict[str, Any], key: str, default: str | None = None, where: str = "") -> str:
        found = super().text(data, key, default, where)
        if found != data.get(key, default):
            raise self.refuse(where + key, data[key], "a text without spaces at its ends")
        return found


class _Writer:
    """Writes the fields in these units."""

    def __init__(self, length: str, angle: str) -> None:
        self.units = {"length": length, "angle": angle}

    def robot(self, robot: Robot) -> dict[str, Any]:
        data: dict[str, Any] = {"id": robot.id, "name": robot.name}
        if robot.description:
            data["description"] = robot.description
        if robot.maker:
            data["maker"] = robot.maker
        data |= {key: _plain(weight) for key in ("payload", "mass") if (weight := getattr(robot, key)) is not None}
        data |= {"source": robot.source, "convention": robot.convention, "units": self.units}
        for key, T in (("base", robot.base), ("tool", robot.tool)):
            if T != IDENTITY:
                data[key] = self.transform(T)
        if robot.mounting is not None:
            data["mounting"] = robot.mounting
        if robot.floor is not None:
            data["floor"] = self.value(robot.floor, True)
        data["rows"] = [self.row(row) for row in robot.rows]
        pairs = zip(robot.joints, robot.home, strict=True)
        data["home"] = {"q": [self.value(value, joint.kind == "prismatic") for joint, value in pairs]}
        if shown := [each for each in robot.pendant if self.is_known(robot, each)]:
            data["pendant"] = {each.joint: self.shown(robot, each) for each in shown}
        names = {joint.name for joint in robot.joints}
        if called := {joint: name for joint, name in robot.ros_joints if joint in names}:
            data["ros_joints"] = called
        if robot.motors:
            data["motors"] = [self.motor(each) for each in robot.motors]
        if robot.capsules:
            if robot.capsules_source:
                data["capsules_source"] = robot.capsules_source
            data["capsules"] = [self.capsule(robot, each) for each in robot.capsules]
        if robot.nominal is not None and robot.nominal_arm is not None:
            data["nominal"] = {"rows": [self.row(row) for row in robot.nominal.rows]}
            if robot.nominal.tool != IDENTITY:
                data["nominal"]["tool"] = self.transform(robot.nominal.tool)
        return data

    @staticmethod
    def is_known(robot: Robot, shown: Shown) -> bool:
        """Whether all that an entry of the pendant names are joints."""
        return {shown.joint, *(name for name, _ in shown.parts)} <= {joint.name for joint in robot.joints}

    def shown(self, robot: Robot, shown: Shown) -> dict[str, Any]:
        """What a pendant shows of a joint."""
        slides = next(joint.kind == "prismatic" for joint in robot.joints if joint.name == shown.joint)
        parts: dict[str, Any] = {name: _plain(share) for name, share in shown.parts}
        return parts | {"offset": self.value(shown.offset, slides)} if shown.offset else parts

    def capsule(self, robot: Robot, capsule: Capsule) -> dict[str, Any]:
        """The row is left out for what stands still, the end of a ball, too."""
        data: dict[str, Any] = {} if capsule.row < 0 else {"row": robot.rows[capsule.row].name}
        data["start"] = [self.value(x, True) for x in capsule.start]
        if capsule.end != capsule.start:
            data["end"] = [self.value(x, True) for x in capsule.end]
        data["radius"] = self.value(capsule.radius, True)
        return data | {"assumed": True} if capsule.assumed else data

    def motor(self, motor: Motor) -> dict[str, Any]:
        """Joint, id, sign, offset and unit; what is not stated or the default is left out."""
        data: dict[str, Any] = {"joint": motor.joint} if motor.joint else {}
        if motor.name != motor.joint:
            data["name"] = motor.name
        data |= {"id": motor.id, "sign": motor.sign, "offset": _plain(motor.offset), "unit": motor.unit}
        if motor.ticks != STS3215:
            data["ticks"] = motor.ticks
        if motor.lead is not None:
            data["lead"] = self.value(motor.lead, True)
        if motor.range is not None:
            data["range"] = list(motor.range)
        return data | {key: value for key in ("drive_mode", "homing_offset") if (value := getattr(motor, key))}

    def row(self, row: Joint) -> dict[str, Any]:
        """Fields that are zero or the default are left out."""
        data: dict[str, Any] = {"name": row.name}
        if row.kind != "revolute":
            data["kind"] = row.kind
        for key in ("theta", "d", "a", "alpha"):
            if value := getattr(row, key):
                data[key] = self.value(value, key in ("d", "a"))
        if row.kind == "fixed":
            return data
        slides = row.kind == "prismatic"
        if row.follows:
            data |= {"follows": row.follows, "ratio": _plain(row.ratio)}
        if not row.follows or row.limits is not None:
            data["limits"] = UNLIMITED if row.limits is None else [self.value(v, slides) for v in row.limits]
        for key, per in PER.items():
            if (largest := getattr(row, key)) is not None:
                data[key] = self.value(largest, slides, per)
        if row.effort is not None:
            data["effort"] = _plain(row.effort)
        return data

    def transform(self, T: Matrix) -> dict[str, Any]:
        """As xyz and rpy if they give exactly this matrix, else as the matrix."""
        place = [row[3] for row in T[:3]]
        xyz = [self.value(value, True) for value in place]
        for rpy in _candidates(rpy_of(T)):
            if matrix_of(place, rpy) == T:
                return {"xyz": xyz, "rpy": [self.value(angle, False) for angle in rpy]}
        rows = [[*map(_plain, row[:3]), value] for row, value in zip(T[:3], xyz, strict=True)]
        return {"matrix": [*rows, [0, 0, 0, 1]]}

    def value(self, value: float, is_length: bool, per: str = "") -> Value:
        """A length or an angle as the number, or text with its own unit, that is read as exactly this value."""
        scale = LENGTHS[self.units["length"]] if is_length else ANGLES[self.units["angle"]]
        guess = value / scale
        for digits in _DIGITS:
            number = float(f"{guess:.{digits}g}")
            if scaled(number, scale) == value:
                return _plain(number)
        for number in (math.nextafter(guess, math.inf), math.nextafter(guess, -math.inf)):
            if scaled(number, scale) == value:
                return _plain(number)
        return f"{value!r} {'m' if is_length else 'rad'}{per}"


def rpy_of(T: Matrix | Array) -> tuple[float, float, float]:
    """Roll, pitch and yaw with ``R = Rz(yaw) Ry(pitch) Rx(roll)``.

    Yaw is computed from what the roll leaves of the rotation: near a pitch of ±90° each of them alone is badly
    defined, but their sum or difference is not.
    """
    pitch = math.atan2(-T[2][0], math.hypot(T[0][0], T[1][0]))
    roll = math.atan2(T[2][1], T[2][2]) if math.hypot(T[2][1], T[2][2]) > 1e-15 else 0.0
    c, s = exact_cos_sin(roll)
    return roll, pitch, math.atan2(s * T[0][2] - c * T[0][1], c * T[1][1] - s * T[1][2])


def _candidates(rpy: Sequence[float]) -> Iterator[list[float]]:
    """The angles without the rounding of the matrix they come from: round degrees, round radians, as they are."""
    for unit in ANGLES.values():
        yield [float(f"{angle / unit:.12g}") * unit for angle in np.round(rpy, 15)]
    yield list(rpy)


def _plain(value: float) -> int | float:
    """A whole number without its decimal point."""
    return int(value) if value == int(value) and abs(value) < 1e6 else value
