"""The options of inverse kinematics: branches, limits, locks, images, masks, preferences, redundancy."""

from __future__ import annotations

import itertools
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from arms import CHAPTER_ARMS, eight_joints
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from kin import IKOptions, InputError, JointConstraints, Status, solve_ik
from kin.ik import failures
from kin.ik.candidates import OVERRUN
from kin.transforms import rotation_angle, rotation_from_wxyz, vector_angle
from kin.units import Units

SEVEN = ("redundant7", "redundant7-craig")
TASKS = ("pose", "approach", "position")


def rotation_vector(R):
    """Logarithm of a rotation, independent of the code under test."""
    angle = rotation_angle(np.eye(3), R)
    if angle < 1e-12:
        return np.zeros(3)
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return angle * axis / np.linalg.norm(axis)


def meets(T, target, task):
    """Whether the tool pose T meets the task."""
    close = np.abs(T[:3, 3] - target[:3, 3]).max() <= 1e-9
    if task == "pose":
        return close and rotation_angle(T[:3, :3], target[:3, :3]) <= 1e-9
    return close and (task == "position" or vector_angle(T[:3, 2], target[:3, 2]) <= 1e-9)


# Branches


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_the_branch_of_every_solution_is_that_of_its_configuration(robot_id):
    """For all tasks."""
    robot = kin.get_robot(robot_id)
    assert len(set(kin.branch_names(robot))) == 8
    rng = np.random.default_rng(1)
    seen = set()
    for q in robot.random_q(rng, 150):
        for task in TASKS:
            for s in solve_ik(robot, kin.fk(robot, q), task=task, respect_limits=False, q_seed=q).solutions:
                # On the border of two branches, where the arm is singular, either name is valid.
                border = any(x.distance < 1e-6 for x in kin.singularities(robot, s.q))
                assert border or s.branch == kin.branch_of(robot, s.q)
                seen.add(s.branch)
    assert seen == set(kin.branch_names(robot))


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
@pytest.mark.parametrize("task", TASKS)
def test_only_the_requested_branches_are_returned(robot_id, task):
    robot = kin.get_robot(robot_id)
    for q in robot.random_q(np.random.default_rng(2), 25 if task != "position" else 6):
        target = kin.fk(robot, q)
        every = solve_ik(robot, target, task=task, q_seed=q)
        for requested in ("elbow positive", "elbow negative", "wrist flip", "seed", kin.branch_of(robot, q)):
            words = kin.branch_of(robot, q) if requested == "seed" else requested
            names = [n for n in kin.branch_names(robot) if all(w in n.split(" · ") for w in words.split(" · "))]
            result = solve_ik(robot, target, task=task, q_seed=q, branch=requested)
            assert {s.branch for s in result.solutions} <= set(names)
            if (
                task != "position"
            ):  # with two redundancy parameters, the choice on a branch depends on the other branches
                wanted = [s for s in every.solutions if s.branch in names]
                assert result.q.tolist() == [s.q.tolist() for s in wanted]
            if requested in ("seed", kin.branch_of(robot, q)):
                assert result.status is Status.SOLVED
            if not result.solutions and result.closest is not None:
                assert result.closest.branch in names
                assert result.cause in ("branch", "joint limits", "outside")


def test_several_branch_names_select_all_of_them():
    robot = kin.get_robot("redundant7-craig")
    target = kin.fk(robot, robot.home)
    one, two = ("shoulder front · elbow positive · wrist flip", "shoulder back, wrist no-flip")
    both = {s.branch for s in solve_ik(robot, target, branch=[one, two]).solutions}
    assert both == {one} | {s.branch for s in solve_ik(robot, target, branch=two).solutions}
    assert len(both) == 3


def test_a_missing_branch_is_distinguished_from_one_outside_the_limits():
    robot = kin.get_robot("pioneer5")
    target = kin.fk(robot, robot.home)
    every = {s.branch for s in solve_ik(robot, target, task="approach", respect_limits=False).solutions}
    missing = next(name for name in kin.branch_names(robot) if name not in every)
    result = solve_ik(robot, target, task="approach", branch=missing)
    assert (result.status, result.cause) == (Status.UNREACHABLE, "branch")
    assert "one configuration reaches this target in other postures" in result.reason
    behind = next(name for name in every if name != kin.branch_of(robot, robot.home))
    result = solve_ik(robot, target, task="approach", branch=behind)
    assert (result.status, result.cause) == (Status.LIMITS, "joint limits")
    assert [b.branch for b in result.blocked] == [behind]
    assert "One configuration is inside the limits in postures that were not chosen" in result.reason


