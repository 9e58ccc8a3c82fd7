"""What the options of lessons say of an arm is true: which are right is found again by NumPy alone.

`RIGHT` finds the texts of the right options for every choice that the scene draws; those of orders and entries are
below.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import permutations
from typing import Any

import numpy as np
import numpy_arm
import pytest
from lesson_arms import arms_of
from test_choices_act import ARM, CHOICES, FRAME, LINE, choices

import kin
from app.exercises import Exercises
from app.exercises.contract import Posed
from app.exercises.kinds.order import OrderKind
from app.viewer.lessons import LESSONS
from app.viewer.lessons.dh import views
from app.viewer.lessons.dh.steps import ORDERS, place
from app.viewer.lessons.guide.answer_drawing import answer_nodes
from app.viewer.lessons.guide.outline import Cosine, Number, Step
from kin import Robot
from kin.transforms import rotation_about
from kin.units import Units

UNITS, ALIKE, NEAR = Units(), 1.25, 1e-6
X, Y, Z = np.eye(3)
UR5, CRAIG, PLANAR = (kin.get_robot(name) for name in ("ur5", "redundant7-craig", "planar2r"))


def pose(robot: Robot, step: Step) -> np.ndarray:
    T: np.ndarray = numpy_arm.pose(robot, robot.q_home if step.pose is None else np.array(step.pose.q))
    return T


def up_or_down(z: float, level: float) -> set[str]:
    return {"Up" if z > level else "Down" if z < -level else "Level, or nearly so"}


def place_of_the_tool(robot: Robot, step: Step, _: Any) -> set[str]:
    x, y, z = (pose(robot, step) - np.array(robot.base))[:3, 3]
    above = "Straight above it" if z > 0 else "Straight below it"
    return {"To the side of it, higher or lower" if np.hypot(x, y) > abs(z) / ALIKE else above}


def way_of_z(_: Robot, step: Step, question: Any) -> set[str]:
    R = rotation_about(Z, np.pi / 2) @ rotation_about(X, np.pi / 2)
    names = {f"Along {sign}{axis}": k * e for axis, e in zip("xyz", np.eye(3), strict=True) for sign, k in SIGNS}
    return {text for text, way in names.items() if np.allclose(way, R[:, 2])}


SIGNS = (("+", 1.0), ("−", -1.0))


def same_rotation(_: Robot, step: Step, question: Any) -> set[str]:
    angles = {"α": 0.3, "β": 0.5, "γ": 0.7}
    axes = {"x": X, "y": Y, "z": Z}
    moving = rotation_about(Z, 0.3) @ rotation_about(Y, 0.5) @ rotation_about(X, 0.7)
    found = set()
    for option in question.options:
        R = np.eye(3)
        for axis, angle in re.findall(r"([xyz]) by ([αβγ])", option.text):
            R = rotation_about(axes[axis], angles[angle]) @ R
        found |= {option.text} if np.allclose(R, moving) else set()
    return found


def product_of_frames(_: Robot, step: Step, question: Any) -> set[str]:
    """Of a camera in the base, a workpiece in the camera: the point of its origin, moved twice."""
    first, second = (
        kin.pose_from_xyz_rpy([1, 2, 3], [0.1, 0.2, 0.3]),
        kin.pose_from_xyz_rpy([4, 5, 6], [1, 2, 0.5]),
    )
    seen = first[:3, :3] @ second[:3, 3] + first[:3, 3]
    products = {
        "T₀₁ T₁₂": first @ second,
        "T₁₂ T₀₁": second @ first,
        "T₀₁⁻¹ T₁₂": np.linalg.inv(first) @ second,
    }
    return {text for text, T in products.items() if np.allclose(T[:3, 3], seen)}


def axis_lines(robot: Robot) -> list[tuple[np.ndarray, np.ndarray]]:
    """A point and the direction of each joint's axis at home."""
    frames = [np.array(robot.base), *numpy_arm.frames(robot, robot.q_home)]
    late = robot.convention == "modified"
    return [(frames[row + late][:3, 3], frames[row + late][:3, 2]) for row in robot.joint_rows]


def lying(robot: Robot, _: Step, question: Any) -> set[str]:
    k = int(re.findall(r"joints (\d+)", question.prompt)[0]) - 1
    (p, z), (r, w) = axis_lines(robot)[k : k + 2]
    across, between = np.cross(z, w), r - p
    if np.linalg.norm(across) < NEAR:
        apart = np.linalg.norm(np.cross(z, between)) > NEAR
        return {"They are parallel." if apart else "They are one line."}
    if abs(between @ across) > NEAR * np.linalg.norm(across):
        return {"They neither meet nor are parallel."}
    return {"They meet at a right angle." if abs(z @ w) < NEAR else "They meet at another angle."}


def height(robot: Robot, step: Step, _: Any) -> set[str]:
    z = pose(robot, step)[2, 3]
    where = "As high as" if abs(z) < 1e-3 else "Higher than" if z > 0 else "Lower than"
    return {f"{where} the origin of the world"}


