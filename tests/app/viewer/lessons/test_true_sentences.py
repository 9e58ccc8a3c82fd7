"""Sentences of lessons and exercises that were once untrue or incomplete, against the arms."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import numpy_arm
import pytest
from lesson_arms import ASKED, arms_of

import kin
from app.exercises import Exercise, builtin_exercises
from app.viewer.exercises.views import unsaid
from app.viewer.lessons.guide.outline import Choice, Number, Step
from app.viewer.lessons.inverse.arm import arm_of
from app.viewer.lessons.inverse.exercise import example, exercise
from app.viewer.lessons.inverse.questions import outline_of
from kin import Robot
from kin.units import Units

OUTLINES = {(lesson.key, robot.id): lesson.outline(robot, Units()) for lesson, robot in ASKED}


def words(step: Step) -> str:
    found = [step.text, step.shown, step.practice]
    for question in (step.estimate, step.question):
        if question is not None:
            found += [question.asked().note, question.solution(), getattr(question, "prompt", "")]
        if isinstance(question, Choice):
            found += [text for option in question.options for text in (option.text, option.reason)]
    return " ".join(found)


def test_no_step_points_at_what_is_not_there() -> None:
    for (lesson, arm), outline in OUTLINES.items():
        for step in outline.steps:
            assert "the warning" not in words(step).lower(), (lesson, arm, step.title)
            assert "if it has another one there" not in words(step), (lesson, arm, step.title)


def test_the_lengths_that_an_exercise_by_hand_needs_are_in_its_words() -> None:
    """In which no table is on show: the lengths are those of the arm."""
    for name in ("two-elbows", "which-joint-moved"):
        exercise = next(each for each in builtin_exercises() if each.id == name)
        for seed in range(4):
            variant = exercise.variant(seed)
            said = variant.text(exercise.text, Units())
            for row in variant.robot.rows:
                assert Units().lengths.brief(row.a) in said, (name, said)


def test_a_ptp_through_a_singularity_is_not_slowed_there() -> None:
    """Of the same joint's way, one part leads through the stretched wrist and the other does not: same time."""
    step = next(step for step in OUTLINES["trajectories", "ur5"].steps if step.title == "Past a singularity")
    assert "PTP goes past the axis, or through it, without slowing down" in words(step)
    robot = kin.get_robot("ur5")
    middle = robot.q_home.copy()
    middle[4] = 0.0
    J = numpy_arm.jacobian(robot, middle)
    assert np.linalg.svd(J, compute_uv=False)[-1] < 1e-9, "a singularity on the way"
    times = []
    for first, last in ((-0.6, 0.6), (0.4, 1.6)):
        ends = [middle.copy(), middle.copy()]
        ends[0][4], ends[1][4] = first, last
        motion = kin.plan_motion(
            robot, [kin.motion.Ptp(target=kin.motion.JointTarget(tuple(ends[1].tolist())))], ends[0]
        )
        times.append(motion.duration)
        rates = np.abs(motion.sample(np.linspace(0.0, motion.duration, 101)).qd[:, 4])
        assert rates[50] == pytest.approx(rates.max(), rel=1e-6), "fastest in the middle, as any other motion"
    assert times[0] == pytest.approx(times[1], rel=1e-9)


@pytest.mark.parametrize("exercise", builtin_exercises(), ids=lambda exercise: exercise.id)
def test_why_repeats_nothing_that_right_has_said(exercise: Exercise) -> None:
    variant = exercise.variant(1)
    verdict = exercise.judge(variant, exercise.kind.answer(variant), Units())
    said = unsaid(exercise.solution(variant, Units()), verdict.reason)
    assert verdict.right
    assert not verdict.reason or verdict.reason not in said
    assert said != verdict.reason
    answer, more, _ = exercise.solution(variant, Units()).partition(". ")
    assert not (more and verdict.reason.endswith(f" {answer}.") and said.startswith(answer))


def axes(robot: Robot) -> list[tuple[np.ndarray, np.ndarray]]:
    """A point of each joint axis, and its direction, at home."""
    frames = [np.array(robot.base), *numpy_arm.frames(robot, robot.q_home)]
    last = 0 if robot.convention == "standard" else 1  # joint i turns about z before its row, or after it
    rows = [i for i, row in enumerate(robot.rows) if row.kind != "fixed"]
    return [(frames[i + last][:3, 3], frames[i + last][:3, 2]) for i in rows]


def test_the_axes_of_two_joints_have_the_names_of_the_scene_and_lie_as_the_answer_says() -> None:
    for robot in arms_of("dh"):
        outline, lines = OUTLINES["dh", robot.id], axes(robot)
        for question in (*(step.question for step in outline.steps), *outline.check):
            if not isinstance(question, Choice) or not question.prompt.startswith("How do the axes of joints"):
                continue
            one, other = map(int, re.findall(r"joints (\d+) and (\d+)", question.prompt)[0])
            first = 1 if robot.convention == "modified" else 0
            names = [f"z{'₀₁₂₃₄₅₆₇₈'[joint - 1 + first]}" for joint in (one, other)]
            assert " and ".join(names) in question.prompt, robot.id
            (p, z), (r, w) = lines[one - 1], lines[other - 1]
            reason = next(option.reason for option in question.options if option.right)
            angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(z, w)), abs(z @ w)))
            assert float(re.findall(r"between them is ([\d.]+)°", reason)[0]) == pytest.approx(angle, abs=0.051)
            n = np.cross(z, w)
            sine = np.linalg.norm(n)
            far = abs((r - p) @ n) / sine if sine > 1e-6 else np.linalg.norm(np.cross(r - p, z))
            stated = float(re.findall(r"distance ([\d.]+) mm", reason)[0])
            assert stated == pytest.approx(1e3 * far, abs=0.051), robot.id


def test_a_branch_that_ends_is_not_said_to_lead_anywhere() -> None:
    robot = kin.get_robot("pioneer5")
    arm = arm_of(robot)
    assert arm is not None
    given = exercise(arm, example(arm))
    assert 0 < sum(branch.q is None for branch in given.branches) < len(given.branches)
    for branch in given.branches:
        steps = outline_of(replace(given, signs=branch.derivation.signs), Units()).steps
        step = next(each for each in steps if each.title == "All branches")
        assert ("ends at the step" in step.practice) == (branch.q is None), branch.name
        assert isinstance(step.question, Number)
        assert not re.search(r"\d", step.question.method), "the second miss does not say how many"
