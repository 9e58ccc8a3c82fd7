"""Null space of a task at one configuration, and motions in it, against the core, for all arms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kin
from app.viewer.null_space import hold, lead, margin, measure, null_space, secondary
from app.viewer.self_motion import leaders
from kin import Robot
from kin.differential.error import task_error
from kin.differential.task import free_motions, task_rows
from kin.ik import Task
from kin.transforms import rotation_angle, vector_angle

TASKS: tuple[Task, ...] = ("pose", "approach", "position")
TURN = math.pi / 2
EIGHT = Robot.from_dh([(0, 0.2, 0.1, TURN), (0, 0, 0.2, -TURN)] * 4, home=[0.3, 0.4, -0.5, 0.6] * 2)
ROBOTS = [kin.get_robot(name) for name in kin.files.classic_robots()]
CASES = [(robot, task) for robot in [*ROBOTS, EIGHT] for task in TASKS]


@pytest.fixture(params=CASES, ids=[f"{robot.id}{robot.n}-{task}" for robot, task in CASES])
def case(request: pytest.FixtureRequest) -> tuple[Robot, Task]:
    found: tuple[Robot, Task] = request.param
    return found


def apart(robot: Robot, q: np.ndarray, T: np.ndarray, task: Task) -> float:
    """How far the tool is from what it holds, by other means than `error`."""
    now = kin.fk(robot, q)
    off = float(np.linalg.norm(now[:3, 3] - T[:3, 3]))
    if task == "approach":
        off = max(off, vector_angle(now[:3, 2], T[:3, 2]))
    if task == "pose":
        off = max(off, rotation_angle(now[:3, :3], T[:3, :3]))
    return off


def test_the_null_space_of_the_jacobian(case: tuple[Robot, Task]) -> None:
    robot, task = case
    rng = np.random.default_rng(5)
    for q in [robot.q_home, *robot.random_q(rng, 3)]:
        space = null_space(robot, q, task)
        J = task_rows(robot, q, task)
        assert space.rank == np.linalg.matrix_rank(J, tol=1e-9)
        assert space.basis.shape == (robot.n, robot.n - space.rank)
        assert np.abs(J @ space.basis).max(initial=0.0) < 1e-12
        assert np.allclose(J @ space.pinv @ J, J, atol=1e-8), "J⁺ is a pseudoinverse"
        z = rng.normal(size=robot.n)
        N = np.eye(robot.n) - space.pinv @ J
        assert np.allclose(space.project(z), N @ z, atol=1e-8)
        # The task rows are those of finite differences of the task's error.
        dq = 1e-6 * rng.normal(size=robot.n)
        assert task_error(robot, q, kin.fk(robot, q + dq), task) == pytest.approx(J @ dq, abs=1e-11)
        part = {"pose": "all", "position": "linear"}.get(task)
        if part and space.rank == min(len(J), robot.n):
            assert float(measure(robot, q, task, space.rank)) == pytest.approx(
                float(kin.manipulability(robot, q, part)), abs=1e-12
            )


def test_a_joint_leads_and_the_tool_stays(case: tuple[Robot, Task]) -> None:
    robot, task = case
    T = kin.fk(robot, robot.q_home)
    items = leaders(robot, robot.q_home, task)
    free = free_motions(robot, task)
    assert bool(items) == (free > 0)
    for item in items[:3]:
        joint = int(item.name.removeprefix("theta")) - 1
        inside = item.value + (0.02 if item.value + 0.02 < robot.upper[joint] else -0.02)
        q = lead(robot, robot.q_home, T, task, joint, inside)
        if q is None:  # another joint is at its limit at home
            continue
        assert q[joint] == pytest.approx(inside, abs=1e-9)
        assert apart(robot, q, T, task) < 1e-8
        assert ((robot.lower <= q) & (q <= robot.upper)).all()


def test_secondary_goals_improve_while_the_tool_stays() -> None:
    for robot, task in ((kin.get_robot("panda"), "pose"), (kin.get_robot("ur5"), "position"), (EIGHT, "pose")):
        q = robot.random_q(np.random.default_rng(8))
        T, rank = kin.fk(robot, q), null_space(robot, q, task).rank
        for goal in ("limits", "manipulability"):
            z = secondary(robot, q, task, goal)
            step = null_space(robot, q, task).project(z)
            assert np.linalg.norm(step) > 1e-6
            moved = hold(robot, q + 1e-3 * step / np.linalg.norm(step), T, task)
            assert moved is not None
            assert apart(robot, moved, T, task) < 1e-8
            if goal == "manipulability":
                assert measure(robot, moved, task, rank) > measure(robot, q, task, rank)
            else:
                half = 0.5 * (robot.upper - robot.lower)
                off = [np.sum(((x - robot.lower) / half - 1.0) ** 2) for x in (q, moved)]
                assert off[1] < off[0]


def test_a_joint_without_limits_is_not_led_to_their_middle() -> None:
    robot = kin.get_robot("ur3")
    endless = ~np.isfinite(robot.upper - robot.lower)
    assert endless.any()
    z = secondary(robot, robot.q_home + 0.1, "pose", "limits")
    assert np.array_equal(z == 0.0, endless)


def test_locked_joints_stay() -> None:
    ur5, T = kin.get_robot("ur5"), kin.fk("ur5", kin.get_robot("ur5").q_home)
    assert free_motions(ur5, "position") == 3
    assert free_motions(ur5, "position", (1,)) == 2
    space = null_space(ur5, ur5.q_home, "position", (1,))
    assert space.basis[1] == pytest.approx(0.0, abs=1e-12)
    q = lead(ur5, ur5.q_home, T, "position", 0, ur5.q_home[0] + 0.05, (1,))
    assert q is not None
    assert q[1] == pytest.approx(ur5.q_home[1], abs=1e-12)
    assert apart(ur5, q, T, "position") < 1e-9
    assert lead(ur5, ur5.q_home, T, "position", 1, ur5.q_home[1] + 0.05, (1,)) is None


def test_margins() -> None:
    robot = kin.get_robot("panda")
    middle = 0.5 * (robot.lower + robot.upper)
    assert margin(robot, middle) == pytest.approx(1.0)
    q = middle.copy()
    q[2] = robot.upper[2]
    assert margin(robot, q) == pytest.approx(0.0)
