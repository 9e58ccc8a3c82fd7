"""Rounded tables: the same postures as the exact table, exact on the table as it is."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from few import arm, typed_arm

import kin
from kin import Status
from kin.solvers import closed_form_of
from kin.solvers.rounded import Rounded, intended_arm
from kin.solvers.rounded.table import _rotation

PI = math.pi
UR5 = kin.get_robot("ur5")
UR10 = replace(
    UR5,
    id="ur10",
    rows=tuple(
        replace(row, a=a, d=d)
        for row, a, d in zip(
            UR5.rows, (0, -0.612, -0.5723, 0, 0, 0), (0.1273, 0, 0, 0.163941, 0.1157, 0.0922), strict=True
        )
    ),
)
ARMS = (
    UR5,
    UR10,
    *(kin.get_robot(name) for name in ("puma560", "irb120", "pioneer5", "panda", "iiwa14", "stanford")),
)
arms = pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
QUARTERS = (1.570796326, 1.5707963, 1.5708)


def rounded(robot, quarter):
    """The same table with another number for a right angle."""

    def typed(angle):
        turns = round(angle / (PI / 2))
        return turns * quarter if abs(angle - turns * PI / 2) < 1e-12 else angle

    rows = tuple(replace(row, alpha=typed(row.alpha), theta=typed(row.theta)) for row in robot.rows)
    return replace(robot, id=f"{robot.id}-{quarter}", rows=rows)


def apart(robot, a, b):
    """Largest joint difference, whole turns aside."""
    gap = np.abs(a - b)
    turns = np.abs((a - b + PI) % (2 * PI) - PI)
    return np.where(robot.revolute, turns, gap).max(axis=-1)


@arms
@pytest.mark.parametrize("quarter", QUARTERS)
def test_a_rounded_table_has_the_postures_of_the_exact_one(robot, quarter):
    table = rounded(robot, quarter)
    form = closed_form_of(table)
    assert isinstance(form, Rounded)
    assert "rounding" in form.reason
    assert kin.branch_names(table) == kin.branch_names(robot)
    for q in robot.random_q(np.random.default_rng(0), 25):
        T = kin.fk(table, q)
        options = {"q_seed": q, "respect_limits": False}
        found = kin.solve_ik(table, T, **options)
        exact = kin.solve_ik(robot, kin.fk(robot, q), **options)
        assert found.status is Status.SOLVED
        postures = {s.branch: s.q for s in found.solutions}
        assert set(postures) == {s.branch for s in exact.solutions}
        near = 2e-2 if robot.n > 6 else 1e-3
        assert all(apart(robot, postures[s.branch], s.q) < near for s in exact.solutions)
        assert min(apart(robot, s.q, q) for s in found.solutions) < (1e-3 if robot.n > 6 else 1e-6)
        assert all(max(s.position_error, s.rotation_error) < 1e-9 for s in found.solutions)


@arms
def test_an_exact_table_is_left_alone(robot):
    assert intended_arm(robot) is None
    assert not isinstance(closed_form_of(robot), Rounded)


@pytest.mark.parametrize("quarter", QUARTERS)
def test_both_levels_agree(quarter):
    table = rounded(UR5, quarter)
    T = kin.fk(table, table.random_q(np.random.default_rng(1), 10))
    for pose, rows in zip(T, kin.ik_branches(table, T), strict=True):
        rich = kin.solve_ik(table, pose, respect_limits=False, images="nearest")
        assert (~np.isnan(rows[:, 0])).sum() == len(rich.solutions)
        assert np.abs(kin.fk(table, rows[~np.isnan(rows[:, 0])]) - pose).max() < 1e-9


def test_a_requested_value_is_kept_exactly():
    table = rounded(kin.get_robot("panda"), 1.5708)
    T = kin.fk(table, table.q_home)
    result = kin.solve_ik(table, T, redundancy={"theta7": 0.5})
    assert result.status is Status.SOLVED
    assert all(s.q[6] == 0.5 for s in result.solutions)


def test_a_table_far_from_its_family_has_a_general_solver():
    assert closed_form_of(rounded(UR5, 1.5715)).name == "general6"
    oblique = replace(UR5, rows=tuple(replace(row, alpha=row.alpha + 0.01) for row in UR5.rows))
    assert closed_form_of(oblique).name == "general6"


def test_short_offsets_and_turned_tools_are_rounding_too():
    rows = list(kin.get_robot("puma560").rows)
    rows[4] = replace(rows[4], a=3e-6, d=-2e-6)
    table = replace(kin.get_robot("puma560"), id="puma-offset", rows=tuple(rows))
    assert closed_form_of(table).name == "wrist6"
    for q in table.random_q(np.random.default_rng(2), 10):
        result = kin.solve_ik(table, kin.fk(table, q), respect_limits=False)
        assert len(result.solutions) == 8
        assert min(apart(table, s.q, q) for s in result.solutions) < 1e-6


def test_the_rotation_turns_counterclockwise():
    turned = _rotation(np.array([0.0, 0.0, 1.0]), 0.1) @ (1.0, 0.0, 0.0)
    assert np.allclose(turned, (math.cos(0.1), math.sin(0.1), 0.0), atol=1e-15)


@pytest.mark.parametrize("row", range(3))
def test_one_tilt_of_several_parallel_axes_counts_once(row):
    rows = list(UR5.rows)
    rows[row] = replace(rows[row], alpha=rows[row].alpha + 1e-5)
    table = replace(UR5, id=f"tilted{row}", rows=tuple(rows))
    assert intended_arm(table).off == pytest.approx(1e-5, rel=1e-3)
    assert closed_form_of(table).name == "parallel6"


def test_tilts_of_parallel_axes_in_a_row_and_of_the_tool():
    typed = 3.1416 - PI
    planar = arm("planar", (0, 0.1, 0.3, 3.1416), (0, 0, 0.25, 3.1416), (0, 0, 0.2, 3.1416))
    assert intended_arm(planar).off == pytest.approx(typed, rel=1e-3)
    assert closed_form_of(planar).name == "scara4"
    five = arm("five", *[(0, 0, 0.3, 3.1416)] * 5)
    assert intended_arm(five).off == pytest.approx(typed, rel=1e-3)
    # The typed twists are all that is off: without them nothing is.
    assert np.abs(kin.fk(intended_arm(five).table, np.zeros(5)) - kin.fk(five, np.zeros(5))).max() < 10.0 * typed


@pytest.mark.parametrize("name", ["puma560", "ur5", "scara", "pioneer5", "iiwa14", "stanford"])
def test_an_approach_direction_is_met_with_a_tool_that_is_tilted_a_little(name):
    robot = kin.get_robot(name)
    c, s = math.cos(2e-5), math.sin(2e-5)
    tilt = np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])
    tool = tuple(tuple(row) for row in (robot.T_last_tool @ tilt).tolist())
    table = replace(robot, id=f"{name}-tilted", tool=tool)
    for q in table.random_q(np.random.default_rng(4), 10):
        for task in ("pose", "approach"):
            found = kin.solve_ik(table, kin.fk(table, q), task=task)
            assert found.status is Status.SOLVED
            assert found.solutions[0].rotation_error < 1e-9


# Joints that are free in the family move the tool by the rounding only, and must move far.
PLANAR = arm("planar-typed", (0, 0.1, 0.3, 0), (0, 0, 0.25, 3.1416), (0, 0, 0.2, -1.5708))
FIVE = arm(
    "five-typed",
    (0, 0.15, 0, 1.5708),
    (0, 0, 0.26, 0),
    (0, 0, 0.42, 3.1416),
    (0.3, 0, -0.1, 1.5708),
    (0, 0, 0, 3.141593),
)


@pytest.mark.full
@pytest.mark.parametrize(("robot", "task"), [(PLANAR, "position"), (FIVE, "approach")])
def test_what_can_be_reached_is_never_called_unreachable(robot, task):
    for seed in range(2):
        for q in robot.random_q(np.random.default_rng(seed), 50):
            T = kin.fk(robot, q)
            found = kin.solve_ik(robot, T, task=task)
            assert found.status is Status.SOLVED
            assert np.abs(kin.fk(robot, found.solutions[0].q)[:3, 3] - T[:3, 3]).max() < 1e-9
            if found.solver == "numeric":
                assert not found.complete


# Tables whose free joints move the tool by the rounding, in two directions or at the joint limits as well.
SEEDS = (2, 10, 17, 31, 43, 67, 75, 86)


def not_solved(robot, count):
    """The targets, as (task, configuration), of random configurations that are not answered with a solution."""
    found = []
    for q in robot.random_q(np.random.default_rng(11), count):
        T = kin.fk(robot, q)
        for task in ("pose", "approach", "position"):
            target = T[:3, 3] if task == "position" else T
            result = kin.solve_ik(robot, target, task=task)
            if result.status is not Status.SOLVED:
                found.append((task, q.tolist(), result.status))
    return found


@pytest.mark.parametrize("seed", SEEDS)
def test_far_motion_in_weak_directions_is_found(seed):
    """Motions that move the tool by the rounding only, and that a target may need far."""
    assert not not_solved(typed_arm(2 + seed % 4, seed), 3)


def test_a_rounded_scara_has_its_other_posture_within_the_rounding():
    """The axes lean by the rounding, elsewhere with the other elbow: no joints make that posture exact."""
    scara = kin.get_robot("scara")
    rows = (scara.rows[0], replace(scara.rows[1], alpha=3.1416), *scara.rows[2:])
    table = replace(scara, id="scara-typed", rows=rows)
    for q in table.random_q(np.random.default_rng(0), 10):
        T = kin.fk(table, q)
        exact = kin.solve_ik(table, T, respect_limits=False)
        near = kin.solve_ik(table, T, respect_limits=False, position_tolerance=1e-5, rotation_tolerance=2e-5)
        assert len(exact.solutions) == 1
        assert {s.branch for s in near.solutions} == {"elbow left", "elbow right"}
        assert 1e-7 < max(s.rotation_error for s in near.solutions) < 2e-5


@pytest.mark.parametrize("far", [10.0, 1000.0])
def test_three_typed_joints_far_from_their_base(far):
    """Lengths beside offsets of hundreds of metres: little is left of the singular values."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        twists = rng.choice((1.5708, -1.5708, 0.0, 3.1416, 1.0), 3).tolist()
        rows = [(*rng.uniform((-3, 0, 0.1), (3, far, 0.4)).tolist(), twist) for twist in twists]
        assert not not_solved(arm(f"far-{far}-{seed}", *rows), 2)


