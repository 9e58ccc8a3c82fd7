"""Names of arms and rows as attacks: on pages, drawings, LaTeX, spreadsheets, XML and programs.

REST takes any text as a name; a link or the tab *Robot* takes what `app.viewer.own_arm` leaves of it.
"""

from __future__ import annotations

import ast
import csv
import io
import json
import re
import shlex
import tomllib
import xml.etree.ElementTree as ET
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.exports.motion_plot import motion_plot
from app.exports.robots import FORMATS, robot_file
from app.exports.snippets import SNIPPETS, Moment
from app.exports.worksheet import Sheet, csv_text, draw, latex
from app.exports.worksheet.words import to_latex
from app.viewer.obstacles import placed
from app.viewer.own_arm import own_arm, pack, unpack
from app.viewer.worksheet.views import page_html
from kin import Robot
from kin.units import Units

HOSTILE = (
    r"\input{/etc/passwd}",
    r"\immediate\write18{touch /tmp/x}",
    r"}\end{document}\catcode`\%=0 $^^5cinput",
    "100 % & # _ ~ ^ < > | \" '",
    "</text><script>alert(1)</script>",
    "<svg onload=alert(1)>",
    "]]>--><!--",
    "&xxe; &#0;",
    "'; import os; os.system('id') #",
    '"); DROP TABLE rooms; --',
    "\n!rm -rf ~\nx = 1",
    '=HYPERLINK("http://x",A1)',
    "@SUM(1+1)*cmd|' /C calc'!A0",
    "a;=1+1",
    "+1\t-2",
    "nul\x00 bell\x07 escape\x1b[31m delete\x7f",
    "line\u2028paragraph\u2029order\u202eback",
    "omicron ο, alpha with tonos ά, 中文, 😀, ẋ, ⁿ",
    "{{ 7*7 }} {% raw %} ${7*7} {x}",
)
SHEET_COMMANDS = re.compile(r"\\(input|include|write|openout|read|catcode|csname|def|let|end\{document\})|\^\^")


def arm(name: str, row: str = "") -> Robot:
    """An arm as REST takes it."""
    rows = [
        {"theta": 0, "d": 0.1, "a": 0.2, "alpha": 90, "limits": [-90, 90], "name": row or name},
        {"theta": 0, "d": 0.0, "a": 0.3, "alpha": 0, "limits": [-90, 90], "name": "second"},
    ]
    return kin.robot_from_dict(
        {
            "id": "hostile",
            "name": name,
            "source": name,
            "description": name,
            "convention": "standard",
            "units": {"length": "m", "angle": "deg"},
            "rows": rows,
        },
        "the request",
    )


def sheet(robot: Robot) -> Sheet:
    return Sheet("A title", robot, robot.q_home, Units())


