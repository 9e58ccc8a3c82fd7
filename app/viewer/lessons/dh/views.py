"""The HTML of the walk through a DH table: caption, table, matrices, the nine steps.

Numbers have fixed decimals in columns of fixed width: they change and never move. Colours always come with words
or with weight.
"""

from __future__ import annotations

from markupsafe import Markup

from app.viewer.lessons.dh.nine_steps import CRAIG_NOTE, NINE_STEPS
from app.viewer.lessons.dh.steps import (
    LETTERS,
    MOVED,
    ORDERS,
    Factor,
    Place,
    axis,
    caption,
    index,
    symbolic,
    turns,
    value,
    verdict,
)
from app.viewer.views import mathml as m
from app.viewer.views.templates import render
from kin import Robot
from kin.robot import Convention
from kin.transforms import Array
from kin.units import Unit, Units

# Okabe and Ito's blue for motions about or along z, and vermilion for x.
ABOUT_Z, ABOUT_X = (0, 114, 178), (213, 94, 0)
TITLES: dict[Convention, str] = {"standard": "Standard convention", "modified": "Craig’s convention (modified)"}
WIDTHS = {"mm": 4.2, "cm": 4.2, "m": 4.8}  # em of a column
MATRIX = 0.74  # em, so that sixteen numbers and a name fit a panel of 300 pixels


def color(factor: Factor, strength: float = 1.0) -> str:
    """The CSS colour of a motion."""
    r, g, b = ABOUT_Z if axis(factor) == 2 else ABOUT_X
    return f"rgba({r},{g},{b},{strength:g})"


def caption_html(robot: Robot, at: Place, units: Units) -> str:
    """The present motion, in words and highlighted in the row's product of four. The height is constant."""
    return render("dh/caption", words=caption(robot, at, units), formula=_product(robot, at))


def _product(robot: Robot, at: Place) -> Markup:
    parts = [m.sub(m.ident("A"), m.short(at.row + 1)), m.op("=")]
    for k, factor in enumerate(ORDERS[robot.convention]):
        parts.append(m.gap())
        name = m.sub(m.text("R" if turns(factor) else "T"), m.ident("xyz"[axis(factor)]))
        piece = m.row(name, m.brackets(_symbol(robot, at.row, factor)))
        if k == at.motion:
            piece = m.mark(piece, color(factor, 0.3))
        parts.append(piece)
    return m.math(*parts, size=1.05)


def _symbol(robot: Robot, row: int, factor: Factor) -> m.MathML:
    return m.sub(m.ident(LETTERS[factor]), m.short(index(robot, row, factor)))


def table_html(robot: Robot, q: Array, at: Place | None, units: Units) -> str:
    """The table at a configuration ``(n,)``, columns in the order of application, the place `at` highlighted."""
    order = ORDERS[robot.convention]
    heads = [{"name": "", "unit": "row"}]
    for factor in order:
        name = LETTERS[factor] + ("ᵢ₋₁" if index(robot, 0, factor) == 0 else "ᵢ")
        heads.append({"name": name, "unit": units.of(turns(factor)).name})
    rows = []
    for i, row in enumerate(robot.rows):
        here = at is not None and at.motion >= 0 and i == at.row
        cells = [
            {
                "value": units.of(turns(factor)).number(value(robot, i, factor, q)),
                "variable": MOVED.get(row.kind) == factor,
                "mark": color(factor) if here and at is not None and k == at.motion else "",
            }
            for k, factor in enumerate(order)
        ]
        rows.append({"here": here, "cells": cells})
    return render("dh/table", title=TITLES[robot.convention], heads=heads, rows=rows)


def matrices_html(robot: Robot, at: Place, symbols: bool, units: Units) -> str:
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


def _symbols(robot: Robot, at: Place, unit: Unit) -> m.MathML:
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


def compare_html(robot: Robot, other: Robot, q: Array, place_other: Place, distance: float, units: Units) -> str:
    """The same numbers in the other convention: table, differences and reasons; `distance` of the tools (m)."""
    return render(
        "dh/compare",
        table=Markup(table_html(other, q, place_other, units)),
        paragraphs=verdict(robot, units),
        distance=units.lengths.text(distance),
    )
