"""*Assign it yourself*: the way through it, what is said about mistakes, and what is kept in the link."""

from __future__ import annotations

import json
import math
import re
import xml.etree.ElementTree as ET
from itertools import pairwise

import numpy as np
import pytest

import kin
from app.exercises.rows import FACTORS, Factor, turns
from app.viewer.declared.scene import Node
from app.viewer.lessons.dh import assign_drawing, choices
from app.viewer.lessons.dh.assign import assign_html, measured_html, rows_html
from app.viewer.lessons.dh.assignment import Assignment, read_row
from app.viewer.lessons.dh.attempt import Attempt, error_of
from app.viewer.lessons.dh.settings import DHSettings
from app.viewer.lessons.dh.steps import OTHER
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.scene.meshes import body
from kin.dh.tables import convert_dh
from kin.units import DEFAULT_UNITS, Units

BUILT_IN = [*kin.files.classic_robots().values()]
ARMS = [arm for robot in BUILT_IN for arm in (robot, convert_dh(robot, OTHER[robot.convention]))]
arms = pytest.mark.parametrize("robot", ARMS, ids=lambda r: f"{r.id}-{r.convention}")
PIONEER, CRAIG = kin.get_robot("pioneer5"), kin.get_robot("redundant7-craig")
IN_M = Units(degrees=False, length="m")


def begin(robot: kin.Robot) -> Attempt:
    return Attempt(Assignment(robot))


def answers(attempt: Attempt, units: Units = DEFAULT_UNITS) -> dict[str, str]:
    """The right values of the next row at home, as they are read off the scene."""
    q = attempt.work.robot.q_home
    row = read_row(attempt.work.convention, attempt.work.frames[-1], attempt.chosen)
    own = {attempt.variable(): attempt.own_value(q)}
    return {
        factor: units.of(turns(factor)).number(getattr(row, factor) + own.get(factor, 0.0)) for factor in FACTORS
    }


def to_row(attempt: Attempt, number: int) -> None:
    """Go on until the row with this number is to be typed."""
    while attempt.part is not None or attempt.number < number:
        attempt.show()


@arms
def test_a_student_who_answers_right_gets_a_table_of_the_arm(robot: kin.Robot) -> None:
    attempt = begin(robot)
    for _ in range(100):
        if attempt.work.complete:
            break
        if attempt.part is not None:
            found = attempt.offered()[attempt.part]
            attempt.choose(attempt.part, next(i for i, choice in enumerate(found) if choice.right))
        else:
            attempt.check(answers(attempt), robot.q_home, DEFAULT_UNITS)
        assert attempt.feedback is not None
        assert attempt.feedback.right
    assert attempt.work.complete
    assert error_of(attempt.work) < 1e-9
    page = assign_html(attempt, DEFAULT_UNITS)
    assert "exactly as the arm does" in page


def drawn(attempt: Attempt, q: np.ndarray) -> dict[str, Node]:
    """The nodes of the scene, by key."""
    nodes = assign_drawing.scene(attempt, q, FigureNodes(body(attempt.work.robot).size), DEFAULT_UNITS)
    return {node.key: node for node in nodes}


def labels(nodes: dict[str, Node]) -> list[str]:
    return [str(node.props["text"]) for node in nodes.values() if node.kind == "label"]


@arms
def test_the_scene_numbers_the_joints_until_their_axes_are_named(robot: kin.Robot) -> None:
    attempt = begin(robot)
    numbered = ", ".join(labels(drawn(attempt, robot.q_home)))
    assert re.findall(r"joint (\d+)", numbered) == [str(k + 1) for k in range(robot.n)]
    while not attempt.work.complete:
        attempt.show()
    assert not [text for text in labels(drawn(attempt, robot.q_home)) if "joint" in text]


