"""The HTML of the walk through a DH table: caption, table, matrices, the nine steps.

Numbers have fixed decimals in columns of fixed width: they change and never move. Colours always come with words
or with weight.
"""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from app.exercises.rows import Factor, turns
from app.viewer.lessons.dh.nine_steps import CRAIG_NOTE, NINE_STEPS
from app.viewer.lessons.dh.steps import (
    LETTERS,
    MOVED,
    ORDERS,
    WalkState,
    amount,
    axis,
    caption,
    expression,
    index,
    low,
    symbolic,
    verdict,
)
from app.viewer.views import mathml as m
from app.viewer.views.templates import render
from kin import Robot
from kin.dh.tables import convert_dh
from kin.robot import Convention
from kin.transforms import Array
from kin.units import Unit, Units

# Okabe and Ito's blue for motions about or along z, and vermilion for x.
ABOUT_Z, ABOUT_X = (0, 114, 178), (213, 94, 0)
TITLES: dict[Convention, str] = {"standard": "Standard convention", "modified": "Craig’s convention (modified)"}
COMMON: tuple[Factor, ...] = ("theta", "d")
LINK: tuple[Factor, ...] = ("a", "alpha")
WIDTHS = {"mm": 4.2, "cm": 4.2, "m": 4.8}  # em of a column
MATRIX = 0.74  # em, so that sixteen numbers and a name fit a panel of 300 pixels


def color(factor: Factor, strength: float = 1.0) -> str:
    """The CSS colour of a motion."""
    r, g, b = ABOUT_Z if axis(factor) == 2 else ABOUT_X
    return f"rgba({r},{g},{b},{strength:g})"


def caption_html(robot: Robot, at: WalkState, units: Units, asked: bool = False, in_order: bool = True) -> str:
    """The present motion, in words and highlighted in the row's product of four. The height is constant.

    `asked`: without what a joint makes of its row, here and in all tables; `in_order`: with the factors.
    """
    formula = _product(robot, at, units, in_order)
    return render("dh/caption", words=caption(robot, at, units, asked), formula=formula)


def _product(robot: Robot, at: WalkState, units: Units, in_order: bool) -> Markup:
    parts = [m.sub(m.ident("A"), m.short(at.row + 1)), m.op("=")]
    if not in_order:
        return m.math(*parts, m.text("?"), size=1.05)
    for k, factor in enumerate(ORDERS[robot.convention]):
        parts.append(m.gap())
        name = m.sub(m.text("R" if turns(factor) else "T"), m.ident("xyz"[axis(factor)]))
        piece = m.row(name, m.brackets(_expression(robot, at.row, factor, units)))
        if k == at.motion:
            piece = m.mark(piece, color(factor, 0.3))
        parts.append(piece)
    return m.math(*parts, size=1.05)


def _symbol(robot: Robot, row: int, factor: Factor) -> m.MathML:
    return m.sub(m.ident(LETTERS[factor]), m.short(index(robot, row, factor)))


def _expression(robot: Robot, row: int, factor: Factor, units: Units) -> m.MathML:
    """The parameter; where a joint changes it, with its offset, as in θ₃ − 90°."""
    offset = float(getattr(robot.rows[row], factor))
    piece = _symbol(robot, row, factor)
    if MOVED.get(robot.rows[row].kind) != factor or not offset:
        return piece
    return m.row(piece, m.op("-" if offset < 0.0 else "+"), m.text(units.of(turns(factor)).brief(abs(offset))))


def table_html(
    robot: Robot,
    q: Array,
    at: WalkState | None,
    units: Units,
    title: str = "",
    senses: Sequence[float] = (),
    asked: bool = False,
) -> str:
    """The table at a configuration ``(n,)``, columns in the order of application, the place `at` highlighted.

    Where a joint changes a parameter, the table has its symbol and offset, and the last column its value.
    `senses`: of each joint, −1 if it counts backwards.
    """
    order = ORDERS[robot.convention]
    heads = [{"name": "", "unit": "row"}]
    for factor in order:
        name = LETTERS[factor] + ("ᵢ₋₁" if index(robot, 0, factor) == 0 else "ᵢ")
        heads.append({"name": name, "unit": units.of(turns(factor)).name})
    heads.append({"name": "now", "unit": ""})
    rows = []
    for i, row in enumerate(robot.rows):
        here = at is not None and at.motion >= 0 and i == at.row
        sense = senses[robot.joint_rows.index(i)] if senses and i in robot.joint_rows else 1.0
        variable = MOVED.get(row.kind)
        cells = [
            {
                "value": _entry(robot, i, factor, units, sense),
                "variable": variable == factor,
                "mark": color(factor) if here and at is not None and k == at.motion else "",
            }
            for k, factor in enumerate(order)
        ]
        now = ""
        if variable is not None:
            offset, joint = float(getattr(row, variable)), robot.joint_rows.index(i)
            now = "?" if asked else units.of(turns(variable)).text(offset + sense * float(q[joint]))
        rows.append({"here": here, "cells": cells, "now": now})
    return render("dh/table", title=title or TITLES[robot.convention], heads=heads, rows=rows)


def _entry(robot: Robot, row: int, factor: Factor, units: Units, sense: float) -> str:
    """A constant, or the joint variable with its offset."""
    if MOVED.get(robot.rows[row].kind) == factor:
        return expression(robot, row, factor, units, sense).removesuffix(units.of(turns(factor)).suffix)
    return units.of(turns(factor)).number(float(getattr(robot.rows[row], factor)))


