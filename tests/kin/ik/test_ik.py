"""Inverse kinematics: golden branches, round trips, limits, order, unreachable targets, invalid input."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from arms import CHAPTER_ARMS
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from kin import InputError, Status, solve_ik
from kin.transforms import rotation_angle, vector_angle

SEVEN = ("redundant7", "redundant7-craig")
ROUND_TRIPS = 5_000


def rotated(T, degrees, axis="z"):
    """T rotated about one of its own axes."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    R = np.eye(4)
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = -s, s
    return T @ R


def angle_gap(a, b):
    """Largest joint difference modulo whole turns."""
    return np.abs((a - b + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)


def assert_exact(robot, target, result, task="pose"):
    """Check with an independent FK that all solutions meet the task, inside the limits, in order of distance."""
    assert result.solutions
    for s in result.solutions:
        T = kin.fk(robot, s.q)
        assert np.abs(T[:3, 3] - target[:3, 3]).max() <= 1e-9
        assert s.position_error <= 1e-9
        if task == "pose":
            assert rotation_angle(T[:3, :3], target[:3, :3]) <= 1e-9
        if task == "approach":
            assert vector_angle(T[:3, 2], target[:3, 2]) <= 1e-9
        assert s.rotation_error <= 1e-9
        assert s.in_limits
        assert robot.in_limits(s.q)
    distances = [s.distance for s in result.solutions]
    assert distances == sorted(distances)


def test_q_has_a_row_for_each_solution():
    robot = kin.get_robot("puma560")
    found = solve_ik(robot, kin.fk(robot, robot.q_home))
    assert found.q.tolist() == [each.q.tolist() for each in found.solutions]
    assert found.q[0].tolist() == found.best.q.tolist()
    assert solve_ik(robot, kin.pose_from_xyz_rpy([9.0, 0.0, 0.0])).q.shape == (0, 6)
    few = solve_ik("pioneer5", kin.fk("puma560", robot.q_home))
    assert few.q.shape == (len(few.solutions), 5)


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_all_golden_branches_and_no_others(robot_id, golden):
    """The complete 50-digit branch sets, for the same value of the redundancy parameter."""
    robot = kin.get_robot(robot_id)
    five = robot.n == 5
    for case in golden(robot_id)["ik"]:
        parameter = None if five else case.get("theta1", case.get("psi"))
        result = solve_ik(
            robot, case["T"], task="approach" if five else "pose", respect_limits=False, redundancy=parameter
        )
        found = result.q
        wanted = np.array(case["branches"])
        assert len(found) == len(wanted)
        for q in wanted:
            # Near a singularity the angles have fewer exact digits than the pose.
            assert angle_gap(found, q).min() < 1e-9


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_the_batch_call_gives_the_same_branches(robot_id, golden):
    robot = kin.get_robot(robot_id)
    case = golden(robot_id)["ik"][0]
    q = kin.ik_branches(robot, np.array(case["T"]), case.get("theta1", case.get("psi", math.nan)))
    for wanted in np.array(case["branches"]):
        assert np.nanmin(angle_gap(q, wanted)) < 1e-9


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
@pytest.mark.parametrize("task", ["pose", "approach"])
def test_every_round_trip_is_solved(robot_id, task):
    """20 000 random configurations inside the limits: the pose of each is solved from an unrelated seed."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(2026)
    q, seeds = robot.random_q(rng, ROUND_TRIPS), robot.random_q(rng, ROUND_TRIPS)
    targets = kin.fk(robot, q)
    unsolved, worst_p, worst_r = [], 0.0, 0.0
    for i in range(ROUND_TRIPS):
        result = solve_ik(robot, targets[i], task=task, q_seed=seeds[i])
        if result.status is not Status.SOLVED:
            unsolved.append((q[i].tolist(), result.reason))
            continue
        found = result.q
        assert robot.in_limits(found).all()
        T = kin.fk(robot, found)
        worst_p = max(worst_p, float(np.abs(T[:, :3, 3] - targets[i, :3, 3]).max()))
        if task == "pose":
            worst_r = max(worst_r, float(np.abs(T[:, :3, :3] - targets[i, :3, :3]).max()))
        else:
            worst_r = max(worst_r, float(np.abs(T[:, :3, 2] - targets[i, :3, 2]).max()))
    assert unsolved == []
    assert worst_p <= 1e-9
    assert worst_r <= 1e-9


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_round_trip_of_points(robot_id):
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(7)
    for q, seed in zip(robot.random_q(rng, 300), robot.random_q(rng, 300), strict=True):
        p = kin.fk(robot, q)[:3, 3]
        result = solve_ik(robot, p, task="position", q_seed=seed)
        assert result.status is Status.SOLVED, (q.tolist(), result.reason)
        for s in result.solutions:
            assert np.linalg.norm(kin.fk(robot, s.q)[:3, 3] - p) <= 1e-9
            assert robot.in_limits(s.q)


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_golden_edge_postures_are_solved(robot_id, golden):
    """Zeros, corners of the limits and singular postures inside the limits have a solution without NaN."""
    robot = kin.get_robot(robot_id)
    tried = 0
    for case in golden(robot_id)["edge"]:
        if not case["in_limits"]:
            continue
        tried += 1
        for task in ("pose", "approach"):
            target = np.array(case["T"])
            assert_exact(robot, target, solve_ik(robot, target, task=task), task)
    assert tried >= 2


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
@pytest.mark.parametrize("share", [0.1, 0.4])
def test_every_round_trip_inside_narrowed_limits_is_solved(robot_id, share):
    """With random limits of a part of the range, feasible arcs are found, however small."""
    from dataclasses import replace

    whole = kin.get_robot(robot_id)
    rng = np.random.default_rng(11)
    for _ in range(40):
        width = whole.upper - whole.lower
        low = whole.lower + rng.random(whole.n) * (1 - share) * width
        high = low + share * width
        joints = iter(zip(low.tolist(), high.tolist(), strict=True))
        rows = tuple(row if row.kind == "fixed" else replace(row, limits=next(joints)) for row in whole.rows)
        robot = replace(whole, rows=rows, home=tuple((0.5 * (low + high)).tolist()))
        for q in robot.random_q(rng, 25):
            target = kin.fk(robot, q)
            result = solve_ik(robot, target)
            assert result.status is Status.SOLVED, (low.tolist(), high.tolist(), q.tolist(), result.reason)
            assert robot.in_limits(result.q).all()


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
@settings(max_examples=60, deadline=None)
@given(fractions=st.lists(st.floats(0, 1), min_size=14, max_size=14))
def test_solutions_are_exact_ordered_and_deterministic(robot_id, fractions):
    robot = kin.get_robot(robot_id)
    span = robot.upper - robot.lower
    q = robot.lower + np.array(fractions[: robot.n]) * span
    seed = robot.lower + np.array(fractions[7 : 7 + robot.n]) * span
    target = kin.fk(robot, robot.clip(q))
    result = solve_ik(robot, target, q_seed=seed)
    assert_exact(robot, target, result)
    again = solve_ik(robot, target, q_seed=seed)
    assert again.q.tolist() == result.q.tolist()


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_the_seed_itself_is_found_first(robot_id):
    """For its present pose, the arm stays where it is."""
    robot = kin.get_robot(robot_id)
    for q in robot.random_q(np.random.default_rng(3), 200):
        best = solve_ik(robot, kin.fk(robot, q), q_seed=q).best
        assert best.distance < 1e-5


@pytest.mark.parametrize("robot_id", SEVEN)
def test_whole_turns_follow_the_seed(robot_id):
    """Joint 7 has ±270°: 200° and −160° are the same posture, and the seed decides between them."""
    robot = kin.get_robot(robot_id)
    for last in (200.0, -160.0):
        q = np.radians([10, 20, 30, 40, 50, 60, last])
        best = solve_ik(robot, kin.fk(robot, q), q_seed=q).best
        assert np.degrees(best.q[6]) == pytest.approx(last, abs=1e-6)


def test_solutions_outside_the_limits_are_rejected_and_the_joint_is_named():
    robot = kin.get_robot("pioneer5")
    q = np.radians([90, 40, 60, 30, 60])
    result = solve_ik(robot, kin.fk(robot, q), task="approach")
    assert result.status is Status.LIMITS
    assert result.solutions == ()
    (violation,) = result.violations
    assert violation.name == "pivoting wrist"
    assert math.degrees(violation.value) == pytest.approx(60)
    assert math.degrees(violation.limit) == pytest.approx(45)
    assert "joint 5 (pivoting wrist) at 60.0° (limit 45.0°)" in result.reason
    assert robot.in_limits(result.closest.q)
    free = solve_ik(robot, kin.fk(robot, q), task="approach", respect_limits=False)
    assert free.status is Status.SOLVED
    assert angle_gap(free.q, q).min() < 1e-9
    assert not any(s.in_limits for s in free.solutions)


def test_the_joint_outside_its_limits_is_named_for_a_redundant_arm():
    robot = kin.get_robot("redundant7-craig")
    q = np.radians([0, 30, 0, 118, 0, 40, 0])
    result = solve_ik(robot, kin.fk(robot, q))
    assert result.status is Status.LIMITS
    assert "joint 4" in result.reason
    assert "118.0°" in result.reason
    assert robot.in_limits(result.closest.q)


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
@pytest.mark.parametrize("task", ["pose", "approach", "position"])
def test_the_distance_of_a_point_too_far_is_reported(robot_id, task):
    """For a point far out along x, it is the distance to the edge of the workspace."""
    robot = kin.get_robot(robot_id)
    rim = {"pioneer5": 0.485911099, "redundant7": 1.08, "redundant7-craig": 1.08}[robot_id]
    height = {"pioneer5": 0.098874, "redundant7": 0.30, "redundant7-craig": 0.30}[robot_id]
    T = np.eye(4)
    T[:3, 3] = (2.0, 0.0, height)
    result = solve_ik(robot, T, task=task)
    assert result.status is Status.UNREACHABLE
    assert result.distance == pytest.approx(2.0 - rim, abs=2e-4)
    assert "too far away" in result.reason
    assert f"by {1e3 * result.distance:.1f} mm: " in result.reason
    assert robot.in_limits(result.closest.q)
    assert np.isfinite(result.closest.q).all()


def test_a_target_in_millimetres_is_answered_with_the_unit_of_targets():
    target = kin.pose_from_xyz_rpy([400.0, 100.0, 300.0], [np.pi, 0.0, 0.0])
    assert solve_ik("ur5", target).reason.endswith("the point is too far away. Targets are in metres.")
    target[:3, 3] *= 0.004
    assert "Targets are in metres" not in solve_ik("ur5", target).reason
    target[:3, 3] *= 0.25
    assert solve_ik("ur5", target).status is Status.SOLVED


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_dragging_out_of_reach_does_not_make_the_arm_jump(robot_id):
    """Of equally close postures, the one nearest to the present one is chosen in every step."""
    robot = kin.get_robot(robot_id)
    target = kin.fk(robot, robot.home)
    direction = target[:3, 3] / np.linalg.norm(target[:3, 3])
    q = np.array(robot.home)
    steps, refused = [], 0
    for _ in range(60):
        target = target.copy()
        target[:3, 3] += 0.02 * direction
        result = solve_ik(robot, target, task="approach", q_seed=q)
        refused += result.status is Status.UNREACHABLE
        steps.append(np.abs(result.best.q - q).max())
        q = np.array(result.best.q)
    assert refused > 20
    assert max(steps[-20:]) < math.radians(5)


def test_a_point_too_close_is_reported():
    robot = kin.get_robot("redundant7-craig")
    result = solve_ik(robot, (0.0, 0.0, 0.30), task="position")
    assert result.status is Status.UNREACHABLE
    assert result.distance == pytest.approx(0.210978668, abs=1e-6)
    assert "too close to the shoulder" in result.reason


def test_an_impossible_orientation_is_reported():
    """At the edge of the workspace the tool can only point outwards."""
    robot = kin.get_robot("redundant7-craig")
    T = np.eye(4)
    T[:3, 3] = (1.0, 0.0, 0.30)
    result = solve_ik(robot, T)
    assert result.status is Status.ORIENTATION
    assert result.cause == "orientation"
    assert result.distance == 0.0
    assert "cannot hold this orientation" in result.reason
    nearest = result.nearest_orientation
    assert nearest.position_error <= 1e-9
    assert robot.in_limits(nearest.q)
    assert f"nearest orientation found is {math.degrees(nearest.rotation_error):.1f}° away" in result.reason


@pytest.mark.parametrize(("roll", "mean"), [(1, 0.29), (5, 1.54), (20, 5.50)])
def test_five_joints_give_two_compromises_for_a_pose_they_cannot_meet(roll, mean):
    """For a pose rolled about the approach axis: keep the direction (error = roll), or a third of that error."""
    robot = kin.get_robot("pioneer5")
    rng = np.random.default_rng(5)
    lefts = []
    for q in robot.random_q(rng, 60):
        target = rotated(kin.fk(robot, q), roll)
        result = solve_ik(robot, target, q_seed=q)
        assert result.status is Status.APPROXIMATE
        assert result.reason.startswith(f"Reached with roll error {roll:.1f}°")
        kept, spread = result.solutions[0], result.solutions[-1]
        assert kept.compromise == "roll"
        assert spread.compromise == "rotation"
        assert math.degrees(kept.rotation_error) == pytest.approx(roll, abs=1e-6)
        for s in result.solutions:
            assert s.position_error <= 1e-9
            assert robot.in_limits(s.q)
        assert spread.rotation_error <= kept.rotation_error + 1e-9
        lefts.append(math.degrees(spread.rotation_error))
    # The expected averages are over all configurations; those of 60, some at a limit, scatter around them.
    assert 0.6 * mean < np.mean(lefts) < 1.6 * mean


def test_with_the_approach_direction_outside_the_limits_the_point_is_kept():
    """The nearest orientation with the exact point, when the approach direction itself is outside the limits."""
    robot = kin.get_robot("pioneer5")
    q = np.radians([90, 40, 60, 30, 44])
    refused = 0
    for axis, degrees in (("x", 6), ("x", -6), ("y", 6), ("y", -6)):
        tilted = rotated(kin.fk(robot, q), degrees, axis)
        if solve_ik(robot, tilted, task="approach").status is not Status.LIMITS:
            continue
        refused += 1
        result = solve_ik(robot, rotated(tilted, 8), q_seed=q)
        assert result.status is Status.APPROXIMATE
        assert result.best.position_error <= 1e-9
        assert result.best.compromise == "rotation"
        assert robot.in_limits(result.best.q)
        assert result.reason.startswith("Point reached, orientation off by")
        assert "limit" in result.reason
    assert refused >= 1


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_no_configuration_of_a_dense_search_is_closer(robot_id):
    """No random configuration, before or after a descent, is closer than `closest` in the documented metric."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(17)
    cloud = kin.fk(robot, robot.random_q(rng, 60_000))
    for _ in range(6):
        target = np.eye(4)
        target[:3, :3] = kin.transforms.rotation_from_wxyz(rng.normal(size=4))
        target[:3, 3] = rng.uniform(-1.5, 1.5, 3)
        result = solve_ik(robot, target, task="approach")
        if result.status is Status.SOLVED:
            continue
        tilt = np.arccos(np.clip(cloud[:, :3, 2] @ target[:3, 2], -1, 1))
        metric = np.hypot(np.linalg.norm(cloud[:, :3, 3] - target[:3, 3], axis=1), 0.1 * tilt)
        mine = math.hypot(result.closest.position_error, 0.1 * result.closest.rotation_error)
        assert mine <= metric.min() + 1e-9


def test_redundancy_is_reported_and_can_be_requested():
    robot = kin.get_robot("redundant7-craig")
    q = np.radians([20, 40, 30, 60, 10, 30, 5])
    target = kin.fk(robot, q)
    result = solve_ik(robot, target, q_seed=q)
    (free,) = result.redundancy
    assert free.name == "psi"
    assert any(low <= free.value <= high for low, high in free.intervals)
    given_value = 0.5 * sum(free.intervals[0])
    asked = solve_ik(robot, target, q_seed=q, redundancy=given_value)
    assert asked.status is Status.SOLVED
    assert all(s.redundancy[0].value == pytest.approx(given_value) for s in asked.solutions)


@pytest.mark.parametrize("robot_id", SEVEN)
def test_intervals_are_exactly_the_values_that_work(robot_id):
    """Inside the reported intervals a requested value is solved; slightly outside it is not."""
    robot = kin.get_robot(robot_id)
    checked = 0
    for q in robot.random_q(np.random.default_rng(23), 40):
        target = kin.fk(robot, q)
        intervals = solve_ik(robot, target, q_seed=q).redundancy[0].intervals
        inside = [v for low, high in intervals for v in np.linspace(low, high, 7)[1:-1]]
        assert all(solve_ik(robot, target, redundancy=float(v)).status is Status.SOLVED for v in inside)
        for low, high in intervals:
            for v in (low - 1e-4, high + 1e-4):
                # Both parameters are angles: a value and its whole-turn images are equivalent.
                images = [v + 2 * math.pi * turn for turn in (-2, -1, 0, 1, 2)]
                if any(a <= image <= b for a, b in intervals for image in images):
                    continue
                checked += 1
                assert solve_ik(robot, target, redundancy=v).status is Status.LIMITS
    assert checked > 10


def test_max_solutions_keeps_the_nearest():
    robot = kin.get_robot("redundant7-craig")
    target = kin.fk(robot, robot.home)
    every = solve_ik(robot, target)
    assert len(every.solutions) > 2
    two = solve_ik(robot, target, max_solutions=2)
    assert two.q.tolist() == [s.q.tolist() for s in every.solutions[:2]]


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"target": np.full((4, 4), np.nan)}, "target"),
        ({"target": np.eye(3)}, "target"),
        ({"target": np.diag([2.0, 2.0, 2.0, 1.0])}, "target rotation"),
        ({"target": np.diag([1.0, 1.0, -1.0, 1.0])}, "target rotation"),
        ({"target": "here"}, "target"),
        ({"task": "dance"}, "task"),
        ({"q_seed": [1, 2]}, "q_seed"),
        ({"q_seed": [math.inf] * 5}, "q_seed[0]"),
        ({"max_solutions": 0}, "max_solutions"),
        ({"redundancy": math.nan}, "redundancy"),
        ({"redundancy": 0.5}, "redundancy"),
    ],
)
def test_invalid_input_names_the_field(arguments, field):
    target = arguments.pop("target", np.eye(4))
    with pytest.raises(InputError) as caught:
        solve_ik(kin.get_robot("pioneer5"), target, **arguments)
    assert caught.value.field.startswith(field)


