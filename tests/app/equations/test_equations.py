"""Equations of every arm: the typeset form has the computed values, and the computed values fit the arm."""

from __future__ import annotations

import math
import re
import subprocess
import sys
import threading
import xml.etree.ElementTree as ET
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kin
from app.equations import DerivationError, NotDerivedError, book, book_later, chapter, check, typeset
from app.equations import books as module
from app.equations.derive import LONGEST, derive
from app.equations.expression import (
    Name,
    Negative,
    Product,
    Sum,
    astray,
    expanded,
    from_text,
    names,
    size,
    terms,
    value,
)
from app.shared.computations import ComputationCache, TooManyPendingError

ROOT = Path(__file__).parents[3]
ROBOTS = tuple(kin.files.classic_robots().values())
CHAPTER = tuple(kin.get_robot(robot_id) for robot_id in chapter.EQUATIONS)
each_robot = pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.id)


def random_q(robot, count, seed=0):
    return robot.random_q(np.random.default_rng(seed), count)


# -- reading the typeset forms back, by parsers independent of our expressions ----------------------------------


def read_mathml(text, values):
    """Value of the right-hand side of a <math> element: juxtaposed factors, signs, brackets."""
    flat = []

    def walk(node):
        tag = node.tag.split("}")[1]
        if tag in ("mrow", "math"):
            for child in node:
                walk(child)
        elif tag in ("msub", "msubsup", "msup"):
            letter, *rest = ["".join(child.itertext()) for child in node]
            index = rest[0] if tag != "msup" else ""
            primes = rest[-1] if tag != "msub" else ""
            flat.append(("name", letter + "|" + index.replace("−", "-") + "'" * len(primes)))
        else:
            flat.append((tag, node.text))

    walk(ET.fromstring(text))
    return evaluate(flat, values)


def read_latex(text, values):
    token = re.compile(r"([A-Za-z])('*)(?:_\{(.*?)\})?|\\left\(|\\right\)|\\,|\d+|[-+=]|\s+")
    flat = []
    for found in token.finditer(text):
        word = found.group()
        if word.startswith("\\left"):
            flat.append(("mo", "("))
        elif word.startswith("\\right"):
            flat.append(("mo", ")"))
        elif found.group(1):
            index = (found.group(3) or "").replace(r"\beta", "β").replace(r"\alpha", "α")
            flat.append(("name", f"{found.group(1)}|{index}{found.group(2)}"))
        elif word.isdigit():
            flat.append(("mn", word))
        elif word in "-+=":
            flat.append(("mo", word.replace("-", "−")))
    assert "".join(found.group() for found in token.finditer(text)) == text
    return evaluate(flat, values)


def evaluate(flat, values):
    known = {}
    for name, number in values.items():
        letter, index, primes = re.fullmatch(r"(.)(.*?)('*)", name).groups()
        known[letter + "|" + re.sub(r"(?<=\d)_", ",", index).removeprefix("_") + primes] = number
    code = ""
    equals = [i for i, (_, text) in enumerate(flat) if text == "="]
    last = ""
    for kind, text in flat[equals[0] + 1 if equals else 0 :]:
        if text == "\u2062":
            continue
        if kind == "name" or kind == "mn" or (kind == "mi" and text not in "()"):
            piece = f"known[{text if '|' in text else text + '|'!r}]" if kind != "mn" else text
            code += ("*" if last in ("value", ")") else "") + piece
            last = "value"
        else:
            assert text in "+−()", text
            code += ("*" if text == "(" and last in ("value", ")") else "") + text.replace("−", "-")
            last = text
    return eval(code, {"known": known})


def all_values(found, q):
    """Every name of a book with its value, intermediate results and entries included."""
    values = {name: symbol.value(q) for name, symbol in found.symbols.items()}
    for line in found.lines:
        values[line.name] = value(line.expression, values)
    for equation in sorted(found.equations, key=lambda e: e.entry):  # a before p
        if equation.correct is not None:
            values[equation.entry] = value(equation.correct, values)
    return values