def matrices_html(robot: Robot, at: WalkState, symbols: bool, units: Units) -> str:
    """The row's matrix and the moving frame's pose, so far. `symbols`: the row's with its joint variable."""
    unit = units.lengths
    whole = at.placed > at.row
    A = m.sub(m.ident("A"), m.short(at.row + 1))
    T = m.subsup(m.ident("T"), m.short(at.row + 1), m.short(0))
    far = "" if whole else " so far"
    shown = _symbols(robot, at, unit) if symbols else _numbers(at.A, unit)
    placed = f"All rows{far}: the moving frame"
    if at.row == 0 and at.motion < 0:
        placed = "No row yet: the frame is at the base"
    blocks = (
        (f"Row {at.row + 1}{far}, lengths in {unit.name}", m.math(A, m.op("="), shown, size=MATRIX)),
        (placed, m.math(T, m.op("="), _numbers(at.T_0_now, unit), size=MATRIX)),
    )
    return render("dh/matrices", blocks=blocks)


def _numbers(T: Array, unit: Unit) -> m.MathML:
    """A pose ``(4, 4)``: directions with three decimals, the position to a tenth of a millimetre."""
    lines = [
        [*(m.number(v, 3) for v in line[:3]), m.number(unit.scale * line[3], unit.decimals(1))]
        for line in T[:3].tolist()
    ]
    return m.matrix([*lines, [m.short(v) for v in T[3].tolist()]], width=WIDTHS[unit.name])


def _symbols(robot: Robot, at: WalkState, unit: Unit) -> m.MathML:
    """The row's matrix up to the present motion, with its joint variable as a symbol."""
    found = symbolic(robot, at.row, at.motion + 1)
    q = _symbol(robot, at.row, MOVED.get(robot.rows[at.row].kind, "theta"))
    names = {"1": None, "cos": m.func("cos", q), "sin": m.func("sin", q), "q": q}

    def entry(r: int, c: int) -> m.MathML:
        terms: list[m.MathML] = []
        for name, constants in zip(found.names, found.constants, strict=True):
            # The joint variable d is a length already.
            length = c == 3 and r < 3 and name != "q"
            k = float(constants[r, c]) * (unit.scale if length else 1.0)
            if abs(k) < 1e-9:
                continue
            piece = names[name]
            size = m.short(abs(k), unit.decimals(1) if length else 3)
            shown = size if piece is None else piece if abs(abs(k) - 1.0) < 1e-9 else m.row(size, m.gap(), piece)
            if terms:
                terms += [m.op("-" if k < 0.0 else "+"), shown]
            else:
                terms.append(m.neg(shown) if k < 0.0 else shown)
        return m.row(*terms) if terms else m.short(0)

    return m.matrix([[entry(r, c) for c in range(4)] for r in range(4)])


def nine_steps_html(convention: Convention) -> str:
    """How to find the table of an arm, collapsed."""
    return render(
        "dh/nine_steps", steps=NINE_STEPS[convention], note=CRAIG_NOTE if convention == "modified" else ""
    )


def same_arm_html(robot: Robot, units: Units) -> str:
    """The same arm in both conventions: θ and d are common, a and α move down by a row; what is left over."""
    tables = {convention: convert_dh(robot, convention) for convention in TITLES}
    standard, craig = tables["standard"], tables["modified"]
    rows = []
    for i, row in enumerate(standard.rows):
        common, pairs = [], []
        for factor in COMMON:
            variable = MOVED.get(row.kind) == factor
            common.append({"value": _entry(standard, i, factor, units, 1.0), "variable": variable})
        for k, table in enumerate((standard, craig)):
            # The pair of row i in the standard table is that of row i + 1 in Craig's.
            link = i if k == 0 else i - 1
            moved = 0 <= link < len(standard.rows) - 1
            for factor in LINK:
                number = units.of(turns(factor)).number(float(getattr(table.rows[i], factor)))
                pairs.append({"value": number, "moved": moved, "odd": link % 2 == 1, "first": factor == "a"})
        rows.append({"common": common, "pairs": pairs})
    # What has no row to move to: the last pair of a standard table, the first of Craig's.
    end = robot.rows[-1] if robot.convention == "standard" else robot.rows[0]
    index = len(robot.rows) if robot.convention == "standard" else 0
    left = [f"{LETTERS[f]}{low(index)} = {amount(f, getattr(end, f), units)}" for f in LINK if getattr(end, f)]
    where = "the tool transform" if robot.convention == "standard" else "the base transform"
    rest = f"{' and '.join(left)} {'go' if len(left) > 1 else 'goes'} into {where}." if left else ""
    return render("dh/same_arm", rows=rows, angle=units.angles.name, length=units.lengths.name, rest=rest)


def compare_html(
    robot: Robot,
    other: Robot,
    q: Array,
    place_other: WalkState,
    distance: float,
    units: Units,
    asked: bool = False,
) -> str:
    """The same numbers in the other convention: table, differences and reasons; `distance` of the tools (m)."""
    return render(
        "dh/compare",
        same=Markup(same_arm_html(robot, units)),
        table=Markup(table_html(other, q, place_other, units, asked=asked)),
        paragraphs=verdict(robot, units),
        distance=units.lengths.text(distance),
    )