@arms
def test_the_lengths_of_the_row_to_be_typed_are_drawn_without_their_values(robot: kin.Robot) -> None:
    attempt, q, rows = begin(robot), robot.random_q(np.random.default_rng(4), 1)[0], 0
    while not attempt.work.complete:
        if attempt.part is None:
            nodes, rows = drawn(attempt, q), rows + 1
            step = np.linalg.inv(attempt.work.frames_at(q)[-1]) @ attempt.work.carried(attempt.chosen, q)
            x, y, z = step[:3, 3]
            standard = robot.convention == "standard"
            sizes = {"d": abs(z) if standard else math.hypot(y, z), "a": math.hypot(x, y) if standard else abs(x)}
            for factor, size in sizes.items():
                assert (factor in nodes) == (size > 1e-6), factor
                if factor in nodes:
                    start, end = nodes[factor].props["points"][0]
                    assert np.linalg.norm(end - start) == pytest.approx(size, abs=1e-6)
                    assert nodes[f"{factor}-label"].props["text"] == f"{attempt.symbol(factor)} = ?"
            assert not [text for text in labels(nodes) if "=" in text and not text.endswith("= ?")]
        attempt.show()
    assert rows == robot.n


@pytest.mark.parametrize("units", [DEFAULT_UNITS, IN_M], ids=["mm", "m"])
@arms
def test_a_row_can_be_computed_from_the_numbers_beside_it(robot: kin.Robot, units: Units) -> None:
    """By the definitions of the four parameters, from what is printed, at any pose."""
    attempt, q, rows = begin(robot), robot.random_q(np.random.default_rng(11), 1)[0], 0
    while not attempt.work.complete:
        html = measured_html(attempt, q, units)
        assert (html == "") == (attempt.part is not None)
        if attempt.part is not None:
            attempt.show()
            continue
        lines = [[*row.itertext()] for row in ET.fromstring(html).iter("tr")][1:]
        (p, x, z), (r, u, w) = (
            [np.array([float(cell.replace("−", "-")) for cell in line[-3:]]) for line in lines[i : i + 3]]
            for i in (0, 3)
        )
        about_z, along_x = (z, u) if robot.convention == "standard" else (w, x)
        typed = {
            "theta": units.angles.scale * math.atan2(about_z @ np.cross(x, u), x @ u),
            "d": (r - p) @ about_z,
            "a": (r - p) @ along_x,
            "alpha": units.angles.scale * math.atan2(along_x @ np.cross(z, w), z @ w),
        }
        attempt.check({factor: f"{value:.9f}" for factor, value in typed.items()}, q, units)
        assert attempt.feedback is not None
        assert attempt.feedback.right, (rows, typed, attempt.feedback)
        rows += 1
    assert rows == robot.n
    assert measured_html(attempt, q, units) == ""


@arms
def test_every_page_is_well_formed_and_kept_in_the_link(robot: kin.Robot) -> None:
    attempt = begin(robot)
    pages = set()
    for _ in range(100):
        html = assign_html(attempt, DEFAULT_UNITS) + rows_html(attempt.work, robot.q_home, DEFAULT_UNITS)
        text = "".join(ET.fromstring(f"<div>{html}</div>").itertext())
        assert "-" not in re.sub(r"[a-z]-[a-z]", "", text), "every minus is a true one"
        assert "nan" not in text
        pages.add(html)
        kept = json.loads(json.dumps(attempt.state()))
        again = Attempt.restored(robot, kept)
        assert (again.number, again.part, again.made) == (attempt.number, attempt.part, attempt.made)
        assert again.state() == kept
        if attempt.work.complete:
            break
        attempt.show()
    assert attempt.work.complete
    assert len(pages) > robot.n


