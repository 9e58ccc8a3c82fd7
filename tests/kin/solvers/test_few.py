"""Arms with three to five joints: three parallel axes (`parallel5`), a last joint that turns the tool about its
point (`turned3`), and any other axes (`general5`)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from arms import reversed_at
from few import (
    DESKTOP,
    ELBOW3,
    ELBOW5,
    GENERAL,
    OFFSETS,
    PI,
    PITCH,
    RM501,
    SCORBOT,
    SPATIAL3,
    TURNED3,
    YOUBOT,
    arm,
    random_arm,
)

import kin
from kin import Status
from kin.axes import screw_x, screw_z
from kin.solvers import closed_form_of
from kin.solvers.general5 import General5
from kin.transforms import rotation_angle

FEW = (*PITCH, *GENERAL)
few = pytest.mark.parametrize("robot", FEW, ids=lambda robot: robot.id)
pitch = pytest.mark.parametrize("robot", PITCH, ids=lambda robot: robot.id)


def apart(a, b):
    """Largest joint difference, whole turns aside."""
    return np.abs((a - b + PI) % (2 * PI) - PI).max(axis=-1)


def turn(a, b):
    """A rotation ``(3, 3)`` about x and z."""
    return (screw_x(0.0, a) @ screw_z(b, 0.0))[:3, :3]


def configurations(robot, count, seed=0):
    """Random configurations, and their poses."""
    q = np.random.default_rng(seed).uniform(-PI, PI, (count, robot.n))
    return q, kin.fk(robot, q)


def missed(robot, count):
    """How many of so many random poses do not have their own configuration among their solutions."""
    q, T = configurations(robot, count)
    found = apart(kin.ik_branches(robot, T), q[:, None])
    return int((~(np.nan_to_num(found, nan=9.0).min(axis=1) < 1e-6)).sum())


def test_families():
    assert {closed_form_of(robot).name for robot in PITCH} == {"parallel5"}
    assert {closed_form_of(robot).name for robot in GENERAL} == {"general5"}
    assert set(kin.branch_names(RM501)) == set(kin.branch_names(ELBOW3))
    for robot in (RM501, YOUBOT, ELBOW3):
        for q in configurations(robot, 30)[0]:
            shoulder, elbow = kin.branch_of(robot, q).split(" · ")
            x = (screw_z(-q[0], 0.0) @ kin.fk(robot, q))[0, 3]
            assert shoulder == ("shoulder front" if x > 0 else "shoulder back")
            assert elbow == ("elbow positive" if q[2] > 0 else "elbow negative")
    assert kin.branch_names(SPATIAL3) == ()
    five = arm("planar", *[(0, 0, 0.3, 0)] * 5)
    ball = arm("ball", (0, 0, 0, PI / 2), (0, 0, 0, -PI / 2), (0, 0.3, 0.1, 0))
    assert closed_form_of(five) is closed_form_of(ball) is None


@few
def test_every_configuration_is_found(robot):
    assert missed(robot, 300 if robot in GENERAL else 1000) == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    "robot", [*FEW, *(random_arm(n, k) for n in (3, 4, 5) for k in range(2, 7))], ids=lambda robot: robot.id
)
def test_every_configuration_is_found_of_many(robot):
    count = 100_000 if robot in PITCH else 20_000
    assert missed(robot, count) <= count // 10_000


@few
def test_poses_of_the_arm_are_solved_with_all_postures(robot):
    for q, T in zip(*configurations(robot, 20, 1), strict=True):
        result = kin.solve_ik(robot, T)
        assert result.status is Status.SOLVED
        assert result.complete
        assert min(apart(s.q, q) for s in result.solutions) < 1e-6
        assert all(s.position_error < 1e-9 and s.rotation_error < 1e-9 for s in result.solutions)


@few
def test_postures_beyond_a_limit_are_listed(robot):
    tight = replace(robot, rows=tuple(replace(row, limits=(-0.5, 0.5)) for row in robot.rows))
    q, T = configurations(robot, 20, 2)
    for own, pose in zip(q, T, strict=True):
        result = kin.solve_ik(tight, pose)
        inside = (np.abs(own) <= 0.5).all()
        assert inside or result.status in (Status.LIMITS, Status.SOLVED)
        if result.status is Status.LIMITS:
            assert min(apart(b.q, own) for b in result.blocked) < 1e-6


@pitch
def test_the_nearest_rotation_of_other_targets(robot):
    """On each shoulder side, no ψ and θ5 come nearer to the orientation with the same point."""
    if not closed_form_of(robot).geometry.tool_on_axis:
        return
    rng = np.random.default_rng(3)
    for T in configurations(robot, 5, 3)[1]:
        turned = T.copy()
        turned[:3, :3] = T[:3, :3] @ turn(*rng.uniform(-0.8, 0.8, 2))
        rows = kin.ik_branches(robot, turned)
        rows = rows[~np.isnan(rows[:, 0])]
        if not len(rows):
            continue
        found = kin.fk(robot, rows)
        assert np.abs(found[:, :3, 3] - T[:3, 3]).max() < 1e-9
        for row, pose in zip(rows, found, strict=True):
            least = rotation_angle(pose[:3, :3], turned[:3, :3])
            for step in rng.uniform(-0.05, 0.05, (20, robot.n)):
                other = row + step
                other[0] = row[0]  # turns the plane, which the point fixes
                R = kin.fk(robot, other)[:3, :3]
                assert rotation_angle(R, turned[:3, :3]) > least - 1e-9
        result = kin.solve_ik(robot, turned)
        assert result.status in (Status.APPROXIMATE, Status.LIMITS)
        assert result.solutions[0].position_error < 1e-9


def test_targets_above_the_base():
    """The tool's point on axis 1: the orientation gives θ1, or a sum of θ1 and θ5."""
    for robot in (RM501, YOUBOT):
        rng = np.random.default_rng(4)
        tried = 0
        while tried < 20:
            q = rng.uniform(-2.0, 2.0, 5)
            form = closed_form_of(robot)
            g = form.geometry
            # The first two links at random; the tool points at axis 1 from where axis 4 is, if it is near enough.
            t = g.sign * q + g.offset
            x = g.a1 + g.a2 * math.cos(t[1]) + g.a3 * math.cos(t[1] + t[2])
            if abs(x) > g.q:
                continue
            q[3] = g.sign[3] * (math.asin(x / g.q) - t[1] - t[2] - g.offset[3])
            T = kin.fk(robot, q)
            result = kin.solve_ik(robot, T, q_seed=q)
            assert min(apart(s.q, q) for s in result.solutions) < 1e-5
            tried += 1
    up = np.zeros(5)
    up[1] = PI / 2  # RM-501 points straight up
    T = kin.fk(RM501, up + np.array([0.3, 0, 0, 0, 0.4]))
    assert np.hypot(T[0, 3], T[1, 3]) < 1e-12
    for seed in (0.0, 0.5, 2.0):
        result = kin.solve_ik(RM501, T, q_seed=(seed, PI / 2, 0.1, 0, 0))
        assert result.status is Status.SOLVED
        assert result.best.rotation_error < 1e-9


