"""Expressions in robot files, angles in the wrong unit, and byte order marks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

import kin
from kin import RobotFileError
from kin.files.units import suspicious_angles

FILES = Path(__file__).parents[2] / "data" / "reports"


def fields(**row: object) -> dict[str, Any]:
    units = {"length": "mm", "angle": "deg"}
    base = {"id": "a", "name": "a", "source": "s", "convention": "standard", "units": units}
    return {**base, "rows": [{"a": 400, **row}]}


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("alpha", "-pi/2", -math.pi / 2),
        ("alpha", "90deg", math.pi / 2),
        ("alpha", "2*45", math.pi / 2),
        ("alpha", "1.5 rad", 1.5),
        ("theta", "π/4", math.pi / 4),
        ("d", "2*400", 0.8),
        ("d", "0.3 m + 10 mm", 0.31),
        ("d", "0,13 m", 0.13),
        ("velocity", "2*90 deg/s", math.pi),
        ("acceleration", "pi rad/s²", math.pi),
        ("jerk", "360/2", math.pi),
    ],
)
def test_expressions_are_read_as_everywhere_else(key, text, value):
    robot = kin.robot_from_dict(fields(**{key: text}))
    assert getattr(robot.rows[0], key) == pytest.approx(value, abs=1e-15)


def test_a_file_with_expressions_is_the_arm_of_their_values():
    robot = kin.load_robot(FILES / "pi.toml")
    assert robot.rows[0].alpha == -math.pi / 2
    assert kin.load_robot("\ufeff" + (FILES / "pi.toml").read_text(encoding="utf-8")) == robot


@pytest.mark.parametrize(
    ("key", "text", "reason"),
    [
        ("d", "90deg", "not a unit of a length"),
        ("alpha", "10 mm", "not a unit of an angle"),
        ("alpha", "pi/0", "divides by zero"),
        ("velocity", "2 rad/s2", "another unit of time"),
        ("alpha", "2 rad/s", "another unit of time"),
        ("d", "1e9*1e9", "smaller than a million"),
        ("d", "9" * 200, "too long"),
        ("d", "", "empty"),
    ],
)
def test_an_expression_without_a_value_names_its_field(key, text, reason):
    with pytest.raises(RobotFileError, match=reason) as caught:
        kin.robot_from_dict(fields(**{key: text}))
    assert caught.value.field == f"rows[0].{key}"


@pytest.mark.parametrize(
    ("name", "count", "words"),
    [
        ("urrad", 3, "alpha of row 1 (base) is 1.5708°, and 1.5708 rad is 90°: it was probably typed in radians."),
        ("urdeg", 3, "alpha of row 1 (base) is 90 rad, 14.3 turns: it was probably typed in degrees."),
        ("urlim", 6, "limits of row 1 (base) are −6.283° to 6.283°: they were probably typed in radians."),
    ],
)
def test_angles_in_the_other_unit_are_suspected(name, count, words):
    found = suspicious_angles(kin.load_robot(FILES / f"{name}.toml"))
    assert (found[0], len(found)) == (words, count)


def test_speeds_and_limits_in_the_other_unit_are_suspected():
    (slow,) = suspicious_angles(kin.robot_from_dict(fields(velocity=3.1416)))
    assert "rad/s is 180°/s" in slow
    (wide,) = suspicious_angles(kin.robot_from_dict(fields(limits=["-180 rad", "180 rad"])))
    assert wide == "limits of row 1 (joint 1) are −180 to 180 rad: they were probably typed in degrees."


@pytest.mark.parametrize("robot", kin.builtin_robots().values(), ids=lambda robot: robot.id)
def test_no_angle_of_a_built_in_arm_is_suspected(robot):
    assert suspicious_angles(robot) == []
