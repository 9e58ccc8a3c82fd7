"""A chosen option acts: it is drawn where it leads, a wrong one broken, the right one whole and only when judged.

`CHOICES` lists every choice of all steps, with how it is drawn or why it is not.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import numpy_arm
import pytest
from lesson_arms import ASKED, arms_of

import kin
from app.exercises.contract import Posed
from app.viewer.lessons import LESSONS
from app.viewer.lessons.figure_shapes import GREEN, VERMILION
from app.viewer.lessons.guide.answer_drawing import DASHES, answer_nodes, lead_nodes
from app.viewer.lessons.guide.outline import Bar, Choice, Ghost, Leads, Number, Path, Step, Triad
from app.viewer.lessons.rotations.drawing import anchor
from kin import Robot
from kin.units import Units

LINE, ARM, WAY, FRAME = "a line", "a copy of the arm", "a way", "a frame"
KINDS = {Bar: LINE, Ghost: ARM, Path: WAY, Triad: FRAME}
# Reasons why a choice is not drawn.
COUNT = "a number of things: none of them is at a place"
TRUTH = "whether something holds: an arm that shows it is the answer itself"
NAMES = "what something is called or means: the same scene, whatever is chosen"
TIME = "what happens in time: the figure of the step shows it"
CHOICES: dict[tuple[str, str, str], str] = {
    ("rotations", "Columns", "estimate"): LINE,
    ("rotations", "Order", "question"): LINE,
    ("rotations", "Fixed and moving axes", "question"): FRAME,
    ("rotations", "Gimbal lock", "question"): NAMES,
    ("rotations", "A chain of frames", "question"): FRAME,
    ("dh", "Rows and frames", "estimate"): LINE,
    ("dh", "Joint axes", "question"): LINE,
    ("dh", "A mistake in the table", "question"): NAMES,
    ("screws", "Six numbers for an axis", "estimate"): COUNT,
    ("screws", "A joint that slides", "question"): NAMES,
    ("screws", "The product", "question"): ARM,
    ("equations", "Four columns", "estimate"): LINE,
    ("equations", "Four columns", "question"): LINE,
    ("equations", "A test that needs no reference", "question"): TRUTH,
    ("inverse", "The wrist centre", "estimate"): LINE,
    ("inverse", "From the tool to two links", "estimate"): LINE,
    ("postures", "Signs", "estimate"): COUNT,
    ("postures", "The posture of the arm", "question"): ARM,
    ("postures", "Out of reach", "question"): COUNT,
    ("postures", "There and back", "question"): TRUTH,
    ("numeric", "The error", "estimate"): LINE,
    ("numeric", "Linearise", "question"): COUNT,
    ("numeric", "Newton near a solution", "question"): TIME,
    ("numeric", "The slope: Jacobian transpose", "question"): NAMES,
    ("numeric", "Joint limits", "question"): TRUTH,
    ("numeric", "Basins of attraction", "question"): TRUTH,
    ("redundancy", "Joints and conditions", "estimate"): TRUTH,
    ("redundancy", "Who moves", "question"): LINE,
    ("velocity", "A column", "estimate"): LINE,
    ("trajectories", "A cubic from rest to rest", "estimate"): TIME,
    ("trajectories", "A cubic from rest to rest", "question"): TIME,
    ("trajectories", "Boundary velocities", "question"): TIME,
    ("trajectories", "Joints or tool", "question"): WAY,
    ("trajectories", "Why jerk matters", "question"): TIME,
    ("trajectories", "From which posture a line goes through", "question"): TIME,
}
Found = tuple[Robot, tuple[str, str, str], Step, Choice, Leads | None]


def _choices() -> Iterator[Found]:
    for lesson, robot in ASKED:
        for step in lesson.outline(robot, Units()).steps:
            title = re.sub(r"\d+", "#", step.title)
            if isinstance(step.estimate, Choice):
                yield robot, (lesson.key, title, "estimate"), step, step.estimate, step.guessed
            if isinstance(step.question, Choice):
                drawn = step.drawn if isinstance(step.drawn, Leads) else None
                yield robot, (lesson.key, title, "question"), step, step.question, drawn


@cache
def choices() -> tuple[Found, ...]:
    """All of them, found when a test asks first: every process of a run collects this file."""
    return tuple(_choices())


def shown(robot: Robot, name: tuple[str, str, str], step: Step, given: int | None, closed: bool) -> dict[str, Any]:
    if name[2] == "question":
        nodes = answer_nodes(robot, step, given, closed)
    else:
        assert step.guessed is not None
        nodes = lead_nodes(robot, step.estimate, step.guessed, given, closed)
    return {node.key: node for node in nodes}


def test_the_list_of_choices_is_complete() -> None:
    found: dict[tuple[str, str, str], set[str]] = {}
    for _, name, _, question, leads in choices():
        kinds = found.setdefault(name, set())
        if leads is not None:
            assert len(leads.options) == len(question.options), name
            kinds |= {KINDS[type(lead)] for lead in leads.options if lead is not None}
    assert found.keys() == CHOICES.keys()
    drawn = set(KINDS.values())
    assert {name: kinds for name, kinds in found.items() if kinds != {CHOICES[name]} & drawn} == {}
    assert len(set(CHOICES.values()) - drawn) == 4, "few reasons, of which each is one of the scene"


def test_the_right_option_is_not_drawn_before_it_is_judged() -> None:
    for robot, name, step, question, leads in choices():
        if leads is None:
            continue
        assert shown(robot, name, step, None, closed=False) == {}
        for i, option in enumerate(question.options):
            nodes = shown(robot, name, step, i, closed=False)
            if not option.right:
                assert not any(key.startswith("right") for key in nodes), (robot.id, name)
                assert bool(nodes) == (leads.options[i] is not None)


def test_true_and_wrong_differ_in_colour_and_line() -> None:
    for robot, name, step, question, leads in choices():
        if leads is None:
            continue
        right = question.right()
        wrong = next((i for i, o in enumerate(question.options) if not o.right and leads.options[i]), None)
        if wrong is None or leads.options[right] is None:
            continue
        nodes = shown(robot, name, step, wrong, closed=True)
        assert {"wrong", "right", "wrong-words", "right-words"} <= nodes.keys(), (robot.id, name)
        one, other = nodes["wrong"].props, nodes["right"].props
        match leads.options[right]:
            case Bar() | Path():
                assert (one["colors"], other["colors"]) == (VERMILION, GREEN)
                assert len(one["points"]) >= DASHES
                gaps = np.linalg.norm(one["points"][1:, 0] - one["points"][:-1, 1], axis=1)
                assert gaps.min() > 1e-6, "broken"
                assert np.allclose(other["points"][1:, 0], other["points"][:-1, 1]), "whole"
            case Ghost():
                assert (one["batched_colors"], other["batched_colors"]) == (VERMILION, GREEN)
                lines = [nodes[f"{key}-line"].props["points"] for key in ("wrong", "right")]
                assert np.linalg.norm(lines[0][1:, 0] - lines[0][:-1, 1], axis=1).min() > 1e-9
                assert np.allclose(lines[1][1:, 0], lines[1][:-1, 1])
            case Triad():
                assert (one["origin_color"], other["origin_color"]) == (VERMILION, GREEN)
                assert one["axes_radius"] < other["axes_radius"]


def lead_of(robot_id: str, title: str, kind: str = "question") -> tuple[Robot, Step, Any]:
    robot, _, step, question, leads = next(
        each for each in choices() if each[0].id == robot_id and each[1][1:] == (title, kind)
    )
    assert leads is not None
    return robot, step, leads.options[question.right()]


def test_the_right_ones_are_true_of_the_arm() -> None:
    """By NumPy alone, at home."""
    for lesson, title, kind in (("equations", "Four columns", "question"), ("velocity", "A column", "estimate")):
        for robot in arms_of(lesson):
            T, J = numpy_arm.pose(robot, robot.q_home), numpy_arm.jacobian(robot, robot.q_home)
            way = T[:3, 2] if lesson == "equations" else J[:3, 0]
            _, _, lead = lead_of(robot.id, title, kind)
            assert np.allclose(lead.start, T[:3, 3], atol=1e-9)
            assert np.allclose(np.cross(np.subtract(lead.end, lead.start), way), 0.0, atol=1e-9)
            assert np.dot(np.subtract(lead.end, lead.start), way) > 0.0
    for robot in arms_of("numeric"):
        _, step, lead = lead_of(robot.id, "The error", "estimate")
        assert step.pose is not None
        start = numpy_arm.pose(robot, np.array(step.pose.q))[:3, 3]
        target = np.array(step.pose.drawing["target"]).reshape(4, 4)[:3, 3]  # type: ignore[arg-type]
        assert np.allclose([lead.start, lead.end], [start, target], atol=1e-9)


def test_the_way_of_a_ptp_ends_where_the_line_does_and_leaves_it() -> None:
    robot, _, lead = lead_of("ur5", "Joints or tool")
    step = next(s for r, n, s, *_ in choices() if r is robot and n[1] == "Joints or tool")
    ends = [numpy_arm.pose(robot, np.array(pose.q))[:3, 3] for pose in (step.pose, step.end)]  # type: ignore[union-attr]
    points = np.array(lead.points)
    assert np.allclose(points[[0, -1]], ends, atol=1e-6)
    way = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    assert np.linalg.norm(np.cross(points - points[0], way), axis=1).max() > 1e-3


def test_the_chosen_posture_is_that_of_the_copy_and_holds_the_tool() -> None:
    count = 0
    for robot, name, _, question, leads in choices():
        if name[1] != "The posture of the arm":
            continue
        for option, lead in zip(question.options, leads.options if leads else (), strict=True):
            if lead is not None:
                assert isinstance(lead, Ghost)
                assert kin.branch_of(robot, np.array(lead.q)) == option.text
                p = [numpy_arm.pose(robot, np.array(q))[:3, 3] for q in (lead.q, robot.q_home)]
                assert np.allclose(*p, atol=1e-6)
                count += 1
    assert count > 8


def test_a_joint_that_is_said_to_move_is_drawn_along_its_axis() -> None:
    for robot, name, _, question, leads in choices():
        if name[1] != "Who moves" or leads is None:
            continue
        J = numpy_arm.jacobian(robot, robot.q_home)
        for option, lead in zip(question.options, leads.options, strict=True):
            if isinstance(lead, Bar):
                k = int(option.text.removeprefix("Joint ")) - 1
                way = np.subtract(lead.end, lead.start)
                assert np.allclose(np.cross(way, J[3:, k] if robot.revolute[k] else J[:3, k]), 0.0, atol=1e-9)


def test_the_lines_of_an_option_lie_as_it_says() -> None:
    for robot, name, _, question, leads in choices():
        if name[1] != "Joint axes" or leads is None:
            continue
        lines = {o.text: lead for o, lead in zip(question.options, leads.options, strict=True)}
        pair = int(re.findall(r"joints (\d+)", question.prompt)[0])
        T = numpy_arm.jacobian(robot, robot.q_home)
        z = T[3:, pair - 1] if robot.revolute[pair - 1] else T[:3, pair - 1] / np.linalg.norm(T[:3, pair - 1])
        ways = {text: np.subtract(lead.end, lead.start) for text, lead in lines.items()}  # type: ignore[union-attr]
        cosine = {text: abs(float(z @ way)) / float(np.linalg.norm(way)) for text, way in ways.items()}
        right = question.options[question.right()].text
        for text, expected in (
            ("They are one line.", 1.0),
            ("They are parallel.", 1.0),
            ("They meet at a right angle.", 0.0),
            ("They meet at another angle.", np.sqrt(0.5)),
        ):
            if text != right or expected in (0.0, 1.0):
                assert cosine[text] == pytest.approx(expected, abs=2e-3), (robot.id, text, right)


def test_the_way_of_the_turned_frame_is_drawn_where_it_stands() -> None:
    lesson = next(each for each in LESSONS if each.key == "rotations")
    for robot in arms_of("rotations"):
        step = lesson.outline(robot, Units()).steps[0]
        assert step.estimate is not None
        assert "beside the arm" in step.estimate.prompt
        assert step.guessed is not None
        for lead in step.guessed.options:
            assert isinstance(lead, Bar)
            assert np.allclose(lead.start, anchor(robot)), robot.id


def test_a_placed_frame_stands_beside_the_right_one_when_it_is_judged() -> None:
    robot = kin.get_robot("ur5")
    lesson = next(each for each in LESSONS if each.key == "rotations")
    step = lesson.outline(robot, Units()).steps[-1]
    assert isinstance(step.question, Posed)
    given = [0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0]
    before = {node.key: node for node in answer_nodes(robot, step, given, closed=False)}
    assert before.keys() == {"wrong", "wrong-words"}
    assert np.allclose(before["wrong"].position, given[:3])
    after = {node.key: node for node in answer_nodes(robot, step, given, closed=True)}
    assert after.keys() == {"wrong", "wrong-words", "right", "right-words", "between"}
    far = step.question.variant.values["far"].value
    assert np.allclose(after["right"].position, [0.0, -far, far])
    up = np.array(after["right-words"].position) - after["right"].position
    assert np.allclose(up / np.linalg.norm(up), [0.0, 0.0, 1.0]), "along its y axis: its z has the frame's name"
    assert answer_nodes(robot, step, "nonsense", closed=False) == []


def test_a_typed_time_and_a_sketch_are_drawn_beside_the_right_ones() -> None:
    lesson = next(each for each in LESSONS if each.key == "trajectories")
    steps = {step.title: step for step in lesson.outline(kin.get_robot("ur5"), Units()).steps}
    step = steps["How long it takes"]
    assert isinstance(step.question, Number)
    assert step.answered is not None
    right = step.question.answer
    assert step.answered(None, False, False) == ""
    wrong = step.answered(0.8 * right, False, False)
    assert "your answer" in wrong
    assert "right" not in wrong, "the right one is not given away"
    both = step.answered(0.8 * right, False, True)
    assert both.count("kb-motion-other") == wrong.count("kb-motion-other") == 1, "broken and whole"
    assert f'stroke="rgb{VERMILION}"' in both
    assert f'stroke="rgb{GREEN}"' in both
    assert "kb-motion-other" not in step.answered(right, True, True)
    for given in (1e300, -1.0, 0.0, "x", None, [1]):
        assert step.answered(given, False, False) == ""
    sketch = steps["Sketch a profile"]
    assert isinstance(sketch.question, Posed)
    assert sketch.answered is not None
    cells = sketch.question.right()
    assert "stroke-dasharray" not in sketch.answered(cells, True, True)
    assert "a right one" not in sketch.answered(cells, True, True), "one's own is right too"
    typed = ["0 °/s", "10", "20", "20", "20", "10", "0"]
    assert "a right one" not in sketch.answered(typed, False, False)
    assert "a right one" in sketch.answered(typed, False, True)
    for given in (3, None, ["x"] * 7, ["1e300"] * 7, ["0"] * 6, [0] * 7):
        assert sketch.answered(given, False, False) == ""


def test_the_curve_of_a_typed_time_covers_the_way_in_it() -> None:
    from app.viewer.lessons.trajectories.figures import _trapezoid
    from kin.units import DEGREES

    for time in (0.4, 1.0, 3.0):
        times, (v,) = _trapezoid(time, 2.0, 4.0, DEGREES)
        fine = np.linspace(0.0, time, 100001)
        assert np.interp(fine, times, v).mean() * time == pytest.approx(np.degrees(2.0), rel=1e-4)
        assert times[-1] == time
