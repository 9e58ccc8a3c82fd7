"""An arm that is sent along: the fields of a robot file as a JSON object."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from pydantic import ConfigDict, Field, RootModel

from app.api.problems import ProblemError, invalid
from app.shared.problems import FieldError
from kin import Robot, RobotFileError, robot_from_dict
from kin.files.numbers import LARGEST
from kin.files.read import ANGLES, MAX_CAPSULES, MAX_MOTORS, MAX_ROWS
from kin.motor import LARGEST_ID, MOST_TICKS, MOTOR_UNITS
from kin.robot import LENGTHS, MOUNTINGS

# What a file must state and an arm in a request need not.
DEFAULTS = {"id": "sent", "name": "Sent arm", "source": "the request"}
SCALES = {**ANGLES, **LENGTHS, "°": ANGLES["deg"]}

_TEXT = {"type": "string", "minLength": 1, "maxLength": 4000, "pattern": r"\S"}
# Digits before the point of a number smaller than a million radians or metres, in each unit.
_DIGITS = {unit: math.floor(math.log10(LARGEST / scale)) for unit, scale in SCALES.items()}


def _number(units: Iterable[str]) -> dict[str, Any]:
    """A number in the unit of the file, which is one of these; the reader knows which and bounds it by that."""
    most = max(LARGEST / SCALES[unit] for unit in units)
    return {"type": "number", "exclusiveMinimum": -most, "exclusiveMaximum": most}


def _decimal(digits: int) -> str:
    """Decimals that are smaller than ten to the power of `digits`, even after rounding."""
    return (
        rf"[-+]?(([0-9]{{1,{digits}}}(\.[0-9]{{0,{15 - digits}}})?"
        rf"|[0-9]{{1,{digits - 1}}}\.[0-9]{{{16 - digits},24}}|\.[0-9]{{1,24}})([eE]-[0-9]{{1,3}})?"
        rf"|[0-9](\.[0-9]{{0,9}})?[eE]\+?0?[0-{digits - 1}])"
    )


def _quantity(units: Sequence[str], description: str) -> dict[str, Any]:
    """A number in the unit of the file, or a text with a unit of its own."""
    example = "-90 deg" if "rad" in units else "0.13 m"
    alike = {
        digits: "|".join(u for u in units if _DIGITS[u] == digits) for digits in (_DIGITS[unit] for unit in units)
    }
    texts = "|".join(f"{_decimal(digits)} ?({names})" for digits, names in alike.items())
    text = {"type": "string", "pattern": f"^({texts})$", "examples": [example]}
    return {"description": description, "anyOf": [_number(units), text]}


def _items(item: dict[str, Any], count: int, description: str = "") -> dict[str, Any]:
    schema = {"type": "array", "items": item, "minItems": count, "maxItems": count}
    return schema | ({"description": description} if description else {})


_ANGLE, _LENGTH = ("rad", "deg", "°"), tuple(LENGTHS)
_ANY = _quantity((*_ANGLE, *_LENGTH), "A value in the units of this object, or a text with its unit.")
_MATRIX = _items(_items(_ANY, 4), 4, "4×4 homogeneous transform, row by row; positions in the length unit.")
_TRANSFORM: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "properties": {
        "xyz": _items(_quantity(_LENGTH, "A length."), 3, "Translation in the length unit."),
        "rpy": _items(
            _quantity(_ANGLE, "An angle."), 3, "Roll, pitch, yaw in the angle unit: Rz(yaw) Ry(pitch) Rx(roll)."
        ),
        "matrix": _MATRIX,
    },
}
_ROW: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "properties": {
        "name": {"type": "string", "maxLength": 4000, "description": "Name of the row, different for each."},
        "kind": {"enum": ["revolute", "prismatic", "fixed"], "description": "By default revolute."},
        "theta": _quantity(_ANGLE, "Rotation about z, 0 by default."),
        "d": _quantity(_LENGTH, "Translation along z, 0 by default."),
        "a": _quantity(_LENGTH, "Translation along x, 0 by default."),
        "alpha": _quantity(_ANGLE, "Rotation about x, 0 by default."),
        "follows": {
            **_TEXT,
            "description": "Name of the row whose joint moves this one; without it the row is a joint itself.",
        },
        "ratio": {
            "description": "By how many times that joint's value it moves, rad (m) for each; 1 by default.",
            "anyOf": [_number(["m"]), {"type": "string", "maxLength": 80}],
        },
        "sign": {"enum": [1, -1], "description": "-1: a pendant counts this joint backwards. 1 by default."},
        "limits": {
            "description": "[lower, upper]; by default ±180° or 0 to 1 m. `none`: an unlimited revolute joint.",
            "anyOf": [_items(_ANY, 2), {"const": "none"}],
        },
        "velocity": {
            "description": "Largest speed, per second; smaller than a million radians or metres per second.",
            "anyOf": [_number(_LENGTH), {"type": "string"}],
        },
        "acceleration": {
            "description": "Largest acceleration, per s²; smaller than a million radians or metres per s².",
            "anyOf": [_number(_LENGTH), {"type": "string"}],
        },
        "jerk": {
            "description": "Largest jerk, per s³; smaller than a million radians or metres per s³.",
            "anyOf": [_number(_LENGTH), {"type": "string"}],
        },
        "effort": {"description": "Largest torque or force in N·m or N.", **_number(["m"]), "exclusiveMinimum": 0},
    },
}
_ROWS: dict[str, Any] = {
    "type": "array",
    "minItems": 1,
    "maxItems": MAX_ROWS,
    "items": _ROW,
    "description": "The DH rows from base to tool; at least one moves.",
}
_POINT = _items(_quantity(_LENGTH, "A length."), 3, "A point in the frame of the row, in the length unit.")
_CAPSULE: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "required": ["start", "radius"],
    "properties": {
        "row": {"type": "string", "maxLength": 4000, "description": "Name of the row; none: what stands still."},
        "start": {**_POINT, "description": "Start of the axis, in the frame of the row."},
        "end": {**_POINT, "description": "End of the axis; without it the body is a sphere."},
        "radius": _quantity(_LENGTH, "Radius, positive."),
        "assumed": {"type": "boolean", "description": "Whether the real body is not known."},
    },
}
EXAMPLE: dict[str, Any] = {  # the table of pioneer5, so that the examples for it work here too
    "convention": "standard",
    "units": {"length": "mm", "angle": "deg"},
    "rows": [
        {"name": "rotating base", "d": 130, "a": 70, "alpha": -90, "limits": [0, 180]},
        {"name": "rotating elbow", "a": 160, "limits": [0, 150]},
        {"name": "pivoting elbow", "theta": -90, "alpha": -90, "limits": [0, 150]},
        {"name": "rotating wrist", "d": 140, "alpha": 90, "limits": [0, 85]},
        {"name": "pivoting wrist", "alpha": -90, "limits": [15, 45]},
        {"name": "tool", "kind": "fixed", "d": 120},
    ],
    "home": {"q": [90, 30, 60, 30, 30]},
}
_TICKS = {"type": "integer", "minimum": -(2**31), "maximum": 2**31}
_MOTOR: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "required": ["id"],
    "properties": {
        "joint": {**_TEXT, "description": "Name of the row that it moves; none: the motor of a gripper, say."},
        "id": {"type": "integer", "minimum": 0, "maximum": LARGEST_ID, "description": "Its number on the bus."},
        "name": {**_TEXT, "description": "What its bus calls it, by default the name of the joint."},
        "sign": {"enum": [1, -1], "description": "-1: it counts backwards. 1 by default."},
        "offset": {**_number(["m"]), "description": "Its reading where the joint value is zero, 0 by default."},
        "unit": {"enum": list(MOTOR_UNITS), "description": "Unit of its readings and its offset, by default deg."},
        "ticks": {
            "type": "integer",
            "minimum": 2,
            "maximum": MOST_TICKS,
            "description": "Of a turn, 4096 by default.",
        },
        "lead": _quantity(_LENGTH, "Length that a slide moves in a turn, positive; for slides only."),
        "range": _items(_TICKS, 2, "Ticks at both ends of LeRobot's calibrated range, the lower one first."),
        "drive_mode": {"enum": [0, 1], "description": "1: the calibrated range is turned round."},
        "homing_offset": {**_TICKS, "description": "As LeRobot's calibration states it, 0 by default."},
    },
}
MOTORS: dict[str, Any] = {
    "type": "array",
    "maxItems": MAX_MOTORS,
    "items": _MOTOR,
    "description": "What the motors of the joints read: offset + sign · q, with q in the motor's unit.",
}
_SCHEMA: dict[str, Any] = {
    "type": "object",
    "description": "An arm as the fields of a robot file: a DH table with its units. `id`, `name` and `source` "
    "are optional here.",
    "additionalProperties": False,
    "required": ["convention", "units", "rows"],
    "properties": {
        "id": {"type": "string", "pattern": "^[a-z0-9][a-z0-9-]{0,39}$", "description": "Short name."},
        "name": {**_TEXT, "description": "Display name."},
        "source": {**_TEXT, "description": "Source of the numbers."},
        "description": {"type": "string", "maxLength": 4000, "description": "Short description of the arm."},
        "maker": {"type": "string", "maxLength": 4000, "description": "Who builds the arm."},
        "payload": {"type": "number", "exclusiveMinimum": 0, "description": "What it may carry, in kg."},
        "mass": {"type": "number", "exclusiveMinimum": 0, "description": "What it weighs, in kg."},
        "convention": {
            "enum": ["standard", "modified"],
            "description": "standard: Rz(θ) Tz(d) Tx(a) Rx(α). modified (Craig): Rx(α) Tx(a) Rz(θ) Tz(d).",
        },
        "units": {
            "type": "object",
            "description": "The units of all numbers in this object.",
            "additionalProperties": False,
            "required": ["length", "angle"],
            "properties": {
                "length": {"enum": list(LENGTHS), "description": "Unit of lengths."},
                "angle": {"enum": ["deg", "rad"], "description": "Unit of angles."},
            },
        },
        "rows": _ROWS,
        "home": {
            "type": "object",
            "additionalProperties": False,
            "required": ["q"],
            "properties": {"q": {"type": "array", "items": _ANY, "description": "One value per moving joint."}},
            "description": "The home configuration, inside the limits; chosen by the service if it is missing.",
        },
        "capsules": {
            "type": "array",
            "maxItems": MAX_CAPSULES,
            "items": _CAPSULE,
            "description": "Bodies of the links, for collisions; without any, bodies are assumed from the table.",
        },
        "capsules_source": {**_TEXT, "description": "Source of the bodies."},
        "mounting": {
            "enum": list(MOUNTINGS),
            "description": "What the arm is mounted on, for drawings. How it is turned, `base` states.",
        },
        "floor": _quantity(_LENGTH, "Height of the floor in the world frame, in the length unit, for drawings."),
        "motors": MOTORS,
        "pendant": {
            "type": "object",
            "maxProperties": MAX_ROWS,
            "additionalProperties": {"type": "object", "maxProperties": MAX_ROWS + 1},
            "description": "By joint, what its pendant shows: how many times joints count, and `offset`.",
        },
        "ros_joints": {
            "type": "object",
            "maxProperties": MAX_ROWS,
            "additionalProperties": _TEXT,
            "description": "By joint, its name in the published description for ROS.",
        },
        "base": {**_TRANSFORM, "description": "Constant transform before the first row."},
        "tool": {**_TRANSFORM, "description": "Constant transform after the last row."},
        "nominal": {
            "type": "object",
            "additionalProperties": False,
            "required": ["rows"],
            "properties": {"rows": _ROWS, "tool": _TRANSFORM},
            "description": "The table from which the arm was calibrated, with the same rows that move: it "
            "decides which links are compared, and names postures.",
        },
    },
}


class RobotDescription(RootModel[dict[str, Any]]):
    """An arm as the fields of a robot file; `robot` reads it and explains errors."""

    model_config = ConfigDict(frozen=True, json_schema_extra=lambda schema: schema.update(_SCHEMA))

    def robot(self, field: str = "robot") -> Robot:
        """The arm; raises 422 naming the field, which is a part of this one."""
        try:
            return robot_from_dict({**DEFAULTS, **self.root}, "robot")
        except RobotFileError as error:
            raise invalid_file(error, field) from None


def invalid_file(error: RobotFileError, prefix: str) -> ProblemError:
    """422 for an error in a description or file that was sent."""
    field = prefix if error.field in ("file", "robot", prefix) else f"{prefix}.{error.field}"
    hint = "docs/robot-files.md lists the fields of a robot."
    return invalid(FieldError(field=field, value=error.value, expected=error.expected), hint=hint)


SENT = Field(description="The arm itself, as the fields of a robot file.")
