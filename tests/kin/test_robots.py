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
ROBOTS = tuple(kin.builtin_robots())


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
