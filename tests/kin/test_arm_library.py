"""Every maker's arm against what others publish of it, to the flange.

``tests/data/library`` holds one file per arm: origins, axes and limits of the joints as a published description
has them, with its source and licence, and where the arm ends. `before` and `after` are constant transforms by
which the description differs from the arm, `signs` joints that count otherwise, each with the reason. Where
there are two descriptions, it is not the one that the arm's own numbers are from. Forward kinematics is
multiplied out here, by nothing of Kinboard's.
"""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

import kin
from kin.files.builtin import BUILTIN
from kin.files.home import margins
from kin.solvers import family_of

PUBLISHED = {
    file.stem: json.loads(file.read_text(encoding="utf-8"))
    for file in sorted((Path(__file__).parents[1] / "data" / "library").glob("*.json"))
}
ROBOTS = kin.builtin_robots()
LIBRARY = {name: robot for name, robot in ROBOTS.items() if name not in kin.files.classic_robots()}
FAMILIES = {
    "ur3 ur10 ur3e ur5e ur10e ur16e ur20 z1": "parallel6",
    "so100 so101 vx300 wx250 palletiser": "parallel5",
    "kr6 tx2-60 lrmate200id gp8 vx300s wx250s jaco2s": "wrist6",
    "crx10ia gofa jaco2 xarm6 cylindrical": "general6",
    "fr3 xarm7": "offset7",
    "iiwa7": "srs7",
    "gen3 sawyer baxter": "general7",
    "gantry": "slides3",
    "rrp prr orthogonal3r": "general5",
    "rpp": "slides2",
}
FAMILY = {name: family for names, family in FAMILIES.items() for name in names.split()}
TASKS = {3: "position", 5: "approach"}  # by the number of joints; six and more meet a pose
each_arm = pytest.mark.parametrize("robot", LIBRARY.values(), ids=list(LIBRARY))


