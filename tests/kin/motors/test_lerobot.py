"""LeRobot's calibration files, and its ways to normalise ticks, written here a second time with plain numbers."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kin
from kin import InputError
from kin.motors import Motor

SO101 = kin.get_robot("so101")
NAMES = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
FILE: dict[str, dict[str, int]] = {
    name: {
        "id": i + 1,
        "drive_mode": int(i == 3),
        "homing_offset": 100 * i - 250,
        "range_min": 0 if name == "wrist_roll" else 700 + 11 * i,
        "range_max": 4095 if name == "wrist_roll" else 3300 - 7 * i,
    }
    for i, name in enumerate(NAMES)
}


def normalized(raw: float, unit: str, low: int, high: int, reverse: bool) -> float:
    """A reading as LeRobot's ``MotorsBus`` computes it from ticks."""
    if unit == "deg":
        return (raw - (low + high) / 2) * 360 / 4095
    inside = min(high, max(low, raw))
    if unit == "range_0_100":
        value = (inside - low) / (high - low) * 100
        return 100 - value if reverse else value
    value = (inside - low) / (high - low) * 200 - 100
    return -value if reverse else value


def test_a_calibration_comes_in_and_goes_out_as_it_was():
    motors = kin.motors.motors_from_lerobot(SO101, json.dumps(FILE, indent=4))
    assert [motor.joint for motor in motors] == [*(joint.name for joint in SO101.joints), ""]
    assert [motor.name for motor in motors] == list(NAMES)
    robot = replace(SO101, motors=motors)
    assert kin.motors.motors_to_lerobot(robot) == FILE
    assert kin.motors.motors_to_lerobot(kin.load_robot(kin.robot_to_toml(robot))) == FILE
    assert kin.motors.motors_from_lerobot(SO101, FILE) == motors, "what the file says, too"


def test_motors_that_are_known_keep_sign_zero_and_unit():
    known = [Motor("elbow flex", 9, "Elbow-Flex", sign=-1, offset=12.5, unit="rad")]
    motors = kin.motors.motors_from_lerobot(replace(SO101, motors=known), FILE, "range_m100_100")
    elbow = motors[2]
    assert (elbow.sign, elbow.offset, elbow.unit, elbow.id) == (-1, 12.5, "rad", 3)
    assert elbow.range == (FILE["elbow_flex"]["range_min"], FILE["elbow_flex"]["range_max"])
    assert motors[0].unit == "range_m100_100"


def test_joints_that_are_named_like_the_ids_are_found():
    rows = [replace(row, name=str(i + 1)) for i, row in enumerate(SO101.rows)]
    motors = kin.motors.motors_from_lerobot(replace(SO101, rows=rows, motors=()), FILE)
    assert [motor.joint for motor in motors] == ["1", "2", "3", "4", "5", ""]


@pytest.mark.parametrize("unit", ["deg", "range_m100_100", "range_0_100"])
def test_ticks_are_normalised_as_lerobot_does(unit: Any):
    motors = [
        replace(motor, unit=unit) for motor in kin.motors.motors_from_lerobot(replace(SO101, motors=()), FILE)
    ]
    raw = np.random.default_rng(2).integers(0, 4096, (50, len(motors)))
    readings = kin.motors.readings_from_ticks(motors, raw)
    for i in range(len(raw)):
        for k, name in enumerate(NAMES):
            low, high = FILE[name]["range_min"], FILE[name]["range_max"]
            expected = normalized(float(raw[i, k]), unit, low, high, bool(FILE[name]["drive_mode"]))
            assert readings[i, k] == pytest.approx(expected, abs=1e-9)
    lows, highs = (np.array([entry[key] for entry in FILE.values()]) for key in ("range_min", "range_max"))
    back = kin.motors.ticks_from_readings(motors, readings)
    bounded = raw if unit == "deg" else np.clip(raw, lows, highs)
    assert np.abs(back - bounded).max() <= 1, "LeRobot cuts a tick off where rounding makes it smaller"
    assert np.array_equal(back, np.trunc(back))


def test_ticks_pass_as_they_are_and_a_motor_without_a_range_is_named():
    assert kin.motors.readings_from_ticks([Motor("elbow", 3, unit="ticks")], [7.0]).tolist() == [7.0]
    assert kin.motors.ticks_from_readings([Motor("elbow", 3, unit="ticks")], [7.9]).tolist() == [7.0]
    for convert in (kin.motors.readings_from_ticks, kin.motors.ticks_from_readings):
        with pytest.raises(InputError, match=r"motors\[0\].range: .* of motor 3, elbow"):
            convert([Motor("elbow", 3)], [7.0])


