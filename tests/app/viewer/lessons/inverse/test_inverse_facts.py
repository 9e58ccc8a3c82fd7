"""What the lesson "Inverse kinematics" knows, without a page, against poses and axes by NumPy alone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS
from bare_page import STORE, bare_page
from lesson_arms import arms_of

import kin
from app.viewer.arm import Arm
from app.viewer.lessons.guide.outline import Drawn, Number
from app.viewer.lessons.inverse.derive import all_signs
from app.viewer.lessons.inverse.facts import InverseFacts
from app.viewer.lessons.inverse.lesson import InverseLesson
from app.viewer.lessons.inverse.questions import outline_of
from app.viewer.lessons.inverse.settings import InverseSettings
from kin import Robot
from kin.transforms import Array
from kin.units import Units

UNITS = Units()
# How many of the last joints turn about the wrist centre.
WRISTS = {
    "planar2r": 0,
    "planar3r": 1,
    "pioneer5": 2,
    "puma560": 3,
    "irb120": 3,
    "redundant7-craig": 3,
    "iiwa14": 3,
}
DERIVED = [robot for robot in CLASSICS if robot.id in WRISTS]
ARMS = pytest.mark.parametrize("robot", DERIVED, ids=[robot.id for robot in DERIVED])


def facts(robot: Robot, seed: int) -> InverseFacts:
    """Of a random configuration whose tool is the target."""
    q = robot.random_q(np.random.default_rng(seed))
    return InverseFacts(InverseSettings.fresh(robot), Arm(robot, q, q))


def axis(robot: Robot, q: Array, i: int) -> tuple[Array, Array]:
    """A point ``(3,)`` of the axis of a joint, and its direction."""
    v, omega = np.split(numpy_arm.jacobian(robot, q)[:, i], 2)
    return numpy_arm.pose(robot, q)[:3, 3] + np.cross(omega, v), omega


def meeting(robot: Robot, q: Array, joints: list[int]) -> Array:
    """The point ``(3,)`` in which the axes of joints meet, the nearest one to the tool if they are one axis."""
    p, rows, right = numpy_arm.pose(robot, q)[:3, 3], [], []
    for point, omega in (axis(robot, q, i) for i in joints):
        across = np.eye(3) - np.outer(omega, omega)
        rows.append(across)
        right.append(across @ (point - p))
    found = np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=1e-6)[0] if joints else np.zeros(3)
    return p + found


def wrist(robot: Robot, q: Array) -> Array:
    return meeting(robot, q, list(range(robot.n - WRISTS[robot.id], robot.n)))


def from_axis(point: Array, line: tuple[Array, Array]) -> float:
    return float(np.linalg.norm(np.cross(point - line[0], line[1])))


def misses(robot: Robot, q: Array, T: Array) -> float:
    """How far the tool is from a target in what the derivation is to reach."""
    here, columns = numpy_arm.pose(robot, q), {2: [3], 5: [2, 3]}.get(robot.n, [0, 1, 2, 3])
    return float(np.abs((here - T)[:3, columns]).max())


def test_the_lesson_derives_the_arms_whose_last_axes_meet() -> None:
    assert {robot.id for robot in CLASSICS if facts(robot, 0).exists} == WRISTS.keys()


@ARMS
def test_branches_reach_the_target_and_are_available_within_the_limits(robot: Robot) -> None:
    for seed in range(4):
        known = facts(robot, seed)
        T = numpy_arm.pose(robot, known.q)
        assert known.branches
        reached = [one for one in known.branches if one.q is not None]
        for one in reached:
            assert one.q is not None
            assert misses(robot, one.q, T) < 1e-7
            over = np.maximum(one.q - robot.upper, robot.lower - one.q)
            assert one.available == bool(over.max() < 1e-6)
            assert {i for i, _ in one.outside} == set(np.flatnonzero(over > 1e-6))
            assert all(excess == pytest.approx(over[i]) for i, excess in one.outside)
        turns = [np.angle(np.exp(1j * (one.q - known.q))) for one in reached]
        assert min(float(np.abs(turn).max()) for turn in turns) < 1e-6, "the arm itself is on one of them"
        apart = [np.abs(np.exp(1j * a) - np.exp(1j * b)).max() for i, a in enumerate(turns) for b in turns[:i]]
        assert min(apart) > 1e-6, "no branch is there twice"


@ARMS
def test_lengths_of_the_derivation_are_distances_of_axes(robot: Robot) -> None:
    for seed in range(4):
        known = facts(robot, seed)
        q, found = known.q, known.followed.derivation
        if known.followed.q is None:
            continue
        w, frame = wrist(robot, q), known.derived.T_base_lesson
        assert frame[:3, :3] @ np.asarray(found.values["w"]) + frame[:3, 3] == pytest.approx(w, abs=1e-7)
        first = axis(robot, q, 0)
        if robot.n <= 3:
            assert found.number("D") == pytest.approx(from_axis(w, first), abs=1e-7)
        elif robot.n == 7:
            shoulder = meeting(robot, q, [0, 1, 2])
            assert found.number("D") == pytest.approx(float(np.linalg.norm(w - shoulder)), abs=1e-7)
        else:
            assert found.number("r") == pytest.approx(from_axis(w, first), abs=1e-7)
            # Axis 2 of the branch, which is not that of the arm unless the arm is on it.
            assert known.followed.q is not None
            second = axis(robot, known.followed.q, 1)
            assert found.number("D") == pytest.approx(from_axis(w, second), abs=1e-6)


@pytest.mark.parametrize("name", ["redundant7-craig", "iiwa14"])
def test_the_arm_angle_is_where_the_elbow_is_on_its_circle(name: str) -> None:
    robot = STORE.get(name)
    for seed in range(6):
        known = facts(robot, seed)
        w, shoulder, z = wrist(robot, known.q), meeting(robot, known.q, [0, 1, 2]), axis(robot, known.q, 0)[1]
        point, along = axis(robot, known.q, 3)
        elbow = point + (shoulder - point) @ along * along
        u = (w - shoulder) / np.linalg.norm(w - shoulder)
        level = np.cross(u, z) / np.linalg.norm(np.cross(u, z))
        highest = np.cross(level, u)
        psi = math.atan2(float((elbow - shoulder) @ level), float((elbow - shoulder) @ highest))
        assert math.remainder(known.psi - psi, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
        turned = replace(known, settings=replace(known.settings, psi=0.4, turned=True))
        assert turned.psi == 0.4
        assert all(one.derivation.number("ψ") == 0.4 for one in turned.branches)


@ARMS
def test_questions_are_about_their_own_pose_wherever_the_arm_is(robot: Robot) -> None:
    known = facts(robot, 3)
    asked = known.exercise
    assert asked is facts(robot, 4).exercise
    assert np.allclose(asked.T, numpy_arm.pose(robot, np.array(known.settings.q)), atol=1e-12)
    assert asked.followed.q is not None
    assert np.allclose(asked.followed.q, known.settings.q, atol=1e-7)
    assert robot.in_limits(np.array(known.settings.q))


@ARMS
def test_numbers_are_on_show_when_they_are_answered_or_wanted(robot: Robot) -> None:
    known, count = facts(robot, 0), len(facts(robot, 0).keys)
    if robot not in arms_of("inverse"):
        assert known.opened == (True,) * count, "nothing is asked"
        return
    assert known.opened == (False,) * count
    answered = (True, *[False] * (count - 1))
    assert replace(known, settings=replace(known.settings, answered=answered)).opened == answered
    assert replace(known, settings=replace(known.settings, all=True)).opened == (True,) * count


@ARMS
def test_a_wrong_angle_is_drawn_as_the_posture_that_has_it(robot: Robot) -> None:
    for signs in all_signs(facts(robot, 0).derived):
        known = facts(robot, 0)
        known = replace(known, settings=replace(known.settings, signs=signs))
        asked, q = known.exercise, np.array(known.settings.q)
        q = q if asked.followed.q is None else asked.followed.q
        for step in outline_of(asked, UNITS).steps:
            if not isinstance(step.drawn, Drawn):
                continue
            assert isinstance(step.question, Number)
            i, right = step.drawn.joint, step.question.answer
            if asked.followed.q is not None:
                off = np.array(step.drawn.at(right)) - q
                assert np.abs(np.exp(1j * off) - 1.0).max() < 1e-9, "the right value is no other posture"
            for wrong in (right + 0.4, -right, right * 180.0 / math.pi):
                drawn = np.array(step.drawn.at(wrong))
                assert np.array_equal(np.delete(drawn, i), np.delete(np.array(step.drawn.q), i))
                # The tool has turned about this axis, by as much as the answer is wrong.
                point, omega = axis(robot, q, i)
                back = np.array(step.drawn.at(right))
                moved, there = numpy_arm.pose(robot, drawn), numpy_arm.pose(robot, back)
                turn = float(known.derived.sense[i]) * (wrong - right)
                arm, now = there[:3, 3] - point, moved[:3, 3] - point
                level, across = arm - arm @ omega * omega, np.cross(omega, arm)
                expected = arm @ omega * omega + math.cos(turn) * level + math.sin(turn) * across
                assert now == pytest.approx(expected, abs=1e-6)


# The page


# Messages for one new configuration, as many as before this lesson was declared.
FRAMES = {"pioneer5": 8.0, "puma560": 8.0, "redundant7-craig": 9.0}


@pytest.mark.parametrize("name", FRAMES)
def test_a_new_pose_takes_no_more_messages_than_before(name: str) -> None:
    robot = STORE.get(name)
    with bare_page(robot) as page:
        lesson = page.open(InverseLesson)
        assert 0.9 <= page.messages_each(lesson, robot) <= FRAMES[name]


def test_a_target_beyond_reach_moves_no_arm_and_says_why() -> None:
    robot = STORE.get("pioneer5")
    with bare_page(robot) as page:
        lesson = page.open(InverseLesson)
        T = kin.fk(robot, robot.q_home)
        T[0, 3] = 3.0
        page.pose(robot.q_home, target=T)
        assert lesson.facts.followed.q is None
        page.press("Show this posture")
        page.rest()
        assert page.notices[-1].title == "Branch 1 is not available"
        assert page.notices[-1].detail == "It has no solution at this target."
        assert np.array_equal(page.now.q, robot.q_home)


def test_the_arm_angle_stays_where_it_is_typed_until_the_target_moves() -> None:
    robot = STORE.get("redundant7-craig")
    with bare_page(robot) as page:
        lesson = page.open(InverseLesson)
        page.set("ψ of the derivation", 40.0)
        page.rest()
        assert lesson.facts.psi == pytest.approx(math.radians(40.0))
        page.pose(robot.q_home + 0.1)
        assert lesson.facts.psi == pytest.approx(math.radians(40.0))
        lesson.on_result(kin.solve_ik(robot, page.now.T_tool, q_seed=robot.q_home))
        page.rest()
        assert lesson.facts.psi != pytest.approx(math.radians(40.0))
        shown = math.degrees(lesson.facts.psi)
        assert page.control("ψ of the derivation").value == pytest.approx(shown, abs=0.06)
        assert "psi" not in lesson.state()
