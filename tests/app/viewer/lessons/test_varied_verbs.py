"""Steps ask for more than a number or an option: to drive the arm, to sort, to put into order, to place a frame.

What such a step takes as right is compared with the arm, computed by NumPy alone from its table.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy_arm
import pytest
from lesson_arms import ASKED, arms_of

import kin
from app.exercises.contract import Posed
from app.exercises.kinds.order import OrderKind
from app.exercises.kinds.sketch import SketchKind
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.outline import Choice, Number, Step
from app.viewer.lessons.guide.progress import Progress
from kin import Robot
from kin.motion import motion_limits
from kin.units import Units

UNITS, RADIANS = Units(), Units(degrees=False, length="m")
VERBS = {
    "sketch": "sketch",
    "find": "drive",
    "reach": "drive",
    "sort": "sort",
    "order": "put into order",
    "frame": "place",
}
# What each lesson asks besides how large and which; the title of the step.
ASKED_BESIDES = {
    "rotations": ("place", "Place a frame"),
    "dh": ("put into order", "Four motions"),
    "screws": ("sort", "Near and far"),
    "equations": ("drive", "Where a test finds nothing"),
    "inverse": ("drive", "Fewer solutions"),
    "postures": ("drive", "Another way to hold it"),
    "numeric": ("sort", "From fast to slow"),
    "redundancy": ("drive", "Move only the arm"),
    "velocity": ("drive", "Drive to a singularity"),
    "trajectories": ("sketch", "Sketch a profile"),
}


def posed(units: Units = UNITS) -> Iterator[tuple[Robot, str, Step, Posed]]:
    for lesson, robot in ASKED:
        for step in lesson.outline(robot, units).steps:
            if isinstance(step.question, Posed):
                yield robot, lesson.key, step, step.question


ALL = [*posed()]


def test_every_lesson_has_another_verb() -> None:
    for lesson in LESSONS:
        verb, title = ASKED_BESIDES[lesson.key]
        found = [question for _, key, step, question in ALL if (key, step.title) == (lesson.key, title)]
        assert found
        assert {VERBS[question.kind.name] for question in found} == {verb}


DRIVEN = [robot for robot, lesson, *_ in ALL if lesson == "velocity"]
SLIDER = 149  # pixels of a joint's slider in a window of 1280 px


@pytest.mark.parametrize("robot", DRIVEN, ids=lambda robot: robot.id)
def test_a_singularity_can_be_reached_by_dragging_a_slider(robot: Robot) -> None:
    """Whatever pixel of the slider is nearest to where the step leads, it is near enough."""
    outline = next(each for each in LESSONS if each.key == "velocity").outline(robot, UNITS)
    step = next(each for each in outline.steps if each.title == "Drive to a singularity")
    assert isinstance(step.question, Posed)
    there = np.array(step.question.right())
    moved = np.flatnonzero(np.abs(there - robot.q_home) > 1e-6)
    [joint] = moved
    pixel = float(robot.upper[joint] - robot.lower[joint]) / SLIDER
    for off in (-0.5, 0.5):
        q = np.clip(there + off * pixel * np.eye(robot.n)[joint], robot.lower, robot.upper)
        assert step.question.judge(q.tolist()).right, robot.id


def test_lessons_count_their_verbs() -> None:
    """How large, which, and at least one more in every lesson."""
    assert {lesson.key for lesson in LESSONS} == ASKED_BESIDES.keys()
    for lesson in LESSONS:
        verbs = set()
        for robot in arms_of(lesson.key):
            for step in lesson.outline(robot, UNITS).steps:
                for question in (step.estimate, step.question):
                    match question:
                        case Posed():
                            verbs.add(VERBS[question.kind.name])
                        case Number():
                            verbs.add("how large")
                        case Choice():
                            verbs.add("which")
        assert len(verbs) >= 3, (lesson.key, verbs)


def test_right_answers_are_right_in_all_units_and_the_start_is_not() -> None:
    for (robot, lesson, _, question), (*_, asked) in zip(ALL, posed(RADIANS), strict=True):
        right = question.right()
        assert question.judge(right).right, (robot.id, lesson)
        assert asked.judge(right).right, (robot.id, lesson)
        form = question.asked().form
        start: Any = {
            "posture": robot.q_home.tolist(),
            "order": list(range(len(question.asked().labels))),
            "fields": ["0"] * len(question.asked().labels),
            "frame": [0, 0, 0, 1, 0, 0, 0],
        }[form]
        assert not question.judge(start).right, f"{robot.id}, {lesson}: nothing has to be done"


def test_nothing_that_is_shown_gives_the_answer_away() -> None:
    for robot, lesson, step, question in ALL:
        asked, solution = question.asked(), question.solution()
        shown = " ".join([step.text, question.prompt, asked.note, *asked.labels])
        assert solution not in shown
        if asked.form == "posture":
            moved = [
                i for i, (a, b) in enumerate(zip(question.right(), robot.q_home, strict=True)) if abs(a - b) > 0.02
            ]  # type: ignore[call-overload]
            assert moved, (robot.id, lesson)
            unit = [UNITS.of(bool(robot.revolute[i])) for i in moved]
            shown_values = [u.text(question.right()[i], 1) for i, u in zip(moved, unit, strict=True)]  # type: ignore[index]
            assert not all(text in shown for text in shown_values), (robot.id, lesson, shown_values)


def wrong_answers(robot: Robot, question: Posed) -> tuple[Any, Any]:
    match question.asked().form:
        case "posture":
            q = robot.q_home
            return q.tolist(), (q + 0.02).tolist()
        case "order":
            n = len(question.asked().labels)
            wrong = [
                p for p in (list(range(n)), list(range(n))[::-1], [*range(1, n), 0]) if not question.judge(p).right
            ]
            return wrong[0], wrong[-1]
        case "fields":
            n = len(question.asked().labels)
            return ["0"] * n, ["0", *["1e6"] * (n - 2), "0"]
    return [0, 0, 0, 1, 0, 0, 0], [0.01, 0, 0, 1, 0, 0, 0]


def test_feedback_says_what_is_wrong_with_this_answer() -> None:
    for lesson, robot in ASKED:
        outline = lesson.outline(robot, UNITS)
        for number, step in enumerate(outline.steps, 1):
            question = step.question
            if not isinstance(question, Posed):
                continue
            progress = Progress(outline)
            first, second = wrong_answers(robot, question)
            verdict = progress.answer(str(number), first)
            assert not verdict.right
            assert len(verdict.reason) > 10
            assert progress.feedback(str(number)) == verdict.reason
            if not verdict.way or first == second:
                continue
            assert verdict.way not in verdict.reason
            progress.answer(str(number), second)
            assert progress.feedback(str(number)).endswith(question.judge(second).way)


# The answers, by NumPy alone.


def angle_between(A: np.ndarray, B: np.ndarray) -> float:
    return math.acos(max(-1.0, min(1.0, (float(np.trace(A[:3, :3].T @ B[:3, :3])) - 1.0) / 2.0)))


def singular(robot: Robot, question: Posed, q: np.ndarray) -> None:
    rows = 6
    there, home = (
        np.linalg.svd(numpy_arm.jacobian(robot, each)[:rows], compute_uv=False) for each in (q, robot.q_home)
    )
    usual = int((home > 1e-6).sum())
    assert there[usual - 1] < 0.05 * home[0]
    assert there[usual - 1] < home[usual - 1]


def hidden(robot: Robot, question: Posed, q: np.ndarray) -> None:
    entry = "xyz".index(question.variant.words["entry_name"][1])
    assert abs(numpy_arm.pose(robot, q)[entry, 3]) < 5e-3
    assert abs(numpy_arm.pose(robot, robot.q_home)[entry, 3]) > 5e-3


def fewer(robot: Robot, question: Posed, q: np.ndarray) -> None:
    def count(each: np.ndarray) -> int:
        return len(kin.solve_ik(robot, numpy_arm.pose(robot, each), q_seed=each).solutions)

    assert 0 < count(q) < count(robot.q_home)


def held(robot: Robot, question: Posed, q: np.ndarray) -> None:
    T, home = numpy_arm.pose(robot, q), numpy_arm.pose(robot, robot.q_home)
    assert np.linalg.norm(T[:3, 3] - home[:3, 3]) < 5e-3
    assert angle_between(T, home) < math.radians(3.0)
    assert np.abs(np.angle(np.exp(1j * (q - robot.q_home)))).max() > math.radians(4.0)


def sorted_by_distance(robot: Robot, question: Posed, names: list[str]) -> None:
    zero = np.zeros(robot.n)
    J, p = numpy_arm.jacobian(robot, zero), numpy_arm.pose(robot, zero)[:3, 3]
    # The tool's velocity, less that of the turn about the tool point: the velocity at the origin.
    v = np.linalg.norm(J[:3] - np.cross(J[3:].T, p).T, axis=0)
    sizes = [float(v[int(name.removeprefix("Joint ")) - 1]) for name in names]
    assert sizes == sorted(sizes)
    assert len(sizes) >= 2


def sketched(robot: Robot, question: Posed, cells: list[str]) -> None:
    """The sketch as a fine curve: its area by small steps, its slope by differences."""
    assert isinstance(question.kind, SketchKind)
    scale = math.pi / 180.0 if robot.revolute[0] else 1e-3
    v = np.array([float(cell.split()[0]) for cell in cells]) * scale
    asked = question.kind.sketch(question.variant)
    t = np.linspace(0.0, asked.times[-1], 60001)
    fine = np.interp(t, asked.times, v)
    limits = motion_limits(robot)
    assert fine[0] == fine[-1] == 0.0
    assert fine.mean() * asked.times[-1] == pytest.approx(asked.way, rel=1e-3)
    assert fine.max() <= limits.velocity[0] * (1.0 + 1e-9)
    assert np.abs(np.diff(fine)).max() / (t[1] - t[0]) <= limits.acceleration[0] * (1.0 + 1e-6)
    # A triangle of the same area is too fast, so that there is something to find.
    assert 2.0 * asked.way / asked.times[-1] > limits.velocity[0]


def placed(robot: Robot, question: Posed, pose: list[float]) -> None:
    far = question.variant.values["far"].value
    assert np.allclose(pose[:3], [0.0, -far, far], atol=1e-9)
    assert np.allclose(np.abs(pose[3:]), [math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0], atol=1e-9)


POSTURES: dict[str, Callable[[Robot, Posed, np.ndarray], None]] = {
    "velocity": singular,
    "equations": hidden,
    "inverse": fewer,
    "redundancy": held,
    "postures": held,
}


def test_right_answers_are_right_for_an_arm_that_numpy_computes() -> None:
    seen = set()
    for robot, lesson, _, question in ALL:
        right: Any = question.right()
        seen.add(lesson)
        match question.asked().form:
            case "posture":
                q = np.array(right)
                assert robot.in_limits(q, 1e-6)
                POSTURES[lesson](robot, question, q)
            case "frame":
                placed(robot, question, right)
            case "fields":
                sketched(robot, question, right)
            case "order" if lesson == "screws":
                labels = question.asked().labels
                sorted_by_distance(robot, question, [labels[place] for place in right])
            case "order" if lesson == "dh":
                assert isinstance(question.kind, OrderKind)
                texts = [question.asked().labels[place] for place in right]
                first = "z" if robot.convention == "standard" else "x"
                assert [text[-1] for text in texts] == sorted("zzxx", key=lambda axis: axis != first)
    assert seen == ASKED_BESIDES.keys()


def test_a_self_motion_that_moves_the_tool_is_none() -> None:
    robot = kin.get_robot("iiwa14")
    question = next(q for arm, lesson, _, q in ALL if (arm, lesson) == (robot, "redundancy"))
    q = np.array(question.right())
    assert question.judge(q.tolist()).right
    alone = robot.q_home.copy()
    joint = int(np.argmax(np.abs(q - robot.q_home)))
    alone[joint] = q[joint]
    verdict = question.judge(alone.tolist())
    assert not verdict.right
    assert verdict.reason.startswith(("The tool is ", "The point is reached"))


def test_another_singularity_than_the_one_in_the_solution_is_right() -> None:
    robot = kin.get_robot("ur5")
    question = next(q for arm, lesson, _, q in ALL if (arm, lesson) == (robot, "velocity"))
    for joint in (2, 4):  # elbow and wrist
        q = robot.q_home.copy()
        q[joint] = 0.0
        assert question.judge(q.tolist()).right, joint
    assert not question.judge((robot.q_home + 0.3).tolist()).right