def test_a_point_leaves_pitch_and_roll_free():
    for robot in (SCORBOT, DESKTOP):
        for q, T in zip(*configurations(robot, 10, 5), strict=True):
            result = kin.solve_ik(robot, T[:3, 3], task="position", q_seed=q)
            assert np.abs(result.best.q - q).max() < 1e-6
            psi = result.redundancy[0]
            assert psi.name == "psi"
            for low, high in psi.intervals:
                for value in (low + 1e-6, 0.5 * (low + high), high - 1e-6):
                    asked = kin.solve_ik(robot, T[:3, 3], task="position", redundancy={"psi": value})
                    assert asked.status is Status.SOLVED
                    assert asked.redundancy[0].value == pytest.approx(value, abs=1e-9)
                    assert asked.best.position_error < 1e-9


def test_an_approach_leaves_the_roll_free():
    for robot in (SCORBOT, RM501, YOUBOT):
        for q, T in zip(*configurations(robot, 10, 6), strict=True):
            result = kin.solve_ik(robot, T, task="approach", redundancy={"theta5": 0.7})
            assert result.status is Status.SOLVED
            assert result.complete
            assert all(s.q[4] == 0.7 for s in result.solutions)
            assert min(apart(s.q[:4], q[:4]) for s in result.solutions) < 1e-6


