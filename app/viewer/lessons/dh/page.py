"""What the panel shows of the walk through a DH table: caption, table, matrices, the nine steps.

HTML as text, from plain data. Numbers have fixed decimals in columns of fixed width: they change and never move.
Colours come with words or weight; the greys are the text's own colour, so that a dark page needs no others.
"""

from __future__ import annotations

from html import escape

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
from kin import Robot
from kin.robot import Convention
from kin.transforms import Array
from kin.units import Unit, Units

# Okabe and Ito's: blue for what is about or along z, vermilion for x, as the axes of every frame are coloured.
ABOUT_Z, ABOUT_X = (0, 114, 178), (213, 94, 0)
ROW_GROUND = "rgba(128,128,128,.16)"
TITLES: dict[Convention, str] = {"standard": "Standard order", "modified": "Craig’s order (modified)"}
WIDTHS = {"mm": 4.2, "cm": 4.2, "m": 4.8}  # em of a column
MATRIX = 0.74  # em, so that sixteen numbers and a name fit a panel of 300 pixels

NINE_STEPS = (
    "Draw every joint’s line: what it turns about or slides along. From the base outwards they are z₀, z₁, z₂ …",
    "Stand frame 0 on z₀, wherever suits you, and turn x₀ as you like.",
    "Between two neighbouring lines find the common normal. Where it meets the outer line, origin i goes. Lines "
    "that meet: take the meeting point. Parallel lines: choose, best so that d becomes 0.",
    "Lay xᵢ along that normal, away from the inner line. Lines that meet: square to both.",
    "yᵢ follows by the right hand: x to y, the thumb along z.",
    "Put the last frame on the tool point, z where the tool approaches, x square to the last joint’s line.",
    "Read off the table. θ: from old x to new x, about old z. d: along old z to the normal. a: the normal’s "
    "length. α: from old z to new z, about new x.",
    "Write each row as a matrix Aᵢ: its four motions, multiplied in order.",
    "Multiply the rows, A₁ A₂ … Aₙ: the tool’s pose in the base’s coordinates.",
)
CRAIG_STEPS = (
    "Craig’s tables differ in 3, 4 and 7: frame i sits on joint i’s own line, so a row begins with the link "
    "before the joint, α and a, and ends with the joint, θ and d."
)


def color(factor: Factor, strength: float = 1.0) -> str:
    """The CSS colour of a motion."""
    r, g, b = ABOUT_Z if axis(factor) == 2 else ABOUT_X
    return f"rgba({r},{g},{b},{strength:g})"


def caption_html(robot: Robot, at: Place, units: Units) -> str:
    """The motion under way: in words, and marked in the row's product of four."""
    words = caption(robot, at, units)
    # Always two lines high: what is below must not jump.
    return (
        '<div data-dh="caption" style="margin:.1em 1em .2em;font-size:.86em;line-height:1.35">'
        f'<div style="min-height:2.7em">{escape(words)}</div>'
        f'<div style="white-space:nowrap">{_product(robot, at)}</div></div>'
    )


def _product(robot: Robot, at: Place) -> str:
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
    """The table at a configuration ``(n,)``, columns in the order of application, the place marked."""
    order = ORDERS[robot.convention]
    line = '<tr style="{}">{}</tr>'
    heads = [("", "row")] + [
        (LETTERS[f] + ("ᵢ₋₁" if index(robot, 0, f) == 0 else "ᵢ"), units.of(turns(f)).name) for f in order
    ]
    head = "".join(
        '<th scope="col" style="padding:0 .35em;font-weight:500;text-align:right">'
        f'{name} <span style="opacity:.65">{unit}</span></th>'
        for name, unit in heads
    )
    body = [line.format("", head)]
    for i, row in enumerate(robot.rows):
        here = at is not None and at.motion >= 0 and i == at.row
        cells = [
            '<th scope="row" style="padding:0 .35em;text-align:right;'
            f'font-weight:{700 if here else 500}">{i + 1}</th>'
        ]
        for k, factor in enumerate(order):
            style = "padding:0 .35em;text-align:right;white-space:nowrap"
            if MOVED.get(row.kind) == factor:
                style += ";font-weight:700;text-decoration:underline dotted;text-underline-offset:.2em"
            if here and at is not None and k == at.motion:
                style += f";background:{color(factor, 0.3)};box-shadow:inset 0 0 0 1.5px {color(factor)}"
            cells.append(f'<td style="{style}">{units.of(turns(factor)).number(value(robot, i, factor, q))}</td>')
        body.append(line.format(f"background:{ROW_GROUND}" if here else "", "".join(cells)))
    return (
        f'<table data-dh="table" aria-label="DH table, {TITLES[robot.convention]}" style="width:calc(100% - 2em);'
        "margin:.2em 1em .3em;border-collapse:collapse;font-size:.78em;line-height:1.5;"
        f'font-variant-numeric:tabular-nums"><caption style="caption-side:top;text-align:left;opacity:.8">'
        f"{TITLES[robot.convention]}; what joints move is bold</caption>{''.join(body)}</table>"
    )