@each_robot
def test_typeset_equations_have_the_computed_values(robot):
    """MathML and LaTeX, parsed, give the exact value of every equation and intermediate result."""
    found = book(robot)
    values = all_values(found, random_q(robot, 20))
    shown = [(line.name, line.expression) for line in found.lines]
    for equation in found.equations:
        shown += [(equation.entry, form) for form in (equation.printed, equation.correct) if form is not None]
    for name, expression in shown:
        expected = value(expression, values)
        for read, text in (
            (read_mathml, typeset.mathml(expression, name)),
            (read_latex, typeset.latex(expression, name)),
        ):
            assert np.allclose(read(text, values), expected, rtol=0, atol=1e-14), text
        broken = "".join(typeset.mathml_terms(expression, name)).replace("</mrow></math>", "")
        broken = re.sub(r"<math [^>]*><mrow>", "", broken)
        whole = f'<math xmlns="http://www.w3.org/1998/Math/MathML"><mrow>{broken}</mrow></math>'
        assert np.allclose(read_mathml(whole, values), expected, rtol=0, atol=1e-14), "broken between terms"


# -- the chapter's ------------------------------------------------------------------------------------------


def test_the_chapters_order_and_brackets_are_kept():
    found = book(kin.get_robot("redundant7"))
    text = typeset.latex(found.equation("17").printed, "n_x").replace(r" \, ", "")
    assert text == (
        r"n_{x} = \left(c_{7}c_{6}c_{5} - s_{7}s_{5}\right)\left(c_{3}c_{4}C - s_{4}S\right)"
        r" + \left(c_{7}s_{5}c_{6} + s_{7}c_{5}\right)\left(-s_{3}C\right)"
        r" + s_{6}c_{7}\left(-c_{3}s_{4}C - c_{4}S\right)"
    )
    assert [line.name for line in found.lines_of(found.equation("17"))] == ["C", "S"]
    assert not found.lines_of(found.equation("19"))


def test_misprints_are_marked_term_by_term():
    """In every wrong equation exactly the terms that its note mentions are marked."""
    pioneer, redundant = map(book, CHAPTER)
    wrong = {e.id: [i for i, mark in enumerate(e.wrong_terms) if mark] for e in pioneer.equations if e.worst}
    assert wrong == {"6": [2], "13": [1]}
    wrong = {e.id: [i for i, mark in enumerate(e.wrong_terms) if mark] for e in redundant.equations if e.worst}
    assert wrong == {"19": [0, 2, 4, 5], "22": [2], "25": [0, 3, 4], "27": [], "28": [0, 3, 4]}
    assert redundant.equation("27").mended_terms == (False, False, False, True)  # what is missing
    for found in (pioneer, redundant):
        for equation in found.equations:
            if equation.verdict == "right":
                assert not any(equation.wrong_terms)


@pytest.mark.parametrize("robot", CHAPTER, ids=lambda robot: robot.id)
def test_no_pose_has_a_larger_difference_than_the_worst_pose(robot):
    found = book(robot)
    q = random_q(robot, 100_000, seed=5)
    for equation, values in found.compare(q):
        if equation.verdict != "misprinted":
            assert not equation.worst
            continue
        worst = np.array(equation.worst)
        assert robot.in_limits(worst, 1e-9)
        there = found.values(equation, worst)
        if equation.is_length:
            assert np.abs(values.difference).max() <= abs(there.difference) + 1e-9
            assert abs(there.difference) > 0.1
        else:
            assert values.turn.max() <= there.turn + 1e-9
            assert there.turn > 0.5


# -- derived ------------------------------------------------------------------------------------------------


@each_robot
def test_the_derived_form_has_the_values_of_forward_kinematics(robot):
    """For every arm of the catalogue, the chapter's own included."""
    derived = derive(robot)
    q = random_q(robot, 2000, seed=1)
    values = {name: symbol.value(q) for name, symbol in derived.symbols.items()}
    for line in derived.lines:
        values[line.name] = value(line.expression, values)
    T = kin.fk(robot, q)
    for entry in sorted(derived.entries):  # a before p, which uses it
        values[entry] = value(derived.entries[entry], values)
        column, row = entry.split("_")
        off = np.abs(values[entry] - T[:, "xyz".index(row), "noap".index(column)]).max()
        assert off <= 1e-12 * (robot.reach if column == "p" else 1.0), entry


@each_robot
def test_a_derived_form_is_short_and_defines_its_names(robot):
    derived = derive(robot)
    forms = [*derived.entries.values(), *(line.expression for line in derived.lines)]
    assert max(map(size, forms)) <= LONGEST
    known = {*derived.symbols, *(line.name for line in derived.lines), *derived.entries}
    assert {name for form in forms for name in names(form)} <= known
    for form in forms:
        assert not isinstance(terms(form)[0], Negative) or all(isinstance(t, Negative) for t in terms(form))


