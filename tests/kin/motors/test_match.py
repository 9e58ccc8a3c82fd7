"""Sign and zero of motors from what an arm with known motors would read, and what is said of wrong ones."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kin
from kin import InputError
from kin.motors import Motor

SO101 = replace(kin.get_robot("so101"), motors=())
UNITS: list[dict[str, Any]] = [
    {"unit": "deg"},
    {"unit": "rad"},
    {"unit": "ticks"},
    {"unit": "range_m100_100", "range": (100, 3900)},
    {"unit": "range_0_100", "range": (100, 3900)},
]
ARMS = ["so101", "ur5", "planar2r", "prr", "panda", "pioneer5", "lrmate200id", "gantry"]


def motors_of(robot: kin.Robot, rng: np.random.Generator, **fields: Any) -> list[Motor]:
    """A motor of each joint with a sign and zero of its own."""
    made = []
    for i, joint in enumerate(robot.joints):
        lead = 0.4 if joint.kind == "prismatic" else None
        motor = Motor(joint.name, i + 1, lead=lead, sign=int(rng.choice([-1, 1])), **fields)
        made.append(replace(motor, offset=round(float(rng.uniform(-0.5, 0.5)) * motor.turn, 3)))
    return made


def unknown(motors: list[Motor]) -> list[Motor]:
    return [replace(motor, sign=1, offset=0.0) for motor in motors]


def read(robot: kin.Robot, motors: list[Motor], q: Any) -> Any:
    return kin.motors.readings_from_q(replace(robot, motors=motors), q)


@pytest.mark.parametrize("fields", UNITS, ids=lambda fields: fields["unit"])
@pytest.mark.parametrize("robot_id", ARMS)
def test_signs_and_zeros_are_found_from_two_and_three_poses(robot_id: str, fields: dict[str, Any]):
    robot, rng = kin.get_robot(robot_id), np.random.default_rng(3)
    for count in (2, 3):
        poses = kin.motors.motor_poses(robot, count)
        for _ in range(4):
            motors = motors_of(robot, rng, **fields)
            # The arm was put into the poses by hand, and the shafts have turned since the motors were switched on.
            put = poses + rng.uniform(-1, 1, poses.shape) * np.where(robot.revolute, math.radians(3.0), 0.004)
            readings = read(robot, motors, put)
            turns = rng.integers(-3, 4, readings.shape)
            readings += [m.turn * m.begins_again for m in motors] * turns
            found = kin.motors.match_motors(robot, poses, readings, unknown(motors))
            assert found.complete, [finding.text for finding in found.findings]
            assert [m.sign for m in found.motors] == [m.sign for m in motors]
            # What counts is where the arm is drawn: at joint values as close as it was put to them.
            q = robot.random_q(rng, 20)
            made = kin.motors.q_from_readings(replace(robot, motors=found.motors), read(robot, motors, q))
            away = np.abs(made - q)
            away = np.where(robot.revolute, np.minimum(away, np.abs(away - 2 * math.pi)), away)
            assert away.max() < math.radians(3.1)


def test_exact_readings_give_exact_zeros_and_say_so():
    motors = [
        Motor("shoulder pan", 1, sign=-1, offset=91.4),
        Motor("shoulder lift", 2, offset=1040, unit="ticks"),
        Motor("elbow flex", 3, sign=-1, offset=-0.25, unit="rad"),
        Motor("wrist flex", 4, offset=12.0, unit="range_m100_100", range=(1000, 3000)),
        Motor("wrist roll", 5),
    ]
    poses = kin.motors.motor_poses(SO101)
    found = kin.motors.match_motors(SO101, poses, read(SO101, motors, poses), unknown(motors))
    assert [m.sign for m in found.motors] == [m.sign for m in motors]
    assert [m.offset for m in found.motors] == pytest.approx([m.offset for m in motors], abs=0.5)
    assert [finding.text for finding in found.findings] == [
        "Motor 1, shoulder pan, counts backwards, its zero is at 91.4°.",
        "Motor 2, shoulder lift, counts as the joint does, its zero is at 1040 ticks (91.4°).",
        "Motor 3, elbow flex, counts backwards, its zero is at −0.250 rad.",
        "Motor 4, wrist flex, counts as the joint does, its zero is at 12.0.",
        "Motor 5, wrist roll, counts as the joint does, its zero is at 0.0°.",
    ]
    assert max(abs(e) for finding in found.findings for e in finding.error) < 1e-3


def case(change: Any, count: int = 3, unit: str = "deg") -> kin.motors.MotorMatch:
    """What is found where readings ``(k, 5)`` and poses are changed before."""
    motors = [Motor(joint.name, i + 1, offset=20.0 * i, unit=unit) for i, joint in enumerate(SO101.joints)]  # type: ignore[arg-type]
    poses = kin.motors.motor_poses(SO101, count)
    poses, readings = change(poses.copy(), read(SO101, motors, poses), motors)
    return kin.motors.match_motors(SO101, poses, readings, unknown(motors))


def only(found: kin.motors.MotorMatch, k: int, cause: str, *words: str) -> kin.motors.MotorFinding:
    """The one motor that is not matched."""
    bad = [i for i, finding in enumerate(found.findings) if finding.status != "matched"]
    assert bad == [k], [finding.text for finding in found.findings]
    assert not found.complete
    finding = found.findings[k]
    assert finding.cause == cause, finding.text
    for part in (f"Motor {k + 1}, {SO101.joints[k].name},", *words):
        assert part in finding.text
    assert (found.motors[k].sign, found.motors[k].offset) == (1, 0.0), (
        "a motor that is not matched stays as it was"
    )
    return finding


def test_a_joint_that_stays_still_must_move_more():
    def still(poses: Any, readings: Any, motors: Any) -> Any:
        poses[:, 2] = np.radians([10.0, 14.0, 12.0])
        return poses, read(SO101, motors, poses)

    only(case(still), 2, "still", "differs by only 4.0°", "Move it further")


def test_half_a_turn_reads_the_same_both_ways():
    def half(poses: Any, readings: Any, motors: Any) -> Any:
        poses[:, 0] = np.radians([-88.0, 91.0])
        return poses, read(SO101, motors, poses)

    only(case(half, 2), 0, "half turn", "turns by 179.0°", "Take a pose between them")


def test_a_reading_that_does_not_change_is_said():
    def stuck(poses: Any, readings: Any, motors: Any) -> Any:
        readings[:, 3] = 55.0
        return poses, readings

    only(case(stuck), 3, "no change", "changes by 0.0° only", "not the one of the joint")
    only(case(stuck, 2), 3, "no change")


def test_a_wrong_pose_is_named():
    def slip(poses: Any, readings: Any, motors: Any) -> Any:
        readings[1, 2] += 47.0
        return poses, readings

    finding = only(case(slip), 2, "pose", "pose 2 does not fit the others")
    assert finding.pose == 1


def test_another_unit_is_recognised():
    def ticks(poses: Any, readings: Any, motors: Any) -> Any:
        return poses, read(
            SO101, [replace(m, unit="ticks", offset=2048) if m.id == 2 else m for m in motors], poses
        )

    for count in (2, 3):
        finding = only(case(ticks, count), 1, "unit", "seems to read ticks, not degrees")
        assert finding.unit == "ticks"

    def radians(poses: Any, readings: Any, motors: Any) -> Any:
        readings[:, 1] = np.radians(readings[:, 1])
        return poses, readings

    for count in (2, 3):
        only(case(radians, count, unit="deg"), 1, "unit", "seems to read radians, not degrees")


def test_exchanged_motors_are_recognised():
    def exchange(poses: Any, readings: Any, motors: Any) -> Any:
        readings[:, [1, 3]] = readings[:, [3, 1]]
        return poses, readings

    found = case(exchange)
    assert [finding.status for finding in found.findings].count("matched") == 3
    for k, other in ((1, 4), (3, 2)):
        finding = found.findings[k]
        assert finding.cause == "other motor"
        assert finding.other is not None
        assert finding.other.id == other
        assert f"Are motors {k + 1} and {other} exchanged?" in finding.text


def test_a_gear_is_recognised_with_three_poses():
    def gear(poses: Any, readings: Any, motors: Any) -> Any:
        readings[:, 4] = -2.5 * np.degrees(poses[:, 4]) + 7.0
        return poses, readings

    finding = only(case(gear), 4, "gear", "turns 2.5 times as far")
    assert finding.gear == pytest.approx(2.5)


def test_readings_without_sense_are_a_contradiction_with_both_numbers():
    def mad(poses: Any, readings: Any, motors: Any) -> Any:
        readings[:, 0] = [0.0, 64.0, 171.0]
        poses[:, 0] = np.radians([0.0, -30.0, 45.0])
        return poses, readings

    finding = only(case(mad), 0, "readings", "moves by 75.0°", "changes by 107.0°")
    assert (finding.moved, finding.read) == pytest.approx((math.radians(75.0), math.radians(107.0)))


def test_no_wrong_sign_is_found_in_careless_runs():
    rng, poses = np.random.default_rng(8), kin.motors.motor_poses(SO101)
    for _ in range(200):
        motors = motors_of(SO101, rng)
        put = poses + rng.normal(0.0, math.radians(6.0), poses.shape)
        found = kin.motors.match_motors(SO101, poses, read(SO101, motors, put), unknown(motors))
        for finding, motor in zip(found.findings, motors, strict=True):
            if finding.status == "matched":
                assert finding.motor.sign == motor.sign
                assert max(abs(e) for e in finding.error) <= math.radians(10.0) + 1e-12


@pytest.mark.parametrize(
    ("q", "readings", "field"),
    [
        (np.zeros((1, 5)), np.zeros((1, 5)), "q"),
        (np.zeros((3, 5)), np.zeros((2, 5)), "readings"),
        (np.zeros((3, 4)), np.zeros((3, 5)), "q"),
        (np.zeros((3, 5)), np.zeros((3, 6)), "readings"),
        (np.zeros((3, 5)), np.full((3, 5), math.nan), "readings[0][0]"),
        (np.zeros((3, 5)), [["a"] * 5] * 3, "readings"),
        (np.zeros((2, 3, 5)), np.zeros((3, 5)), "q"),
    ],
)
def test_poses_and_readings_that_do_not_fit_are_refused(q: Any, readings: Any, field: str):
    motors = [Motor(joint.name, i) for i, joint in enumerate(SO101.joints)]
    with pytest.raises(InputError) as caught:
        kin.motors.match_motors(SO101, q, readings, motors)
    assert caught.value.field.startswith(field)


def test_other_invalid_input_is_refused():
    motors = [Motor(joint.name, i) for i, joint in enumerate(SO101.joints)]
    for arguments, words in (
        ({"motors": [Motor("hip", 1)]}, "a moving joint"),
        ({"motors": [Motor("", 1, "gripper")]}, "an arm with motors"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"tolerance": math.nan}, "tolerance"),
        ({"tolerance": "wide"}, "tolerance"),
    ):
        with pytest.raises(InputError, match=words):
            kin.motors.match_motors(SO101, np.zeros((2, 5)), np.zeros((2, 5)), **({"motors": motors} | arguments))
    with pytest.raises(InputError, match="an arm with motors"):
        kin.motors.match_motors(SO101, np.zeros((2, 5)), np.zeros((2, 0)))


@pytest.mark.parametrize("robot_id", sorted(kin.builtin_robots()))
def test_poses_move_every_joint_clearly_inside_its_limits_and_touch_nothing(robot_id: str):
    robot = kin.get_robot(robot_id)
    poses = kin.motors.motor_poses(robot)
    assert poses.shape == (3, robot.n)
    assert np.array_equal(poses, kin.motors.motor_poses(robot)), "the same poses each time"
    assert robot.in_limits(poses).all()
    assert (kin.clearance(robot, poses) > 0.0).all()
    moved, span = np.abs(poses[1] - poses[0]), robot.upper - robot.lower
    least = np.where(robot.revolute, np.minimum(math.radians(40.0), 0.5 * span), 0.4 * span)
    assert np.all(moved >= least - 1e-9)
    assert np.all(moved[robot.revolute] <= math.radians(100.0) + 1e-9), "well less than half a turn"
    if robot.floor is not None:
        assert kin.link_frames(robot, poses)[..., 2, 3].min() > robot.floor


def test_poses_obey_what_a_caller_allows():
    arm = kin.get_robot("planar2r")
    poses = kin.motors.motor_poses(arm, 2, lambda q: kin.fk(arm, q)[1, 3] > 0.2)
    assert (kin.fk(arm, poses)[:, 1, 3] > 0.2).all()
    with pytest.raises(InputError, match="move each joint clearly"):
        kin.motors.motor_poses(arm, 2, lambda q: False)
    with pytest.raises(InputError, match="2 or 3"):
        kin.motors.motor_poses(arm, 4)
