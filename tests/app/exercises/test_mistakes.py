"""The mistake behind a wrong number: each row against a mistake that was made by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kin
from app.exercises import ExerciseFileError, Variant, Verdict, parse_exercise
from app.exercises.expressions import Expression
from app.exercises.mistakes import ROWS, Case
from app.exercises.questions import RELATED, WRITTEN
from kin import Robot
from kin.transforms import Array
from kin.units import Units

T1, T2 = math.radians(20.0), math.radians(50.0)
QUARTER = math.pi / 2
# An offset in row 1, both conventions differ, no two rows alike.
ARM = Robot.from_dh([(0.4, 0.3, 0.2, QUARTER), (0.0, 0.1, 0.5, 0.0), (0.0, 0.2, 0.1, -QUARTER)], home=[0.0] * 3)
PLANAR = replace(kin.get_robot("planar2r"), id="two")
Q = (T1, T2, 0.3)


def judged(
    given: list[float],
    value: list[str],
    robot: Robot = PLANAR,
    more: str = "",
    unit: str = "m",
    vary: str = "",
    q: str = "",
    tolerance: float = 0.001,
) -> Verdict:
    """The verdict on these numbers; the joints are at T1, T2 and, of three, 0.3 rad."""
    exercise = parse_exercise(
        f"""id = "one"
title = "One"
topic = "Velocity"
robot = "one"
kind = "number"
text = "What is it?"
{q or f"q = {['t1', 't2', '0.3'][: robot.n]}"}

[vary]
t1 = {{ choose = [20], unit = "deg" }}
t2 = {{ choose = [50], unit = "deg" }}
p = {{ choose = [400], unit = "mm" }}
long = {{ choose = [2000], unit = "mm" }}
{vary}