# Limits and locks


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
@pytest.mark.parametrize("task", TASKS)
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_narrowed_limits_and_locks_hold(robot_id, task, data):
    """The pose of a configuration inside narrowed limits is solved, and all solutions are inside them."""
    robot = kin.get_robot(robot_id)
    unit = st.floats(0, 1)
    width = robot.upper - robot.lower
    share = np.array(data.draw(st.lists(st.floats(0.02, 1), min_size=robot.n, max_size=robot.n)))
    low = robot.lower + np.array([data.draw(unit) for _ in range(robot.n)]) * (1 - share) * width
    high = np.minimum(low + share * width, robot.upper)
    q = low + np.array([data.draw(unit) for _ in range(robot.n)]) * (high - low)
    q = np.clip(q, low, high)
    locked = [float(x) if data.draw(st.booleans()) and i % 2 else None for i, x in enumerate(q)]
    target = kin.fk(robot, q)
    result = solve_ik(robot, target, task=task, limits=np.c_[low, high].tolist(), locked=locked)
    assert result.status is Status.SOLVED, result.reason
    for s in result.solutions:
        assert (s.q >= low).all()
        assert (s.q <= high).all()
        assert all(value is None or s.q[i] == value for i, value in enumerate(locked))
        assert meets(kin.fk(robot, s.q), target, task)


def test_wider_limits_are_intersected_where_that_is_wanted():
    arm = kin.get_robot("ur5")
    T = kin.fk(arm, [0.4, -1.2, 1.4, 0.3, 1.1, 0.2])
    narrow = [(-9.0, 3.0), (-3.0, 0.0), (0.0, 9.0), None, None, (-7.0, 7.0)]
    inside = [(arm.lower[0], 3.0), (-3.0, 0.0), (0.0, arm.upper[2]), None, None, (arm.lower[5], arm.upper[5])]
    wanted = kin.solve_ik(arm, T, limits=inside)
    found = kin.solve_ik(arm, T, limits=narrow, wider_limits="intersect")
    assert found.q.tolist() == wanted.q.tolist()
    assert 0 < len(found.solutions) < 8
    many = kin.solve_ik_many(arm, [T], limits=narrow, wider_limits="intersect")
    assert many.q[0].tolist() == found.solutions[0].q.tolist()
    constraints = kin.JointConstraints(narrow, wider_limits="intersect")
    points = kin.workspace.sample_workspace(arm, 50, constraints=constraints, with_q=True)
    assert all((chunk.q <= arm.upper).all() and (chunk.q[:, 0] <= 3.0).all() for chunk in points)


def test_a_violation_says_that_the_joint_is_locked():
    robot = kin.get_robot("pioneer5")
    target = kin.fk(robot, robot.home)
    result = solve_ik(robot, target, task="approach", locked=[1.0, None, None, None, None])
    assert result.status is Status.LIMITS
    assert "joint 1 (rotating base) at 90.0° (locked at 57.3°)" in result.reason
    assert result.reason.startswith("Not possible while joint 1 is locked: ")
    assert "outside the limits" not in result.reason


@pytest.mark.parametrize(("name", "point"), [("puma560", [0.2, 0.5, 0.5]), ("ur5", [0.1, 0.4, 0.4])])
@pytest.mark.parametrize("kind", ["lock", "limits"])
def test_a_point_that_a_constraint_puts_out_of_reach_is_not_called_too_far_away(name, point, kind):
    robot = kin.get_robot(name)
    home = float(robot.q_home[0])
    rest = [None] * (robot.n - 1)
    constraint = {"locked": [home, *rest]} if kind == "lock" else {"limits": [[home - 0.1, home + 0.1], *rest]}
    result = solve_ik(robot, point, task="position", **constraint)
    free = solve_ik(robot, point, task="position")
    assert np.linalg.norm(kin.fk(robot, free.solutions[0].q)[:3, 3] - point) < 1e-9
    assert (result.status, result.cause, result.details.restriction.distance) == ("unreachable", "outside", 0.0)
    assert "too far away" not in result.reason
    why = "joint 1 is locked" if kind == "lock" else "the limits of joint 1 are narrowed"
    assert f" by {1e3 * result.distance:.1f} mm while {why}: " in result.reason
    assert "the point can be reached." in result.reason
    assert result.explain().title.endswith(f" mm while {why}")


def test_a_lock_that_only_adds_to_the_distance_is_named_with_what_is_left():
    robot = kin.get_robot("puma560")
    result = solve_ik(robot, [2.0, 0.5, 0.5], task="position", locked=[0.0, *[None] * 5])
    free = solve_ik(robot, [2.0, 0.5, 0.5], task="position")
    assert 0.0 < free.distance < result.distance
    assert free.details.restriction is None
    assert result.details.restriction == ((0,), (), pytest.approx(free.distance, abs=1e-6))
    assert "too far away; with joint 1 unlocked, it would still be out of reach by" in result.reason


def test_a_lock_that_does_not_matter_is_not_blamed():
    robot = kin.get_robot("ur5")
    result = solve_ik(robot, [3.0, 0.0, 0.0], task="position", locked=[*[None] * 5, 0.0])
    assert (result.cause, result.details.restriction) == ("too far", None)


def test_coordinates_that_locks_prevent_can_be_met_without_them():
    robot = kin.get_robot("puma560")
    T = kin.fk(robot, robot.random_q(np.random.default_rng(0)))
    mask = [True] * 4 + [False, True]
    assert solve_ik(robot, T, mask=mask).status is Status.SOLVED
    result = solve_ik(robot, T, mask=mask, locked=[*[None] * 4, *robot.q_home[4:].tolist()])
    assert (result.status, result.details.restriction) == (Status.UNREACHABLE, ((4, 5), (), 0.0))
    assert result.reason.startswith("These coordinates cannot be met together while joints 5 and 6 are locked: ")
    assert "with joints 5 and 6 unlocked, they can be met." in result.reason