@pytest.mark.slow
@pytest.mark.parametrize("joints", range(1, 6))
def test_no_target_of_random_typed_arms_is_called_unreachable(joints):
    for seed in range(200):
        assert not not_solved(typed_arm(joints, seed), 4), seed


def test_a_posture_of_a_rounded_table_outside_the_limits_is_blocked_not_unreachable():
    q = np.array([0.4, 0.6, -0.5])
    joints = tuple(replace(row, limits=(-2.0, 0.3)) for row in PLANAR.rows)
    found = kin.solve_ik(
        replace(PLANAR, id="narrow", rows=joints, home=(0.1, 0.1, 0.1)), kin.fk(PLANAR, q), task="position"
    )
    assert found.status is Status.LIMITS
    assert found.blocked
    assert all(max(posture.q) > 0.3 or min(posture.q) < -2.0 for posture in found.blocked)


@pytest.mark.slow
@pytest.mark.parametrize("quarter", QUARTERS)
@pytest.mark.parametrize("robot", [robot for robot in ARMS if robot.n == 6], ids=lambda robot: robot.id)
def test_every_configuration_is_found(robot, quarter):
    table = rounded(robot, quarter)
    q = table.random_q(np.random.default_rng(3), 10_000)
    T = kin.fk(table, q)
    found = apart(table, kin.ik_branches(table, T), q[:, None])
    assert int((~(np.nan_to_num(found, nan=9.0).min(axis=1) < 1e-5)).sum()) <= 10