def latex_of(robot_id, entry):
    return typeset.latex(derive(kin.get_robot(robot_id)).entries[entry]).replace(r" \, ", "").replace("\\left", "")


def test_derived_forms_match_the_textbooks():
    assert latex_of("pioneer5", "p_x") == r"c_{1}(a_{1} + a_{2}c_{2} + d_{4}c_{23}\right) + d_{6}a_{x}"
    assert latex_of("pioneer5", "p_z") == "d_{1} - a_{2}s_{2} - d_{4}s_{23} + d_{6}a_{z}"
    assert latex_of("scara", "n_x") == "c_{12-4}"
    assert latex_of("scara", "p_z") == "d_{1} - d_{3}"
    assert latex_of("ur5", "n_z") == "c_{234}s_{6} + s_{234}c_{5}c_{6}"
    assert latex_of("redundant7", "o_z") == "c_{6}y_{5,z} - s_{6}x_{5,z}"
    assert latex_of("iiwa14", "p_x") == "p_{4,x} + d_{5}z_{4,x} + d_{7}a_{x}"


def odd_robot(rng, convention):
    """A general arm: any angle, any length, prismatic joints, fixed rows, any base and tool."""
    rows = []
    for i in range(rng.integers(1, 9)):
        kind = rng.choice(["revolute", "revolute", "prismatic", "fixed"]) if i else "revolute"
        angles = rng.choice([0.0, math.pi / 2, -math.pi / 2, math.pi, 0.3, -1.1], 2).tolist()
        lengths = (rng.choice([0.0, 1.0], 2) * rng.normal(size=2)).tolist()
        limits = None if kind == "fixed" else (-1.5, 2.0)
        rows.append(kin.Joint(f"row {i}", angles[0], lengths[0], lengths[1], angles[1], str(kind), limits))
    n = sum(row.kind != "fixed" for row in rows)
    ends = []
    for _ in range(2):
        T = np.eye(4)
        if rng.random() < 0.5:
            T[:3, 3] = rng.normal(size=3)
        if rng.random() < 0.5:
            T[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            T[:3, 0] *= np.sign(np.linalg.det(T[:3, :3]))
        ends.append(tuple(map(tuple, T.tolist())))
    return kin.Robot("odd", "odd", "", convention, tuple(rows), (0.0,) * n, base=ends[0], tool=ends[1])


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("seed", range(12))
def test_any_arm_can_be_derived(seed, convention):
    robot = odd_robot(np.random.default_rng(seed), convention)
    found = book(robot)  # `book` verifies the equations
    values = all_values(found, random_q(robot, 5))
    for equation in found.equations:
        text = typeset.mathml(equation.correct, equation.entry)
        assert np.allclose(read_mathml(text, values), values[equation.entry], rtol=0, atol=1e-12)


def test_rows_that_follow_are_expanded():
    assert latex_of("palletiser", "p_x") == r"c_{1}(a_{1} + a_{5} + a_{2}s_{2} + a_{4}c_{3}\right)"
    rows = (
        kin.Joint("a", 0.0, 0.1, 0.2, math.pi / 2, limits=(-1.5, 2.0)),
        kin.Joint("b", 0.3, 0.0, 0.4, follows="a", ratio=-2.0),
        kin.Joint("c", 0.0, 0.2, 0.1, 0.3, "prismatic", (0.0, 0.5)),
        kin.Joint("d", 0.1, 0.3, 0.0, 0.7, "prismatic", follows="c", ratio=0.25),
    )
    robot = kin.Robot("own", "own", "", "standard", rows, (0.0, 0.0))
    assert (
        book(robot).symbols["d4"].meaning == "0.25 times the value of joint 2, c, plus 0.3 m"
    )  # and it is checked
    halved = replace(robot, rows=(rows[0], replace(rows[1], ratio=0.5), *rows[2:]))
    with pytest.raises(NotDerivedError, match="whole multiples of a joint's angle, b does not"):
        book(halved)


def test_a_long_arm_is_cut_into_readable_pieces():
    rows = tuple(
        kin.Joint(f"row {i}", 0.0, 0.1, 0.2, (-1) ** i * math.pi / 2, "revolute", (-3.0, 3.0)) for i in range(16)
    )
    robot = kin.Robot("long", "long", "", "standard", rows, (0.0,) * 16)
    found = book(robot)
    assert max(size(line.expression) for line in found.lines) <= LONGEST
    assert any("''" in line.name for line in found.lines)


def test_an_arm_is_derived_once_and_another_arm_of_the_same_name_again(monkeypatch):
    robot = kin.get_robot("pioneer5")
    assert book(robot) is book(robot)
    rows = (replace(robot.rows[0], d=0.2), *robot.rows[1:])
    longer = replace(robot, rows=rows)
    assert book(longer).source == "derived"
    assert book(longer).symbols["d1"].constant == 0.2
    threads = []
    monkeypatch.setattr(module, "derive", lambda r: threads.append(threading.current_thread()) or derive(r))
    other = replace(robot, rows=(replace(robot.rows[0], d=0.3), *robot.rows[1:]))
    assert book(other).source == "derived"
    assert threads[0] is not threading.current_thread()


@pytest.mark.parametrize(
    "damage",
    [
        lambda e: Negative(e),
        lambda e: Sum((*terms(e), Product((Name("d1"), Name("s1"))))),
        lambda e: Product((e, Name("undefined"))),
    ],
    ids=["sign", "extra term", "nan"],
)
def test_a_wrong_closed_form_is_not_shown(monkeypatch, damage):
    robot = replace(kin.get_robot("puma560"), id=f"mine-{id(damage)}")

    def wrong(r):
        derived = derive(r)
        nowhere = replace(derived.symbols["d1"], name="undefined", constant=math.nan)
        entries = {**derived.entries, "n_y": damage(derived.entries["n_y"])}
        return replace(derived, entries=entries, symbols={**derived.symbols, "undefined": nowhere})

    monkeypatch.setattr(module, "derive", wrong)
    with pytest.raises(DerivationError, match="n_y of mine"):
        book(robot)
    with pytest.raises(DerivationError), book_later(robot) as waiting:
        waiting.future.result(30)
    monkeypatch.undo()
    check(book(robot))


def variant(d):
    puma = kin.get_robot("puma560")
    return replace(puma, rows=(replace(puma.rows[0], d=d), *puma.rows[1:]))


def test_what_nobody_waits_for_is_not_derived_and_the_queue_is_bounded(monkeypatch):
    released, derived = threading.Event(), []

    def slowly(robot):
        derived.append(robot)
        assert released.wait(30)
        return derive(robot)

    monkeypatch.setattr(module, "derive", slowly)
    monkeypatch.setattr(module, "_BOOKS", ComputationCache(ThreadPoolExecutor(1), 16))
    arms = [variant(1.0 + k) for k in range(module.MAX_PENDING + 1)]
    waiting = [book_later(arm, limited=True) for arm in arms[:-1]]
    with pytest.raises(TooManyPendingError):
        book_later(arms[-1], limited=True)
    for each in waiting[1:]:
        each.leave()
    with book_later(arms[-1], limited=True) as last:
        released.set()
        assert last.future.result(30).robot == arms[-1]
    assert derived == [arms[0], arms[-1]]


def test_arms_with_very_many_rows_have_no_equations():
    puma = kin.get_robot("puma560")
    fixed = tuple(kin.Joint(f"spacer {k}", kind="fixed") for k in range(module.MOST_ROWS))
    with pytest.raises(NotDerivedError, match="at most 16 rows, this arm has 23"):
        book(replace(puma, rows=(*puma.rows, *fixed)))


@pytest.mark.full
def test_sympy_is_imported_for_derived_equations_only():
    code = (
        "import sys, app.equations, app.viewer.lessons.equations, kin\n"
        "app.equations.book(kin.get_robot('pioneer5'))\n"
        "sys.exit('sympy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


# -- expressions --------------------------------------------------------------------------------------------


def test_multiplying_out():
    a, b = from_text("c1*(s2 - c2) - s3"), from_text("-c1*c2 + s2*c1 - s3")
    assert expanded(a) == expanded(b)
    assert astray(a, b) == (False, False)
    assert astray(from_text("c1*s2 + c1*c2"), b) == (False, True)
    assert expanded(from_text("-c1*(-s2)")) == expanded(from_text("c1*s2"))


def test_unknown_names_are_refused():
    with pytest.raises(ValueError, match="not a name"):
        typeset.glyphs("1x")
