"""Paths: continuous where possible, otherwise with the fewest jumps, and the causes of jumps."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from arms import CHAPTER_ARMS, problem_of

import kin
from kin import InputError, Status, solve_ik
from kin.path import solve_path
from kin.path.configurations import meeting
from kin.transforms import rotation_angle, vector_angle

ROBOTS = CHAPTER_ARMS
SRS = "redundant7-craig"
PRINTED = "redundant7"


def rotated(T, degrees, axis="z"):
    """T rotated about one of its own axes."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    R = np.eye(4)
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = -s, s
    return T @ R


def moved(T, *shift):
    """T with its origin shifted in the base frame."""
    out = T.copy()
    out[:3, 3] += shift
    return out


def wave(robot, rng, count):
    """A random smooth joint path inside the limits ``(count, n)``; no joint moves more than 0.3 rad in a step."""
    t = np.linspace(0.0, 1.0, count)[:, None]
    shape = np.zeros((count, robot.n))
    for m in (0.3, 0.6):
        shape += rng.normal(size=robot.n) * np.sin(2 * np.pi * (m * t + rng.random(robot.n)))
    width = robot.upper - robot.lower
    shape *= width / np.abs(shape).max(axis=0)
    middle = robot.lower + width * (0.5 + 0.2 * rng.uniform(-1, 1, robot.n))
    return middle + shape * min(0.29, 0.3 / largest(shape))


def limited(robot, *degrees):
    """The robot with other limits, in degrees, one pair or None (no limits) per joint."""
    pairs = iter(degrees)
    rows = tuple(
        row
        if row.kind == "fixed"
        else replace(row, limits=None if (pair := next(pairs)) is None else tuple(np.radians(pair).tolist()))
        for row in robot.rows
    )
    return replace(robot, rows=rows)


def squares(q):
    return float((np.diff(q, axis=0) ** 2).sum())


def largest(q):
    return float(np.abs(np.diff(q, axis=0)).max())


def assert_exact(robot, targets, result, task="pose", rows=slice(None)):
    """Check with an independent FK that the waypoints in `rows` are met and the path is inside the limits."""
    assert result.q.shape == (len(targets), robot.n)
    assert robot.in_limits(result.q).all()
    assert not result.q.flags.writeable
    assert result.continuous == (result.jumps == ())
    q = result.q[rows]
    for T, wanted in zip(kin.fk(robot, q), np.asarray(targets)[rows], strict=True):
        assert np.abs(T[:3, 3] - wanted[:3, 3]).max() <= 1e-9
        if task == "pose":
            assert rotation_angle(T[:3, :3], wanted[:3, :3]) <= 1e-9
        if task == "approach":
            assert vector_angle(T[:3, 2], wanted[:3, 2]) <= 1e-9
    assert result.position_error[rows].max() <= 1e-9
    assert result.rotation_error[rows].max() <= 1e-9


# -- continuous paths ---------------------------------------------------------------------------------------------


