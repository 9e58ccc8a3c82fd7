"""What the lesson on equations shows, as HTML and as lines in the picture: functions of a book and a pose."""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape

import numpy as np

from app.equations import Book, Equation, Line, Symbol, Values, typeset
from app.equations.expression import Expression, names
from app.viewer.panel.status import ink
from kin.transforms import Array
from kin.units import Units, fixed

# Mark, words and colour of each verdict; the colours are Okabe and Ito's.
LOOKS = {
    "right": ("✓", "printed correctly", "#009e73"),
    "misprinted": ("✕", "misprinted", "#d55e00"),
    "unreadable": ("?", "unreadable", "#6b4c9a"),
    "derived": ("✓", "derived and checked", "#0072b2"),
}
SAME = 1e-9  # rounding, in metres or pure numbers
AXES = {"n": "x", "o": "y", "a": "z"}


def label(equation: Equation) -> str:
    """An equation in the dropdown: number, entry, and whether something is wrong with it."""
    name = "the whole matrix" if equation.entry == "T" else equation.entry
    if equation.number is None:
        return name
    mark, words, _ = LOOKS[equation.verdict]
    return f"({equation.number}) {name} {mark}" + ("" if equation.verdict == "right" else f" {words}")


def summary(book: Book) -> str:
    """What this arm's equations are, in a sentence."""
    if book.source == "derived":
        return "Derived from the DH table, and checked against forward kinematics before they are shown."
    wrong = [f"({e.number})" for e in book.equations if e.verdict == "misprinted"]
    read = sum(e.correct is not None for e in book.equations)
    return f"{len(wrong)} of the chapter's {read} readable equations are misprinted: {', '.join(wrong)}."


def equation_html(book: Book, equation: Equation) -> str:
    """The equation as printed and corrected, or as derived, with what it is built on."""
    out = [
        f'<div data-robot="{escape(book.robot.id)}" data-equation="{escape(equation.id)}" '
        f'data-verdict="{equation.verdict}" '
        'style="margin:.1em 1em .4em;font-size:.85em;line-height:1.45">'
    ]
    if equation.printed is not None:
        wrong = equation.wrong_terms if equation.verdict == "misprinted" else ()
        out.append(
            _formula("As printed", equation.entry, equation.printed, wrong, LOOKS["misprinted"][2], "wrong")
        )
        if equation.verdict == "misprinted":
            assert equation.correct is not None
            mended = equation.mended_terms
            color = LOOKS["right"][2]
            out.append(_formula("Corrected", equation.entry, equation.correct, mended, color, "mended"))
    elif equation.correct is not None:
        out.append(_formula("Closed form", equation.entry, equation.correct))
    if equation.note:
        out.append(f'<div style="opacity:.85">{note_html(equation.note)}</div>')
    lines = book.lines_of(equation)
    if lines:
        out.append(_lines(lines, book.source))
    if equation.verdict == "derived" and equation.correct is not None:
        own = [f"a_{axis}" for axis in "xyz" if f"a_{axis}" in names(equation.correct)]
        out += [
            f'<div style="opacity:.85">{typeset.mathml_name(a)} has an equation of its own.</div>' for a in own
        ]
    return "".join(out) + "</div>"


def verdict_html(equation: Equation) -> str:
    """What is to be thought of the equation, by a mark, words and a colour."""
    mark, words, color = LOOKS[equation.verdict]
    number = "" if equation.number is None else f"Equation ({equation.number}): "
    return f'<b style="font-size:1.08em">{number}<span style="color:{ink(color)}">{mark} {words}</span></b>'


def note_html(note: str) -> str:
    """A note with its products written as such: c5 with an index, no asterisks."""
    text = escape(note).replace("*", "\u2009").replace("-", "−")
    return re.sub(r"\b([acds])(\d+)", r"<i>\1</i><sub>\2</sub>", text)


def symbols_html(symbols: Iterable[Symbol], units: Units) -> str:
    """What the names of an equation stand for, one a line."""
    rows = "".join(
        f'<tr><td style="padding:0 .6em 0 0;white-space:nowrap">{typeset.mathml_name(symbol.name)}</td>'
        f'<td style="padding:0">{escape(meaning(symbol, units))}</td></tr>'
        for symbol in symbols
    )
    return (
        '<table aria-label="symbols" style="margin:.1em 1em .4em;border-collapse:collapse;font-size:.8em;'
        f'line-height:1.6">{rows}</table>'
    )


def meaning(symbol: Symbol, units: Units) -> str:
    """A symbol in words, a constant with its value."""
    if not symbol.fixed or symbol.kind in ("cos", "sin"):
        return symbol.meaning
    if symbol.kind == "number":
        return f"{symbol.constant:.6g}, {symbol.meaning}".replace("-", "−")
    return f"{symbol.constant * units.lengths.scale:.6g}{units.lengths.suffix}, {symbol.meaning}".replace("-", "−")