def matrices_html(robot: Robot, at: Place, symbols: bool, units: Units) -> str:
    """The row's matrix and the moving frame's, so far. `symbols`: the row's with its joint open."""
    unit = units.lengths
    whole = at.placed > at.row
    A = m.sub(m.ident("A"), m.short(at.row + 1))
    T = m.subsup(m.ident("T"), m.short(at.row + 1), m.short(0))
    far = "" if whole else " so far"
    shown = _symbols(robot, at, unit) if symbols else _numbers(at.A, unit)
    blocks = (
        (f"Row {at.row + 1}{far}, lengths in {unit.name}", m.math(A, m.op("="), shown, size=MATRIX)),
        (f"All rows{far}: the moving frame", m.math(T, m.op("="), _numbers(at.T_0_now, unit), size=MATRIX)),
    )
    return "".join(
        f'<div style="margin:.25em 1em .4em"><div style="font-size:.78em;opacity:.8">{escape(title)}'
        f'</div><div style="overflow-x:auto">{formula}</div></div>'
        for title, formula in blocks
    )


def _numbers(T: Array, unit: Unit) -> m.MathML:
    """A pose ``(4, 4)``: directions with three decimals, the position with one of a millimetre."""
    lines = [
        [*(m.number(v, 3) for v in line[:3]), m.number(unit.scale * line[3], unit.decimals(1))]
        for line in T[:3].tolist()
    ]
    return m.matrix([*lines, [m.short(v) for v in T[3].tolist()]], width=WIDTHS[unit.name])


def _symbols(robot: Robot, at: Place, unit: Unit) -> m.MathML:
    """The row's matrix, up to the motion under way, as sums of what its joint leaves open."""
    found = symbolic(robot, at.row, at.motion + 1)
    q = _symbol(robot, at.row, MOVED.get(robot.rows[at.row].kind, "theta"))
    names = {"1": None, "cos": m.func("cos", q), "sin": m.func("sin", q), "q": q}

    def entry(r: int, c: int) -> m.MathML:
        terms: list[m.MathML] = []
        for name, constants in zip(found.names, found.constants, strict=True):
            # A sliding joint's own d is a length already.
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
    """How a table is made, to unfold."""
    items = "".join(f'<li style="margin:.25em 0">{escape(step)}</li>' for step in NINE_STEPS)
    note = f'<p style="margin:.4em 0">{escape(CRAIG_STEPS)}</p>' if convention == "modified" else ""
    return (
        '<details data-dh="nine" style="margin:.4em 1em;font-size:.84em;line-height:1.4">'
        '<summary style="cursor:pointer">From an arm to its table, in nine steps</summary>'
        f'<ol style="margin:.3em 0;padding-left:1.6em">{items}</ol>{note}</details>'
    )


def compare_html(robot: Robot, other: Robot, q: Array, place_other: Place, apart: float, units: Units) -> str:
    """The same numbers read in the other order: its table, what differs and why; `apart`: between the tools, m."""
    paragraphs = "".join(f'<p style="margin:0 0 .4em">{escape(words)}</p>' for words in verdict(robot, units))
    return (
        f"{table_html(other, q, place_other, units)}"
        '<div data-dh="verdict" style="margin:.2em 1em .5em;font-size:.84em;line-height:1.4">'
        f"{paragraphs}"
        '<div style="opacity:.85;font-variant-numeric:tabular-nums">At these joint values the two tool points are '
        f"{units.lengths.text(apart)} apart.</div></div>"
    )