def test_a_gripper_beside_the_roll_axis_leaves_neither_point_nor_direction_free():
    form = closed_form_of(OFFSETS)
    assert [form.handles(task) for task in range(4)] == [True, False, False, False]
    counts = [
        len(kin.solve_ik(OFFSETS, T[:3, 3], task="position", q_seed=q).solutions)
        for q, T in zip(*configurations(OFFSETS, 10), strict=True)
    ]
    assert max(counts) > 1  # the other postures of the pose that is found


def test_five_joints_and_a_direction():
    """With the roll about the tool free, all postures of point and direction are found, and those of a pose."""
    for q, T in zip(*configurations(ELBOW5, 20, 7), strict=True):
        result = kin.solve_ik(ELBOW5, T, task="approach")
        assert result.complete
        assert len(result.solutions) >= 4
        assert min(apart(s.q, q) for s in result.solutions) < 1e-6
        rolled = T @ screw_z(0.5, 0.0)
        other = kin.solve_ik(ELBOW5, rolled)
        assert other.status is Status.APPROXIMATE
        assert other.solutions[0].compromise == "roll"


def test_a_point_has_up_to_four_postures_of_three_joints():
    counts = set()
    for robot in (ELBOW3, SPATIAL3, random_arm(3, 1)):
        for q, T in zip(*configurations(robot, 30, 8), strict=True):
            result = kin.solve_ik(robot, T[:3, 3], task="position")
            assert result.complete
            assert min(apart(s.q, q) for s in result.solutions) < 1e-6
            counts.add(len(result.solutions))
            assert kin.solve_ik(robot, T).solutions
    assert counts == {2, 4}
    far = kin.solve_ik(SPATIAL3, (5.0, 0.0, 0.0), task="position")
    assert (far.status, far.cause) == (Status.UNREACHABLE, "too far")


@pytest.mark.parametrize("alpha", [1.57, 1.5708, 1.1])
@pytest.mark.parametrize("sliding", [(), (2,), (0,), (0, 1)], ids=str)
def test_three_joints_in_no_family_are_solved_as_three(alpha, sliding):
    """With virtual joints, nearly special axes would make six joints that take half a minute to match."""
    robot = slides(
        arm(f"typed-{alpha}", (0.2, 0.3, 0.1, alpha), (0, 0.05, 0.3, alpha), (0, 0.1, 0.2, 0)), *sliding
    )
    form = closed_form_of(robot)
    assert not isinstance(form, General5) or form.form.named
    for q in robot.random_q(np.random.default_rng(6), 10):
        result = kin.solve_ik(robot, kin.fk(robot, q)[:3, 3], task="position")
        assert result.complete
        assert min(moved(s.q, q, robot) for s in result.solutions) < 1e-6
    far = kin.solve_ik(robot, (9.0, 0.0, 0.0), task="position")
    assert far.status in (Status.UNREACHABLE, Status.LIMITS)


def test_a_point_on_axis_1_keeps_joint_1_of_the_seed():
    """The polynomial vanishes there: joint 1 is free."""
    robot = arm("on-axis", (0, 0.2, 0.3, 1.1), (0, 0.1, 0.3, -0.8), (0, 0.1, 0.25, 0))
    q = next(
        q for q in robot.random_q(np.random.default_rng(7), 2000) if np.hypot(*kin.fk(robot, q)[:2, 3]) < 0.02
    )
    for _ in range(20):  # Newton steps of joints 2 and 3 to the axis
        J, point = kin.jacobian(robot, q)[:2, 1:], kin.fk(robot, q)[:2, 3]
        q = q - np.append(0.0, np.linalg.solve(J, point))
    turned_first = np.array([0.7, 0.0, 0.0])
    found = kin.solve_ik(robot, kin.fk(robot, q)[:3, 3], task="position", q_seed=q + turned_first)
    assert not found.complete
    np.testing.assert_allclose(found.best.q, q + turned_first, atol=1e-6)


