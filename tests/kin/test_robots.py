"""The built-in arms compared with poses of other libraries, computed from joint origins instead of DH rows."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from arms import CHAPTER_ARMS

import kin
from kin.fk import manipulability

GOLDEN = json.loads((Path(__file__).parent.parent / "data" / "golden-fk.json").read_text(encoding="utf-8"))
ROBOTS = tuple(kin.files.classic_robots())


def poses(robot_id):
    """q ``(k, n)`` and T_base_tool ``(k, 4, 4)`` of another library."""
    cases = GOLDEN[robot_id]["cases"]
    return np.array([case["q"] for case in cases]), np.array([case["T"] for case in cases])


def test_every_built_in_arm_has_golden_poses():
    assert [*CHAPTER_ARMS, *sorted(GOLDEN)] == list(ROBOTS)  # those of the chapter have their own golden files


@pytest.mark.parametrize("robot_id", GOLDEN)
def test_poses_equal_those_of_another_library(robot_id):
    robot = kin.get_robot(robot_id)
    q, T = poses(robot_id)
    assert len(q) >= 20
    assert np.abs(kin.fk(robot, q) - T).max() < 1e-11


@pytest.mark.parametrize("robot_id", GOLDEN)
def test_the_jacobian_is_the_derivative_of_the_golden_poses(robot_id):
    """J dq equals the difference of the poses on both sides, whose mean is the golden pose to second order."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(3)
    for q, T in zip(*poses(robot_id), strict=True):
        dq = rng.uniform(-1e-3, 1e-3, robot.n)
        ahead, behind = kin.fk(robot, q + dq), kin.fk(robot, q - dq)
        W = (ahead[:3, :3] - behind[:3, :3]) @ T[:3, :3].T / 2
        twist = [*(ahead[:3, 3] - behind[:3, 3]) / 2, W[2, 1], W[0, 2], W[1, 0]]
        assert np.abs(kin.jacobian(robot, q) @ dq - twist).max() < 1e-8
        assert np.abs((ahead + behind) / 2 - T).max() < 1e-5


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_home_is_away_from_limits_singularities_and_the_floor(robot_id):
    robot = kin.get_robot(robot_id)
    margin = np.minimum(robot.q_home - robot.lower, robot.upper - robot.q_home) / (robot.upper - robot.lower)
    assert margin.min() > 0.05
    sample = manipulability(robot, robot.random_q(np.random.default_rng(4), 2000))
    assert manipulability(robot, robot.q_home) > 0.25 * np.median(sample)


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_descriptions_have_two_sentences(robot_id):
    robot = kin.get_robot(robot_id)
    assert robot.description.count(". ") == 1
    assert robot.description.endswith(".")
    assert len(robot.source) > 20
    assert all(joint.limits for joint in robot.joints)
    assert math.isfinite(robot.reach)


# -- tables in Python ---------------------------------------------------------------------------------------------


def table(**fields):
    """A valid arm of one joint, but for `fields`."""
    valid = {"convention": "standard", "rows": (kin.Joint("j"),), "home": (0.0,)}
    return kin.Robot("one", "one", "test", **{**valid, **fields})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: kin.Joint("j", kind="screw"), "kind of j: got 'screw', expected one of \"fixed\""),
        (lambda: kin.Joint("j", d=math.nan), "d of j: got nan, expected a finite number"),
        (lambda: kin.Joint("j", alpha="90"), "alpha of j: got '90'"),
        (lambda: kin.Joint("j", limits=(1, -1)), "limits of j: got (1, -1), expected the lower limit first"),
        (lambda: kin.Joint("j", limits=(0, math.inf)), "limits of j: got inf"),
        (lambda: kin.Joint("j", limits=3), "limits of j: got 3, expected two numbers"),
        (lambda: kin.Joint("j", kind="fixed", limits=(0, 1)), "because the row is fixed"),
        (lambda: table(convention="craig"), "convention: got 'craig', expected one of"),
        (lambda: table(units="inch"), "units: got 'inch'"),
        (lambda: table(rows=()), "rows: got ()"),
        (lambda: table(rows=(kin.Joint("j"), (0, 0, 0, 0))), "rows[1]: got (0, 0, 0, 0), expected a Joint"),
        (lambda: table(home=(0, 0)), "home: got"),
        (lambda: table(home=(math.nan,)), "home[0]: got nan"),
        (lambda: table(tool=np.ones((4, 4))), "tool[3]"),
        (lambda: table(base=((1, 2),)), "base: got"),
    ],
)
def test_a_table_that_cannot_be_meant_is_refused_by_field(make, message):
    with pytest.raises(kin.InputError) as error:
        make()
    assert message in str(error.value)


def test_lists_and_integers_are_taken_as_they_are_meant():
    joint = kin.Joint("j", theta=1, limits=[-2, 2])
    assert (joint.theta, joint.limits) == (1.0, (-2.0, 2.0))
    robot = table(rows=[joint], home=[0], tool=np.eye(4))
    assert robot == table(rows=(joint,), tool=np.eye(4).tolist())
    assert hash(robot) == hash(table(rows=(joint,)))


def test_another_base_and_tool():
    T = kin.pose_from_position_wxyz([0.1, -0.2, 0.3], [0.5, 0.5, -0.5, 0.5])
    robot = kin.get_robot("ur5")
    q = robot.q_home
    assert np.allclose(kin.fk(robot.with_tool(T), q), kin.fk(robot, q) @ T, atol=1e-12)
    assert np.allclose(kin.fk(robot.with_base(T), q), T @ kin.fk(robot, q), atol=1e-12)
    assert robot.with_tool(np.eye(4)) == robot
    with pytest.raises(kin.InputError, match="T_last_tool"):
        robot.with_tool(2.0 * np.eye(4))


@pytest.mark.parametrize("name", ["in_limits", "clip"])
@pytest.mark.parametrize("q", [[0.0], "12", [0.0, float("nan")]])
def test_what_is_no_configuration_is_refused(name, q):
    with pytest.raises(kin.InputError) as caught:
        getattr(kin.get_robot("planar2r"), name)(q)
    assert caught.value.field.startswith("q")


def test_quaternions_are_public():
    T = kin.pose_from_position_wxyz([0, 0, 0], [0.6, 0.0, 0.8, 0.0])
    assert kin.wxyz_from_rotation(T[:3, :3]) == pytest.approx([0.6, 0.0, 0.8, 0.0])
    assert kin.rotation_from_wxyz(np.array([0.6, 0.0, 0.8, 0.0])) == pytest.approx(T[:3, :3])


def test_results_print_as_one_line():
    robot = kin.get_robot("puma560")
    result = kin.solve_ik(robot, kin.fk(robot, robot.q_home), q_seed=robot.q_home)
    assert repr(result).startswith(f"IKResult(solved, {len(result.solutions)} solutions, wrist6: 'Reached")
    assert repr(result.solutions[0]).startswith("IKSolution([")
    assert result.solutions[0].branch in repr(result.solutions[0])
    assert "\n" not in repr(result)


def test_a_robot_prints_as_one_line() -> None:
    text = "Robot('ur5', 'UR5', 6 joints: base, shoulder, elbow, wrist 1, wrist 2, wrist 3)"
    assert repr(kin.get_robot("ur5")) == text
    for robot in kin.builtin_robots().values():
        assert "\n" not in repr(robot)
        assert len(repr(robot)) < 250
