"""Worksheets: their numbers are those of `kin`, and their files can be read by others."""

from __future__ import annotations

import csv
import io
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import combinations
from typing import get_args

import numpy as np
import pytest

import kin
from app.exports.worksheet import Formula, Left, Part, Question, Sheet, csv_text, draw, latex
from app.exports.worksheet.labels import BASE, Label
from app.exports.worksheet.words import to_latex
from kin.units import Units

ROBOTS = tuple(kin.files.classic_robots().values())
PIONEER = kin.get_robot("pioneer5")
SLANTED = replace(
    PIONEER, base=((0.8, 0.0, 0.6, 0.2), (0.0, 1.0, 0.0, 0.3), (-0.6, 0.0, 0.8, 0.9), (0, 0, 0, 1.0))
)
each_robot = pytest.mark.parametrize(
    "robot", [*ROBOTS, SLANTED, kin.get_robot("palletiser")], ids=lambda robot: robot.name
)
PARTS = (
    Part(
        "1. First", "A text with θ₁ − 90° & 5 %.", (Question("How far is it?", "12.0 mm. √(x² + y²).", (), "mm"),)
    ),
    Part("Check", "", (Question("Which?", "n. It is n.", ("n", "o_1", "{a}")),)),
)


def sheet(robot, units=None, **more):
    q = robot.random_q(np.random.default_rng(1), 1)[0]
    return Sheet("A title", robot, q, units or Units(), **more)


@each_robot
def test_the_product_of_the_matrices_is_the_pose(robot):
    made = sheet(robot)
    T = robot.T_world_base
    for A in made.matrices:
        T = T @ A
    assert np.allclose(T @ robot.T_last_tool, kin.fk(robot, made.q), atol=1e-12)
    assert ("B" in made.product.split()) == (not np.array_equal(robot.T_world_base, np.eye(4)))
    assert made.product.count("A") == len(robot.rows)


@each_robot
@pytest.mark.parametrize("units", [Units(), Units(False, "m")], ids=["mm", "m"])
def test_csv_is_read_back(robot, units):
    made = sheet(robot, units)
    rows = list(csv.DictReader(io.StringIO(csv_text(made))))
    assert len(rows) == len(robot.rows) + 1
    angle, length = (np.pi / 180, 1e-3) if units.degrees else (1.0, 1.0)
    names = (
        ("theta_deg", "d_mm", "a_mm", "alpha_deg") if units.degrees else ("theta_rad", "d_m", "a_m", "alpha_rad")
    )
    values = []
    for row, line in zip(robot.rows, rows, strict=False):
        scales = (angle, length, length, angle)
        read = [float(line[name]) * scale for name, scale in zip(names, scales, strict=True)]
        assert np.allclose(read, (row.theta, row.d, row.a, row.alpha), atol=1e-13)
        if line["value"]:
            values.append(float(line["value"]) * (angle if row.kind == "revolute" else length))
    assert np.allclose(values, robot.expand(made.q), atol=1e-13)
    T = np.array(
        [float(rows[-1][f"m{r}{c}"]) * (length if c == 4 else 1) for r in (1, 2, 3) for c in (1, 2, 3, 4)]
    )
    assert np.allclose(T.reshape(3, 4), kin.fk(robot, made.q)[:3], atol=1e-12)
    assert rows[-1]["row"] == "tool"


@each_robot
def test_the_drawing_is_svg_and_inside_its_box(robot):
    drawing = draw(sheet(robot))
    root = ET.fromstring(drawing.svg())
    _, _, width, height = map(float, root.attrib["viewBox"].split())
    for line in drawing.lines:
        assert (line.points >= -1.0).all()
        assert (line.points <= (width + 1.0, height + 1.0)).all()
    texts = ["".join(node.itertext()) for node in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {str(k + 1) for k in range(robot.n)} <= set(texts)
    labels = " ".join(texts).split()
    subscript = str(len(robot.rows)).translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))
    assert {"z₀", f"z{subscript}", f"x{subscript}"} <= set(labels)