@pytest.mark.parametrize("factor", FACTORS)
def test_a_wrong_entry_is_named_and_its_ghost_is_where_it_leads(factor: Factor) -> None:
    attempt = begin(PIONEER)
    to_row(attempt, 1)
    right = answers(attempt)
    typed = {**right, factor: "12.3"}
    attempt.check(typed, PIONEER.q_home, DEFAULT_UNITS)
    assert attempt.wrong == (factor,)
    assert attempt.feedback is not None
    assert attempt.feedback.title == f"{attempt.symbol(factor)} is wrong"
    assert attempt.meaning(factor) in attempt.feedback.sentences[0]
    assert attempt.ghost is not None
    ghost = attempt.work.frames_at(PIONEER.q_home, attempt.ghost, attempt.chosen)[-1]
    chosen = attempt.work.with_row(read_row("standard", attempt.work.frames[-1], attempt.chosen))
    assert not np.allclose(ghost, chosen.frames_at(PIONEER.q_home)[-1], atol=1e-3)
    html = ET.fromstring(assign_html(attempt, DEFAULT_UNITS))
    invalid = [field.get("data-guide-field") for field in html.iter("input") if field.get("aria-invalid")]
    assert invalid == [factor]
    values = {field.get("data-guide-field"): field.get("value") for field in html.iter("input")}
    assert values == typed, "what was typed stays"
    attempt.check(right, PIONEER.q_home, DEFAULT_UNITS)
    assert attempt.number == 2
    assert (attempt.ghost, attempt.wrong) == (None, ())


def test_usual_mistakes_are_recognised() -> None:
    attempt = begin(PIONEER)
    to_row(attempt, 2)
    right = answers(attempt)

    def said(**typed: str) -> str:
        attempt.check({**right, **typed}, PIONEER.q_home, DEFAULT_UNITS)
        assert attempt.feedback is not None
        assert not attempt.feedback.right
        return " ".join(attempt.feedback.sentences)

    flip = f"{-float(right['theta'].replace('−', '-')):g}"
    assert "its sign is not" in said(theta=flip)
    assert "with joint 2 at 0" in said(theta="0")
    assert "half a turn off" in said(alpha="180")
    assert "the other length" in said(a="0")
    assert "is not a number" in said(a="seven")
    assert "not a unit" in said(a="7 °")
    assert attempt.number == 2


def test_the_opposite_x_is_accepted_and_said() -> None:
    attempt = begin(PIONEER)
    to_row(attempt, 1)
    right = {key: float(text.replace("−", "-")) for key, text in answers(attempt).items()}
    other = {"theta": right["theta"] + 180.0, "d": right["d"], "a": -right["a"], "alpha": -right["alpha"]}
    attempt.check({key: str(value) for key, value in other.items()}, PIONEER.q_home, DEFAULT_UNITS)
    assert attempt.feedback is not None
    assert attempt.feedback.right
    assert "x₁ points the other way" in attempt.feedback.sentences[0]
    while not attempt.work.complete:
        attempt.show()
    assert error_of(attempt.work) < 1e-9


def test_units_of_the_reader_are_read() -> None:
    attempt = begin(CRAIG)
    to_row(attempt, 2)
    attempt.check(answers(attempt, IN_M), CRAIG.q_home, IN_M)
    assert attempt.number == 3
    assert "rad" in assign_html(attempt, IN_M) or attempt.part is not None


def test_a_wrong_choice_has_its_reason_and_can_be_changed() -> None:
    attempt = begin(PIONEER)
    while attempt.number < 1:
        attempt.show()
    assert attempt.part == "axis"
    attempt.choose("axis", 0)
    assert attempt.part == "axis"
    assert attempt.feedback is not None
    assert attempt.feedback.sentences == (
        "z₁ is the axis of joint 2: zᵢ is that of joint i + 1, because the row of joint i ends there.",
    )
    attempt.choose("axis", 1)
    assert attempt.part == "direction"
    with pytest.raises(kin.InputError, match="choice"):
        attempt.choose("x", 0)
    with pytest.raises(kin.InputError, match="index"):
        attempt.choose("direction", 7)
    with pytest.raises(kin.InputError, match="row"):
        attempt.check({}, PIONEER.q_home, DEFAULT_UNITS)


@pytest.mark.parametrize("robot", [PIONEER, CRAIG], ids=lambda r: r.id)
def test_back_undoes_one_step_at_a_time(robot: kin.Robot) -> None:
    attempt = begin(robot)
    states = [attempt.state()]
    while not attempt.work.complete:
        attempt.show()
        states.append(attempt.state())
    for before in reversed(states[:-1]):
        attempt.back()
        assert attempt.state() == before
    attempt.back()
    assert attempt.state() == states[0]
    to_row(attempt, 2)
    attempt.restart()
    assert attempt.state() == states[0]


