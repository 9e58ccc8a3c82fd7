"""The HTML of the lesson on equations, and its lines in the scene: functions of a book and a pose."""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape

import numpy as np
from markupsafe import Markup

from app.equations import Book, Equation, Line, Symbol, Values, typeset
from app.equations.expression import Expression, names
from app.viewer.views.templates import render
from kin.transforms import Array
from kin.units import Units, fixed

# Mark, words and CSS class of each verdict.
LOOKS = {
    "right": ("✓", "printed correctly", "kb-green"),
    "misprinted": ("✕", "misprinted", "kb-vermilion"),
    "unreadable": ("?", "unreadable", "kb-violet"),
    "derived": ("✓", "derived and checked", "kb-blue"),
}
SAME = 1e-9  # rounding, in metres or pure numbers
AXES = {"n": "x", "o": "y", "a": "z"}
COLUMNS = "The tool’s pose is [n o a p]: the directions of its x, y and z axes, and its point."


def label(equation: Equation) -> str:
    """An equation in the dropdown: number, entry, and whether it is wrong."""
    # There are no Unicode subscripts for y and z, and a dropdown shows plain text.
    name = "the whole matrix" if equation.entry == "T" else " of ".join(reversed(equation.entry.split("_")))
    if equation.number is None:
        return name
    mark, words, _ = LOOKS[equation.verdict]
    return f"({equation.number}) {name} {mark}" + ("" if equation.verdict == "right" else f" {words}")


def summary(book: Book) -> str:
    """The origin of this arm's equations, in one sentence."""
    if book.source == "derived":
        return f"Derived from the DH table, and checked against forward kinematics. {COLUMNS}"
    wrong = [f"({e.number})" for e in book.equations if e.verdict == "misprinted"]
    read = sum(e.correct is not None for e in book.equations)
    return (
        f"This arm comes from a book chapter that prints its equations. {len(wrong)} of the {read} readable ones "
        f"are misprinted: {', '.join(wrong)}. {COLUMNS}"
    )


def equation_html(book: Book, equation: Equation) -> str:
    """The equation as printed and corrected, or as derived, with its intermediate results."""
    formulas = []
    if equation.printed is not None:
        wrong = equation.wrong_terms if equation.verdict == "misprinted" else ()
        formulas.append(_formula("As printed", equation.entry, equation.printed, wrong, "misprinted", "wrong"))
        if equation.verdict == "misprinted":
            assert equation.correct is not None
            corrected = equation.mended_terms
            formulas.append(
                _formula("Corrected", equation.entry, equation.correct, corrected, "right", "corrected")
            )
    elif equation.correct is not None:
        formulas.append(_formula("Closed form", equation.entry, equation.correct))
    lines = book.lines_of(equation)
    separate = []
    if equation.verdict == "derived" and equation.correct is not None:
        separate = [f"a_{axis}" for axis in "xyz" if f"a_{axis}" in names(equation.correct)]
    return render(
        "equations/equation",
        robot=book.robot.id,
        id=equation.id,
        verdict=equation.verdict,
        formulas=formulas,
        note=note_html(equation.note) if equation.note else "",
        lines=[Markup(typeset.mathml(line.expression, line.name)) for line in lines],
        legend=_legend(lines, equation) if book.source == "derived" else "",
        separate=[Markup(typeset.mathml_name(name)) for name in separate],
    )


def verdict_html(equation: Equation) -> str:
    """Whether the equation is right, as a mark, words and a colour."""
    mark, words, color = LOOKS[equation.verdict]
    number = "" if equation.number is None else f"Equation ({equation.number}): "
    return render("equations/verdict", number=number, mark=mark, words=words, color=color)


def unreadable_html(equation: Equation) -> str:
    """The verdict alone, for an equation without values."""
    return render("equations/unreadable", verdict=Markup(verdict_html(equation)))


def note_html(note: str) -> Markup:
    """A note with its products typeset: c5 with an index, no asterisks."""
    text = escape(note).replace("*", "\u2009").replace("-", "−")
    return Markup(re.sub(r"\b([acds])(\d+)", r"<i>\1</i><sub>\2</sub>", text))