@each_robot
def test_words_of_the_drawing_stand_apart(robot):
    boxes = []
    for word in draw(Sheet("A title", robot, robot.q_home, Units())).words:
        room = Label(word.text, np.zeros((1, 2)), word.colour, word.size).room
        boxes.append((word.at + np.array([0.5 * room[0], -BASE * word.size]), room, word.text))
    for (a, room, one), (b, other, two) in combinations(boxes, 2):
        assert (np.abs(a - b) >= 0.5 * (room + other)).any(), (one, two)


def balanced(text):
    """Assert what a LaTeX compiler needs first: brackets, environments, math and tables are balanced."""
    plain = re.sub(r"\\[\\{}$%&#_]", "", text)
    assert plain.count("{") == plain.count("}")
    assert plain.count("$") % 2 == 0
    stack = []
    for kind, name in re.findall(r"\\(begin|end)\{(\w+)\}", text):
        if kind == "begin":
            stack.append(name)
        else:
            assert stack.pop() == name
    assert not stack
    assert text.count(r"\[") == text.count(r"\]")
    assert text.count(r"\left(") == text.count(r"\right)")
    for table in re.findall(r"\\begin\{tabular\}\{([|rc]+)\}(.*?)\\end", text, re.DOTALL):
        columns = table[0].replace("|", "")
        for line in table[1].split(r"\\ \hline")[:-1]:
            assert line.count("&") - line.count(r"\&") == len(columns) - 1


@each_robot
@pytest.mark.parametrize("left", get_args(Left))
def test_latex_is_balanced(robot, left):
    formula = Formula("(6)", "<math></math>", r"p_{z} = \left(c_{1}\right)", True)
    text = latex(sheet(robot, parts=PARTS, formulas=(formula,), left=left, goal="You can & will."))
    balanced(text)
    assert text.isascii()
    questions, solutions = text.split(r"\newpage")
    assert "12.0 mm" not in questions
    assert "12.0 mm" in solutions
    assert "(6)" in solutions
    assert "(6)" not in questions
    count = len(robot.rows) + len(sheet(robot).ends) + 1
    asked = {"nothing": count, "table": 0, "pose": count - 1, "configuration": 1}[left]
    assert questions.count(r"\begin{bmatrix}") == asked
    assert solutions.count(r"\begin{bmatrix}") == (0 if left == "nothing" else count)


def test_a_sheet_without_questions_has_no_solutions():
    made = sheet(PIONEER)
    assert not made.has_solutions
    assert r"\newpage" not in latex(made)
    assert [row.cells[0] for row in made.rows] == ["θ₁", "θ₂", "θ₃ − 90.0", "θ₄", "θ₅", "0.0"]
    assert made.heads == ("θ (°)", "d (mm)", "a (mm)", "α (°)")


def test_text_becomes_latex():
    assert to_latex("θ₁₂ − 90° & 5 % of x²") == r"$\theta$$_{12}$ $-$ 90$^\circ$ \& 5 \% of x$^{2}$"
    assert to_latex("q̇ and ẋ") == r"$\dot{q}$ and $\dot{x}$"
    assert to_latex("a_b{c}\\") == r"a\_b\{c\}\textbackslash{}"
    assert to_latex("10⁻¹⁶") == "10$^{-16}$"
    assert to_latex("xₖ") == "x$_{k}$"
    assert to_latex("“R” = RᵀR ≤ λ") == r"``R'' = R$^{T}$R $\le$ $\lambda$"


def test_rows_that_follow_have_the_variable_of_their_joint():
    robot = kin.get_robot("palletiser")
    rows = sheet(robot).rows
    assert [row.cells[0] for row in rows] == ["θ₁", "θ₂ − 90.0", "−θ₂ + 90.0", "θ₃", "−θ₃", "θ₄"]
    half = replace(robot, rows=(*robot.rows[:4], replace(robot.rows[4], ratio=0.5), robot.rows[5]))
    assert sheet(half).rows[4].cells[0] == "0.5 θ₃"