def column(robot: Robot, step: Step, question: Any) -> set[str]:
    given = [float(text.replace("−", "-")) for text in re.findall(r"[−-]?\d+\.\d+", question.prompt)]
    return {
        name
        for name, way in zip("noap", pose(robot, step)[:3].T, strict=True)
        if np.allclose(way, given, atol=6e-4)
    }


def how_far(robot: Robot, step: Step, question: Any) -> set[str]:
    far = np.linalg.norm((pose(robot, step) - np.array(robot.base))[:3, 3]) / robot.reach
    return {question.options[int(far >= 0.5)].text}


def gap(robot: Robot, step: Step, question: Any) -> set[str]:
    assert step.pose is not None
    target = np.array(step.pose.drawing["target"], float).reshape(4, 4)
    part = float(np.linalg.norm((pose(robot, step) - target)[:3, 3])) / robot.reach
    return {question.options[int(part >= 0.1) + int(part > 0.5)].text}


def fastest(robot: Robot, step: Step, question: Any) -> set[str]:
    _, s, V = np.linalg.svd(numpy_arm.jacobian(robot, robot.q_home))
    assert robot.n - int((s > NEAR).sum()) == 1
    sizes = np.abs(V[-1])
    return {f"Joint {k + 1}" for k in np.flatnonzero(sizes > (1.0 - 1e-3) * sizes.max())}


def motion_of_joint_1(robot: Robot, step: Step, question: Any) -> set[str]:
    v = numpy_arm.jacobian(robot, robot.q_home)[:3, 0]
    moves = np.linalg.norm(v) > 1e-3
    return {question.options[0 if abs(v[2]) > 1e-3 else 1 if moves else 2].text}


RIGHT: dict[tuple[str, str, str], Callable[[Robot, Step, Any], set[str]]] = {
    ("rotations", "Columns", "estimate"): lambda robot, step, _: up_or_down(pose(robot, step)[2, 2], 0.1),
    ("rotations", "Order", "question"): way_of_z,
    ("rotations", "Fixed and moving axes", "question"): same_rotation,
    ("rotations", "A chain of frames", "question"): product_of_frames,
    ("dh", "Rows and frames", "estimate"): place_of_the_tool,
    ("dh", "Joint axes", "question"): lying,
    ("equations", "Four columns", "estimate"): height,
    ("equations", "Four columns", "question"): column,
    ("inverse", "The wrist centre", "estimate"): lambda robot, step, _: up_or_down(pose(robot, step)[2, 2], 0.3),
    ("inverse", "From the tool to two links", "estimate"): how_far,
    ("numeric", "The error", "estimate"): gap,
    ("redundancy", "Who moves", "question"): fastest,
    ("velocity", "A column", "estimate"): motion_of_joint_1,
}


def test_the_options_that_are_right_are_so_by_numpy() -> None:
    assert RIGHT.keys() == {name for name, how in CHOICES.items() if how in (LINE, FRAME)}
    judged, wrong = set(), []
    for robot, name, step, question, _ in choices():
        if name not in RIGHT:
            continue
        expected = RIGHT[name](robot, step, question)
        judged.add(name)
        if (found := {option.text for option in question.options if option.right}) != expected:
            wrong.append((robot.id, name, found, expected))
    assert wrong == []
    assert judged == RIGHT.keys()
    assert ARM in CHOICES.values(), "copies of the arm: test_choices_act"


# Orders and entries


def one_row(convention: Any, **values: Any) -> np.ndarray:
    """The frame ``(4, 4)`` after a row of these numbers, by forward kinematics."""
    row = replace(PLANAR.rows[0], **{"theta": 0.0, "d": 0.0, "a": 0.0, "alpha": 0.0, **values})
    frames: np.ndarray = kin.link_frames(replace(PLANAR, rows=(row,), home=(0.0,), convention=convention), [0.0])
    return frames[0]


def order_steps() -> list[tuple[Robot, Step]]:
    """The steps that ask for the order of a row, of both conventions."""
    lesson = next(each for each in LESSONS if each.key == "dh")
    found = [(robot, step) for robot in (UR5, CRAIG) for step in lesson.outline(robot, UNITS).steps]
    return [(robot, step) for robot, step in found if "four motions" in step.title.lower() and step.question]


def orders() -> list[Any]:
    """The orders that are asked for: kind, variant, convention and judge."""
    found = []
    for robot, step in order_steps():
        question = step.question
        assert isinstance(question, Posed)
        found.append(
            pytest.param(question.kind, question.variant, robot.convention, id=f"lesson-{robot.convention}")
        )
    exercise = Exercises().get("dh-order")
    assert exercise is not None
    return [*found, *(pytest.param(exercise.kind, exercise.variant(k), "standard", id=f"{k}") for k in range(2))]


