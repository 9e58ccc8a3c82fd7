"""What the lesson "Screws" knows, without a page, against exponentials and differences by NumPy alone."""

from __future__ import annotations

import math

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS

import kin
from app.viewer.arm import Arm
from app.viewer.lessons.screws.lesson import ScrewsFacts, ScrewsSettings

ARMS = pytest.mark.parametrize("robot", CLASSICS, ids=[robot.id for robot in CLASSICS])


def facts(robot: kin.Robot, q: np.ndarray, **settings: object) -> ScrewsFacts:
    given = {"joint": 1, "factors": robot.n, **settings}
    return ScrewsFacts(ScrewsSettings(**given), Arm(robot, q, q))


def exponential(S: np.ndarray, value: float) -> np.ndarray:
    """e^([S] value) as a power series."""
    A = np.zeros((4, 4))
    A[:3, :3] = np.cross(np.eye(3), S[:3])
    A[:3, 3] = S[3:]
    term, total = np.eye(4), np.eye(4)
    for k in range(1, 40):
        term = term @ A * (value / k)
        total = total + term
    return np.asarray(total)


@ARMS
def test_the_exponentials_give_the_pose_of_the_table(robot: kin.Robot) -> None:
    for q in robot.random_q(np.random.default_rng(6), 3):
        space, body = facts(robot, q), facts(robot, q, form="body")
        home, pose = numpy_arm.pose(robot, np.zeros(robot.n)), numpy_arm.pose(robot, q)
        T = home
        for S, value in reversed(list(zip(space.columns.T, q.tolist(), strict=True))):
            T = exponential(S, value) @ T
        assert np.abs(T - pose).max() < 1e-9
        T = home
        for B, value in zip(body.columns.T, q.tolist(), strict=True):
            T = T @ exponential(B, value)
        assert np.abs(T - pose).max() < 1e-9
        assert np.abs(space.origin - np.eye(4)).max() == 0.0
        assert np.abs(body.origin - home).max() < 1e-12


@ARMS
def test_axes_now_are_those_about_which_the_tool_moves(robot: kin.Robot) -> None:
    for q in robot.random_q(np.random.default_rng(9), 3):
        known = facts(robot, q, axes="now")
        J, tool = numpy_arm.jacobian(robot, q), numpy_arm.pose(robot, q)[:3, 3]
        for i, (point, z) in enumerate(zip(*known.axes, strict=True)):
            moves = np.cross(z, tool - point) if robot.revolute[i] else z
            assert np.abs(moves - J[:3, i]).max() < 1e-7
            assert np.abs((z if robot.revolute[i] else 0.0) - J[3:, i]).max() < 1e-7
        # In the world frame: the velocity of the point that is at its origin.
        assert np.abs(known.columns[3:] - (J[:3] - np.cross(J[3:].T, tool).T)).max() < 1e-7


@ARMS
def test_the_ghost_has_the_joints_whose_factors_act(robot: kin.Robot) -> None:
    q = robot.random_q(np.random.default_rng(1))
    for factors in range(robot.n + 1):
        last, first = facts(robot, q, factors=factors), facts(robot, q, factors=factors, form="body")
        assert last.acting.tolist() == [0.0] * (robot.n - factors) + q[robot.n - factors :].tolist()
        assert first.acting.tolist() == q[:factors].tolist() + [0.0] * (robot.n - factors)
    assert np.abs(facts(robot, q).ghost).max() == 0.0
    assert facts(robot, q, axes="now").ghost is None


@ARMS
def test_the_first_joint_on_show_is_away_from_the_origin_if_there_is_one(robot: kin.Robot) -> None:
    zero = np.zeros(robot.n)
    axes, far = facts(robot, zero).axes, []
    for i, (point, z) in enumerate(zip(*axes, strict=True)):
        off = float(np.linalg.norm(np.cross(z, point)))
        if robot.revolute[i] and off > 1e-6:
            far.append((off, i + 1))
    chosen = ScrewsSettings.fresh(robot).joint
    assert chosen in [joint for _, joint in far] or (not far and chosen == 1)
    assert math.isfinite(chosen)
