"""Arms with one or two joints of any kind (`pair2`), and planar arms with four joints (`planar4`)."""

from __future__ import annotations

import math
import tracemalloc
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


FOLDED = kin.Robot.from_dh([(0, 0, 1, 0), (0, 0, 1, 0)])
FOLDED_ACROSS = kin.Robot.from_dh([(0, 0, 1, PI / 2), (0, 0, 1, 0)])
POINTER = kin.Robot.from_dh([(0, 0.3, 0, PI / 2), (PI / 2, 0, 0, PI / 2)], tool=kin.pose_from_xyz_rpy([0, 0, 0.2]))


@pytest.mark.parametrize(
    ("robot", "second", "task"),
    [
        (FOLDED, PI, "position"),
        (FOLDED_ACROSS, PI, "position"),
        (POINTER, PI / 2, "position"),
        (POINTER, -PI / 2, "approach"),
    ],
)
def test_a_point_on_axis_1_leaves_joint_1_free(robot, second, task):
    T = kin.fk(robot, [0.5, second])
    target = T[:3, 3] if task == "position" else T
    result = kin.solve_ik(robot, target, task=task, q_seed=[1.7, 0.3])
    assert (result.complete, result.details.infinite, result.details.free) == (True, True, ("θ1",))
    assert result.best.q == pytest.approx((1.7, second), abs=1e-7)
    assert result.redundancy[0].intervals == ((-PI, PI),)
    narrow = kin.solve_ik(robot, target, task=task, q_seed=[1.7, 0.3], limits=[(-0.2, 0.4), None])
    assert narrow.best.q == pytest.approx((0.4, second), abs=1e-7)
    assert narrow.redundancy[0].intervals == ((-0.2, 0.4),)
    assert not kin.solve_ik(robot, T).details.infinite
    beside = kin.fk(robot, [0.5, second + 1e-3])
    assert not kin.solve_ik(robot, beside[:3, 3], task="position").details.infinite


def test_branches_of_two_joints_exist_at_reachable_points_only():
    T = np.eye(4)
    for x, exists in ((2.0, True), (2.0 + 1e-8, False), (2.015, False)):
        T[0, 3] = x
        assert np.isnan(kin.ik_branches(FOLDED, T)).all() != exists
    tilted = kin.fk(OBLIQUE2, (0.4, -0.7)) @ kin.pose_from_xyz_rpy([0, 0, 0], [1e-4, 0, 0])
    rows = kin.ik_branches(OBLIQUE2, tilted)
    (row,) = rows[~np.isnan(rows[:, 0])]
    assert np.linalg.norm(kin.fk(OBLIQUE2, row)[:3, 3] - tilted[:3, 3]) < 1e-12


def test_a_batch_of_two_joints_is_solved_in_chunks():
    targets = kin.fk(OBLIQUE2, OBLIQUE2.random_q(np.random.default_rng(3), 2500))
    kin.ik_branches(OBLIQUE2, targets[:1])
    tracemalloc.start()
    rows = kin.ik_branches(OBLIQUE2, targets)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4e6
    for k in (0, 1023, 1024, 2499):
        assert np.array_equal(rows[k], kin.ik_branches(OBLIQUE2, targets[k]), equal_nan=True)


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


def test_the_end_of_the_reach_hides_no_posture():
    """The range of φ that ends there is closed: nearest to the seed, both postures are there and stay apart."""
    four = kin.Robot.from_dh([(0, 0, a, 0) for a in (0.4, 0.3, 0.2, 0.1)])
    three = kin.Robot.from_dh([(0, 0, a, 0) for a in (0.4, 0.3, 0.2)])
    rng = np.random.default_rng(0)
    for q in ([-0.084988, 2.336927, 2.604261, -0.853229], *four.random_q(rng, 60)):
        for robot, target, task in (
            (four, kin.fk(four, q), "pose"),
            (three, kin.fk(three, q[:3])[:3, 3], "position"),
        ):
            result = kin.solve_ik(robot, target, task=task)
            assert {s.branch for s in result.solutions} == {"elbow left", "elbow right"}
            for solution in result.solutions:
                assert abs(math.sin(solution.q[1])) > 1e-5
                for low, high in solution.redundancy[0].intervals:
                    assert high - low > 1e-7


def test_four_parallel_axes_and_a_name():
    assert set(kin.branch_names(PLANAR4)) == {"elbow left", "elbow right"}
    for q in PLANAR4.random_q(np.random.default_rng(4), 20):
        name = kin.branch_of(PLANAR4, q)
        # Seen from axis 1 towards the third axis, the elbow is on the right where joint 2 turns to the left.
        assert name == ("elbow right" if math.sin(q[1] + 0.1) > 0 else "elbow left")


@pytest.mark.parametrize("seed", range(6))
def test_a_point_of_four_parallel_axes(seed):
    """θ4 and φ are free: the ranges are the values for which there is a posture."""
    robot = planar(seed)
    rng = np.random.default_rng(seed)
    for q in robot.random_q(rng, 2):
        point = kin.fk(robot, q)[:3, 3]
        assert np.abs(kin.solve_ik(robot, point, task="position", q_seed=q).best.q - q).max() < 1e-6
        result = kin.solve_ik(robot, point, task="position", q_seed=robot.random_q(rng))
        assert (result.status, result.complete, result.details.infinite) == (Status.SOLVED, True, True)
        assert [r.name for r in result.redundancy] == ["theta4", "phi"]
        for s in result.solutions:
            for own, held in zip(s.redundancy, ({}, {"theta4": s.redundancy[0].value}), strict=True):
                for low, high in own.intervals:
                    for value in (low + 1e-7, 0.5 * (low + high), high - 1e-7) if high - low > 1e-6 else ():
                        asked = {own.name: value, **held}
                        found = kin.solve_ik(robot, point, task="position", redundancy=asked, branch=s.branch)
                        assert found.status is Status.SOLVED
                        assert {r.name: r.value for r in found.redundancy}.items() >= asked.items()
        intervals = result.redundancy[0].intervals
        for value in rng.uniform(robot.lower[3], robot.upper[3], 8).tolist():
            inside = any(low <= value <= high for low, high in intervals)
            asked = kin.solve_ik(robot, point, task="position", redundancy={"theta4": value})
            assert (asked.status is Status.SOLVED) == inside
        asked = kin.solve_ik(robot, point, task="position", redundancy={"phi": float(q[:3].sum()) + 0.3})
        assert asked.status in (Status.SOLVED, Status.LIMITS, Status.UNREACHABLE)


def test_a_point_at_the_border_of_the_workspace_of_four_parallel_axes():
    robot = kin.Robot.from_dh([(0, 0, a, 0) for a in (0.4, 0.3, 0.2, 0.1)])
    result = kin.solve_ik(robot, (math.cos(0.3), math.sin(0.3), 0.0), task="position")
    assert result.best.q == pytest.approx((0.3, 0.0, 0.0, 0.0), abs=1e-6)
    far = kin.solve_ik(robot, (1.001, 0.0, 0.0), task="position")
    assert (far.status, far.cause) == (Status.UNREACHABLE, "too far")
    along = kin.solve_ik(robot, kin.fk(robot, (0.3, 0.4, 0.5, 0.6)), task="approach")
    assert along.complete
    assert [r.name for r in along.redundancy] == ["theta4", "phi"]