def turn(axis, angle):
    """Rodrigues' formula ``(3, 3)``."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


def placed(origin):
    """The transform of xyz and rpy, as URDF means them."""
    T = np.eye(4)
    roll, pitch, yaw = origin["rpy"]
    T[:3, :3] = turn([0, 0, 1], yaw) @ turn([0, 1, 0], pitch) @ turn([1, 0, 0], roll)
    T[:3, 3] = origin["xyz"]
    return T


def published_pose(about, q):
    """The pose of the tool from origins and axes, joint by joint."""
    T = placed(about["before"]) if "before" in about else np.eye(4)
    values = iter(q)
    for joint in about["joints"]:
        T = T @ placed(joint)
        if joint["type"] != "fixed":
            moved, value = np.eye(4), joint.get("sign", 1) * next(values)
            if joint["type"] == "prismatic":
                moved[:3, 3] = value * np.array(joint["axis"])
            else:
                moved[:3, :3] = turn(joint["axis"], value)
            T = T @ moved
    assert next(values, None) is None
    return T @ placed(about["after"]) if "after" in about else T


def anywhere(robot, count, seed=0):
    """Joint values within the limits; a joint without limits turns once."""
    lower = np.where(np.isfinite(robot.lower), robot.lower, -math.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, math.pi)
    return np.random.default_rng(seed).uniform(lower, upper, (count, robot.n))


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_tool_is_where_a_published_description_has_it(name):
    robot, about = ROBOTS[name], PUBLISHED[name]
    q = anywhere(robot, 100)
    expected = np.array([published_pose(about, each) for each in q])
    found = kin.fk(robot, q)
    assert np.linalg.norm(found[:, :3, 3] - expected[:, :3, 3], axis=1).max() < 1e-4  # m
    assert np.abs(found[:, :3, :3] - expected[:, :3, :3]).max() < 1e-4


def differing_limits(name):
    """The joints whose limits or speeds are not the published ones."""
    moving = [joint for joint in PUBLISHED[name]["joints"] if joint["type"] != "fixed"]
    for ours, theirs in zip(ROBOTS[name].joints, moving, strict=True):
        if "limits" not in theirs or theirs["type"] == "continuous":
            same = ours.limits is None
        else:
            limits = sorted(theirs.get("sign", 1) * value for value in theirs["limits"])
            same = ours.limits == pytest.approx(limits, abs=2e-3)
        speed = theirs.get("velocity")
        if not same or (speed and ours.velocity and ours.velocity != pytest.approx(speed, rel=2e-3)):
            yield ours.name


@pytest.mark.parametrize("name", PUBLISHED)
def test_joint_limits_are_the_published_ones_or_it_says_why_not(name):
    assert bool(list(differing_limits(name))) == ("other_limits" in PUBLISHED[name])


@pytest.mark.parametrize("name", PUBLISHED)
def test_joints_have_the_names_of_the_published_description(name):
    names = [joint["name"] for joint in PUBLISHED[name]["joints"] if joint["type"] != "fixed"]
    if " " in names[0]:  # a textbook's
        assert ROBOTS[name].ros_joints == ()
    else:
        assert ROBOTS[name].ros_names == names


def test_every_makers_arm_is_checked_and_every_check_names_its_source():
    assert {name for name, robot in ROBOTS.items() if robot.maker} == set(PUBLISHED)
    assert len(LIBRARY) >= 25
    for about in PUBLISHED.values():
        assert about["source"]
        assert about["licence"]
        assert all(about[key]["why"] for key in ("before", "after") if key in about)
        assert any("sign" in joint for joint in about["joints"]) == bool(about.get("signs"))


@pytest.mark.parametrize("name", PUBLISHED)
def test_z_of_the_tool_points_out_along_the_last_axis(name):
    """So that `--approach` and capability maps mean what the flange or the fingers point at."""
    robot = ROBOTS[name]
    for q in anywhere(robot, 5):
        z, J = kin.fk(robot, q)[:3, 2], kin.jacobian(robot, q)
        before, last = J[:, -2], J[:, -1]
        assert abs(z @ last[3:]) == pytest.approx(1.0, abs=1e-5)
        if name != "scara":  # whose axes are all parallel; its flange is checked against the description
            assert z @ np.cross(before[:3], before[3:]) > 0.02, "m ahead of the axis before the last"


@pytest.mark.parametrize("name", PUBLISHED)
def test_an_arm_that_ends_elsewhere_than_in_its_flange_says_so_first(name):
    end = PUBLISHED[name]["end"]
    assert end == "the flange" or end in ROBOTS[name].description.partition(":")[0].partition(".")[0]


@each_arm
def test_a_file_states_where_its_numbers_are_from(robot):
    (file,) = BUILTIN.rglob(f"{robot.id}.toml")
    data = tomllib.loads(file.read_text(encoding="utf-8"))
    assert len(data["source"]) > 60
    assert data["description"].endswith(".")
    assert ("maker" in data) == (file.parent.name != "textbook")
    assert "payload" not in data or "payload" in data["source"]
    assert "mass" not in data or "mass" in data["source"]
    for row in data["rows"]:
        assert row.get("kind") == "fixed" or "follows" in row or "limits" in row, row["name"]
    assert kin.load_robot(kin.robot_to_toml(robot)) == robot


@each_arm
def test_home_is_inside_the_limits_and_not_singular(robot):
    q = robot.q_home
    assert (q >= robot.lower).all()
    assert (q <= robot.upper).all()
    assert margins(robot, np.array([q]))[0] > 0.01


@each_arm
def test_inverse_kinematics_finds_the_way_back(robot):
    assert family_of(robot) == FAMILY[robot.id]
    for q in anywhere(robot, 3, seed=4):
        T = kin.fk(robot, q)
        task = TASKS.get(robot.n, "pose")
        result = kin.solve_ik(robot, T, q_seed=q, task=task)
        assert result.status == "solved", result.message
        for solution in result.solutions:
            found = kin.fk(robot, solution.q)
            assert np.abs(found[:3, 3] - T[:3, 3]).max() < 1e-6
            across = slice(2, 3) if task == "approach" else slice(0, 3 if task == "pose" else 0)
            assert np.abs(found[:3, across] - T[:3, across]).max(initial=0.0) < 1e-6


def orthogonal(q1, q2, q3):
    """Where the tool is ahead of link 1, beside it and above, turned about axis 1."""
    out, aside = 0.4 + 0.3 * math.cos(q3), 0.2 + 0.3 * math.sin(q3)
    ahead, up = 0.2 + out * math.cos(q2), -out * math.sin(q2)
    return math.cos(q1) * ahead - math.sin(q1) * aside, math.sin(q1) * ahead + math.cos(q1) * aside, up


FORMULAS = {
    "rpp": lambda q: (-q[2] * math.sin(q[0]), q[2] * math.cos(q[0]), 0.3 + q[1]),
    "rrp": lambda q: (
        q[2] * math.cos(q[0]) * math.sin(q[1]),
        q[2] * math.sin(q[0]) * math.sin(q[1]),
        0.5 + q[2] * math.cos(q[1]),
    ),
    "prr": lambda q: (
        0.4 * math.cos(q[1]) + 0.3 * math.cos(q[1] + q[2]),
        0.4 * math.sin(q[1]) + 0.3 * math.sin(q[1] + q[2]),
        q[0],
    ),
    "orthogonal3r": lambda q: orthogonal(*q),
    # The hand of these two reaches 120 and 150 mm past the wrist's point.
    "cylindrical": lambda q: (-q[2] * math.sin(q[0]), q[2] * math.cos(q[0]), 0.3 + q[1]),
    "gantry": lambda q: (-q[2], q[1], q[0]),
    # The upper arm is counted from the vertical, the forearm from the horizontal; the hand stays level.
    "palletiser": lambda q: (
        math.cos(q[0]) * (0.4 + 0.9 * math.sin(q[1]) + math.cos(q[2])),
        math.sin(q[0]) * (0.4 + 0.9 * math.sin(q[1]) + math.cos(q[2])),
        0.8 + 0.9 * math.cos(q[1]) - math.sin(q[2]),
    ),
}


def test_the_arms_of_textbooks_are_where_their_coordinates_say():
    assert {name for name, robot in LIBRARY.items() if not robot.maker} == set(FORMULAS)
    for name, formula in FORMULAS.items():
        robot = LIBRARY[name]
        hand = {"cylindrical": 0.12, "gantry": 0.15, "palletiser": 0.25}.get(name, 0.0)
        for q in anywhere(robot, 20):
            T = kin.fk(robot, q)
            assert T[:3, 3] - hand * T[:3, 2] == pytest.approx(np.array(formula(q)), abs=1e-12)