class Tags(HTMLParser):
    """The names of all elements and attributes of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: set[str] = set()
        self.feed(page)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.found |= {tag, *(f"{tag}.{name}" for name, _ in attributes)}


def shape(xml: str) -> list[tuple[str, tuple[str, ...]]]:
    """Elements and attributes of a document, without texts and values."""
    return [(each.tag, tuple(sorted(each.keys()))) for each in ET.fromstring(xml).iter()]


names = pytest.mark.parametrize("name", HOSTILE)


@names
def test_worksheets_hold_names_as_text(name):
    robot, plain = own_arm(kin.robot_to_dict(arm(name))).robot, own_arm(kin.robot_to_dict(arm("plain"))).robot
    assert Tags(page_html(sheet(robot))).found == Tags(page_html(sheet(plain))).found
    ET.fromstring(draw(sheet(robot)).svg())
    text, harmless = latex(sheet(robot)), latex(sheet(plain))
    assert not SHEET_COMMANDS.search(text.replace(r"\end{document}", "", 1))
    for opening, closing in (("{", "}"), ("[", "]")):
        count = (text.replace(rf"\{opening}", "").count(opening), text.replace(rf"\{closing}", "").count(closing))
        assert opening == "[" or count[0] == count[1]
    assert text.count(r"\begin") == harmless.count(r"\begin")
    assert text.replace(r"\$", "").count("$") % 2 == 0
    (*_, row), *_ = [list(csv.reader(io.StringIO(csv_text(sheet(robot)))))[1:2]]
    assert not row[1].lstrip(" ").startswith(("=", "+", "-", "@", "\t"))
    assert len(row) == 22


@pytest.mark.full
@given(st.text(st.characters(codec="utf-8"), max_size=30))
def test_any_name_in_a_worksheet_leaves_its_latex_and_drawing_whole(name):
    robot = own_arm(kin.robot_to_dict(arm("plain"))).robot
    robot = own_arm({**kin.robot_to_dict(robot), "name": name}).robot
    text = latex(sheet(robot))
    assert not SHEET_COMMANDS.search(text.replace(r"\end{document}", "", 1))
    assert text.replace(r"\{", "").count("{") == text.replace(r"\}", "").count("}")
    ET.fromstring(draw(sheet(robot)).svg())


@names
def test_files_of_arms_hold_names_as_text(name):
    robot = arm(name)
    for kind, each in FORMATS.items():
        if each.suffix not in (".xml", ".urdf") and not each.suffix.endswith(".toml"):
            continue  # source, of which tests/kin/codegen judges
        text, plain = robot_file(robot, kind), robot_file(arm("plain"), kind)
        if kind in ("urdf", "mjcf"):
            assert shape(text) == shape(plain)
        else:
            assert tomllib.loads(text).keys() == tomllib.loads(plain).keys()
            assert kin.robot_from_dict(tomllib.loads(text), "the file").name == robot.name


@names
def test_a_link_holds_names_that_can_be_shown(name):
    made = own_arm(kin.robot_to_dict(arm(name)))
    assert made.robot.name.isprintable()
    assert all(row.name.isprintable() for row in made.robot.rows)
    assert unpack(pack(made)).robot == made.robot


@names
def test_programs_hold_names_as_text(name):
    robot = arm(name)
    T = kin.fk(robot, robot.q_home)
    for kind, snippet in SNIPPETS.items():
        made, plain = (snippet(moment(each, T)) for each in (robot, arm("plain")))
        if "Python" in kind or kind == "Robotics Toolbox":
            assert _skeleton(made) == _skeleton(plain)
        if kind == "MATLAB":
            assert len(made.splitlines()) == len(plain.splitlines())


@names
def test_programs_hold_names_of_obstacles_as_text(name):
    """Of obstacles as a link has them: in the programs of Python as literals, for the shell as one word."""
    UR5 = kin.get_robot("ur5")

    def around(name: str) -> Moment:
        obstacles = placed.unpack([["b", name, 0.5, 0, 0.2, 0, 0, 0, 0.1, 0.1, 0.1]])
        assert len(obstacles) == 1
        return replace(moment(UR5, kin.fk(UR5, UR5.q_home)), obstacles=obstacles, avoid=True)

    hostile, plain = around(name), around("plain")
    for kind, snippet in SNIPPETS.items():
        made, harmless = snippet(hostile), snippet(plain)
        if "Python" in kind:
            assert _skeleton(made) == _skeleton(harmless)
        if kind == "curl":
            words, expected = (shlex.split(text.replace("\\\n", "")) for text in (made, harmless))
            assert len(words) == len(expected)
            (asked,) = [json.loads(word) for word in words if '"obstacles"' in word]
            assert asked["obstacles"][0]["name"] == hostile.obstacles[0].name


def moment(robot: Robot, T: np.ndarray) -> Moment:
    return Moment(robot, robot.q_home, T)


def _skeleton(code: str) -> list[str]:
    return [type(node).__name__ for node in ast.walk(ast.parse(code))]


@names
def test_drawings_of_motions_hold_names_as_text(name):
    program = {"name": name, "segments": [{"kind": "ptp", "q": [0.3, 0.2], "name": name}]}
    made, plain = (
        motion_plot(kin.plan_motion(each, {**program, **more}))
        for each, more in ((arm(name), {}), (arm("plain"), {"name": "plain"}))
    )
    assert shape(made) == shape(plain)


@names
def test_latex_has_only_commands_that_exist(name):
    """Of letters, and of signs; a name with a letter that has none stays as it is."""
    commands = set(re.findall(r"\\([A-Za-z]+)", to_latex(name + " αβΓΩ ϕ ς ά")))
    known = {"textbackslash", "textasciitilde", "textasciicircum", "textless", "textgreater", "textbar", "dot"}
    assert commands <= known | {"alpha", "beta", "Gamma", "Omega", "sigma"}