@pytest.mark.parametrize(
    "state",
    [
        {},
        {"base": [1]},
        {"base": ["x"] * 16},
        {"base": [math.inf] * 16},
        {"base": [0.0] * 16},
        {"rows": [[1, 2, 3, 4]]},
        {"made": {"axis": 99, "x": True}},
        {"made": {"axis": -1}},
    ],
)
def test_a_hostile_link_starts_at_the_beginning(state: object) -> None:
    assert Attempt.restored(PIONEER, state).state() == begin(PIONEER).state()


@pytest.mark.parametrize("state", [3, "x", [], True])
def test_what_is_no_attempt_is_refused(state: object) -> None:
    with pytest.raises(kin.InputError, match="assign"):
        Attempt.restored(PIONEER, state)
    kept = DHSettings.fresh(PIONEER).restored({"assign": {}}, PIONEER)
    assert kept.assign is not None
    assert kept.restored({"assign": state}, PIONEER).assign is kept.assign
    assert kept.restored({"assign": None}, PIONEER).assign is None


def test_rows_of_a_link_are_taken_as_far_as_they_are_numbers() -> None:
    base = np.eye(4).ravel().tolist()
    rows = [[0.0, 0.13, 0.07, -math.pi / 2], [0.0, 1e9, 0.0, 0.0]]
    attempt = Attempt.restored(PIONEER, {"base": base, "rows": rows, "made": {}})
    assert len(attempt.work.rows) == 1


def test_a_joint_that_counts_backwards_has_a_minus_in_the_table() -> None:
    attempt = begin(PIONEER)
    attempt.show()
    attempt.back()
    while attempt.part != "direction":
        attempt.show()
    attempt.choose("direction", 1)
    while not attempt.work.complete:
        attempt.show()
    assert "−θ₁" in rows_html(attempt.work, PIONEER.q_home, DEFAULT_UNITS)
    assert "Joint 1 counts backwards" in assign_html(attempt, DEFAULT_UNITS)
    assert error_of(attempt.work) < 1e-9


def test_choices_come_in_the_order_of_the_steps() -> None:
    attempt = begin(PIONEER)
    seen = []
    while attempt.number < 2:
        if attempt.number == 1 and attempt.part is not None:
            seen.append(attempt.part)
        attempt.show()
    places = [choices.PARTS.index(part) for part in seen]
    assert all(one < other for one, other in pairwise(places))
    assert seen == ["axis", "direction", "normal", "origin", "x"]


def random_arm(seed: int) -> kin.Robot:
    """Any kinds of joints and fixed rows, with zeros and right angles among the numbers."""
    rng = np.random.default_rng(seed)
    rows = []
    for i in range(int(rng.integers(2, 8))):
        kind = "revolute" if i == 0 else str(rng.choice(["revolute", "prismatic", "fixed"], p=[0.6, 0.2, 0.2]))
        theta, alpha = (
            float(rng.choice([0.0, np.pi / 2, -np.pi / 2, np.pi, rng.uniform(-3, 3)])) for _ in range(2)
        )
        d, a = (float(rng.choice([0.0, rng.uniform(-0.5, 0.5)])) for _ in range(2))
        rows.append({"name": f"j{i}", "theta": theta, "d": d, "a": a, "alpha": alpha, "kind": kind})
        if kind != "fixed":
            rows[-1]["limits"] = (-1.0, 1.0)
    return kin.Robot.from_dh(rows, "standard" if seed % 2 else "modified")


@pytest.mark.parametrize("seed", range(30))
def test_any_right_choices_on_any_arm_give_a_table_of_it(seed: int) -> None:
    robot, rng = random_arm(seed), np.random.default_rng(seed)
    attempt = begin(robot)
    while not attempt.work.complete:
        if attempt.part is None:
            attempt.show()
            continue
        found = attempt.offered()[attempt.part]
        attempt.choose(attempt.part, int(rng.choice([i for i, choice in enumerate(found) if choice.right])))
    assert error_of(attempt.work) < 1e-9