def values_html(equation: Equation, values: Values, units: Units, largest: float) -> str:
    """The values side by side, and by how much the first one is off; `largest` is the most it can be."""
    columns = {"printed": values.printed, "corrected": values.correct, "DH product": values.dh}
    if equation.verdict == "derived":
        columns = {"closed form": values.correct, "DH product": values.dh}
    head = "".join(f'<th style="{CELL};font-weight:500;opacity:.75">{name}</th>' for name in columns)
    cells = "".join(
        f'<td style="{CELL}">{number(float(v), equation.is_length, units)}</td>'
        for v in columns.values()
        if v is not None
    )
    unit = f"{typeset.mathml_name(equation.entry)}{f' in {units.lengths.name}' if equation.is_length else ''}"
    mark, words, color = told(equation, values, units, largest)
    return (
        f'<div style="margin:.1em 1em .4em;font-size:.8em;line-height:1.6">{verdict_html(equation)}'
        '<table aria-label="values here" style="width:100%;table-layout:fixed;border-collapse:collapse;'
        f'font-variant-numeric:tabular-nums"><caption style="text-align:left;opacity:.75">{unit}, at this pose'
        f"</caption><tr>{head}</tr><tr>{cells}</tr></table>"
        '<div data-off="" style="min-height:2.6em;line-height:1.3;padding-top:.2em">'
        f'<b style="color:{ink(color)}">{mark}</b> {words}</div></div>'
    )


CELL = "padding:0 0 0 .4em;text-align:right"


def told(equation: Equation, values: Values, units: Units, largest: float) -> tuple[str, str, str]:
    """Mark, words and colour: what the difference at this pose means for the tool."""
    right, wrong = LOOKS["right"], LOOKS["misprinted"]
    off = abs(float(values.difference))
    if off < SAME and equation.verdict == "misprinted":
        return right[0], "no difference at this pose: the misprinted part happens to vanish", right[2]
    if off < SAME:
        return right[0], "equal to the DH product", right[2]
    if equation.is_length:
        size, most = escape(units.distance(off)), escape(units.distance(largest))
        return wrong[0], f"puts the tool off by <b>{size}</b> here, by {most} at worst", wrong[2]
    size, most = escape(units.angle(float(values.turn))), escape(units.angle(largest))
    axis = f"the tool’s {AXES[equation.entry[0]]} axis ({equation.entry[0]})"
    return wrong[0], f"turns {axis} by <b>{size}</b> here, by {most} at worst", wrong[2]


def number(value: float, is_length: bool, units: Units) -> str:
    """A value for people: a length, or a pure number."""
    return units.lengths.number(value) if is_length else fixed(value, 4)


def _formula(
    title: str,
    name: str,
    expression: Expression,
    marked: tuple[bool, ...] = (),
    color: str = "",
    word: str = "",
) -> str:
    """A titled equation whose line may break between its terms; marked terms are coloured and underlined."""
    parts = typeset.mathml_terms(expression, name)
    spans = []
    for part, mark in zip(parts, marked or (False,) * len(parts), strict=True):
        style = "display:inline-block;margin-right:.25em"
        if mark:
            style += f";color:{ink(color)};border-bottom:2px solid {color}"
        spans.append(f'<span style="{style}"' + (f' title="{word}"' if mark else "") + f">{part}</span>")
    return f'<div style="margin-top:.35em;opacity:.75">{title}</div><div style="{BOX}">{" ".join(spans)}</div>'


BOX = (
    "overflow-x:auto;max-width:100%;padding:.3em .5em;border-radius:.3em;background:rgba(128,128,128,.12);"
    "line-height:1.75;font-size:1.08em"
)


def _lines(lines: list[Line], source: str) -> str:
    """Intermediate results, and what the names of derived ones mean."""
    frames = sorted({"".join(typeset.glyphs(line.name).index[:-2]) for line in lines} - {""})
    said = ""
    if source == "derived":
        frame = " and ".join(frames)
        said = f" (x, y, z: axes of frame {frame}, p: its origin; primed: the tool as seen from there)"
    rows = "".join(
        f'<div style="white-space:nowrap">{typeset.mathml(line.expression, line.name)}</div>' for line in lines
    )
    return (
        f'<div style="margin-top:.35em;opacity:.75">where{said}</div>'
        f'<div style="{BOX};max-height:11em;overflow-y:auto">{rows}</div>'
    )


def message(text: str) -> str:
    """A sentence."""
    return f'<div style="margin:.1em 1em .4em;font-size:.85em;opacity:.85">{escape(text)}</div>'


def segments(equation: Equation, values: Values, T_base_tool: Array, length: float) -> Array:
    """What a misprint looks like, lines ``(k, 2, 3)`` in metres, the printed one first.

    For p, from the tool to where the equation puts it; for an axis, the printed one and the true one, as long as
    `length` both.
    """
    assert values.printed is not None
    row, column = equation.index
    tool = T_base_tool[:3, 3]
    printed = T_base_tool[:3, column].copy()
    printed[row] = float(values.printed)
    if column == 3:
        return np.array([[tool, printed]])
    size = float(np.linalg.norm(printed)) or 1.0
    true = T_base_tool[:3, column]
    return np.array([[tool, tool + length / size * printed], [tool, tool + length * true]])