def symbols_html(symbols: Iterable[Symbol], units: Units) -> str:
    """The meaning of each name in an equation, one per line."""
    rows = [(Markup(typeset.mathml_name(symbol.name)), meaning(symbol, units)) for symbol in symbols]
    return render("equations/symbols", rows=rows)


def meaning(symbol: Symbol, units: Units) -> str:
    """A symbol in words, a constant with its value."""
    if not symbol.fixed or symbol.kind in ("cos", "sin"):
        return symbol.meaning
    if symbol.kind == "number":
        return f"{symbol.constant:.6g}, {symbol.meaning}".replace("-", "−")
    return f"{symbol.constant * units.lengths.scale:.6g}{units.lengths.suffix}, {symbol.meaning}".replace("-", "−")


def values_html(equation: Equation, values: Values, units: Units, largest: float) -> str:
    """The values side by side, and the error of the first one; `largest` is its largest possible error."""
    columns = {"printed": values.printed, "corrected": values.correct, "DH product": values.dh}
    if equation.verdict == "derived":
        columns = {"closed form": values.correct, "DH product": values.dh}
    mark, words, color = error_in_words(equation, values, units, largest)
    return render(
        "equations/values",
        verdict=Markup(verdict_html(equation)),
        name=Markup(typeset.mathml_name(equation.entry)),
        unit=f" in {units.lengths.name}" if equation.is_length else "",
        columns=[
            {"name": name, "value": number(float(value), equation.is_length, units)}
            for name, value in columns.items()
            if value is not None
        ],
        mark=mark,
        words=words,
        color=color,
    )


def error_in_words(equation: Equation, values: Values, units: Units, largest: float) -> tuple[str, Markup, str]:
    """Mark, words and CSS class: what the error at this pose means for the tool."""
    right, wrong = LOOKS["right"], LOOKS["misprinted"]
    error = abs(float(values.difference))
    if error < SAME and equation.verdict == "misprinted":
        return right[0], Markup("no difference at this pose: the misprinted part happens to vanish"), right[2]
    if error < SAME:
        return right[0], Markup("equal to the DH product"), right[2]
    if equation.is_length:
        text = Markup("puts the tool off by <b>{}</b> here, by {} at worst")
        return wrong[0], text.format(units.distance(error), units.distance(largest)), wrong[2]
    axis = f"the tool’s {AXES[equation.entry[0]]} axis ({equation.entry[0]})"
    text = Markup("turns {} by <b>{}</b> here, by {} at worst")
    return wrong[0], text.format(axis, units.angle(float(values.turn)), units.angle(largest)), wrong[2]


def number(value: float, is_length: bool, units: Units) -> str:
    """A length, or a pure number, as text."""
    return units.lengths.number(value) if is_length else fixed(value, 4)


def _formula(
    title: str,
    name: str,
    expression: Expression,
    marked: tuple[bool, ...] = (),
    look: str = "right",
    word: str = "",
) -> dict[str, object]:
    """A titled equation that may break between its terms; marked terms are coloured and underlined."""
    terms = typeset.mathml_terms(expression, name)
    marks = marked or (False,) * len(terms)
    parts = [{"term": Markup(term), "marked": mark} for term, mark in zip(terms, marks, strict=True)]
    return {"title": title, "parts": parts, "color": LOOKS[look][2], "word": word}


def _legend(lines: list[Line], equation: Equation) -> str:
    """What the names of derived intermediate results mean."""
    frames = sorted({"".join(typeset.glyphs(line.name).index[:-2]) for line in lines} - {""})
    frame = " and ".join(frames)
    used = {name for line in lines for name in (line.name, *names(line.expression))}
    if equation.correct is not None:
        used |= set(names(equation.correct))
    primed = "; primed: the tool in that frame" if any("'" in name for name in used) else ""
    return f" (x, y, z: axes of frame {frame}, p: its origin{primed})"


def message(text: str) -> str:
    """A sentence."""
    return render("equations/message", text=text)


def segments(equation: Equation, values: Values, T_base_tool: Array, length: float) -> Array:
    """The effect of a misprint as lines ``(k, 2, 3)`` in metres, the printed one first.

    For p, a line from the tool to where the equation puts it; for an axis, the printed and the true axis, both
    with this `length`.
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