[answer]
value = {value}
labels = {[str(i) for i in range(len(value))]}
unit = "{unit}"
tolerance = {tolerance}
method = "Compute."
{more}
""",
        find=lambda _: robot,
    )
    return exercise.judge(exercise.variant(0), [f"{number:.6f}" for number in given], Units(length="m"))


def row(theta: float, d: float, a: float, alpha: float, craig: bool = False) -> Array:
    """The matrix of a row."""
    c, s = math.cos(theta), math.sin(theta)
    z = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d], [0, 0, 0, 1.0]])
    c, s = math.cos(alpha), math.sin(alpha)
    x = np.array([[1, 0, 0, a], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])
    return np.asarray(x @ z if craig else z @ x)


def rows(*, craig: bool = False, offset: float = 0.4, order: tuple[int, ...] = (0, 1, 2)) -> list[Array]:
    """The matrices of the arm; the offset stays with its joint, the lengths are those of the row in `order`."""
    cells = [(one.theta, one.d, one.a, one.alpha) for one in (ARM.rows[i] for i in order)]
    cells[order.index(0)] = (offset, *cells[order.index(0)][1:])
    return [row(theta + q, d, a, alpha, craig) for q, (theta, d, a, alpha) in zip(Q, cells, strict=True)]


A, B, C = rows()
T = A @ B @ C
XYZ = ["x", "y", "z"]


def planar(t1: float, t2: float) -> list[float]:
    return [math.cos(t1) + 0.6 * math.cos(t1 + t2), math.sin(t1) + 0.6 * math.sin(t1 + t2)]


def point(*matrices: Array) -> list[float]:
    product = np.eye(4)
    for one in matrices:
        product = product @ one
    return list(product[:3, 3])


# The code, what is asked, what the mistake leads to by hand, and the arm.
MADE: list[tuple[str, list[str], list[float], Robot]] = [
    ("sign", ["x", "y"], planar(T1, -T2), PLANAR),
    ("sign", XYZ, point(row(0.4 + T1, 0.3, 0.2, QUARTER), row(T2, 0.1, -0.5, 0.0), C), ARM),
    ("left out", ["x", "y"], planar(0.0, T2), PLANAR),
    ("degrees", ["x", "y"], planar(20.0, 50.0), PLANAR),
    ("radians", ["x", "y"], planar(T1 * math.pi / 180, T2 * math.pi / 180), PLANAR),
    ("millimetres", ["hypot(p, long)"], [math.hypot(400.0, 2.0)], PLANAR),
    ("offset", XYZ, point(*rows(offset=0.0)), ARM),
    ("convention", XYZ, point(*rows(craig=True)), ARM),
    ("rows exchanged", XYZ, point(*rows(order=(0, 2, 1))), ARM),
    ("transposed", ["ny", "oz"], [T[0, 1], T[1, 2]], ARM),
    ("frame", XYZ, list(-T[:3, :3].T @ T[:3, 3]), ARM),
    ("order", XYZ, point(C, B, A), ARM),
    ("fixed axes", ["x", "y"], [math.cos(T1) + 0.6 * math.cos(T2), math.sin(T1) + 0.6 * math.sin(T2)], PLANAR),
    ("previous frame", XYZ, point(A, B), ARM),
    ("sine for cosine", ["0.5*cos(t1) + sin(t2)"], [0.5 * math.sin(T1) + math.cos(T2)], PLANAR),
    ("atan for atan2", ["1 + atan2(-p, -0.5)"], [1.0 + math.atan(0.8)], PLANAR),
    ("double angle", ["p*cos(t1)"], [0.4 * math.cos(T1 / 2)], PLANAR),
    ("diameter", ["1 + p"], [1.8], PLANAR),
    ("branch", ["1 - sqrt(p)"], [1.0 + math.sqrt(0.4)], PLANAR),
    ("other angle", ["1 + acos(p**2)"], [1.0 + math.pi - math.acos(0.16)], PLANAR),
    ("sum", ["1 + hypot(p, 0.3)"], [1.7], PLANAR),
    ("root", ["1 + sqrt(p)"], [1.4], PLANAR),
]


@pytest.mark.parametrize(("code", "value", "given", "robot"), MADE, ids=[made[0] for made in MADE])
def test_a_mistake_made_by_hand_is_named(code: str, value: list[str], given: list[float], robot: Robot) -> None:
    verdict = judged(given, value, robot)
    assert not verdict.right
    assert verdict.cause == code, verdict.reason
    assert ROWS[code].advice in verdict.reason
    assert verdict.mistaken is not None
    assert judged(given, value, robot, f'without = ["{code}"]').cause != code


def test_every_row_was_made_by_hand_and_is_documented() -> None:
    assert {made[0] for made in MADE} == ROWS.keys()
    page = (Path(__file__).parents[3] / "docs" / "exercises.md").read_text(encoding="utf-8")
    listed = page.partition("## Mistakes that the page recognises")[2]
    assert not [code for code in ROWS if f"`{code}`" not in listed]


def test_the_words_have_the_numbers_of_the_text() -> None:
    said = judged(planar(T1, -T2), ["x", "y"]).reason
    assert said == (
        "You get this with the other sign of 50°. Look at the positive sense, and at the signs of the formula."
    )


def test_the_arm_that_was_meant_is_known() -> None:
    mistaken = judged(planar(T1, -T2), ["x", "y"]).mistaken
    assert mistaken is not None
    assert mistaken.q.tolist() == pytest.approx([T1, -T2])
    mistaken = judged(point(*rows(craig=True)), XYZ, ARM).mistaken
    assert mistaken is not None
    assert mistaken.robot.convention == "modified"


def test_two_mistakes_at_once_are_named_if_none_alone_is_it() -> None:
    verdict = judged([math.cos(T2) - 0.5 * math.sin(T1)], ["0.5*cos(t1) + sin(t2)"])
    assert verdict.cause == "sign + sine for cosine"
    assert "with sine and cosine exchanged and with the other sign of 20°." in verdict.reason


HEIGHT = """h = { choose = [700], unit = "mm" }
l2 = { choose = [300], unit = "mm" }"""


def test_a_length_without_others_is_not_in_another_unit_than_they() -> None:
    assert judged([math.hypot(400.0, 2.0)], ["hypot(p, 2)"]).cause == ""
    quill = 'q = ["t1", "t2", "p", "0"]'
    verdict = judged([0.387 - 400.0], ["z"], kin.get_robot("scara"), q=quill)
    assert verdict.cause == "millimetres", "the arm has others"


def test_a_second_mistake_that_changes_nothing_is_not_named() -> None:
    """A cosine does not know the sign of its angle."""
    verdict = judged([0.4443], ["h + p*cos(t2)"], vary=HEIGHT, tolerance=0.005)
    assert (verdict.reason, verdict.cause) == ("Too small. Compute.", "")


def test_both_of_two_mistakes_with_the_functions_count() -> None:
    value = ["h + p*cos(t2) + l2*sin(t2)"]
    twice, both = 0.7 + 0.4 * math.cos(2 * T2) + 0.3 * math.sin(2 * T2), 0.7 + 0.4 * math.sin(2 * T2)
    both += 0.3 * math.cos(2 * T2)
    verdict = judged([twice + 0.0011], value, vary=HEIGHT, tolerance=0.005)
    assert (verdict.reason, verdict.cause) == ("Too small. Compute.", "")
    verdict = judged([both], value, vary=HEIGHT, tolerance=0.005)
    assert verdict.cause == "sine for cosine + double angle"


def test_nothing_is_named_if_two_mistakes_lead_there() -> None:
    assert judged([0.4 * math.cos(T2)], ["p*cos(t1 + t2)"]).cause == "left out"
    assert judged([1.4], ["1 + p*b"], vary="b = { choose = [500], unit = 'mm' }").cause == "", "p or b is doubled"
    assert judged([0.8], ["p"]).cause == RELATED, "half or twice the value is said as such"


def test_a_mistake_beside_zero_is_named() -> None:
    flat, vary = ["cos(r)"], "r = { choose = [90], unit = 'deg' }"
    assert judged([math.cos(math.pi / 4)], flat, vary=vary).cause == "double angle"
    assert judged([0.7], flat, vary=vary).cause == ""


def test_the_reason_in_the_file_goes_first() -> None:
    more = 'mistakes = [{ value = 1.8, reason = "That is the diameter." }]'
    verdict = judged([1.8], ["1 + p"], more=more)
    assert (verdict.reason, verdict.cause) == ("That is the diameter.", WRITTEN)


def test_a_count_has_no_mistaken_model() -> None:
    assert judged([6.0], ["2 + 2"], unit="count").cause == ""
    assert judged([0.0], ["round(2*cos(t1))"], unit="count").cause == ""


def test_no_mistake_turns_a_slide_into_a_hinge() -> None:
    scara = kin.get_robot("scara")
    case = Case(Variant("one", scara, scara.q_home), (Expression("x"),), Units())
    arms = [mistaken.robot for row in ROWS.values() for _, mistaken in row.mistaken(case)]
    assert len(set(arms)) >= 8
    assert all(arm.revolute.tolist() == scara.revolute.tolist() for arm in arms)
    assert all(np.isfinite(arm.lower).all() for arm in arms), "it has a place in the scene"


def test_a_mistake_without_a_configuration_is_none() -> None:
    """Twice the length has no angle: the other mistakes are still found."""
    q = 'q = ["acos(p / (500*mm))", "t2"]'
    assert judged(planar(math.acos(0.4), T2), ["x", "y"], q=q).cause == "diameter", "half of it"
    assert judged(planar(math.acos(0.8), 0.0), ["x", "y"], q=q).cause == "left out"


def test_the_tool_point_in_a_formula_is_given() -> None:
    """Who reads x and y on the page makes no mistake in the table."""
    assert judged([2.0], ["1 + hypot(x, y)"]).cause == "", "the elbow is 1 m from the base"
    assert judged([1.0 + sum(planar(T1, T2))], ["1 + hypot(x, y)"]).cause == "sum"


def test_a_mistake_that_no_row_makes_is_refused_in_a_file() -> None:
    with pytest.raises(ExerciseFileError, match=r'answer\.without\[1\]: got .*typo.*, expected one of "sign", '):
        judged([1.0], ["p"], more='without = ["sign", "typo"]')