def test_an_orientation_that_a_lock_prevents_can_be_held_without_it():
    robot = kin.get_robot("panda")
    T = kin.fk(robot, robot.random_q(np.random.default_rng(6)))
    result = solve_ik(robot, T, locked=[*[None] * 5, float(robot.q_home[5]), None])
    assert (result.cause, result.details.restriction) == ("orientation", ((5,), (), 0.0))
    assert result.reason.startswith("The arm cannot hold this orientation at this point while joint 6 is locked: ")
    assert result.reason.endswith("; with joint 6 unlocked, it can.")


def test_a_redundancy_that_a_lock_leaves_is_given_up_with_the_lock():
    arm = kin.get_robot("ur5")
    rail = kin.Joint("rail", 0.0, 0.0, 0.0, math.pi / 2, kind="prismatic", limits=(0.0, 4.0))
    robot = replace(arm, id="on a rail", rows=(rail, *arm.rows), home=(0.0, *arm.home))
    T = kin.fk(robot, [3.0, *arm.home])
    result = solve_ik(robot, T, task="approach", locked=[0.0, *[None] * 6], redundancy=0.2)
    assert result.details.restriction == ((0,), (), 0.0)


# Images


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_all_golden_images_inside_the_limits(robot_id, golden):
    """Exactly the whole-turn images of the 50-digit sets."""
    robot = kin.get_robot(robot_id)
    checked = 0
    for case in golden(robot_id)["ik"]:
        wanted = np.array(case["in_limits"]) if "in_limits" in case else None
        if wanted is None or not len(wanted):
            continue
        task = "approach" if robot.n == 5 else "pose"
        value = None if robot.n == 5 else case.get("theta1", case.get("psi"))
        result = solve_ik(robot, case["T"], task=task, redundancy=value, images="all")
        found = result.q
        assert len(found) == len(wanted)
        for q in wanted:
            assert np.abs(found - q).max(axis=1).min() < 1e-8
        checked += 1
    assert checked >= 3


@pytest.mark.parametrize("robot_id", SEVEN)
def test_images_are_whole_turns_of_the_nearest_ones(robot_id):
    robot = kin.get_robot(robot_id)
    for q in robot.random_q(np.random.default_rng(4), 20):
        target = kin.fk(robot, q)
        nearest = solve_ik(robot, target, q_seed=q)
        every = solve_ik(robot, target, q_seed=q, images="all")
        expected = set()
        for s in nearest.solutions:
            spans = [
                [y for y in (x + 2 * math.pi * k for k in range(-3, 4)) if low - 1e-9 <= y <= high + 1e-9]
                for x, low, high in zip(s.q, robot.lower, robot.upper, strict=True)
            ]
            expected |= {tuple(np.round(image, 9)) for image in itertools.product(*spans)}
        assert {tuple(np.round(s.q, 9)) for s in every.solutions} == expected
        assert [s.distance for s in every.solutions] == sorted(s.distance for s in every.solutions)
        assert all(s.position_error <= 1e-9 and s.rotation_error <= 1e-9 for s in every.solutions)


# Masks

