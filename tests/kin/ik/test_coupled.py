"""Closed forms of arms in which rows follow joints: nothing made up, nothing missed, and where there is none."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kin
from kin import Joint, Robot
from kin.solvers import closed_form_of

DOWN = -math.pi / 2


def palletiser() -> Robot:
    """Four joints, five axes: joint 3 turns the forearm in space, and a parallelogram keeps the tool level."""
    rows = [
        Joint("turn", d=0.6, a=0.2, alpha=DOWN, limits=(-math.pi, math.pi)),
        Joint("upper arm", DOWN, a=0.9, limits=(-0.7, 1.6)),
        Joint("parallelogram", -DOWN, follows="upper arm", ratio=-1.0),
        Joint("forearm", a=1.0, limits=(-0.4, 2.1)),
        Joint("level", a=0.15, alpha=DOWN, follows="forearm", ratio=-1.0),
        Joint("tool turn", d=0.2, limits=(-6.1, 6.1)),
    ]
    return Robot.from_dh(rows, home=(0.0, 0.2, 0.4, 0.0))


def hollow_wrist() -> Robot:
    """Six joints of a PUMA 560 whose wrist motors each turn what is behind them too: an invertible map."""
    puma = kin.get_robot("puma560")
    rows = list(puma.rows)
    at = [i for i, row in enumerate(rows) if row.driven]
    fifth, sixth = rows[at[4]], rows[at[5]]
    rows.insert(at[5], Joint("by 5", follows=fifth.name, ratio=-1.0))
    rows.insert(at[4], Joint("by 4", follows=rows[at[3]].name, ratio=2.0))
    assert sixth in rows
    return replace(puma, rows=tuple(rows), capsules=())


ARMS = [palletiser(), kin.dh.convert_dh(palletiser(), "modified"), hollow_wrist()]
IDS = ["palletiser", "palletiser, modified", "hollow wrist"]


@pytest.mark.parametrize("robot", ARMS, ids=IDS)
def test_every_pose_gives_back_its_configuration_and_all_that_is_found_is_right(robot):
    for q in robot.random_q(np.random.default_rng(3), 60):
        T = kin.fk(robot, q)
        result = kin.solve_ik(robot, T, max_solutions=None)
        assert (result.status.value, result.completeness) == ("solved", "proved"), result.reason
        found = result.q
        turned = np.abs(np.remainder(found - q + math.pi, 2.0 * math.pi) - math.pi).max(axis=1)
        assert turned.min() < 1e-9
        assert np.abs(kin.fk(robot, found) - T).max() < 1e-12
        assert robot.in_limits(found, 1e-12).all()


def test_a_palletiser_has_the_four_postures_of_its_links():
    """By hand: the tool's point and turn, with the elbow above or below and the arm forwards or backwards."""
    robot = replace(
        palletiser(), rows=tuple(replace(row, limits=None) for row in palletiser().rows), home=(0.0, 0.2, 0.4, 0.0)
    )
    q = np.array([0.3, 0.4, 0.9, -1.0])
    T = kin.fk(robot, q)
    expected = set()
    for side in (1.0, -1.0):
        # From the shoulder to the elbow and the wrist: upper arm from the vertical, forearm from the horizontal.
        r = side * math.hypot(T[0, 3], T[1, 3]) - 0.2 - 0.15
        h = T[2, 3] + 0.2 - 0.6
        reach = (r * r + h * h - 0.9**2 - 1.0) / (2.0 * 0.9 * 1.0)
        for bend in (1.0, -1.0):
            relative = bend * math.acos(reach)  # from the line of the upper arm down to the forearm
            upper = math.atan2(h, r) + math.atan2(math.sin(relative), 0.9 + math.cos(relative))
            lift = math.pi / 2 - upper
            forearm = -(upper - relative)
            turn = 0.3 if side > 0.0 else 0.3 - math.pi
            roll = -1.0 + (turn - 0.3)  # the tool points down: with joint 1, joint 4 turns as far
            expected.add(tuple(np.remainder([turn, lift, forearm, roll], 2.0 * math.pi).round(7)))
    found = kin.solve_ik(robot, T, max_solutions=None).solutions
    assert {tuple(np.remainder(each.q, 2.0 * math.pi).round(7)) for each in found} == expected
    assert len(found) == 4