@pytest.mark.full
@pytest.mark.parametrize("robot_id", ROBOTS)
def test_poses_of_smooth_motions_have_no_jump(robot_id):
    """Poses of random joint motions: the path is exact and hardly longer than the original motion."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(41)
    ratios = []
    for _ in range(20 if robot.n == 5 else 8):
        path = wave(robot, rng, 16)
        assert largest(path) < 0.5
        targets = kin.fk(robot, path)
        result = solve_path(robot, targets)
        assert_exact(robot, targets, result)
        assert result.continuous
        assert result.gaps == ()
        assert result.reason.startswith("Continuous through 16 waypoints: the largest step is ")
        assert largest(result.q) <= min(0.5 + 1e-6, 4.0 * largest(path))
        ratios.append(squares(result.q) / squares(path))
    assert max(ratios) < 1.3
    assert np.median(ratios) < 1.0 + 1e-6


@pytest.mark.parametrize("robot_id", ROBOTS)
@pytest.mark.parametrize("task", ["approach", "position"])
def test_redundant_tasks_have_no_jump(robot_id, task):
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(5)
    for _ in range(3):
        path = wave(robot, rng, 24)
        targets = kin.fk(robot, path)
        result = solve_path(robot, targets if task == "approach" else targets[:, :3, 3], task=task)
        assert_exact(robot, targets, result, task)
        assert result.continuous
        assert result.gaps == ()
        assert squares(result.q) < 1.1 * squares(path)


def test_masked_waypoints_have_no_jump():
    """The mask keeps height and inclination of the tool; the other coordinates may have any value."""
    robot = kin.get_robot(SRS)
    path = wave(robot, np.random.default_rng(8), 20)
    targets = kin.fk(robot, path)
    result = solve_path(robot, targets, mask=(False, False, True, True, False, False), mask_frame="base")
    assert result.continuous
    assert result.gaps == ()
    assert result.solver == "numeric"
    assert np.abs(kin.fk(robot, result.q)[:, 2, 3] - targets[:, 2, 3]).max() <= 1e-9
    assert squares(result.q) < 0.5 * squares(path)


@pytest.mark.parametrize("robot_id", [PRINTED, SRS])
def test_the_redundancy_parameter_changes_smoothly(robot_id):
    """On a slow arc, second differences of the joints are far below the steps of the sampling grid."""
    robot = kin.get_robot(robot_id)
    path = np.radians([10, 40, 20, 60, 30, 50, 10]) + np.sin(np.linspace(0, 2, 61))[:, None] * np.radians(
        [60, -20, 30, 25, -40, 20, 70]
    )
    result = solve_path(robot, kin.fk(robot, path))
    assert result.continuous
    assert squares(result.q) <= squares(path)
    assert np.abs(np.diff(result.q, 2, axis=0)).max() < 0.004


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_closed_circles(robot_id):
    """The tool point moves on a circle with constant orientation."""
    robot = kin.get_robot(robot_id)
    home = np.radians([90, 60, 60, 30, 30]) if robot.n == 5 else np.radians([20, 40, 10, 70, 30, 40, 20])
    T = kin.fk(robot, home)
    angles = np.linspace(0, 2 * np.pi, 49)
    targets = [moved(T, 0.02 * math.cos(a) - 0.02, 0.02 * math.sin(a), 0.0) for a in angles]
    task = "approach" if robot.n == 5 else "pose"
    result = solve_path(robot, targets, task=task, q_start=home)
    assert_exact(robot, targets, result, task)
    assert result.continuous
    assert largest(result.q) < 0.15
    assert np.abs(result.q[0] - home).max() < 0.3


def test_a_single_waypoint_is_the_solution_nearest_to_the_start():
    for robot_id in ROBOTS:
        robot = kin.get_robot(robot_id)
        q = robot.random_q(np.random.default_rng(2))
        result = solve_path(robot, [kin.fk(robot, q)], q_start=q)
        assert result.q.shape == (1, robot.n)
        assert np.abs(result.q[0] - q).max() < 1e-4
        assert result.continuous
        assert result.reason == "One waypoint."
        assert solve_path(robot, [kin.fk(robot, q)]).gaps == ()


def test_refined_configurations_stay_on_their_turn():
    """A row with an error of 1e-8 and θ7 = 200° is corrected there, not at −160°, which is nearer to home."""
    robot = kin.get_robot(SRS)
    near = np.radians([10, 40, 20, 60, 30, 50, 200])
    problem = problem_of(robot, kin.fk(robot, near))
    rows = near + 1e-8 * np.array([[1, 0, 0, 0, 0, 0, 0]])
    assert meeting(problem, False, rows, near) == pytest.approx(near[None], abs=1e-7)


# -- whole turns and limits ---------------------------------------------------------------------------------------


def roll_path(start_degrees, sweep, count):
    """A 7-joint arm, and poses that only turn the tool about its z axis, which is axis 7."""
    robot = kin.get_robot(SRS)
    q = np.radians([0, 30, 0, 60, 0, 45, start_degrees])
    return robot, [rotated(kin.fk(robot, q), d) for d in np.linspace(0, sweep, count)]


def test_a_long_rotation_starts_at_the_image_with_enough_range():
    """θ7 is 110° or −250° at the start. Only from −250° can it turn by 500°."""
    robot, targets = roll_path(110.0, 500.0, 26)
    for q_start in (None, np.radians([0, 30, 0, 60, 0, 45, 110])):
        result = solve_path(robot, targets, q_start=q_start)
        assert_exact(robot, targets, result)
        assert result.continuous
        # The elbow may move meanwhile; otherwise θ7 would go from −250° to 250°.
        assert math.degrees(result.q[0, 6]) == pytest.approx(-250.0, abs=30.0)
        assert math.degrees(result.q[-1, 6]) == pytest.approx(250.0, abs=30.0)


@pytest.mark.full
def test_a_rotation_beyond_the_range_of_joint_7_has_one_jump_that_names_it():
    """700° do not fit into 540°: one jump, at the latest where θ7 reaches its limit."""
    robot, targets = roll_path(0.0, 700.0, 29)
    result = solve_path(robot, targets)
    assert_exact(robot, targets, result)
    (jump,) = result.jumps
    assert jump.cause == "limits"
    assert 6 in jump.joints
    assert jump.step > math.pi / 2
    assert "joint 7 reaches its limit of 270.0°" in jump.reason
    # From −212.9° at best (over all arm angles) the limit is 482.9° away.
    assert 700 - 540 <= 25 * jump.index <= 483 + 25
    assert result.reason == f"29 waypoints with one jump: before waypoint {jump.index} (limits)."
    rest = np.delete(np.abs(np.diff(result.q, axis=0)).max(axis=1), jump.index - 1)
    assert rest.max() < 0.5


def test_turning_backwards_names_the_other_limit():
    robot, targets = roll_path(0.0, -600.0, 25)
    (jump,) = solve_path(robot, targets, locked=[None, None, 0.0, None, 0.0, None, None], branch="seed").jumps
    assert jump.cause == "limits"
    assert "joint 7 reaches its limit of -270.0°" in jump.reason


def test_every_further_turn_needs_one_more_jump():
    """With the arm angle fixed, θ7 turns alone: from 0° to 270°, then repeatedly from −90°."""
    robot, targets = roll_path(0.0, 1100.0, 45)
    result = solve_path(robot, targets, locked=[None, None, 0.0, None, 0.0, None, None], branch="seed")
    assert_exact(robot, targets, result)
    assert len(result.jumps) == math.ceil((1100 - 270) / 360)
    assert {jump.cause for jump in result.jumps} == {"limits"}
    assert all(jump.joints == (6,) and jump.step == pytest.approx(math.radians(335)) for jump in result.jumps)


def test_joints_without_limits_turn_forever():
    robot, targets = roll_path(0.0, 1000.0, 41)
    endless = limited(robot, (-270, 270), (-110, 110), (-180, 180), (-110, 110), (-180, 180), (-90, 90), None)
    result = solve_path(endless, targets, q_start=np.radians([0, 30, 0, 60, 0, 45, 0]))
    assert_exact(endless, targets, result)
    assert result.continuous
    assert math.degrees(result.q[-1, 6] - result.q[0, 6]) == pytest.approx(1000.0, abs=70.0)


def test_a_joint_of_many_turns_starts_where_the_whole_path_fits():
    """With limits of ±560°, a rotation by 1000° must start between −560° and −440°, although home is at 0°."""
    robot, targets = roll_path(-120.0, 1000.0, 41)
    others = ((-270, 270), (-110, 110), (-180, 180), (-110, 110), (-180, 180), (-90, 90))
    wide = limited(robot, *others, (-560, 560))
    result = solve_path(wide, targets)
    assert_exact(wide, targets, result)
    assert result.continuous
    short = limited(robot, *others, (-450, 450))
    result = solve_path(short, targets)
    assert_exact(short, targets, result)
    assert [jump.cause for jump in result.jumps] == ["limits"]


# -- singularities, branches, spacing -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("robot_id", "joint", "base"),
    [
        (SRS, 3, [10, 40, 20, 0, 30, 50, 10]),
        (SRS, 5, [10, 40, 20, 60, 30, 0, 10]),
        (SRS, 1, [10, 0, 20, 60, 30, 50, 10]),
        (PRINTED, 5, [10, 40, 20, 60, 40, 0, 10]),
        (PRINTED, 3, [10, 40, 20, 0, 30, 50, 10]),
    ],
)
def test_singularities_are_crossed_without_a_flip(robot_id, joint, base):
    """A joint passes through 0°, where another is undetermined; one waypoint is exactly there."""
    robot = kin.get_robot(robot_id)
    path = np.radians(np.array(base, dtype=float)) + np.linspace(-1, 1, 31)[:, None] * np.radians([5] * 7)
    path[:, joint] = np.radians(np.linspace(-15, 15, 31))
    assert path[15, joint] == 0.0
    targets = kin.fk(robot, path)
    result = solve_path(robot, targets)
    assert_exact(robot, targets, result)
    assert result.continuous
    assert largest(result.q) < 0.25
    assert squares(result.q) < 2.5 * squares(path)


def test_an_angle_changes_smoothly_along_a_singular_stretch():
    """θ6 = 0 for 20 waypoints, where only θ5 + θ7 is determined; before and after, θ5 differs by 100°."""
    robot = kin.get_robot(PRINTED)
    turn = np.concatenate([np.zeros(10), np.linspace(0, 100, 20), np.full(10, 100)])
    tilt = np.concatenate([np.linspace(20, 2, 10), np.zeros(20), np.linspace(2, 20, 10)])
    path = np.radians([[10, 40, 20, 60, a, b, -0.5 * a] for a, b in zip(turn, tilt, strict=True)])
    targets = kin.fk(robot, path)
    result = solve_path(robot, targets, q_start=path[0], branch="seed")
    assert_exact(robot, targets, result)
    assert result.continuous
    assert squares(result.q) <= squares(path)
    assert largest(result.q) < 2.0 * largest(path)


def test_the_wrist_centre_passes_through_the_first_axis():
    """θ1 of the 5-joint arm is undetermined at one waypoint, and keeps its value."""
    robot = kin.get_robot("pioneer5")
    a1, a2, d4, t2 = 0.07, 0.16, 0.14, math.radians(75)
    over = math.acos(-(a1 + a2 * math.cos(t2)) / d4) - t2
    path = np.array([[1.4, t2, over + t, 0.7, 0.5] for t in np.linspace(-0.6, 0.6, 41)])
    assert {kin.branch_of(robot, path[i]).split(" · ")[0] for i in (0, -1)} == {"shoulder front", "shoulder back"}
    assert kin.singularities(robot, path[20])[0].kind == "shoulder"
    targets = kin.fk(robot, path)
    result = solve_path(robot, targets)
    assert_exact(robot, targets, result)
    assert result.continuous
    assert np.abs(result.q - path).max() < 1e-6


def test_a_jump_next_to_a_singularity_is_reported():
    """At 1° from the wrist singularity, joints 5 and 7 must turn by nearly 180° within one or two steps."""
    robot = kin.get_robot(PRINTED)
    sides = np.radians(np.linspace(-20, 20, 21))
    turn = np.arctan2(math.radians(1.0), sides)
    tilt = np.hypot(math.radians(1.0), sides)
    path = np.array([[0.2, 0.5, 0.5, 1.0, a, b, -a] for a, b in zip(turn, tilt, strict=True)])
    targets = kin.fk(robot, path)
    assert rotation_angle(targets[10, :3, :3], targets[11, :3, :3]) < math.radians(2.1)
    result = solve_path(robot, targets, q_start=path[0], branch="seed")
    assert_exact(robot, targets, result)
    assert len(result.jumps) >= 1
    for jump in result.jumps:
        assert jump.cause == "singularity"
        assert "a singularity, hand in line with the forearm (θ6 = 0°)" in jump.reason
        assert 9 <= jump.index <= 12
        assert {4, 6} <= set(jump.joints)


def test_a_jump_between_distant_poses_has_the_cause_spacing():
    robot = kin.get_robot("pioneer5")
    targets = [kin.fk(robot, np.radians([a, 40, 60, 30, 30])) for a in (10, 50, 90, 100, 110)]
    result = solve_path(robot, targets)
    assert_exact(robot, targets, result)
    assert [(jump.index, jump.joints, jump.cause) for jump in result.jumps] == [
        (1, (0,), "spacing"),
        (2, (0,), "spacing"),
    ]
    assert result.jumps[0].step == pytest.approx(math.radians(40))
    for jump, (a, b) in zip(result.jumps, itertools.pairwise(targets), strict=False):
        shift, turn = 1e3 * np.linalg.norm(b[:3, 3] - a[:3, 3]), math.degrees(rotation_angle(a[:3, :3], b[:3, :3]))
        assert jump.reason == (
            f"Between waypoints {jump.index - 1} and {jump.index} joint 1 (rotating base) jumps by 40.0°: there "
            f"they are too far apart for steps of 28.6°: the tool moves by {shift:.1f} mm "
            f"and turns by {turn:.1f}°."
        )
    assert solve_path(robot, targets, max_step=0.7).continuous


def test_only_masked_coordinates_count_as_tool_motion():
    """Of three distant waypoints only the height counts: 50 mm up, then no motion."""
    robot = kin.get_robot("pioneer5")
    T = kin.fk(robot, robot.home)
    targets = [T, moved(T, -0.4, 0.3, 0.05), rotated(moved(T, 0.5, 0.0, 0.05), 90.0, "x")]
    height = (False, False, True, False, False, False)
    result = solve_path(robot, targets, mask=height, mask_frame="base", q_start=robot.home, max_step=0.02)
    (jump,) = result.jumps
    assert (jump.index, jump.cause) == (1, "spacing")
    assert jump.reason.endswith("too far apart for steps of 1.1°: the tool moves by 50.0 mm.")


def test_the_end_of_a_branch_is_reported():
    """The wrist centre moves along a ray towards axis 2, from a point that only the front of the shoulder reaches.

    Close to axis 2 the front would need a forearm as long as the upper arm; only the back reaches.
    """
    robot = limited(kin.get_robot("pioneer5"), *[(-200, 200)] * 5)
    T = np.array([[1.0, 0, 0, 0], [0, -1.0, 0, 0], [0, 0, -1.0, 0.13 - 0.12], [0, 0, 0, 1.0]])
    targets = [moved(T, x, 0.0, 0.0) for x in np.linspace(0.27, 0.085, 60)]
    sides = [
        {s.branch.split(" · ")[0] for s in solve_ik(robot, targets[i], task="approach").solutions} for i in (0, -1)
    ]
    assert sides == [{"shoulder front"}, {"shoulder back"}]
    result = solve_path(robot, targets, task="approach")
    assert_exact(robot, targets, result, "approach")
    (jump,) = result.jumps
    assert jump.cause == "branch"
    assert "the posture being followed (shoulder front · elbow " in jump.reason
    assert jump.reason.endswith("ends, elbow folded (θ3 = 180°).") or "θ3 = -180°" in jump.reason


# -- gaps ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_an_unreachable_stretch_is_a_gap(robot_id):
    """The rest is exact, and the arm neither flips nor drifts in the gap."""
    robot = kin.get_robot(robot_id)
    home = np.array(robot.home)
    T = kin.fk(robot, home)
    outwards = T[:3, 3] / np.linalg.norm(T[:3, 3])
    ways = 1.5 * robot.reach * np.sin(np.linspace(0, np.pi, 17))
    targets = [T[:3, 3] + w * outwards for w in ways]
    result = solve_path(robot, targets, task="position", q_start=home)
    missing = [gap.index for gap in result.gaps]
    assert missing == list(range(missing[0], missing[-1] + 1))
    assert 0 < missing[0] < missing[-1] < 16
    for gap in result.gaps:
        assert gap.status is Status.UNREACHABLE
        closest = solve_ik(robot, targets[gap.index], task="position", q_seed=result.q[gap.index])
        assert gap.distance == pytest.approx(closest.distance, abs=1e-6)
        assert f" by {1e3 * gap.distance:.1f} mm" in gap.reason
        assert result.position_error[gap.index] == pytest.approx(closest.distance, rel=0.05, abs=1.1e-3)
    rest = [i for i in range(17) if i not in missing]
    assert result.position_error[rest].max() <= 1e-9
    assert robot.in_limits(result.q).all()
    assert f"No exact solution at {len(missing)} of 17 waypoints: {missing[0]}" in result.reason
    within = [i for i in missing[1:] if i - 1 in missing]
    assert np.abs(np.diff(result.q, axis=0)[np.array(within) - 1]).max() < 0.5


def test_an_impossible_orientation_is_a_gap():
    robot = kin.get_robot(SRS)
    T = kin.fk(robot, np.array(robot.home))
    targets = [moved(T, 0.02 * i, 0.0, 0.0) for i in range(12)]
    result = solve_path(robot, targets)
    assert result.gaps
    assert Status.ORIENTATION in {gap.status for gap in result.gaps} <= {Status.ORIENTATION, Status.LIMITS}
    rest = [i for i in range(12) if i not in {gap.index for gap in result.gaps}]
    assert_exact(robot, targets, result, rows=rest)


def test_a_path_out_of_reach_is_one_gap():
    robot = kin.get_robot("pioneer5")
    targets = [(0.1 * i, 3.0, 0.0) for i in range(5)]
    result = solve_path(robot, targets, task="position")
    assert [gap.index for gap in result.gaps] == [0, 1, 2, 3, 4]
    assert result.continuous
    assert robot.in_limits(result.q).all()


@pytest.mark.parametrize("roll", [1.0, 20.0])
def test_five_joints_keep_point_and_direction_and_report_the_roll(roll):
    robot = kin.get_robot("pioneer5")
    path = wave(robot, np.random.default_rng(6), 25)
    targets = kin.fk(robot, path)
    targets = np.array([rotated(T, roll) if 5 <= i < 15 else T for i, T in enumerate(targets)])
    result = solve_path(robot, targets)
    assert_exact(robot, targets, result, "approach", rows=[i for i in range(25) if not 5 <= i < 15])
    assert result.continuous
    assert [gap.index for gap in result.gaps] == list(range(5, 15))
    for gap in result.gaps:
        assert gap.status is Status.APPROXIMATE
        assert gap.reason.startswith(f"Reached with roll error {roll:.1f}°")
    assert np.degrees(result.rotation_error[5:15]) == pytest.approx(np.full(10, roll), abs=1e-6)
    assert result.position_error.max() <= 1e-9
    assert np.abs(result.q - path).max() < 1e-6


def test_a_direction_outside_the_limits_keeps_the_point():
    robot = kin.get_robot("pioneer5")
    path = np.radians([[90, 40, 60, 30, t] for t in np.linspace(30, 60, 16)])
    wide = limited(robot, (0, 180), (0, 150), (0, 150), (0, 85), (15, 80))
    targets = [rotated(T, 5.0) for T in kin.fk(wide, path)]
    result = solve_path(robot, targets)
    assert [gap.index for gap in result.gaps] == list(range(16))
    assert {gap.status for gap in result.gaps} == {Status.APPROXIMATE}
    assert [gap.reason.split()[0] for gap in result.gaps] == ["Reached"] * 8 + ["Point"] * 8
    assert result.position_error.max() <= 1e-9
    assert result.continuous


# -- limits, locks, branches --------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_narrowed_limits_hold_everywhere(robot_id):
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(19)
    for _ in range(3):
        path = wave(robot, rng, 20)
        margin = 0.05
        limits = [
            (low - margin, high + margin) for low, high in zip(path.min(axis=0), path.max(axis=0), strict=True)
        ]
        limits = [
            (max(low, a), min(high, b))
            for (low, high), a, b in zip(limits, robot.lower.tolist(), robot.upper.tolist(), strict=True)
        ]
        targets = kin.fk(robot, path)
        result = solve_path(robot, targets, limits=limits)
        assert_exact(robot, targets, result)
        assert result.continuous
        assert (result.q >= np.array(limits)[:, 0] - 1e-9).all()
        assert (result.q <= np.array(limits)[:, 1] + 1e-9).all()


@pytest.mark.parametrize("robot_id", [PRINTED, SRS])
def test_locked_joints_do_not_move(robot_id):
    """With joint 3 locked the arms are not redundant: the original motion is the only solution."""
    robot = kin.get_robot(robot_id)
    locked = [0.3 if robot_id == PRINTED else None, None, 0.4 if robot_id == SRS else None, None, None, None, None]
    joint = next(i for i, value in enumerate(locked) if value is not None)
    path = wave(robot, np.random.default_rng(3), 24)
    path[:, joint] = locked[joint]
    targets = kin.fk(robot, path)
    result = solve_path(robot, targets, locked=locked)
    assert_exact(robot, targets, result)
    assert (result.q[:, joint] == locked[joint]).all()
    assert result.continuous
    assert squares(result.q) <= squares(path) * (1 + 1e-6)


def test_a_lock_in_the_way_is_reported():
    robot = kin.get_robot("pioneer5")
    path = np.radians([[90, 40, 60, t, 30] for t in np.linspace(20, 40, 9)])
    result = solve_path(robot, kin.fk(robot, path), task="approach", locked=[None, None, None, path[0, 3], None])
    assert [gap.index for gap in result.gaps] == list(range(1, 9))
    assert {gap.status for gap in result.gaps} == {Status.LIMITS}
    assert "joint 4 (rotating wrist) at 22.5° (locked at 20.0°)" in result.gaps[0].reason


def test_a_lock_that_causes_a_jump_is_reported():
    """θ1 is the redundancy parameter: with θ1 locked at its first value, the branch ends."""
    robot = kin.get_robot(PRINTED)
    path = wave(robot, np.random.default_rng(7), 16)
    locked = [path[0, 0], *[None] * 6]
    result = solve_path(robot, kin.fk(robot, path), locked=locked, q_start=path[0], branch="seed")
    jump = result.jumps[-1]
    assert jump.cause == "limits"
    assert 0 not in jump.joints
    assert jump.reason.endswith(f"joint 1 is locked at {math.degrees(locked[0]):.1f}°.")


@pytest.mark.parametrize(
    "branch", ["elbow negative", "shoulder back", "shoulder front · elbow positive · wrist flip"]
)
def test_the_path_stays_on_the_requested_branches(branch):
    robot = kin.get_robot(SRS)
    path = np.radians([10, 40, 20, 60, 30, 50, 10]) + np.linspace(0, 1, 21)[:, None] * np.radians([40] * 7)
    path[:, 5] = np.radians(np.linspace(50, 30, 21))
    targets = kin.fk(robot, path)
    result = solve_path(robot, targets, branch=branch)
    assert_exact(robot, targets, result)
    assert result.gaps == ()
    for q in result.q:
        assert all(part in kin.branch_of(robot, q) for part in branch.split(" · "))


# -- optimality ---------------------------------------------------------------------------------------------------


def exhaustive(layers, start, pull, max_step):
    """The fewest jumps, then the least sum of squares, over all combinations."""
    best = (math.inf, math.inf)
    for rows in itertools.product(*layers):
        q = np.array(rows)
        moves = np.abs(np.diff(q, axis=0))
        jumps = int((moves.max(axis=1) > max_step).sum())
        best = min(best, (jumps, float((moves**2).sum() + pull * ((q[0] - start) ** 2).sum())))
    return best


@pytest.mark.parametrize("case", ["wide5", "locked7"])
@pytest.mark.parametrize("started", [False, True])
def test_no_other_choice_of_solutions_is_better(case, started):
    """For three unrelated targets, compared with all combinations of solutions and whole-turn images."""
    rng = np.random.default_rng(31)
    if case == "wide5":
        wide = ((-170, 170), (-190, 190), (-200, 200), (-170, 170), (-120, 120))
        robot, options = limited(kin.get_robot("pioneer5"), *wide), {"task": "approach"}
    else:
        robot, options = kin.get_robot(PRINTED), {"locked": [0.5, *[None] * 6]}
    several = 0
    for _ in range(8):
        path = robot.random_q(rng) + rng.normal(scale=0.5, size=(3, robot.n)).cumsum(axis=0)
        path = robot.clip(path)
        if case == "locked7":
            path[:, 0] = 0.5
        start = robot.random_q(rng) if started else np.array(robot.home)
        targets = kin.fk(robot, path)
        layers = [[s.q for s in solve_ik(robot, T, images="all", **options).solutions] for T in targets]
        several += min(len(layer) for layer in layers) > 3
        result = solve_path(robot, targets, q_start=start if started else None, max_step=1.0, **options)
        wanted = exhaustive(layers, start, 1.0 if started else 1e-6, 1.0)
        found = squares(result.q) + (1.0 if started else 1e-6) * float(((result.q[0] - start) ** 2).sum())
        assert len(result.jumps) == wanted[0]
        assert found == pytest.approx(wanted[1], rel=1e-7)
    assert several > 4


def test_the_redundancy_parameter_is_the_best_of_a_fine_grid():
    """For two poses of the S-R-S arm, no pair of arm angles on a one-degree grid needs less motion."""
    robot = kin.get_robot(SRS)
    start = np.radians([10, 40, 20, 60, 30, 50, 10])
    targets = kin.fk(robot, start + np.radians([[0] * 7, [15, 10, -10, 5, 20, -10, 10]]))
    result = solve_path(robot, targets)
    layers = []
    for T in targets:
        found = np.concatenate([kin.ik_branches(robot, T, psi) for psi in np.radians(np.arange(-180, 180, 1.0))])
        found = start + np.remainder(found - start + np.pi, 2 * np.pi) - np.pi
        layers.append(found[robot.in_limits(found)])
    pairs = ((layers[0][:, None] - layers[1][None]) ** 2).sum(axis=-1)
    assert pairs.size > 100_000
    assert squares(result.q) <= pairs.min() * (1 + 1e-3)


# -- further properties -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_the_same_problem_has_the_same_path(robot_id):
    robot = kin.get_robot(robot_id)
    targets = kin.fk(robot, wave(robot, np.random.default_rng(77), 12))
    first, second = (solve_path(robot, targets) for _ in range(2))
    assert first.q.tolist() == second.q.tolist()
    assert first.reason == second.reason


def test_an_arm_with_a_slide_that_fits_no_family():
    text = """
    id = "odd"
    name = "odd"
    source = "made up"
    convention = "modified"
    units = { length = "m", angle = "deg" }
    rows = [
      { name = "1", d = 0.3, alpha = 10 },
      { name = "2", a = 0.1, alpha = -80 },
      { name = "3", kind = "prismatic", a = 0.3, alpha = 35, limits = [0.0, 0.4] },
      { name = "4", d = 0.2, alpha = 70 },
      { name = "5", a = 0.05, alpha = -60 },
      { name = "6", d = 0.1, alpha = 95 },
    ]
    """
    robot = kin.load_robot(text)
    base = np.array([0.3, -0.4, 0.2, 0.5, 0.7, 0.1])
    shift = np.array([0.8, 0.7, 0.15, -0.6, 0.5, 2.5])
    path = base + np.linspace(0, 1, 31)[:, None] * shift
    targets = kin.fk(robot, path)
    result = solve_path(robot, targets)
    assert_exact(robot, targets, result)
    assert result.solver == "general6"
    assert result.continuous
    assert result.gaps == ()
    # A slide counts as a share of the reach: of 0.15 m it is more than a tenth.
    far = kin.fk(robot, np.array([base, base + 0.15 * np.eye(6)[2]]))
    (jump,) = solve_path(robot, far, q_start=base, max_step=0.1).jumps
    assert jump.joints == (2,)
    assert jump.step == pytest.approx(0.15 / robot.reach)
    assert jump.cause == "spacing"
    longest = f"{100.0 * robot.reach:.1f} mm"
    assert f"joint 3 jumps by 150.0 mm: there they are too far apart for steps of {longest}" in jump.reason


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"targets": []}, "targets"),
        ({"targets": np.empty((0, 4, 4))}, "targets"),
        ({"targets": None}, "targets"),
        ({"targets": 3}, "targets"),
        ({"targets": "path"}, "targets"),
        ({"targets": np.eye(4)}, "targets[0]"),
        ({"targets": [np.eye(4), np.eye(3)]}, "targets[1]"),
        ({"targets": [np.eye(4), np.full((4, 4), np.nan)]}, "targets[1][0][0]"),
        ({"targets": [np.eye(4)] * 2 + [np.diag([1.0, 1.0, -1.0, 1.0])]}, "targets[2] rotation"),
        ({"targets": [moved(np.eye(4), 1e9, 0, 0)]}, "targets[0] position"),
        ({"targets": [(0.1, 0.2)], "task": "position"}, "targets[0]"),
        ({"targets": [[(0.1, 0.2), (0.3,)]], "task": "position"}, "targets[0]"),
        ({"targets": [(0.1, 0.2, math.inf)], "task": "position"}, "targets[0][2]"),
        ({"targets": [(0.1, 0.2, 0.3)]}, "targets[0]"),
        ({"task": "dance"}, "task"),
        ({"mask": [True] * 5}, "mask"),
        ({"mask_frame": "world"}, "mask_frame"),
        ({"q_start": [1, 2]}, "q_start"),
        ({"q_start": [[0.0] * 5] * 2}, "q_start"),
        ({"q_start": [math.nan] * 5}, "q_start[0]"),
        ({"limits": [(0, 9)] * 5}, "limits[0]"),
        ({"locked": [9.0] * 5}, "locked[0]"),
        ({"branch": "sideways"}, "branch"),
        ({"max_step": 0}, "max_step"),
        ({"max_step": -0.1}, "max_step"),
        ({"max_step": math.nan}, "max_step"),
        ({"max_step": math.inf}, "max_step"),
        ({"max_step": True}, "max_step"),
        ({"max_step": "0.5"}, "max_step"),
        ({"max_step": 10**400}, "max_step"),
        ({"max_step": np.complex128(0.5 + 1j)}, "max_step"),
        ({"limits": [((0.1, 0.2), 0.3)] + [None] * 4}, "limits[0]"),
    ],
)
def test_invalid_input_names_the_field(arguments, field):
    targets = arguments.pop("targets", [np.eye(4)])
    with pytest.raises(InputError) as caught:
        solve_path(kin.get_robot("pioneer5"), targets, **arguments)
    assert caught.value.field == field


def test_a_scara_reports_a_waypoint_out_of_reach_as_a_gap():
    """The relaxed waypoint requires an approach direction, which leaves the tool angle free; a pose does not."""
    scara = kin.get_robot("scara")
    T = kin.fk(scara, scara.q_home)
    far = T.copy()
    far[:3, 3] *= 5.0
    result = solve_path(scara, [T, far, T], task="pose")
    assert [gap.index for gap in result.gaps] == [1]
