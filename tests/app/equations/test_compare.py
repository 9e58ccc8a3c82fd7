"""Misprints term by term, and by RᵀR: what is found is exactly what the errata list."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from hypothesis import assume, given
from hypothesis import strategies as st

import kin
from app.equations import book, chapter, compared, gram, suspects
from app.equations.compare import SMALLEST
from app.equations.expression import names, value
from kin.transforms import rotation_from_wxyz

CHAPTER = tuple(kin.get_robot(robot_id) for robot_id in chapter.EQUATIONS)
each_robot = pytest.mark.parametrize("robot", CHAPTER, ids=lambda robot: robot.id)

# By equation: how its terms differ from the right ones, and in which factors, with how many in all.
ERRATA = {
    "6": ["spurious"],
    "13": ["factor: c5 for s5"],
    "19": ["sign and factor: s5 for c5", "spurious", "sign", "sign"],
    "22": ["factor: c4 for s4"],
    "25": ["sign", "sign", "sign"],
    "27": ["missing"],
    "28": ["sign", "sign", "sign"],
}


@each_robot
def test_the_differing_terms_are_the_errata(robot):
    found = {}
    for equation in book(robot).equations:
        if equation.printed is None:
            continue
        rows = compared(equation.printed, equation.correct)
        differing = [row for row in rows if row.kind != "same"]
        if differing:
            found[equation.id] = [
                row.kind + (f": {row.wrong} for {row.right}" if row.wrong else "") for row in differing
            ]
    assert found == {key: kinds for key, kinds in ERRATA.items() if key in found}
    assert set(found) == {e.id for e in book(robot).equations if e.verdict == "misprinted"}


@each_robot
def test_the_terms_add_up_to_both_forms(robot):
    """By our values, and by sympy for the terms that differ: their difference is that of the two forms."""
    found = book(robot)
    q = robot.random_q(np.random.default_rng(4), 5)
    values = {name: symbol.value(q) for name, symbol in found.symbols.items()}
    for line in found.lines:
        values[line.name] = value(line.expression, values)
    for equation in found.equations:
        if equation.printed is None:
            continue
        rows = compared(equation.printed, equation.correct)
        for side, form in (("printed", equation.printed), ("correct", equation.correct)):
            terms = [term for row in rows if (term := getattr(row, side)) is not None]
            total = sum(value(term, values) for term in terms)
            assert np.allclose(total, value(form, values), rtol=0, atol=1e-14)
        differing = [row for row in rows if row.kind != "same"]
        printed, right = in_sympy(equation.printed), in_sympy(equation.correct)
        symbols = {name: sympy.Symbol(name) for row in differing for name in symbols_in(row)}
        rest = sum(value(row.printed, symbols) if row.printed is not None else 0 for row in differing) - sum(
            value(row.correct, symbols) if row.correct is not None else 0 for row in differing
        )
        assert sympy.expand(printed - right - rest) == 0


def symbols_in(row):
    return [name for term in (row.printed, row.correct) if term is not None for name in names(term)]


def in_sympy(form):
    return value(form, {name: sympy.Symbol(name) for name in names(form)})


def test_the_two_products_find_the_misprints_of_r_and_no_others():
    numbers = {}
    for robot in CHAPTER:
        found = book(robot)
        entries = {e.entry: e.id for e in found.equations}
        columns, rows = set(), set()
        for q in robot.random_q(np.random.default_rng(6), 20):
            R = found.as_printed(q)[:3, :3]
            columns.update(suspects(gram(R)))
            rows.update(suspects(gram(R.T)))
        numbers[robot.id] = sorted(int(entries[f"{'noa'[c]}_{'xyz'[r]}"]) for c in columns for r in rows)
    assert numbers == {"pioneer5": [13], "redundant7": [19, 22, 25]}


@each_robot
def test_a_right_rotation_has_no_suspects(robot):
    off = gram(kin.fk(robot, robot.random_q(np.random.default_rng(7), 50))[:, :3, :3])
    assert off.shape == (50, 3, 3)
    assert np.abs(off).max() < SMALLEST / 1e6
    assert all(suspects(one) == () for one in off)


numbers = st.floats(-1.0, 1.0)


@given(
    st.tuples(numbers, numbers, numbers, numbers),
    st.integers(0, 2),
    st.integers(0, 2),
    st.floats(0.05, 1.0),
)
def test_one_wrong_entry_is_found(wxyz, row, column, error):
    wxyz = np.array(wxyz)
    assume(np.linalg.norm(wxyz) > 0.1)
    R = rotation_from_wxyz(wxyz / np.linalg.norm(wxyz))
    R[row, column] += error
    off = gram(R)
    # The length of a column, or of a row, stays where the entry changes its sign only.
    assume(abs(off[column, column]) > 1e-3)
    assert suspects(off) == (column,)
    assert suspects(gram(R.T)) == (row,)


def test_the_print_is_written_out():
    found = book(kin.get_robot("redundant7"))
    for equation in found.equations:
        if equation.printed is not None:
            q = found.robot.random_q(np.random.default_rng(8), 4)
            values = {name: symbol.value(q) for name, symbol in found.symbols.items()}
            written = found.written_out(equation.printed)
            assert np.allclose(value(written, values), found.values(equation, q).printed, rtol=0, atol=1e-13)
