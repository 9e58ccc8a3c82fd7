"""Motors of an arm: their fields in robot files, and readings as joint values and back."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kin
from kin import InputError, RobotFileError
from kin.motors import Motor

UR5, PRR = kin.get_robot("ur5"), kin.get_robot("prr")
NAMES = [joint.name for joint in UR5.joints]
SO101 = kin.get_robot("so101")
FILE = """
[[motors]]
joint = "shoulder pan"
name = "shoulder_pan"
id = 1
sign = -1
offset = 91.4
unit = "deg"
range = [740, 3331]
homing_offset = -1203

[[motors]]
joint = "elbow flex"
id = 3
unit = "ticks"
ticks = 1024
offset = 512

[[motors]]
name = "gripper"
id = 6
unit = "range_0_100"
range = [2013, 3500]
drive_mode = 1
"""


def text_with(extra: str) -> str:
    return kin.robot_to_toml(replace(SO101, motors=())) + extra


def test_a_file_states_motors_and_is_written_as_it_was_read():
    robot = kin.load_robot(text_with(FILE))
    pan, elbow, gripper = robot.motors
    assert pan == Motor(
        "shoulder pan", 1, "shoulder_pan", sign=-1, offset=91.4, range=(740, 3331), homing_offset=-1203
    )
    assert elbow == Motor("elbow flex", 3, "elbow flex", 1, 512.0, "ticks", 1024)
    assert (gripper.joint, gripper.name, gripper.drive_mode, gripper.range) == ("", "gripper", 1, (2013, 3500))
    assert kin.load_robot(kin.robot_to_toml(robot)) == robot
    assert kin.robot_from_dict(json.loads(json.dumps(kin.robot_to_dict(robot)))) == robot
    assert "motors" not in kin.robot_to_dict(UR5), "arms without motors are written as before"


def test_the_motor_of_a_slide_states_how_far_a_turn_moves_it():
    name = PRR.joints[0].name
    robot = replace(PRR, motors=[Motor(name, 7, offset=-10.0, lead=0.008)])
    assert kin.load_robot(kin.robot_to_toml(robot, "mm")) == replace(robot, units="mm")
    assert kin.robot_to_dict(robot, "mm")["motors"][0]["lead"] == 8
    assert kin.motors.readings_from_q(robot, PRR.q_home)[0] == pytest.approx(-10.0 + 360.0 * PRR.q_home[0] / 0.008)


@pytest.mark.parametrize(
    ("old", "new", "field", "words"),
    [
        ('joint = "elbow flex"', 'joint = "elbow"', "motors[1].joint", "a moving joint: shoulder pan"),
        ("id = 3", "id = 1", "motors[1].id", "no other motor"),
        ("id = 3", "", "motors[1].id", "number of the motor"),
        ("id = 3", "id = -3", "motors[1].id", "whole number from 0"),
        ("id = 3", "id = true", "motors[1].id", "whole number"),
        ("sign = -1", "sign = 0", "motors[0].sign", "1 or -1"),
        ("sign = -1", 'sign = "-"', "motors[0].sign", "1 or -1"),
        ("offset = 91.4", "offset = nan", "motors[0].offset", "finite"),
        ("offset = 91.4", "offset = 1e9", "motors[0].offset", "smaller than a million"),
        ('unit = "ticks"', 'unit = "turns"', "motors[1].unit", '"range_0_100"'),
        ('unit = "ticks"', 'unit = "range_m100_100"', "motors[1].range", "two ends"),
        ("ticks = 1024", "ticks = 1", "motors[1].ticks", "whole number from 2"),
        ("ticks = 1024", "ticks = 99999999999999999999", "motors[1].ticks", "whole number from 2"),
        ("range = [740, 3331]", "range = [3331, 740]", "motors[0].range", "the lower one first"),
        ("range = [740, 3331]", "range = [740]", "motors[0].range", "two whole numbers"),
        ("range = [740, 3331]", "range = [740.5, 900]", "motors[0].range", "whole number"),
        ("drive_mode = 1", "drive_mode = 2", "motors[2].drive_mode", "from 0 to 1"),
        ('name = "gripper"', "", "motors[2].name", "a name for a motor that moves no joint"),
        ("sign = -1", "sign = -1\nlead = 2", "motors[0].lead", "does not slide"),
        ("sign = -1", "sense = -1", "motors[0].sense", "only the fields drive_mode"),
    ],
)
def test_errors_of_a_file_name_the_field_and_what_is_valid(old: str, new: str, field: str, words: str):
    assert old in FILE
    with pytest.raises(RobotFileError) as caught:
        kin.load_robot(text_with(FILE.replace(old, new, 1)))
    assert caught.value.field == field
    assert words in str(caught.value)


@pytest.mark.parametrize("motors", [7, [7], "abc", [{"id": "x"}], [{}] * 65, {"id": 1}])
def test_motors_of_another_shape_are_refused(motors: Any):
    fields = kin.robot_to_dict(replace(SO101, motors=())) | {"motors": motors}
    with pytest.raises(RobotFileError, match="motors"):
        kin.robot_from_dict(fields)


def test_motors_of_python_are_checked():
    with pytest.raises(InputError, match=r"motors\[1\].id"):
        replace(UR5, motors=[Motor(NAMES[0], 1), Motor(NAMES[1], 1)])
    with pytest.raises(InputError, match=r"motors\[0\]"):
        replace(UR5, motors=["shoulder"])
    with pytest.raises(InputError, match="a moving joint"):
        kin.robot_to_toml(replace(UR5, motors=[Motor("hip", 1)]))
    with pytest.raises(InputError, match="an arm with motors"):
        kin.motors.q_from_readings(UR5, np.zeros(6))
    few = replace(UR5, motors=[Motor(NAMES[0], 1)])
    with pytest.raises(InputError, match=f"a motor of {NAMES[1]}"):
        kin.motors.q_from_readings(few, [0.0])
    with pytest.raises(InputError, match="finite"):
        kin.motors.q_from_readings(few, [math.nan])
    with pytest.raises(InputError, match="readings"):
        kin.motors.q_from_readings(few, [0.0, 1.0])


def test_readings_of_every_motor_count_without_those_that_move_no_joint():
    motors = [Motor("", 9, "gripper"), *SO101.motors[:5], Motor("", 7, "lamp")]
    arm = replace(SO101, motors=motors)
    moving = np.array([[10.0, -20.0, 30.0, 40.0, -50.0], [11.0, -21.0, 31.0, 41.0, -51.0]])
    every = np.hstack([[[70.0], [71.0]], moving, [[1.0], [0.0]]])
    assert np.array_equal(kin.motors.q_from_readings(arm, every), kin.motors.q_from_readings(arm, moving))
    with pytest.raises(InputError) as caught:
        kin.motors.q_from_readings(arm, every[:, :6])
    assert "6 values" in caught.value.value
    assert "5 values, of motors 1 shoulder pan, " in caught.value.expected
    assert caught.value.expected.endswith("5 wrist roll, or 7, with 9 gripper, 7 lamp in its place")


def test_ticks_of_a_calibrated_arm_show_where_it_is():
    """As LeRobot reads an SO-101: six servos, of which the gripper moves no joint."""
    ranges = [(745, 3398), (822, 3201), (866, 3078), (890, 3224), (0, 4095), (2026, 3500)]
    arm = replace(SO101, motors=[replace(m, range=r) for m, r in zip(SO101.motors, ranges, strict=True)])
    ticks = [round((low + high) / 2) + 1024 for low, high in ranges]
    q = kin.motors.q_from_readings(arm, kin.motors.readings_from_ticks(arm.motors, ticks))
    assert np.degrees(q) == pytest.approx([90.0] * 5, abs=0.1)  # ticks are whole, and 4095 of them are a turn


def test_readings_and_joint_values_are_each_others_inverse():
    rng = np.random.default_rng(5)
    units: list[dict[str, Any]] = [
        {"unit": "deg", "offset": 91.4, "sign": -1},
        {"unit": "rad", "offset": -2.5},
        {"unit": "ticks", "offset": 4000, "sign": -1},
        {"unit": "range_m100_100", "range": (500, 3500), "offset": 3.0},
        {"unit": "range_0_100", "range": (1000, 3000), "sign": -1},
    ]
    robot = replace(
        SO101, motors=[Motor(j.name, i, **u) for i, (j, u) in enumerate(zip(SO101.joints, units, strict=True))]
    )
    q = SO101.random_q(rng, (3, 400))
    readings = kin.motors.readings_from_q(robot, q)
    assert readings.shape == (3, 400, 5)
    found = kin.motors.q_from_readings(robot, readings)
    tick = 2.0 * math.pi / 4096
    away = np.abs(found - q).max(axis=(0, 1))
    assert away[2] <= 0.5 * tick + 1e-12, "ticks are whole"
    assert np.delete(away, 2).max() < 1e-12
    ticks = readings[..., 2]
    assert ticks.min() >= 0
    assert ticks.max() < 4096
    assert np.array_equal(ticks, np.round(ticks))
    assert kin.fk(robot, found)[..., :3, 3] == pytest.approx(kin.fk(SO101, q)[..., :3, 3], abs=1e-3)


def test_a_turn_of_the_shaft_does_not_change_the_joint_value():
    robot = replace(SO101, motors=[Motor(j.name, i, offset=170.0) for i, j in enumerate(SO101.joints)])
    q = SO101.random_q(np.random.default_rng(1), 200)
    readings = kin.motors.readings_from_q(robot, q)
    for turns in (-2, 1, 5):
        assert kin.motors.q_from_readings(robot, readings + 360.0 * turns) == pytest.approx(q, abs=1e-9)
    beyond = SO101.upper + math.radians(4.0)
    again = kin.motors.q_from_readings(robot, kin.motors.readings_from_q(robot, beyond))
    assert again == pytest.approx(beyond), "a little too far"


def test_a_joint_of_two_turns_keeps_what_its_motor_counts():
    robot = replace(UR5, motors=[Motor(name, i) for i, name in enumerate(NAMES)])
    q = np.array([-6.0, 6.0, 3.0, -4.0, 5.0, 0.5])
    assert UR5.in_limits(q)
    assert kin.motors.q_from_readings(robot, np.degrees(q)) == pytest.approx(q)


def test_a_joint_with_two_motors_has_the_mean():
    pair = [Motor("shoulder", 2), Motor("shoulder", 3, sign=-1, offset=180.0), Motor("elbow", 4)]
    robot = replace(kin.get_robot("planar2r"), motors=pair)
    assert kin.motors.readings_from_q(robot, np.radians([30.0, 10.0])) == pytest.approx([30.0, 150.0, 10.0])
    assert np.degrees(kin.motors.q_from_readings(robot, [30.0, 146.0, 10.0])) == pytest.approx([32.0, 10.0])
