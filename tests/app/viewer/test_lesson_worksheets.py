"""Worksheets of every lesson, for every kind of arm: questions first, solutions on pages of their own."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
from lesson_arms import arms_of

import kin
from app.equations import book
from app.exports.worksheet import Sheet, latex
from app.viewer.arm import Arm
from app.viewer.lessons import LESSONS
from app.viewer.lessons.equations import views
from app.viewer.lessons.guide.outline import Number
from app.viewer.worksheet.feature import FILES, Worksheets, parts_of
from app.viewer.worksheet.views import page_html
from kin.units import DEFAULT_UNITS, Units

PIONEER = kin.get_robot("pioneer5")
EACH = [(lesson, robot) for lesson in LESSONS for robot in arms_of(lesson.key)]

NUMBER = re.compile(r"(?<![\w.])[−-]?\d+(?:\.\d+)?(?![\w.]*\d)")
SMALL = 12  # whole numbers up to it are those of joints and steps
# Answers that other numbers of a sheet equal on many arms.
CHANCE = {
    ("rotations", "c4"): "half a turn is a column of many tables, and a limit of many joints",
    ("screws", "5"): "|v| in the body form is a length of the table on some arms: which one, is asked",
}


def as_sheet(lesson, robot, units=DEFAULT_UNITS, q=None):
    outline = lesson.asked(robot, units)
    q = robot.q_home if q is None else q
    return Sheet(lesson.title, robot, q, units, outline.goal, parts_of(outline), (), lesson.left)


def parsed(html):
    """The page as a tree: it is well-formed XML but for a few names of characters."""
    return ET.fromstring(f"<div>{html.replace('&nbsp;', ' ')}</div>")


@pytest.mark.parametrize(("lesson", "robot"), EACH, ids=[f"{lesson.key}-{robot.id}" for lesson, robot in EACH])
def test_every_question_is_asked_and_solved(lesson, robot):
    sheet = as_sheet(lesson, robot)
    outline = lesson.asked(robot, DEFAULT_UNITS)
    assert len(sheet.questions) == len(list(outline.questions()))
    articles = parsed(page_html(sheet)).findall("article")
    asked, solved = (" ".join("".join(article.itertext()).split()) for article in articles)
    for question in sheet.questions:
        assert " ".join(question.prompt.split()) in asked
        assert " ".join(question.solution.split()) in solved
        assert " ".join(question.solution.split()) not in asked
        assert not re.search(r"<\w", question.solution), "text for a page, not for paper"
    for step in outline.steps:
        assert not step.practice or step.practice not in solved
    left = {character for character in latex(sheet) if not character.isascii()}
    assert not left, "app/exports/worksheet/words.py says what they are in LaTeX"
    cells = [cell.text for cell in articles[0].iter("td")]
    assert (None in cells or "" in cells) == (sheet.left in ("table", "pose"))


@pytest.mark.parametrize("robot", arms_of("inverse"), ids=lambda robot: robot.id)
def test_the_joint_values_are_not_on_the_sheet_that_asks_for_them(robot):
    sheet = as_sheet(next(lesson for lesson in LESSONS if lesson.key == "inverse"), robot)
    asked, solved = ("".join(each.itertext()) for each in parsed(page_html(sheet)).findall("article"))
    first, second = latex(sheet).split(r"\newpage")
    for name, value in sheet.values:
        assert f"{name} = {value}" not in asked
        assert f"{name} = {value}" in solved
    pose = sheet.entries(sheet.pose)[0]
    assert all(number in asked for number in pose)
    assert "Joints:" not in first
    assert "A_{1}" not in first
    assert "Joints:" in second


def numbers(text):
    return {float(found.replace("−", "-")) for found in NUMBER.findall(text)}


def printed(lesson, robot, outline):
    """The parts of a sheet, and all numbers beside them, on the page and in LaTeX, at the poses of the lesson."""
    poses = {step.pose.q for step in outline.steps if step.pose is not None} | {tuple(robot.q_home.tolist())}
    parts = [f"{part.text} {' '.join(q.prompt for q in part.questions)}" for part in parts_of(outline)]
    around = set()
    for q in sorted(poses):
        sheet = replace(as_sheet(lesson, robot, q=np.array(q)), parts=())
        first = latex(sheet).split(r"\newpage")[0]
        plain = re.sub(r"\\begin{tikzpicture}.*\\end{tikzpicture}", " ", first, flags=re.DOTALL)
        around |= numbers("".join(parsed(page_html(sheet))[0].itertext())) | numbers(re.sub("[{}]", " ", plain))
    return parts, around


@pytest.mark.full
@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.key)
def test_a_sheet_prints_nothing_that_it_asks(lesson):
    """Other numbers may equal an answer by chance, but not on all arms that have the question."""
    hits, asked = Counter(), Counter()
    for robot in arms_of(lesson.key):
        outline = lesson.outline(robot, DEFAULT_UNITS)
        parts, around = printed(lesson, robot, outline)
        for key, question in outline.questions():
            if not isinstance(question, Number) or question.whole:
                continue
            answer = question.answer * question.unit.scale
            near = min(question.tolerance * question.unit.scale, 0.005 * abs(answer))
            if abs(answer) < 1e-6 or (answer == round(answer) and abs(answer) <= SMALL):
                continue
            at = len(outline.steps) if key[0] == "c" else int(key) - 1
            others = numbers(" ".join(part for k, part in enumerate(parts) if k != at))
            shown = (around | others) - numbers(f"{parts[at]} {question.prompt}")
            asked[key] += 1
            hits[key] += any(abs(x - answer) <= near for x in shown)
    leaks = {key for key, count in hits.items() if asked[key] == count > 1}
    assert leaks == {key for name, key in CHANCE if name == lesson.key}, hits


def test_the_page_has_the_units_of_the_reader():
    sheet = as_sheet(next(lesson for lesson in LESSONS if lesson.key == "dh"), PIONEER, Units(False, "m"))
    html = page_html(sheet)
    assert "θ (rad)" in html
    assert "d (m)" in html
    assert " mm" not in html
    assert f">{kin.fk(PIONEER, PIONEER.q_home)[2, 3]:.4f}<".replace("-", "−") in html


def test_equations_are_on_the_sheet_with_their_corrections_among_the_solutions():
    formulas = views.formulas(book(PIONEER))
    assert [f.title for f in formulas if f.solution] == ["(6), corrected", "(13), corrected"]
    assert len([f for f in formulas if not f.solution]) == 12
    sheet = Sheet("Equations", PIONEER, PIONEER.q_home, DEFAULT_UNITS, formulas=formulas)
    assert page_html(sheet).count("<math") >= 12
    derived = views.formulas(book(kin.get_robot("ur5")))
    assert {f.title for f in derived} >= {"nx", "pz"}
    assert not any(f.solution for f in derived)


@pytest.fixture
def worksheets():
    stage = MagicMock()
    stage.arm.now, stage.display.units = Arm(PIONEER, PIONEER.q_home, PIONEER.q_home), DEFAULT_UNITS
    lesson = SimpleNamespace(key="dh", formulas=tuple, left=lambda robot: "table")
    made = Worksheets(stage, lesson, MagicMock())
    made.sheet = lambda: Sheet("An arm", PIONEER, np.array(PIONEER.q_home), DEFAULT_UNITS)
    return made


def test_the_page_is_handed_to_the_script_that_asked(worksheets):
    worksheets.handle(("page", 7), None)
    content = worksheets._page.content
    assert 'data-sheet="7"' in content
    assert "<template data-sheet-page>" in content
    assert "An arm</h1>" in content


@pytest.mark.parametrize("name", FILES)
def test_files_are_sent(worksheets, name):
    worksheets.handle((name, 1), None)
    (file, data), _ = worksheets.stage.client.send_file_download.call_args
    assert file == f"pioneer-arm-dh.{FILES[name][0]}"
    assert len(data) > 500


def test_other_messages_are_refused(worksheets):
    for key in (("pdf", 1), ("page", "1"), "page"):
        with pytest.raises(kin.InputError, match="one of page"):
            worksheets.handle(key, None)