def test_threads_get_the_same_results_as_serial_calls():
    robots = [kin.get_robot(i) for i in CHAPTER_ARMS]
    rng = np.random.default_rng(9)
    jobs = [(r, kin.fk(r, q)) for r in robots for q in r.random_q(rng, 100)]
    serial = [solve_ik(r, T).best.q.tolist() for r, T in jobs]
    with ThreadPoolExecutor(8) as pool:
        threaded = list(pool.map(lambda job: solve_ik(*job).best.q.tolist(), jobs))
    assert threaded == serial


def test_an_arm_with_base_other_lengths_and_twist_signs_has_the_closed_form():
    """The axes determine the family: base, tool and the signs of twists do not matter."""
    text = """
    id = "other"
    name = "other"
    source = "made up"
    convention = "standard"
    units = { length = "cm", angle = "deg" }
    base = { xyz = [10, 20, 30], rpy = [10, 20, 30] }
    tool = { xyz = [1, 2, 12], rpy = [5, 6, 7] }
    rows = [
      { name = "1", d = 34, alpha = 90, limits = [-170, 170] },
      { name = "2", alpha = -90, limits = [-120, 120] },
      { name = "3", d = 40, alpha = -90, limits = [-170, 170] },
      { name = "4", alpha = 90, limits = [-120, 120] },
      { name = "5", d = 39, alpha = 90, limits = [-170, 170] },
      { name = "6", alpha = -90, limits = [-120, 120] },
      { name = "7", d = 8, limits = [-175, 175] },
    ]
    """
    robot = kin.load_robot(text)
    rng = np.random.default_rng(1)
    for q, seed in zip(robot.random_q(rng, 500), robot.random_q(rng, 500), strict=True):
        target = kin.fk(robot, q)
        result = solve_ik(robot, target, q_seed=seed)
        assert result.solver == "srs7"
        assert_exact(robot, target, result)


def test_an_arm_without_a_closed_form_is_solved_numerically():
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
      { name = "7", a = 0.1, alpha = 40 },
    ]
    """
    robot = kin.load_robot(text)
    for q in robot.random_q(np.random.default_rng(2), 40):
        target = kin.fk(robot, q)
        result = solve_ik(robot, target)
        assert result.solver == "numeric"
        assert_exact(robot, target, result)