@pytest.mark.parametrize(("kind", "variant", "convention"), orders())
def test_every_order_of_a_row_is_judged_and_drawn_as_forward_kinematics_has_it(
    kind: OrderKind, variant: Any, convention: str
) -> None:
    names = {(2, True): "theta", (2, False): "d", (0, False): "a", (0, True): "alpha"}
    asked = kind.asked(variant, UNITS)
    by_text = {motion.text(variant, UNITS): motion for motion in kind.motions}
    motions = [by_text[label] for label in asked.labels]
    values = {names[motion.axis, motion.turns]: variant.number(motion.by) for motion in motions}
    factors = [one_row("standard", **{name: values[name]}) for name in (names[m.axis, m.turns] for m in motions)]
    other = "modified" if convention == "standard" else "standard"
    right, crossed = one_row(convention, **values), one_row(other, **values)
    counts = {"right": 0, "other": 0}
    for order in permutations(range(4)):
        T = np.linalg.multi_dot([factors[i] for i in order])
        verdict = kind.judge(variant, list(order), UNITS)
        assert verdict.right == np.allclose(T, right, atol=1e-9)
        assert np.allclose(kind.leads(variant, order)[-1], T, atol=1e-12)
        crossed_too = "correct for the other convention" in verdict.reason
        assert crossed_too == np.allclose(T, crossed, atol=1e-9), (order, verdict.reason)
        assert "the axes of the base" not in verdict.reason, "that is the other convention"
        counts["right"] += verdict.right
        counts["other"] += crossed_too
    assert counts == {"right": 5, "other": 5}, "both of an axis exchanged, or both slides"
    product = np.linalg.multi_dot([one_row("standard", **{name: values[name]}) for name in ORDERS[convention]])  # type: ignore[index]
    assert np.allclose(product, right), "the product in the panel"


def test_a_wrong_order_is_drawn_on_its_way_beside_the_right_one() -> None:
    for robot, step in order_steps():
        assert isinstance(step.question, Posed)
        right: Any = step.question.right()
        assert answer_nodes(robot, step, None, closed=False) == []
        before = {node.key: node for node in answer_nodes(robot, step, right[::-1], closed=False)}
        assert before.keys() == {"wrong", "wrong-words", "wrong-way"}, "the right one is not given away"
        after = {node.key: node for node in answer_nodes(robot, step, right[::-1], closed=True)}
        assert after.keys() == {f"{one}{part}" for one in ("wrong", "right") for part in ("", "-words", "-way")}
        rises, out = (step.question.variant.values[name].value for name in ("rise", "reach_out"))
        for key in ("wrong", "right"):
            way = after[f"{key}-way"].props["points"]
            assert np.allclose(way[0, 0], robot.T_world_base[:3, 3], atol=1e-6)
            assert np.allclose(way[-1, 1], np.array(after[key].position), atol=1e-6)
            assert np.linalg.norm(way[-1, 1] - way[0, 0]) <= rises + out


def test_the_product_of_a_row_is_not_on_show_while_its_order_is_asked_for() -> None:
    for robot, step in order_steps():
        assert step.withheld == {"order"}
        at = place(robot, robot.q_home, 0.0)
        shown, hidden = (views.caption_html(robot, at, UNITS, in_order=on) for on in (True, False))
        assert shown.count("<msub>") > hidden.count("<msub>") == 1
        listed = re.findall(r"\b(a|d)\b = |(θ|α) = ", step.question.prompt if step.question else "")
        assert ["".join(each) for each in listed] == ["a", "d", "α", "θ"], "in no order of either convention"


def test_entries_of_a_rotation_are_drawn_as_the_direction_that_has_them() -> None:
    lesson = next(each for each in LESSONS if each.key == "rotations")
    for robot in arms_of("rotations"):
        steps = lesson.outline(robot, UNITS).steps
        for step, inverse in zip(steps[:2], (False, True), strict=True):
            question, drawn = step.question, step.drawn
            assert isinstance(question, Number)
            assert isinstance(drawn, Cosine)
            row, at = (int(found) - 1 for found in re.findall(r"row (\d) and column (\d)", question.prompt)[0])
            R = pose(robot, step)[:3, :3]
            R = R.T if inverse else R
            assert question.answer == pytest.approx(R[row, at], abs=1e-9)
            # As an axis of the tool, and the fixed axis of the entry.
            own, fixed = (pose(robot, step)[:3, row], at) if inverse else (R[:, at], row)
            for entry in (question.answer, 0.3, -0.8, 1.0):
                bar = drawn.at(entry)
                assert bar is not None
                way = np.subtract(bar.end, bar.start) / drawn.length
                assert way[fixed] == pytest.approx(entry, abs=1e-9)
                assert np.linalg.norm(way) == pytest.approx(1.0)
                if entry == question.answer:
                    assert np.allclose(way, own, atol=1e-7)
            assert drawn.at(1.2) is None, "no cosine"
