"""Capsules in robot files: read, written, refused with the field, and kept by a conversion."""

from __future__ import annotations

import numpy as np
import pytest

import kin

WITH = [robot for robot in kin.files.classic_robots().values() if robot.capsules]


@pytest.mark.parametrize("robot", WITH, ids=lambda robot: robot.id)
def test_capsules_survive_a_round_trip(robot):
    for length in ("m", "mm"):
        again = kin.load_robot(kin.robot_to_toml(robot, length=length))
        assert again.capsules == robot.capsules
        assert again.capsules_source == robot.capsules_source


@pytest.mark.parametrize("robot", WITH, ids=lambda robot: robot.id)
def test_a_converted_arm_has_the_same_bodies(robot):
    other = kin.dh.convert_dh(robot, "modified" if robot.convention == "standard" else "standard")
    q = robot.random_q(np.random.default_rng(2), 20)
    assert np.abs(kin.clearance(other, q) - kin.clearance(robot, q)).max() < 1e-12


def arm(**capsule):
    row = {"name": "one", "a": 0.3}
    return {
        "id": "arm",
        "name": "Arm",
        "source": "test",
        "convention": "standard",
        "units": {"length": "m", "angle": "rad"},
        "rows": [row, {**row, "name": "two"}],
        "capsules": [{"row": "one", "start": [0, 0, 0], "radius": 0.1, **capsule}],
    }


@pytest.mark.parametrize(
    ("capsule", "field"),
    [
        ({"row": "three"}, "capsules[0].row"),
        ({"start": [0, 0]}, "capsules[0].start"),
        ({"end": [0, 0, "x"]}, "capsules[0].end[2]"),
        ({"radius": 0}, "capsules[0].radius"),
        ({"radius": None}, "capsules[0].radius"),
        ({"colour": "red"}, "capsules[0].colour"),
    ],
)
def test_a_malformed_capsule_is_named(capsule, field):
    with pytest.raises(kin.RobotFileError) as caught:
        kin.robot_from_dict(arm(**capsule))
    assert caught.value.field == field


def test_too_many_capsules_are_refused():
    data = arm()
    data["capsules"] *= 65
    with pytest.raises(kin.RobotFileError) as caught:
        kin.robot_from_dict(data)
    assert caught.value.field == "capsules"


def test_the_link_follows_from_the_row():
    robot = kin.robot_from_dict(arm(row="two", end=[-0.3, 0, 0]))
    assert [(c.link, c.row) for c in robot.capsules] == [(2, 1)]
    still = kin.robot_from_dict(arm(row=None))
    assert [(c.link, c.row, c.end) for c in still.capsules] == [(0, -1, (0.0, 0.0, 0.0))]