def test_reversed_joints_and_the_other_convention_change_nothing():
    """Axes as lines decide: a table with a joint that counts the other way is solved by the same family."""
    for robot in (SCORBOT, DESKTOP, ELBOW3):
        turned = reversed_at(robot, (1, 2))
        assert closed_form_of(turned).name == closed_form_of(robot).name
        for q, T in zip(*configurations(robot, 10, 9), strict=True):
            a, b = kin.solve_ik(robot, T), kin.solve_ik(turned, T)
            assert len(a.solutions) == len(b.solutions)
            signs = np.where(np.isin(np.arange(robot.n), (1, 2)), -1.0, 1.0)
            assert min(apart(s.q * signs, q) for s in b.solutions) < 1e-6


def test_no_posture_is_lost_where_the_last_axis_is_almost_the_approach_axis():
    rows = (
        (0, 0, 0, 1.6502),
        (-PI / 2, 0, 0, -PI / 2),
        (-PI / 2, 0.461753, 0, PI / 2),
        (0.3, 0, -0.319846, 0),
        (0, -0.281150, -0.470773, 3.1416),
    )
    assert missed(arm("nearly-rolled", *rows), 300) == 0


@pytest.mark.parametrize("robot", [RM501, SCORBOT, ELBOW5], ids=lambda robot: robot.id)
def test_a_last_joint_that_turns_the_z_axis_a_little_is_no_roll(robot):
    """Without limits, so that a descent may turn the last joint as far as it must."""
    rows = (*robot.rows[:-1], replace(robot.rows[-1], alpha=3.141593))
    table = replace(robot, id=f"{robot.id}-tilted", rows=rows)
    for T in configurations(table, 40)[1]:
        found = kin.solve_ik(table, T, task="approach", respect_limits=False)
        assert found.status is Status.SOLVED
        assert found.solutions[0].rotation_error < 1e-9


# -- a last joint that turns the tool about its point -------------------------------------------------------------

TASKS = ("pose", "approach", "position")


def moved(a, b, robot):
    """Largest joint difference, whole turns of revolute joints aside."""
    return np.where(robot.revolute, np.abs((a - b + PI) % (2 * PI) - PI), np.abs(a - b)).max(axis=-1)


def slides(robot, *joints):
    """The same table with some joints that slide."""
    rows = (
        replace(r, kind="prismatic", limits=(-0.4, 0.4)) if i in joints else r for i, r in enumerate(robot.rows)
    )
    return replace(robot, id=f"{robot.id}-{joints}", rows=tuple(rows))


ROLL = arm("roll3", (0, 0.3, 0.1, PI / 2), (0, 0, 0.4, PI / 2), (0, 0.2, 0, 0))
ELBOW = arm("elbow-turn3", (0, 0.1, 0.4, 0), (0, 0, 0.3, PI / 2), (0, 0, 0, 0.5))
# A camera that pans, tilts and rolls about its own point.
CAMERA = arm("camera3", (0, 0.2, 0, PI / 2), (PI / 2, 0, 0, PI / 2), (0, 0, 0, 0))
TURNED_THREE = (TURNED3, ROLL, ELBOW, CAMERA, slides(TURNED3, 0), slides(TURNED3, 1), slides(ROLL, 0, 1))
TURNED_FOUR = (
    arm("four", (0.3, 0.2, 0.3, 1.1), (-0.4, 0.1, 0.25, 0.7), (0.5, 0.1, 0.2, -0.9), (0.2, 0.15, 0, 0.4)),
    arm("four-roll", (0.3, 0.2, 0.3, 1.1), (-0.4, 0.1, 0.25, 0.7), (0.5, 0.1, 0.2, -0.9), (0.2, 0.15, 0, 0)),
    arm("four-pitch", (0, 0.2, 0.05, PI / 2), (0, 0, 0.3, 0), (0, 0, 0.2, 0), (0, 0.1, 0, 0)),
)
turned = pytest.mark.parametrize("robot", [*TURNED_THREE, *TURNED_FOUR], ids=lambda robot: robot.id)


