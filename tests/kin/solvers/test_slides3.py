"""Three turning and three sliding joints in any order: all postures of a pose."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from sliding import RIGHT, arm, check_postures, random_arm

import kin
from kin.robot import Robot
from kin.solvers import closed_form_of

ORDERS = sorted(set(itertools.permutations("PPPRRR")))


GANTRY = arm(
    "PPPRRR",
    [(0, 0, 0, -RIGHT), (RIGHT, 0, 0, RIGHT), (0, 0, 0, 0), (0, 0.1, 0, -RIGHT), (0, 0, 0, RIGHT), (0, 0.1, 0, 0)],
)


def check(robot: Robot, rng: np.random.Generator, poses: int, descents: int) -> None:
    """Every posture is there, and proved to be all."""
    assert closed_form_of(robot).name == "slides3"
    assert check_postures(robot, rng, poses, descents) == {"proved": poses}


@pytest.mark.parametrize("kinds", ORDERS[::4], ids="".join)
def test_three_slides_in_any_order(kinds):
    rng = np.random.default_rng(ORDERS.index(kinds))
    check(random_arm("".join(kinds), rng), rng, 6, 3)


@pytest.mark.slow
@pytest.mark.parametrize("kinds", ORDERS, ids="".join)
def test_many_arms_with_three_slides(kinds):
    rng = np.random.default_rng(100 + ORDERS.index(kinds))
    for _ in range(10):
        check(random_arm("".join(kinds), rng), rng, 10, 10)


def test_a_gantry_with_a_wrist_has_two_postures():
    rng = np.random.default_rng(1)
    check(GANTRY, rng, 10, 3)
    T = kin.fk(GANTRY, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    first, second = kin.solve_ik(GANTRY, T).solutions
    assert sorted([first.q[4], second.q[4]]) == pytest.approx([-0.5, 0.5])


def test_a_stretched_wrist_has_a_curve_of_configurations():
    T = kin.fk(GANTRY, [0.1, 0.2, 0.3, 0.4, 0.0, 0.6])
    result = kin.solve_ik(GANTRY, T, q_seed=[0.0, 0.0, 0.0, 0.7, 0.0, 0.0])
    assert result.details.infinite
    assert len(result.solutions) == 1
    assert result.best.q[3] == pytest.approx(0.7)
    assert result.best.q[3] + result.best.q[5] == pytest.approx(1.0)
    assert "infinitely many" in result.reason


def test_where_slides_lie_in_one_plane_nothing_is_proved():
    """Joint 2 turns the other two slides until the first one is in their plane."""
    robot = random_arm("PRPPRR", np.random.default_rng(0))

    def volume(angle: float) -> float:
        return float(np.linalg.det(kin.jacobian(robot, [0, angle, 0, 0, 0.3, 0.4])[:3][:, ~robot.revolute]))

    angles = np.linspace(-3, 3, 601).tolist()
    low, high = next((a, b) for a, b in itertools.pairwise(angles) if volume(a) * volume(b) < 0.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if volume(low) * volume(middle) > 0.0 else (low, middle)
    T = kin.fk(robot, [0.1, low, 0.2, 0.3, 0.3, 0.4])
    assert kin.solve_ik(robot, T, respect_limits=False).completeness == "unknown"


def test_an_unreachable_orientation_is_none():
    """Axes that are almost parallel cannot tilt the tool far."""
    robot = arm(
        "PPPRRR",
        [(0, 0, 0, -RIGHT), (RIGHT, 0, 0, RIGHT), (0, 0, 0, 0), (0, 0.1, 0, 0.3), (0, 0, 0, 0.2), (0, 0.1, 0, 0)],
    )
    T = kin.fk(robot, robot.q_home)
    T[:3, :3] = T[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    result = kin.solve_ik(robot, T)
    assert result.status == "orientation"
    assert not result.solutions


@pytest.mark.parametrize("kinds", ["PPPPRR", "PPRRRR", "PRRRRR"])
def test_arms_with_another_number_of_slides_are_left_alone(kinds):
    form = closed_form_of(random_arm(kinds, np.random.default_rng(2)))
    assert form is None or form.name != "slides3"


def test_the_batch_kernels_agree_with_single_answers():
    rng = np.random.default_rng(3)
    robot = random_arm("PRPRPR", rng)
    targets = kin.fk(robot, robot.random_q(rng, 50))
    rows = kin.ik_branches(robot, targets)
    for T, row in zip(targets, rows, strict=True):
        assert np.array_equal(kin.ik_branches(robot, T[None])[0], row, equal_nan=True)
