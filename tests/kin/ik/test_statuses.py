"""The status of an answer does not depend on the solver: arms without a closed form say as much as the others."""

from __future__ import annotations

import math

import numpy as np
import pytest
from arms import eight_joints

import kin
from kin import Joint, Robot, Status

PI = math.pi


def arm(name, rows, limits):
    joints = tuple(
        Joint(f"joint {i + 1}", *row, limits=tuple(map(math.radians, span)))
        for i, (row, span) in enumerate(zip(rows, limits, strict=True))
    )
    return Robot(name, name, "test", "standard", joints, (0.1,) * len(joints))


# Five joints whose wrist pitches and rolls, and four joints; their closed forms are not used here.
SCORBOT = arm(
    "scorbot",
    [(0, 0.349, 0.016, PI / 2), (0, 0, 0.221, 0), (0, 0, 0.221, 0), (PI / 2, 0, 0, PI / 2), (0, 0.145, 0, 0)],
    [(-155, 155), (-35, 130), (-130, 130), (-130, 130), (-179, 179)],
)
FOUR = arm(
    "four",
    [(0, 0.2, 0, PI / 2), (0, 0, 0.3, 0), (0, 0, 0.25, PI / 2), (0, 0.1, 0.1, 0)],
    [(-110, 110), (-90, 90), (-110, 110), (-110, 110)],
)
SEARCHED = (SCORBOT, FOUR)
searched = pytest.mark.parametrize("robot", SEARCHED, ids=lambda robot: robot.id)


def solve_ik(robot, target, **options):
    """The answer of the numeric solver."""
    return kin.solve_ik(robot, target, solver="numeric", **options)


def beyond(robot, rng):
    """A configuration with one joint outside its limits, but on the same turn."""
    q = robot.random_q(rng)
    joint = int(rng.integers(robot.n))
    q[joint] = robot.upper[joint] + 0.1 if rng.random() < 0.5 else robot.lower[joint] - 0.1
    return q


@searched
@pytest.mark.parametrize("task", ["pose", "approach"])
def test_a_target_beyond_a_stop_names_the_stop(robot, task):
    rng = np.random.default_rng(1)
    blocked = 0
    for _ in range(12):
        q = beyond(robot, rng)
        T = kin.fk(robot, q)
        result = solve_ik(robot, T, task=task)
        assert result.status in (Status.SOLVED, Status.LIMITS)
        if result.status is Status.LIMITS:
            blocked += 1
            assert not result.complete
            assert result.violations
            assert "(numeric)" not in result.reason
            for posture in result.blocked:
                there = solve_ik(
                    robot, kin.fk(robot, posture.q), task=task, respect_limits=False, q_seed=posture.q
                )
                assert np.abs(there.solutions[0].q - posture.q).max() < 1e-6
                assert {v.joint for v in posture.violations} == set(
                    np.flatnonzero((posture.q < robot.lower) | (posture.q > robot.upper)).tolist()
                )
            totals = [sum(abs(v.value - v.limit) for v in posture.violations) for posture in result.blocked]
            assert np.diff(totals).min(initial=0.0) > -2e-12  # rounding does not decide
            assert result.closest is not None
    assert blocked >= 3


@searched
def test_few_joints_keep_point_and_approach_where_they_cannot_keep_the_roll(robot):
    rng = np.random.default_rng(2)
    turned = kin.fk(robot, robot.q_home) * 0.0 + np.eye(4)
    turned[:2, :2] = [[math.cos(0.3), -math.sin(0.3)], [math.sin(0.3), math.cos(0.3)]]
    rolled = 0
    for _ in range(6):
        q = robot.random_q(rng)
        result = solve_ik(robot, kin.fk(robot, q) @ turned, q_seed=q)
        assert result.status in (Status.SOLVED, Status.APPROXIMATE)
        if result.status is Status.APPROXIMATE:
            first = result.solutions[0]
            rolled += first.compromise == "roll"
            assert (result.cause, first.position_error < 1e-9) == ("roll", True)
            assert first.rotation_error <= 0.3 + 1e-9
    assert rolled == (6 if robot is FOUR else 0)


@searched
def test_an_orientation_that_few_joints_cannot_hold_is_met_as_nearly_as_possible(robot):
    rng = np.random.default_rng(3)
    approximate = 0
    for _ in range(6):
        q = robot.random_q(rng)
        T = kin.fk(robot, q)
        T[:3, :3] = T[:3, :3] @ np.array(
            [[1, 0, 0], [0, math.cos(0.2), -math.sin(0.2)], [0, math.sin(0.2), math.cos(0.2)]]
        )
        result = solve_ik(robot, T, q_seed=q)
        approximate += result.status is Status.APPROXIMATE
        assert result.status in (Status.SOLVED, Status.LIMITS, Status.APPROXIMATE)
        for s in result.solutions:
            assert s.position_error < 1e-8
    assert approximate >= 4


@pytest.mark.parametrize("name", ["ur5", "puma560", "pioneer5", "iiwa14", "panda", "stanford", "scara"])
def test_the_numeric_solver_gives_the_status_of_the_closed_form(name):
    robot = kin.get_robot(name)
    rng = np.random.default_rng(4)
    seen = set()
    far = kin.fk(robot, robot.q_home)
    far[:3, 3] += (0.0, 0.0, 50.0)
    targets = [kin.fk(robot, beyond(robot, rng)) for _ in range(8)]
    targets += [kin.fk(robot, robot.random_q(rng)) for _ in range(4)]
    rolled = kin.fk(robot, robot.random_q(rng))
    rolled[:3, :2] = rolled[:3, :2] @ [[0.8, -0.6], [0.6, 0.8]]
    for T in (*targets, rolled, far):
        exact, found = kin.solve_ik(robot, T), solve_ik(robot, T)
        assert found.status is exact.status
        assert found.cause == exact.cause
        assert bool(found.blocked) == bool(exact.blocked)
        seen.add(exact.status)
    # A slide without limits reaches as far as one likes.
    assert (Status.UNREACHABLE in seen) == robot.revolute.all()
    assert Status.SOLVED in seen
    assert Status.LIMITS in seen or name in ("ur5", "iiwa14", "panda")


def test_a_lock_that_is_in_the_way_is_named():
    robot = eight_joints(kin.get_robot("panda"))
    q = robot.q_home.copy()
    locked = [float(x) for x in q[:6]] + [None, None]
    locked[3] = float(q[3]) + 0.2
    result = solve_ik(robot, kin.fk(robot, q), locked=locked)
    assert result.status is Status.LIMITS
    assert any(v.locked for v in result.violations)
    assert "locked at" in result.reason