MASKS = [m for m in itertools.product((False, True), repeat=6) if any(m)]


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
@pytest.mark.parametrize("frame", ["tool", "base"])
def test_every_mask_is_solved_in_its_frame(robot_id, frame):
    """All 63 masks: the kept coordinates are zero, by an independent logarithm."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(6)
    for mask in MASKS:
        q = robot.random_q(rng)
        target = kin.fk(robot, q)
        result = solve_ik(robot, target, mask=mask, mask_frame=frame, q_seed=robot.random_q(rng))
        assert result.status is Status.SOLVED, (mask, result.reason)
        for s in result.solutions:
            T = kin.fk(robot, s.q)
            p = T[:3, 3] - target[:3, 3]
            if frame == "tool":
                p = target[:3, :3].T @ p
                phi = rotation_vector(target[:3, :3].T @ T[:3, :3])
            else:
                phi = rotation_vector(T[:3, :3] @ target[:3, :3].T)
            error = np.concatenate([p, phi])[list(mask)]
            assert np.abs(error).max() <= 3e-9, (mask, error)
            assert robot.in_limits(s.q)


def test_masks_equivalent_to_a_task_give_its_result():
    robot = kin.get_robot("redundant7-craig")
    target = kin.fk(robot, robot.home)
    for mask, frame, task in (
        ((True,) * 6, "base", "pose"),
        ((True,) * 5 + (False,), "tool", "approach"),
        ((True,) * 3 + (False,) * 3, "base", "position"),
    ):
        masked, plain = solve_ik(robot, target, mask=mask, mask_frame=frame), solve_ik(robot, target, task=task)
        assert masked.task == task
        assert masked.q.tolist() == plain.q.tolist()
    assert solve_ik(robot, target, mask=(True,) * 5 + (False,), mask_frame="base").task == "mask"


def test_a_mask_that_cannot_be_met_reports_its_error():
    robot = kin.get_robot("redundant7-craig")
    T = np.eye(4)
    T[2, 3] = 3.0
    result = solve_ik(robot, T, mask=[False, False, True, True, True, False], mask_frame="base")
    assert result.status is Status.UNREACHABLE
    assert result.distance == pytest.approx(3.0 - 1.38, abs=2e-3)
    assert "cannot be met together" in result.reason
    assert robot.in_limits(result.closest.q)


# Preferences and redundancy parameters


@pytest.mark.parametrize("robot_id", SEVEN)
@pytest.mark.parametrize("task", ["pose", "approach"])
@pytest.mark.parametrize("prefer", ["limits", "manipulability"])
def test_no_value_of_a_sweep_is_better_than_the_preferred_one(robot_id, task, prefer):
    """No value of a fine sweep over the redundancy parameter, on any branch, is better than the one chosen."""
    robot = kin.get_robot(robot_id)

    def worth(q):
        if prefer == "manipulability":
            return float(kin.manipulability(robot, q))
        return float((np.minimum(q - robot.lower, robot.upper - q) / (0.5 * (robot.upper - robot.lower))).min())

    for q in robot.random_q(np.random.default_rng(8), 4):
        target = kin.fk(robot, q)
        result = solve_ik(robot, target, task=task, q_seed=q, prefer=prefer)
        values = [worth(s.q) for s in result.solutions]
        assert all(a >= b - 1e-6 * abs(values[0]) for a, b in itertools.pairwise(values))
        free = result.redundancy[0]
        swept = [
            worth(s.q)
            for low, high in free.intervals
            for v in np.linspace(low, high, 40)
            for s in solve_ik(robot, target, task=task, q_seed=q, redundancy={free.name: float(v)}).solutions
        ]
        # With two parameters the sweep varies only one, and the search optimises one after the other.
        assert max(swept) <= values[0] + (1e-3 if len(result.redundancy) == 1 else 1e-2) * abs(values[0]) + 1e-9
        assert meets(kin.fk(robot, result.solutions[0].q), target, task)


@pytest.mark.parametrize("robot_id", SEVEN)
def test_two_redundancy_parameters_can_both_be_requested(robot_id):
    robot = kin.get_robot(robot_id)
    for q in robot.random_q(np.random.default_rng(9), 20):
        target = kin.fk(robot, q)
        first = solve_ik(robot, target, task="approach", q_seed=q)
        requested = {
            r.name: 0.5 * sum(first.solutions[0].redundancy[k].intervals[0])
            for k, r in enumerate(first.redundancy)
        }
        result = solve_ik(
            robot, target, task="approach", q_seed=q, redundancy=requested, branch=first.solutions[0].branch
        )
        assert result.status is Status.SOLVED
        (s,) = result.solutions
        assert [r.value for r in s.redundancy] == pytest.approx(list(requested.values()), abs=1e-9)
        assert meets(kin.fk(robot, s.q), target, "approach")


def test_a_requested_joint_value_is_not_changed_by_a_whole_turn():
    """θ1 = −200° is kept, although 160° would be nearer to the seed."""
    robot = kin.get_robot("redundant7")
    q = np.radians([-200, 30, 20, 40, 50, 60, 70])
    result = solve_ik(robot, kin.fk(robot, q), redundancy={"theta1": float(q[0])})
    assert all(s.q[0] == pytest.approx(q[0], abs=1e-12) for s in result.solutions)
    assert any(np.abs(s.q - q).max() < 1e-9 for s in result.solutions)


@pytest.mark.parametrize("robot_id", SEVEN)
def test_the_ranges_of_a_branch_are_exact(robot_id):
    """A value just inside each end is solved on the branch, one just outside is not; also with narrowed limits."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(10)
    ends = 0
    for _ in range(25):
        width = robot.upper - robot.lower
        share = rng.uniform(0.2, 0.7, robot.n)
        low = robot.lower + rng.random(robot.n) * (1 - share) * width
        limits = np.c_[low, low + share * width]
        q = rng.uniform(limits[:, 0], limits[:, 1])
        target = kin.fk(robot, q)

        def solved(value, branch, target=target, limits=limits):
            result = solve_ik(robot, target, limits=limits.tolist(), branch=branch, redundancy=float(value))
            return result.status is Status.SOLVED

        for s in solve_ik(robot, target, limits=limits.tolist()).solutions:
            (free,) = s.redundancy
            assert free.intervals
            for a, b in free.intervals:
                assert solved(0.5 * (a + b), s.branch)
                for inside, outside in ((a + 1e-7, a - 1e-6), (b - 1e-7, b + 1e-6)):
                    if b - a > 1e-6:
                        assert solved(inside, s.branch)
                    whole = abs(abs(outside) - math.pi) < 1e-5 and free.name == "psi"
                    if not whole and not any(x <= outside <= y for x, y in free.intervals):
                        assert not solved(outside, s.branch)
                        ends += 1
    assert ends > 30


