"""Arms with one or two joints of any kind (`pair2`), and planar arms with four joints (`planar4`)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from few import OBLIQUE2, PI, PLANAR2, PLANAR4, arm, random_arm, typed_arm

import kin
from kin import Status
from kin.axes import is_zero, joint_axes
from kin.solvers import closed_form_of

TASKS = ("pose", "approach", "position")


def sliding(robot, *joints):
    """The same table with some joints that slide."""
    rows = tuple(
        replace(row, kind="prismatic", limits=(-0.5, 0.5)) if i in joints else row
        for i, row in enumerate(robot.rows)
    )
    return replace(robot, id=f"{robot.id}-slides{joints}", rows=rows)


def apart(robot, a, b):
    """Largest joint difference, whole turns aside."""
    turns = np.abs((a - b + PI) % (2 * PI) - PI)
    return np.where(robot.revolute, turns, np.abs(a - b)).max(axis=-1)


def small_arms(count):
    """One and two joints: random and typed tables, either convention, some joints slide."""
    for seed in range(count):
        joints = 1 + seed % 2
        robot = typed_arm(joints, seed) if seed % 3 else random_arm(joints, seed)
        robot = sliding(robot, *((), (0,), (joints - 1,), (0, joints - 1))[seed // 2 % 4])
        yield replace(robot, convention="modified") if seed % 5 == 0 else robot


def found_everywhere(robot, count):
    """Whether random configurations are among the answers to all tasks, and among the branches."""
    for q in robot.random_q(np.random.default_rng(5), count):
        T = kin.fk(robot, q)
        rows = kin.ik_branches(robot, T)
        assert np.nan_to_num(apart(robot, rows, q), nan=9.0).min() < 1e-6
        for task in TASKS:
            result = kin.solve_ik(robot, T[:3, 3] if task == "position" else T, task=task, q_seed=q)
            assert result.status is Status.SOLVED
            assert apart(robot, result.best.q, q) < 1e-6
            assert all(max(s.position_error, s.rotation_error) < 1e-9 for s in result.solutions)


def do_the_same(robot):
    """Whether both joints turn about one line or slide along one direction."""
    axes = joint_axes(robot)
    if robot.n == 1 or not is_zero(*np.cross(axes[0].direction, axes[1].direction)):
        return False
    if axes[0].slides or axes[1].slides:
        return axes[0].slides and axes[1].slides
    return is_zero(*np.cross(axes[1].point - axes[0].point, axes[0].direction))


@pytest.mark.parametrize("part", range(4))
def test_one_or_two_joints_of_any_kind(part):
    solved = 0
    for robot in list(small_arms(64))[part::4]:
        form = closed_form_of(robot)
        assert (form is None) == do_the_same(robot)
        if form is not None:
            assert form.name == "pair2"
            found_everywhere(robot, 2)
            solved += 1
    assert solved > 12


@pytest.mark.slow
def test_one_or_two_joints_of_any_kind_many():
    for robot in small_arms(2000):
        if closed_form_of(robot) is not None:
            found_everywhere(robot, 5)


def test_two_parallel_axes_have_an_elbow():
    assert set(kin.branch_names(PLANAR2)) == {"elbow positive", "elbow negative"}
    assert kin.branch_names(OBLIQUE2) == ()
    for q in PLANAR2.random_q(np.random.default_rng(1), 20):
        result = kin.solve_ik(PLANAR2, kin.fk(PLANAR2, q)[:3, 3], task="position")
        assert result.complete
        assert {s.branch for s in result.solutions} == {"elbow positive", "elbow negative"}
        for s in result.solutions:
            offset = 0.1  # the second row's own angle
            assert s.branch == ("elbow positive" if math.sin(s.q[1] + offset) > 0 else "elbow negative")
        assert len(kin.solve_ik(PLANAR2, kin.fk(PLANAR2, q)).solutions) == 1
    straight = kin.solve_ik(PLANAR2, kin.fk(PLANAR2, (0.3, -0.1))[:3, 3], task="position")
    assert len(straight.solutions) == 1
    far = kin.solve_ik(PLANAR2, (2.0, 0.0, 0.05), task="position")
    assert (far.status, far.cause) == (Status.UNREACHABLE, "too far")


def test_a_last_joint_that_keeps_the_tool_is_free():
    """The tool on the last axis: a point leaves joint 2 free, a direction along it too."""
    robot = arm("roll2", (0, 0.1, 0.3, PI / 2), (0, 0.2, 0, 0))
    for q in robot.random_q(np.random.default_rng(2), 5):
        T = kin.fk(robot, q)
        for task in ("approach", "position"):
            result = kin.solve_ik(robot, T[:3, 3] if task == "position" else T, task=task, redundancy=0.7)
            assert result.complete
            assert [r.name for r in result.redundancy] == ["theta2"]
            assert result.best.q == pytest.approx((q[0], 0.7), abs=1e-9)
    assert len(kin.solve_ik(robot, T).solutions) == 1


def test_one_pose_of_two_joints_that_few_digits_miss():
    """What a rounded target misses is met within its precision."""
    q = np.array([0.4, -0.7])
    target = kin.fk(OBLIQUE2, q).round(5)
    result = kin.solve_ik(OBLIQUE2, target)
    assert result.status is Status.SOLVED
    assert apart(OBLIQUE2, result.best.q, q) < 1e-4


def planar(seed):
    """A random planar arm with four joints, half of them with narrow limits."""
    rng = np.random.default_rng(seed)
    rows = [
        (*rng.uniform((-3, -0.3, 0.1), (3, 0.3, 0.5)).tolist(), float(rng.choice((0.0, PI)))) for _ in range(4)
    ]
    robot = arm(f"planar4-{seed}", *rows, turned=0.7 * (seed % 3 == 0))
    if seed % 2:
        limits = rng.uniform((0.3, 0.5), (2.5, 2.5), (4, 2)).tolist()
        robot = replace(
            robot,
            rows=tuple(replace(row, limits=(-a, b)) for row, (a, b) in zip(robot.rows, limits, strict=True)),
        )
    return robot


@pytest.mark.parametrize("seed", range(8))
def test_four_parallel_axes(seed):
    robot = planar(seed)
    assert closed_form_of(robot).name == "planar4"
    for q in robot.random_q(np.random.default_rng(seed), 4):
        T = kin.fk(robot, q)
        assert kin.solve_ik(robot, T).complete
        result = kin.solve_ik(robot, T, q_seed=q)
        assert np.abs(result.best.q - q).max() < 1e-6
        (phi,) = result.redundancy
        for low, high in phi.intervals:
            for value in (low + 1e-6, 0.5 * (low + high), high - 1e-6):
                asked = kin.solve_ik(robot, T, redundancy={"phi": value})
                assert asked.status is Status.SOLVED
                assert asked.redundancy[0].value == pytest.approx(value, abs=1e-9)
        rows = kin.ik_branches(robot, T, phi.value)
        assert np.nan_to_num(apart(robot, rows, q), nan=9.0).min() < 1e-6
        point = kin.solve_ik(robot, T[:3, 3], task="position")
        assert point.status is Status.SOLVED
        assert not point.complete


def test_the_ranges_of_phi_leave_nothing_out():
    """Values outside the ranges have no solution inside the limits on that branch."""
    robot = planar(1)
    for q in robot.random_q(np.random.default_rng(3), 3):
        T = kin.fk(robot, q)
        result = kin.solve_ik(robot, T)
        for value in np.linspace(-3.1, 3.1, 60).tolist():
            inside = any(low <= value <= high for low, high in result.redundancy[0].intervals)
            asked = kin.solve_ik(robot, T, redundancy={"phi": value})
            assert (asked.status is Status.SOLVED) == inside


def test_four_parallel_axes_and_a_name():
    assert set(kin.branch_names(PLANAR4)) == {"elbow left", "elbow right"}
    for q in PLANAR4.random_q(np.random.default_rng(4), 20):
        name = kin.branch_of(PLANAR4, q)
        # Seen from axis 1 towards the third axis, the elbow is on the right where joint 2 turns to the left.
        assert name == ("elbow right" if math.sin(q[1] + 0.1) > 0 else "elbow left")
