"""The HTML of the lesson on equations, and its lines in the scene: functions of a book and a pose."""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape

import numpy as np
from markupsafe import Markup

from app.equations import Book, Compared, Equation, Line, Symbol, Values, compared, gram, suspects, typeset
from app.equations.compare import SMALLEST
from app.equations.expression import Expression, names
from app.exports.worksheet import Formula
from app.viewer.views import mathml
from app.viewer.views.mathml import MathML
from app.viewer.views.templates import render
from kin.transforms import Array
from kin.units import Units, fixed, general

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
    rows: list[dict[str, object]] = []
    lines = book.lines_of(equation)
    if equation.printed is not None:
        wrong = equation.wrong_terms if equation.verdict == "misprinted" else ()
        written = book.written_out(equation.printed)
        formulas.append(_formula("As printed", equation.entry, written, wrong, "misprinted", "wrong"))
        if equation.verdict == "misprinted":
            assert equation.correct is not None
            corrected, written = equation.mended_terms, book.written_out(equation.correct)
            formulas.append(_formula("Corrected", equation.entry, written, corrected, "right", "corrected"))
            rows = [_compared_row(row) for row in compared(equation.printed, equation.correct)]
    elif equation.correct is not None:
        formulas.append(_formula("Closed form", equation.entry, equation.correct))
    if book.source == "chapter" and not rows:
        lines = []  # written out, as in print
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
        rows=rows,
        matrix=_corrected_matrix(book) if equation.entry == "T" else "",
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
    return Markup(re.sub(r"\b[acds]\d+", lambda found: typeset.mathml_name(found[0]), text))


def symbols_html(symbols: Iterable[Symbol], units: Units) -> str:
    """The meaning of each name in an equation, one per line."""
    rows = [(Markup(typeset.mathml_name(symbol.name)), meaning(symbol, units)) for symbol in symbols]
    return render("equations/symbols", rows=rows)


def meaning(symbol: Symbol, units: Units) -> str:
    """A symbol in words, a constant with its value."""
    if not symbol.fixed or symbol.kind in ("cos", "sin"):
        return symbol.meaning
    if symbol.kind == "number":
        return f"{general(symbol.constant)}, {symbol.meaning}"
    return f"{general(symbol.constant * units.lengths.scale)}{units.lengths.suffix}, {symbol.meaning}"


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


# What a term of the print is, by how it differs from the right one: words and CSS class.
DIFFERENCES = {
    "same": ("the same", ""),
    "sign": ("wrong sign", "kb-vermilion"),
    "factor": ("{wrong} should be {right}", "kb-amber"),
    "sign and factor": ("wrong sign, and {wrong} should be {right}", "kb-vermilion"),
    "spurious": ("does not belong here", "kb-mauve"),
    "missing": ("missing in print", "kb-blue"),
}


def _compared_row(row: Compared) -> dict[str, object]:
    """A term as printed, the right one, and how they differ."""
    words, color = DIFFERENCES[row.kind]
    wrong, right = (Markup(typeset.mathml_name(name)) if name else "" for name in (row.wrong, row.right))
    printed, correct = (
        "—" if term is None else Markup(typeset.mathml_signed(term)) for term in (row.printed, row.correct)
    )
    text = Markup(words).format(wrong=wrong, right=right)
    return {"printed": printed, "correct": correct, "kind": row.kind, "words": text, "color": color}


def _corrected_matrix(book: Book) -> Markup:
    """The whole matrix [n o a p] with the right entries; those of misprinted equations are marked."""
    entries = {e.entry: e for e in book.equations if e.correct is not None}
    marks = {e.index: "rgba(0, 158, 115, .22)" for e in entries.values() if e.verdict == "misprinted"}
    rows: list[list[MathML]] = []
    for axis in "xyz":
        row = [entries[f"{column}_{axis}"].correct for column in "noap"]
        rows.append([MathML(typeset.mathml_inside(entry)) for entry in row if entry is not None])
    rows.append([mathml.short(float(k == 3)) for k in range(4)])
    left = [mathml.ident("T"), mathml.op("=")]
    return mathml.math(*left, mathml.matrix(rows, marks=marks), alt="T, the whole matrix, corrected")


def test_html(book: Book, q: Array) -> str:
    """RᵀR − I and RRᵀ − I of the printed R at a configuration, and what they say."""
    R = book.as_printed(q)[:3, :3]
    tables, found = [], []
    for title, off, heads in (
        ("RᵀR − I compares the columns", gram(R), ("n", "o", "a")),
        ("RRᵀ − I compares the rows", gram(R.T), ("x", "y", "z")),
    ):
        wrong = suspects(off)
        found.append([heads[k] for k in wrong])
        cells = [[(fixed(float(v), 3), int(abs(v) > SMALLEST)) for v in row] for row in off]
        tables.append({"title": title, "heads": heads, "rows": list(zip(heads, cells, strict=True))})
    mark, words, color = _finding(book, *found)
    return render("equations/test", tables=tables, mark=mark, words=words, color=color)


def _finding(book: Book, columns: list[str], rows: list[str]) -> tuple[str, Markup, str]:
    """Mark, words and CSS class: where the misprint must be."""
    right, wrong = LOOKS["right"], LOOKS["misprinted"]
    if not columns:
        text = "Zero at this pose: no misprint shows here. Move the arm: elsewhere one may."
        return right[0], Markup(text), right[2]
    by_entry = {e.entry: e for e in book.equations}
    found = [by_entry[f"{column}_{row}"] for column in columns for row in rows]
    names = [Markup("{} in ({})").format(Markup(typeset.mathml_name(e.entry)), e.number) for e in found]
    text = Markup("{} {} and {} {} cannot be right: look at {}.").format(
        "Columns" if len(columns) > 1 else "Column",
        _listed(columns),
        "rows" if len(rows) > 1 else "row",
        _listed(rows),
        _listed(names),
    )
    return wrong[0], text, wrong[2]


def _listed(items: list[str] | list[Markup]) -> Markup:
    *first, last = items
    return (Markup(", ").join(first) + " and " if first else Markup("")) + last


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


def formulas(book: Book) -> tuple[Formula, ...]:
    """All equations for a worksheet: as printed, with the corrected ones among the solutions; or as derived."""
    lines = [(line.name, line.name, line.expression, False) for line in book.lines if book.source == "derived"]
    for equation in book.equations:
        number = equation.entry.replace("_", "") if equation.number is None else f"({equation.number})"
        if equation.printed is not None:
            lines.append((number, equation.entry, equation.printed, False))
        if equation.correct is not None and equation.verdict in ("misprinted", "derived"):
            title = number if equation.printed is None else f"{number}, corrected"
            lines.append((title, equation.entry, equation.correct, equation.printed is not None))
    written = [
        (title, name, book.written_out(form) if book.source == "chapter" else form, solution)
        for title, name, form, solution in lines
    ]
    return tuple(
        Formula(title, "".join(typeset.mathml_terms(form, name)), typeset.latex(form, name), solution)
        for title, name, form, solution in written
    )


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