def test_a_palletiser_says_by_which_closed_form_it_is_solved():
    robot = palletiser()
    form = closed_form_of(robot)
    assert form is not None
    assert (form.name, form.off) == ("parallel5", 0.0)
    result = kin.solve_ik(robot, kin.fk(robot, robot.q_home))
    assert (result.solver, result.completeness) == ("parallel5", "proved")
    assert "4 joints move these 5 axes" in result.solver_reason
    assert form.branch_of(robot.q_home) == form.branches.index(result.solutions[0].branch)


def test_a_tilted_target_is_approximated_and_a_distant_one_out_of_reach():
    robot = palletiser()
    T = kin.fk(robot, robot.q_home)
    tilted = T @ kin.pose_from_xyz_rpy([0.0, 0.0, 0.0], [0.05, 0.02, 0.0])
    result = kin.solve_ik(robot, tilted)
    assert result.status.value == "approximate"
    assert result.solutions[0].position_error < 1e-9
    assert result.solutions[0].rotation_error == pytest.approx(math.hypot(0.05, 0.02), rel=0.01)
    away = T.copy()
    away[:3, 3] *= 3.0
    assert kin.solve_ik(robot, away).status.value == "unreachable"
    low = kin.solve_ik(robot, kin.fk(robot, [0.0, 1.7, 0.4, 0.0]))
    assert low.status.value in ("limits", "approximate")


def test_tasks_without_a_closed_form_are_searched_and_said_to_be():
    robot = palletiser()
    T = kin.fk(robot, [0.5, 0.3, 0.8, 1.0])
    result = kin.solve_ik(robot, T[:3, 3], task="position")
    assert (result.status.value, result.completeness) == ("solved", "unknown")
    assert not result.details.complete
    assert kin.fk_positions(robot, result.solutions[0].q) == pytest.approx(T[:3, 3], abs=1e-6)


def test_batches_and_branches_give_the_same():
    robot = palletiser()
    q = robot.random_q(np.random.default_rng(4), 12)
    T = kin.fk(robot, q)
    many = kin.solve_ik_many(robot, T)
    assert many.solved.all()
    assert many.q == pytest.approx(np.array([kin.solve_ik(robot, each).solutions[0].q for each in T]), abs=1e-12)
    branches = kin.ik_branches(robot, T)
    right = ~np.isnan(branches[..., 0])
    assert right.any(axis=1).all()
    poses = kin.fk(robot, branches[right])
    assert np.abs(poses - np.repeat(T, right.sum(axis=1), axis=0)).max() < 1e-12


@pytest.mark.parametrize(
    "follower",
    [
        Joint("half", a=0.2, follows="c", ratio=0.5),
        Joint("screw", kind="prismatic", alpha=1.0, follows="c", ratio=0.1),
    ],
    ids=lambda row: row.name,
)
def test_other_ratios_are_searched_with_what_a_whole_turn_changes(follower):
    rows = [
        Joint("a", d=0.3, alpha=DOWN, limits=(-2.0, 2.0)),
        Joint("b", a=0.4, limits=(-2.0, 2.0)),
        Joint("c", a=0.3, limits=(-3.0, 9.0)),
        follower,
    ]
    robot = Robot.from_dh(rows)
    assert closed_form_of(robot) is None
    for q in robot.random_q(np.random.default_rng(5), 10):
        result = kin.solve_ik(robot, kin.fk_positions(robot, q), task="position", q_seed=q)
        best = result.solutions[0].q
        assert kin.fk_positions(robot, best) == pytest.approx(kin.fk_positions(robot, q), abs=1e-6)
        assert result.solutions[0].distance < 1e-6


def test_singularities_are_those_of_the_joints():
    robot = palletiser()
    straight = np.array([0.0, 0.5, 0.5 + DOWN, 0.0])  # the forearm along the upper arm
    assert kin.singularities(robot, straight)[0].distance < 1e-9
    assert kin.singularities(robot, robot.q_home)[0].distance > 0.1


def test_what_only_the_free_arm_reaches_is_no_branch():
    """Batch kernels verify nothing: a pitched hand is a posture of the five axes, not of the four joints."""
    robot = palletiser()
    T = kin.fk(robot, robot.q_home)
    pitched = T @ kin.pose_from_xyz_rpy([0.0, 0.0, 0.0], [0.0, 0.3, 0.0])
    assert np.isnan(kin.ik_branches(robot, pitched)).all()
    assert not np.isnan(kin.ik_branches(robot, T)).all()
    assert kin.solve_ik(robot.free, pitched).status.value == "solved"
