"""What the lesson "Redundancy" knows, without a page, against computations by NumPy alone."""

from __future__ import annotations

import math

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS
from bare_page import STORE

import kin
from app.viewer.arm import Arm
from app.viewer.lessons.redundancy.facts import RedundancyFacts
from app.viewer.lessons.redundancy.settings import RedundancySettings

ARMS = pytest.mark.parametrize("robot", CLASSICS, ids=[robot.id for robot in CLASSICS])
TASKS: tuple[kin.ik.Task, ...] = ("pose", "approach", "position")


def facts(robot: kin.Robot, q: np.ndarray, task: kin.ik.Task, goal: np.ndarray | None = None) -> RedundancyFacts:
    goal = q if goal is None else goal
    arm = Arm(robot, q, goal, task=task, locks=(False,) * robot.n)
    return RedundancyFacts(RedundancySettings(), arm)


def rows(robot: kin.Robot, q: np.ndarray, task: kin.ik.Task) -> np.ndarray:
    J, R = numpy_arm.jacobian(robot, q), numpy_arm.pose(robot, q)[:3, :3]
    return {"pose": J, "approach": np.vstack([J[:3], R[:, :2].T @ J[3:]]), "position": J[:3]}[task]


@ARMS
@pytest.mark.parametrize("task", TASKS)
def test_there_are_parameters_where_joints_can_move_and_the_task_does_not(
    robot: kin.Robot, task: kin.ik.Task
) -> None:
    rng = np.random.default_rng(8)
    for q in robot.random_q(rng, 3):
        known = facts(robot, q, task)
        free = robot.n - np.linalg.matrix_rank(rows(robot, q, task), tol=1e-5)
        if known.numeric and known.parameters:
            assert free > 0
            # Each offered joint takes part in a motion of the null space.
            basis = np.linalg.svd(rows(robot, q, task))[2][robot.n - free :]
            for item in known.parameters:
                joint = int(item.name.removeprefix("theta")) - 1
                assert np.linalg.norm(basis[:, joint]) > 1e-4
                assert item.value == pytest.approx(q[joint])
        assert (known.item is not None) == bool(known.parameters)
        if not free:
            assert not known.parameters
            assert "No redundancy" in known.idea or "Redundancy" in known.idea
        for item in known.exact:
            if item.name.startswith("theta"):
                joint = int(item.name.removeprefix("theta")) - 1
                assert math.remainder(item.value - q[joint], 2 * math.pi) == pytest.approx(0.0, abs=1e-6)
            assert any(low - 1e-6 <= item.value <= high + 1e-6 for low, high in item.intervals)


@ARMS
def test_the_residual_is_how_far_the_tool_has_left_the_held_pose(robot: kin.Robot) -> None:
    rng = np.random.default_rng(5)
    goal, q = robot.random_q(rng, 2)
    A, B = numpy_arm.pose(robot, goal), numpy_arm.pose(robot, q)
    turn = math.acos(min(max((np.trace(A[:3, :3].T @ B[:3, :3]) - 1) / 2, -1), 1))
    tilt = math.acos(min(max(float(A[:3, 2] @ B[:3, 2]), -1), 1))
    for task, off in zip(TASKS, (turn, tilt, None), strict=True):
        position, rotation = facts(robot, q, task, goal).residual
        assert position == pytest.approx(np.linalg.norm(A[:3, 3] - B[:3, 3]), abs=1e-9)
        assert rotation == (None if off is None else pytest.approx(off, abs=1e-6))


def test_the_elbows_circle_holds_shoulder_and_wrist() -> None:
    robot, rng = STORE.get("iiwa14"), np.random.default_rng(2)
    for q in robot.random_q(rng, 5):
        known = facts(robot, q, "pose")
        circle, item = known.circle, known.item
        assert circle is not None
        assert item is not None
        assert item.name == "psi"
        # The elbow is where axes 3 and 4 meet: the frame after row 3.
        elbow = numpy_arm.frames(robot, q)[2][:3, 3]
        assert circle.at(item.value) == pytest.approx(elbow, abs=1e-6)
        assert (elbow - circle.center) @ (circle.wrist - circle.shoulder) == pytest.approx(0.0, abs=1e-9)


def test_a_trade_of_two_coaxial_joints_moves_nothing_else() -> None:
    robot = STORE.get("redundant7")
    q = robot.q_home.copy()
    known = facts(robot, q, "pose")
    assert known.trades
    # Against each other, or with each other: what counts is the direction of the second axis.
    apart = [facts(robot, q + np.array([0.2, way * 0.2, 0, 0, 0, 0, 0]), "pose", q).moved for way in (-1, 1)]
    assert None not in apart
    assert min(apart) == pytest.approx(0.0, abs=1e-12)  # type: ignore[type-var]
    assert max(apart) > 0.01  # type: ignore[type-var, operator]
    assert facts(STORE.get("ur5"), STORE.get("ur5").q_home, "pose").moved is None