def test_a_requested_value_outside_the_limits_names_the_joint_and_the_possible_values():
    robot = kin.get_robot("redundant7-craig")
    target = kin.fk(robot, robot.home)
    result = solve_ik(robot, target, redundancy={"psi": math.pi}, q_seed=robot.home, branch="seed")
    assert result.status is Status.LIMITS
    assert "with arm angle ψ = " in result.reason
    low, high = result.redundancy[0].intervals[0]
    assert f"Possible arm angle ψ: {math.degrees(low):.1f}° … {math.degrees(high):.1f}°" in result.reason


# Reasons


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_every_blocked_branch_reports_its_violations(robot_id):
    """With the values of the branch and the limits that they exceed; the closest branch is first."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(12)
    blocked = 0
    for _ in range(120):
        q = rng.uniform(1.6 * robot.lower, 1.6 * robot.upper)
        target = kin.fk(robot, q)
        result = solve_ik(robot, target, task="approach" if robot.n == 5 else "pose")
        if result.status is not Status.LIMITS:
            continue
        blocked += 1
        overruns = []
        for branch in result.blocked:
            assert branch.branch == kin.branch_of(robot, branch.q)
            assert branch.violations
            beyond = {i for i in range(robot.n) if not robot.lower[i] <= branch.q[i] <= robot.upper[i]}
            assert {v.joint for v in branch.violations} == beyond
            for v in branch.violations:
                assert v.value == branch.q[v.joint]
                assert v.limit in (robot.lower[v.joint], robot.upper[v.joint])
            overruns.append(sum(abs(v.value - v.limit) for v in branch.violations))
        assert (np.diff(overruns) > -1e-11).all(), "those equally far outside are in the order of the branches"
        assert f"joint {result.violations[0].joint + 1}" in result.reason
    assert blocked >= 10


def test_the_hole_around_the_first_axis_is_named():
    """A two-link arm on a rotating base that cannot fold back leaves a hole around axis 1."""
    robot = kin.load_robot(
        """
        id = "hole"
        name = "hole"
        source = "made up"
        convention = "standard"
        units = { length = "m", angle = "deg" }
        home = [0, 0.3]
        rows = [
          { name = "turn", d = 0.5, a = 0.2, alpha = -90, limits = [-180, 180] },
          { name = "lift", kind = "prismatic", alpha = 90, limits = [-0.4, 0.4] },
        ]
        """.replace("home = [0, 0.3]\n", "")
    )
    T = kin.fk(robot, robot.q_home)
    point = np.array([0.02, 0.01, T[2, 3]])
    result = solve_ik(robot, point, task="position")
    assert (result.status, result.cause) == (Status.UNREACHABLE, "around the axis")
    assert "hole around the first axis" in result.reason


@pytest.mark.parametrize(("degrees", "said"), [(0.0, True), (1.0, False)])
def test_a_singular_solution_names_the_kind_of_singularity(degrees, said):
    robot = kin.get_robot("redundant7-craig")
    q = np.radians([10, 40, 20, 60, 30, degrees, 15])
    q[4] = math.pi / 2 if said else q[4]
    result = solve_ik(robot, kin.fk(robot, q), q_seed=q)
    assert result.status is Status.SOLVED
    assert ("configuration is singular" in result.reason) is said
    assert bool([s for s in result.singularities if s.kind == "wrist"]) is said


# Closest and nearest


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
@pytest.mark.parametrize("task", ["pose", "approach"])
def test_no_configuration_of_a_dense_search_is_closer(robot_id, task):
    """No configuration of a dense sample, nor a descent from the best of them, is closer than `closest`."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(17)
    cloud_q = robot.random_q(rng, 30_000)
    cloud = kin.fk(robot, cloud_q)
    tried = 0
    for _ in range(14):
        target = np.eye(4)
        target[:3, :3] = rotation_from_wxyz(rng.normal(size=4))
        target[:3, 3] = rng.uniform(-1, 1, 3) * robot.reach
        result = solve_ik(robot, target, task=task)
        if result.status is Status.SOLVED:
            continue
        tried += 1
        metric = _metric(cloud, target, task)
        mine = math.hypot(result.closest.position_error, 0.1 * result.closest.rotation_error)
        assert mine <= metric.min() + 1e-9
        # The best of the sample, improved by an independent random search.
        q, best = cloud_q[np.argmin(metric)].copy(), metric.min()
        for step in np.geomspace(0.3, 1e-3, 60):
            tries = np.clip(q + step * rng.normal(size=(60, robot.n)), robot.lower, robot.upper)
            values = _metric(kin.fk(robot, tries), target, task)
            if values.min() < best:
                q, best = tries[np.argmin(values)], values.min()
        assert mine <= best + 1e-9
    assert tried >= 8


def _metric(T, target, task):
    """The documented metric of tool poses ``(k, 4, 4)``."""
    cosine = 0.5 * (np.einsum("kij,ij->k", T[:, :3, :3], target[:3, :3]) - 1)
    if task == "approach":
        cosine = T[:, :3, 2] @ target[:3, 2]
    return np.hypot(np.linalg.norm(T[:, :3, 3] - target[:3, 3], axis=1), 0.1 * np.arccos(np.clip(cosine, -1, 1)))