@turned
def test_every_task_of_a_turned_tool_has_a_closed_form(robot):
    form = closed_form_of(robot)
    assert form.name == {3: "turned3", 4: "parallel5" if robot.id == "four-pitch" else "general5"}[robot.n]
    for q in robot.random_q(np.random.default_rng(1), 8):
        T = kin.fk(robot, q)
        for task in TASKS if robot is not CAMERA else ("pose",):
            result = kin.solve_ik(robot, T[:3, 3] if task == "position" else T, task=task, q_seed=q)
            assert (result.status, result.complete) == (Status.SOLVED, True)
            assert min(moved(s.q, q, robot) for s in result.solutions) < 1e-6
            assert all(max(s.position_error, s.rotation_error) < 1e-9 for s in result.solutions)
        rows = kin.ik_branches(robot, T)
        assert np.nan_to_num(moved(rows, q, robot), nan=9.0).min() < 1e-6


@turned
def test_a_point_leaves_the_last_joint_free(robot):
    if robot is CAMERA or robot.id == "four-pitch":  # its point does not move at all; its parameter is the pitch
        return
    name = f"theta{robot.n}"
    for q in robot.random_q(np.random.default_rng(2), 4):
        found = kin.solve_ik(robot, kin.fk(robot, q)[:3, 3], task="position", redundancy={name: 0.7})
        assert found.best.q[-1] == 0.7
        (last,) = (r for r in found.redundancy if r.name == name)
        assert last.intervals == ((-PI, PI),)
    far = kin.solve_ik(robot, (9.0, 0.0, 0.0), task="position")
    assert far.status is Status.UNREACHABLE


def test_orientations_that_three_joints_do_not_reach_keep_the_point():
    for robot in (TURNED3, ELBOW):
        for q in robot.random_q(np.random.default_rng(3), 4):
            T = kin.fk(robot, q) @ kin.pose_from_xyz_rpy([0, 0, 0], [0.2, 0.1, 0.3])
            result = kin.solve_ik(robot, T)
            assert result.status is Status.APPROXIMATE
            assert result.solutions[0].position_error < 1e-9


def test_limits_and_names_of_a_turned_tool():
    assert set(kin.branch_names(ELBOW)) == {"elbow positive", "elbow negative"}
    assert kin.branch_names(TURNED3) == ()
    for q in ELBOW.random_q(np.random.default_rng(4), 5):
        T = kin.fk(ELBOW, q)
        assert kin.branch_of(ELBOW, q) == ("elbow positive" if q[1] > 0 else "elbow negative")
        tight = kin.solve_ik(ELBOW, T, limits=[None, None, (-3.0, -2.9)])
        assert tight.status is (Status.SOLVED if -3.0 <= q[2] <= -2.9 else Status.LIMITS)


def test_a_rounded_table_with_a_turned_tool():
    typed = replace(ROLL, rows=(replace(ROLL.rows[0], alpha=1.5708), *ROLL.rows[1:]))
    for q in ROLL.random_q(np.random.default_rng(5), 5):
        result = kin.solve_ik(typed, kin.fk(typed, q))
        assert result.status is Status.SOLVED
        assert min(moved(s.q, q, ROLL) for s in result.solutions) < 1e-6
    assert closed_form_of(typed).name == "turned3"


def test_joints_that_do_the_same_are_left_to_descents():
    """Two joints about one line: infinitely many configurations for every pose."""
    twice = arm("twice", (0, 0.2, 0.3, PI / 2), (0, 0.1, 0, 0), (0, 0.1, 0, 0.4))
    assert closed_form_of(twice) is None
    result = kin.solve_ik(twice, kin.fk(twice, (0.3, 0.4, 0.5)))
    assert (result.status, result.complete) == (Status.SOLVED, False)