def renamed(old: str, new: str) -> dict[str, Any]:
    """The file with another name of a motor."""
    return {new if name == old else name: each for name, each in FILE.items()}


BAD: list[tuple[Any, str]] = [
    ("", "LeRobot's calibration"),
    ("{", "LeRobot's calibration"),
    ("[" * 50_000, "at most 2000 values"),
    ("x" * 100_001, "at most 100000"),
    ([1], "LeRobot's calibration"),
    ({}, "LeRobot's calibration"),
    ({"elbow_flex": 7}, r"calibration.elbow_flex: got 7, expected a table"),
    ({"elbow_flex": {**FILE["elbow_flex"], "id": "3"}}, r"calibration.elbow_flex.id"),
    ({"elbow_flex": {**FILE["elbow_flex"], "id": True}}, r"calibration.elbow_flex.id"),
    ({"elbow_flex": {**FILE["elbow_flex"], "range_min": float("nan")}}, r"calibration.elbow_flex.range_min"),
    ({"elbow_flex": {**FILE["elbow_flex"], "range_max": float("inf")}}, r"calibration.elbow_flex.range_max"),
    ({"elbow_flex": {**FILE["elbow_flex"], "range_max": 3}}, r"calibration.elbow_flex.range"),
    ({"elbow_flex": {**FILE["elbow_flex"], "speed": 3}}, r"calibration.elbow_flex.speed"),
    ({"elbow_flex": {"id": 3}}, r"calibration.elbow_flex.drive_mode: got None"),
    ({"elbow_flex": FILE["elbow_flex"], "other": FILE["elbow_flex"]}, "an id that no other motor has"),
    ({"left": {**FILE["elbow_flex"], "id": 40}}, "named like a joint: shoulder pan"),
    (
        {"sholder_pan" if name == "shoulder_pan" else name: each for name, each in FILE.items()},
        "; perhaps shoulder pan",
    ),
    ({"wheel" if name == "wrist_roll" else name: each for name, each in FILE.items()}, "no motor: wrist roll$"),
    ({"motor_names": ["a"], "homing_offset": [3], "drive_mode": [0]}, "an older format of LeRobot"),
    ({f"m{i}": FILE["elbow_flex"] for i in range(65)}, "at most 64"),
]


@pytest.mark.parametrize("unit", ["deg", "range_m100_100", "ticks"])
def test_a_gripper_reads_from_0_to_100_whatever_the_unit_of_the_others(unit: Any):
    file = {**FILE, "gripper": {**FILE["gripper"], "range_min": 2000, "range_max": 3500, "drive_mode": 0}}
    motors = kin.motors.motors_from_lerobot(replace(SO101, motors=()), file, unit)
    assert [motor.unit for motor in motors] == [unit] * 5 + ["range_0_100"]
    known = kin.motors.motors_from_lerobot(SO101, file)  # the arm has these motors, with a gripper in degrees
    assert known[-1].unit == "range_0_100"
    readings = kin.motors.readings_from_ticks(known, [m.range[0] for m in known[:-1]] + [3500])
    assert readings[-1] == pytest.approx(100.0)
    assert kin.motors.ticks_from_readings(known, readings)[-1] == 3500


@pytest.mark.parametrize(("given", "words"), BAD, ids=range(len(BAD)))
def test_what_is_no_calibration_is_refused_in_words(given: Any, words: str):
    with pytest.raises(InputError, match=words):
        kin.motors.motors_from_lerobot(SO101, given)


def test_what_lerobot_could_not_read_is_not_written():
    for motors, words in (
        ([], "an arm with motors"),
        ([Motor("elbow flex", 3)], r"motors\[0\].range"),
        ([Motor("elbow flex", i, "m", range=(0, 9)) for i in (1, 2)], r"motors\[1\].name"),
    ):
        with pytest.raises(InputError, match=words):
            kin.motors.motors_to_lerobot(replace(SO101, motors=motors))


def test_the_so101_has_the_motors_of_its_bus_and_lerobots_degrees_are_its_joint_values():
    assert [(motor.name, motor.id) for motor in SO101.motors] == [(name, i + 1) for i, name in enumerate(NAMES)]
    degrees = [10.0, -20.0, 30.0, 40.0, -50.0]
    assert kin.motors.q_from_readings(SO101, degrees) == pytest.approx(np.radians(degrees))