@pytest.mark.parametrize("robot_id", SEVEN)
def test_no_orientation_of_a_dense_search_is_nearer(robot_id):
    """None of thousands of configurations that meet the point is nearer in orientation than the reported one."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(19)
    tried = 0
    for q in robot.random_q(rng, 40):
        if tried == 4:
            break
        target = kin.fk(robot, q)
        target[:3, :3] = rotation_from_wxyz(rng.normal(size=4))
        result = solve_ik(robot, target)
        if result.status is not Status.ORIENTATION:
            continue
        tried += 1
        nearest = result.nearest_orientation
        assert nearest.position_error <= 1e-9
        assert robot.in_limits(nearest.q)
        found = [
            rotation_angle(kin.fk(robot, s.q)[:3, :3], target[:3, :3])
            for seed in robot.random_q(rng, 200)
            for s in solve_ik(robot, target[:3, 3], task="position", q_seed=seed).solutions
        ]
        assert len(found) > 200
        assert nearest.rotation_error <= min(found) + 1e-6
    assert tried == 4


# Invalid options


@pytest.mark.parametrize(
    ("arguments", "field", "said"),
    [
        ({"limits": [[0, 1]]}, "limits", "7 pairs"),
        ({"limits": "wide"}, "limits", "pairs"),
        ({"limits": [None] * 6 + [[1, 0]]}, "limits[6]", "not below"),
        ({"limits": [None] * 6 + [[0, math.nan]]}, "limits[6][1]", "finite"),
        ({"limits": [None] * 6 + [5]}, "limits[6]", "lower limit"),
        ({"limits": [[-9, 9]] + [None] * 6}, "limits[0]", "inside the joint's own"),
        ({"limits": [[-9, 9]] + [None] * 6}, "limits[0]", "or the option wider_limits intersect"),
        ({"limits": [[8, 9]] + [None] * 6, "wider_limits": "intersect"}, "limits[0]", "overlap the joint's own"),
        ({"wider_limits": "clip"}, "wider_limits", '"intersect"'),
        ({"locked": [0.0]}, "locked", "7 joint values"),
        ({"locked": ["a"] + [None] * 6}, "locked[0]", "finite number"),
        ({"locked": [10**400] + [None] * 6}, "locked[0]", "finite number"),
        ({"locked": [True] + [None] * 6}, "locked[0]", "finite number"),
        ({"locked": [None, 3.0] + [None] * 5}, "locked[1]", "inside the limits"),
        ({"locked": [0.0] + [None] * 6, "respect_limits": False}, "respect_limits", "true"),
        ({"branch": "elbow sideways"}, "branch", "elbow positive"),
        ({"branch": "elbow positive · elbow negative"}, "branch", "go together"),
        ({"branch": []}, "branch", "at least one"),
        ({"branch": 3}, "branch", "at least one"),
        ({"branch": [3]}, "branch", "elbow up"),
        ({"images": "some"}, "images", "nearest"),
        ({"prefer": "beauty"}, "prefer", "manipulability"),
        ({"mask": [True] * 5}, "mask", "six"),
        ({"mask": [1, 1, 1, 1, 1, 1]}, "mask", "six"),
        ({"mask": [False] * 6}, "mask", "at least one"),
        ({"mask": [True] * 6, "task": "approach"}, "task", "besides a mask"),
        ({"mask": [True] * 6, "mask_frame": "world"}, "mask_frame", "tool"),
        ({"task": "mask"}, "task", "pose"),
        ({"redundancy": {"theta9": 1.0}}, "redundancy", "psi"),
        ({"redundancy": {"psi": math.inf}}, "redundancy.psi", "finite"),
        ({"redundancy": {"psi": "up"}}, "redundancy.psi", "finite"),
        ({"redundancy": 1.0, "task": "position"}, "redundancy", "no redundancy parameter"),
        ({"max_solutions": 1.5}, "max_solutions", "whole number"),
    ],
)
def test_an_invalid_option_names_the_field_and_what_is_valid(arguments, field, said):
    robot = kin.get_robot("redundant7-craig")
    with pytest.raises(InputError) as caught:
        solve_ik(robot, kin.fk(robot, robot.home), **arguments)
    assert caught.value.field == field
    assert said in str(caught.value)


# Choice of solver


def test_the_closed_form_can_be_switched_off():
    for robot_id, task in (("pioneer5", "approach"), ("redundant7", "pose"), ("redundant7-craig", "pose")):
        robot = kin.get_robot(robot_id)
        for q in robot.random_q(np.random.default_rng(12), 10):
            target = kin.fk(robot, q)
            result = solve_ik(robot, target, task=task, solver="numeric")
            assert (result.status, result.solver) == (Status.SOLVED, "numeric")
            assert result.solver_reason == "requested: numeric descent from many starts"
            assert robot.in_limits(result.solutions[0].q)
            reached = kin.fk(robot, result.solutions[0].q)
            assert np.abs(reached[:3, 3] - target[:3, 3]).max() < 1e-9
    with pytest.raises(kin.InputError, match=r"solver.*\"auto\", \"numeric\""):
        solve_ik(robot, target, solver="magic")


def test_the_result_explains_the_choice_of_solver():
    arm = kin.get_robot("redundant7-craig")
    target = kin.fk(arm, arm.q_home)
    assert "axes 1, 2, 3 meet in one point" in solve_ik(arm, target).solver_reason
    masked = solve_ik(arm, target, mask=(True, True, False, False, False, False))
    assert "(srs7) does not cover this task" in masked.solver_reason or masked.solver == "srs7"


def test_results_survive_pickling():
    """Processes exchange them."""
    arm = kin.get_robot("redundant7-craig")
    result = solve_ik(arm, kin.fk(arm, arm.q_home))
    again = pickle.loads(pickle.dumps(result))
    assert again.q.tolist() == result.q.tolist()
    assert (again.reason, again.redundancy) == (result.reason, result.redundancy)
    kin.ik_branches(arm, kin.fk(arm, arm.q_home))
    copy = pickle.loads(pickle.dumps(arm))
    assert copy == arm
    assert np.array_equal(kin.fk(copy, copy.q_home), kin.fk(arm, arm.q_home))


# Options as one value


def test_options_are_values():
    """Options made of lists, arrays or tuples are equal keys; a bool is not a number."""
    lists = IKOptions(
        mask=[True] * 3 + [False] * 3,
        constraints=JointConstraints(limits=[None, [0, 1]], locked=np.array([0.5, 0.25])),
        branch=["elbow up"],
        redundancy={"psi": 1},
    )
    tuples = IKOptions(
        mask=(True,) * 3 + (False,) * 3,
        constraints=JointConstraints(limits=(None, (0.0, 1.0)), locked=(0.5, 0.25)),
        branch="elbow up",
        redundancy=(("psi", 1.0),),
    )
    assert lists == tuples
    assert hash(lists) == hash(tuples)
    assert {lists: 1}[tuples] == 1
    assert replace(lists, max_solutions=2) != lists
    copy = pickle.loads(pickle.dumps(lists))
    assert copy == lists
    assert "_hash" not in vars(copy), "hashes of strings differ between processes"
    with pytest.raises(InputError, match="max_solutions"):
        IKOptions(max_solutions=True)


def test_keywords_and_options_give_the_same_result():
    arm = kin.get_robot("redundant7-craig")
    rng = np.random.default_rng(8)
    q, seed = arm.random_q(rng), arm.random_q(rng)
    locked = [None, None, float(q[2]), None, None, None, None]
    limits = [[-2.0, 2.0], *[None] * 6]
    options = IKOptions(constraints=JointConstraints(limits, locked), branch="seed", prefer="limits")
    one = solve_ik(arm, kin.fk(arm, q), q_seed=seed, limits=limits, locked=locked, branch="seed", prefer="limits")
    other = kin.ik.solve(arm, kin.fk(arm, q), options, seed)
    assert (one.status, one.reason, one.details) == (other.status, other.reason, other.details)
    assert one.q.tolist() == other.q.tolist()


def test_the_branch_of_the_seed_follows_each_seed():
    """Prepared options are shared by all seeds; the branch of the seed is not."""
    arm = kin.get_robot("redundant7-craig")
    T, options = kin.fk(arm, arm.q_home), IKOptions(branch="seed")
    seeds = arm.random_q(np.random.default_rng(4), 20)
    names = set()
    for seed in seeds:
        for found in kin.ik.solve(arm, T, options, seed).solutions:
            assert found.branch == kin.branch_of(arm, seed)
            names.add(found.branch)
    assert len(names) > 1


def test_an_explanation_has_a_headline_and_a_detail_in_any_units():
    arm = kin.get_robot("pioneer5")
    result = solve_ik(arm, [2.0, 0.0, 0.0], task="position")
    distance = result.details.distance
    assert result.distance == distance
    text = result.explain(Units(False, "m"))
    assert text.headline.endswith(f" by {distance:.4f} m")
    assert text.detail.startswith("The point is too far away.")
    assert text.text.startswith(f"{text.headline}: the point is too far away.")
    assert f" by {1e3 * distance:.1f} mm: " in result.reason


# How many solutions there are, and whether these are all


@pytest.mark.parametrize(
    ("name", "options", "complete", "said"),
    [
        ("ur5", {}, True, "Reached: 8 configurations for this pose."),
        ("ur5", {"branch": "seed"}, True, "Reached: one configuration in the chosen posture for this pose."),
        ("ur5", {"branch": "wrist flip"}, True, "Reached: 4 configurations in the chosen postures for this pose."),
        ("ur5", {"solver": "numeric"}, False, "Reached: one configuration found for this pose; others may exist."),
        ("panda", {}, False, "Reached: 2 postures; θ7 is free, so there are infinitely many configurations."),
        ("puma560", {"max_solutions": 1}, True, "Reached: 3 configurations for this pose."),
    ],
)
def test_an_answer_says_whether_its_solutions_are_all(name, options, complete, said):
    robot = kin.get_robot(name)
    result = solve_ik(robot, kin.fk(robot, robot.q_home), q_seed=robot.q_home, **options)
    assert result.status is Status.SOLVED
    assert (result.complete, result.details.complete) == (complete, complete)
    assert result.reason == said


@pytest.mark.parametrize(
    ("name", "q", "multiple", "said"),
    [
        (
            "planar2r",
            (0.3, 0.0),
            1,
            "one configuration for this pose; it is a multiple root, where postures merge.",
        ),
        ("planar2r", (0.3, 0.4), 0, "one configuration for this pose."),
        (
            "ur5",
            (0.1, -0.7, 0.0, 0.4, 0.8, 0.2),
            1,
            "5 configurations for this pose; one of them is a multiple root",
        ),
        ("ur5", (0.1, -0.7, 0.9, 0.4, 0.0, 0.2), 0, "infinitely many"),
    ],
)
def test_a_multiple_root_is_said(name, q, multiple, said):
    robot = kin.get_robot(name)
    result = solve_ik(robot, kin.fk(robot, q), q_seed=q, respect_limits=False)
    assert result.details.multiple == multiple
    assert said in result.reason


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("puma560", {"task": "position"}, "Reached: infinitely many configurations for this point;"),
        ("ur5", {"mask": [True] * 4 + [False, True]}, "Reached: infinitely many configurations for this set of"),
        (
            "pioneer5",
            {"task": "position"},
            "Reached: one posture; θ4 and θ5 are free, so there are infinitely many",
        ),
        ("scara", {"task": "position"}, "Reached: 2 postures; tool angle ψ is free, so there are infinitely many"),
        ("redundant7", {"redundancy": 0.3}, "Reached: 4 configurations for this pose and the requested θ1."),
        (
            "redundant7",
            {"branch": "seed"},
            "Reached: θ1 is free, so there are infinitely many configurations in the",
        ),
        # The task leaves nothing: three joints keep a point of space, six keep five coordinates and a lock.
        (
            "scara",
            {"task": "position", "locked": [None, None, None, 0.0]},
            "Reached: 2 configurations for this point.",
        ),
    ],
)
def test_a_motion_that_a_task_leaves_is_said(name, options, said):
    robot = kin.get_robot(name)
    result = solve_ik(robot, kin.fk(robot, robot.q_home), q_seed=robot.q_home, **options)
    assert result.reason.startswith(said)
    assert result.details.infinite is ("infinitely" in said)


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_a_locked_joint_takes_the_motion_that_is_left(name):
    """Three joints for a point: with the other joints locked, the numeric search finds separate solutions."""
    robot = kin.get_robot(name)
    locked = [None] * 3 + robot.q_home[3:].tolist()
    result = solve_ik(robot, kin.fk(robot, robot.q_home), task="position", locked=locked, solver="numeric")
    assert "infinitely" not in result.reason
    free = solve_ik(robot, kin.fk(robot, robot.q_home), task="position", solver="numeric")
    assert "infinitely many" in free.reason


def test_what_a_search_does_not_find_may_exist():
    for robot, complete in ((kin.get_robot("ur5"), True), (eight_joints(kin.get_robot("panda")), False)):
        far = kin.fk(robot, robot.q_home)
        far[:3, 3] *= 10.0
        assert solve_ik(robot, far).complete is complete


def test_the_shared_neighbours_of_a_limit_are_all_named():
    """Both postures of the SCARA are as far outside: neither is called the only one."""
    robot = kin.get_robot("scara")
    T = kin.fk(robot, [0.0, 0.7, 0.25, 0.0])
    result = solve_ik(robot, T)
    assert result.status is Status.LIMITS
    assert "One other posture is outside the limits too." in result.reason
    assert {len(b.violations) for b in result.blocked} == {1}


def test_rounding_does_not_decide_between_postures_outside_the_limits():
    stats = np.zeros((4, 5))
    stats[:, OVERRUN] = 0.1 + 0.2, 0.3, 0.3 - 1e-11, math.nan
    there = np.array([True, True, True, False])
    assert failures._by_overrun(np.arange(4.0)[:, None], there, stats) == [2, 0, 1]


@pytest.mark.parametrize("value", [1e154, 1e12, -1e7])
def test_a_seed_too_many_turns_away_is_refused(value):
    robot = kin.get_robot("ur5")
    T = kin.fk(robot, robot.q_home)
    for seed in ([0.0, value, 0.0, 0.0, 0.0, 0.0], np.array([0.0, value, 0.0, 0.0, 0.0, 0.0])):
        with pytest.raises(InputError, match=r"q_seed\[1\]"):
            solve_ik(robot, T, q_seed=seed, respect_limits=False)
    far = solve_ik(robot, T, q_seed=[9e5] * 6, respect_limits=False)
    assert far.status is Status.SOLVED
    assert far.best.position_error < 1e-9


def test_branches_that_meet_where_they_are_best_are_both_answers():
    # Both wrists are farthest from the limits where their intervals begin: there they are one configuration.
    panda = kin.get_robot("panda")
    T = kin.fk(panda, np.array([-2.09493, -1.706058, 2.307344, -2.714471, 2.88947, 0.199472, 2.028364]))
    found, best = solve_ik(panda, T, q_seed=panda.q_home), solve_ik(panda, T, q_seed=panda.q_home, prefer="limits")
    assert len(found.solutions) == 4
    assert {s.branch for s in best.solutions} == {s.branch for s in found.solutions}
    for solution in best.solutions:
        value, intervals = solution.redundancy[0].value, solution.redundancy[0].intervals
        assert any(low < value < high for low, high in intervals)
