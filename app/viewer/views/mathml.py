"""Typeset mathematics for the panel: MathML, which browsers draw by themselves.

Small functions that put one piece of markup round others. A leaf (`ident`, `text`, `op`, `number`) takes plain
text and escapes it; everything else takes and gives :data:`MathML`, so that a type checker keeps the two apart.
`math` closes a formula: it goes into an HTML or Markdown element of viser.

>>> math(sub(ident("T"), text("02")), op("="), number(-1, 0))[:26]
'<math style="font-size:1em'

Brackets do not stretch with the fonts most machines have: `matrix` draws its own, as borders.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import NewType

from kin.units import fixed

MathML = NewType("MathML", str)

# A bracket is a border with two serifs: short lines painted as gradients, in the colour of the text.
_SERIFS = ",".join(
    f"linear-gradient(currentColor,currentColor) {corner}/.3em .09em no-repeat"
    for corner in ("left top", "left bottom", "right top", "right bottom")
)
_BRACKETS = (
    "border-left:.09em solid currentColor;border-right:.09em solid currentColor;"
    f"background:{_SERIFS};border-spacing:0;padding:0 .2em"
)


def math(*parts: MathML, alt: str = "", size: float = 1.0) -> str:
    """A whole formula as HTML. `alt` is what a screen reader says instead; `size` is in em."""
    label = f' aria-label="{escape(alt, quote=True)}"' if alt else ""
    return f'<math style="font-size:{size:g}em;font-variant-numeric:tabular-nums"{label}>{"".join(parts)}</math>'


def ident(name: str) -> MathML:
    """A variable. A single letter comes out slanted, as mathematics has it; a longer name upright."""
    return MathML(f"<mi>{escape(name)}</mi>")


def text(words: str) -> MathML:
    """Upright words or labels, blanks kept."""
    return MathML(f"<mtext>{escape(words)}</mtext>")


def op(symbol: str) -> MathML:
    """An operator or bracket, with the spacing of its kind. A hyphen becomes a minus sign."""
    shown = "−" if symbol == "-" else symbol
    return MathML(f'<mo stretchy="false">{escape(shown)}</mo>')


def number(value: float, decimals: int = 3) -> MathML:
    """`fixed` as a piece of a formula."""
    return MathML(f"<mn>{fixed(value, decimals)}</mn>")


def short(value: float, decimals: int = 3) -> MathML:
    """`number` without the zeros that say nothing: for constants, which do not flicker."""
    shown = fixed(value, decimals)
    return MathML(f"<mn>{shown.rstrip('0').rstrip('.') if '.' in shown else shown}</mn>")


def row(*parts: MathML) -> MathML:
    """Pieces side by side, as one piece."""
    return MathML(f"<mrow>{''.join(parts)}</mrow>")


def neg(part: MathML) -> MathML:
    """Minus a piece; the sign is close to it, as a sign and not a difference."""
    return row(MathML('<mo form="prefix">−</mo>'), part)


def brackets(*parts: MathML) -> MathML:
    """Pieces in round brackets."""
    return row(op("("), *parts, op(")"))


def sub(base: MathML, index: MathML) -> MathML:
    """A piece with an index below."""
    return MathML(f"<msub>{base}{index}</msub>")


def subsup(base: MathML, index: MathML, exponent: MathML) -> MathML:
    """A piece with an index below and an exponent."""
    return MathML(f"<msubsup>{base}{index}{exponent}</msubsup>")


def gap() -> MathML:
    """A thin space, as between a factor and a function's name."""
    return MathML('<mspace width=".17em"/>')


def func(name: str, argument: MathML) -> MathML:
    """A function's upright name and its argument, without brackets: cos θ₁."""
    return row(
        MathML(f'<mi mathvariant="normal">{escape(name)}</mi>'), MathML('<mspace width=".17em"/>'), argument
    )


def mark(part: MathML, color: str) -> MathML:
    """A piece on a ground of this CSS colour."""
    return MathML(f'<mrow style="background:{escape(color, quote=True)};border-radius:.2em">{part}</mrow>')


def matrix(
    rows: Sequence[Sequence[MathML]],
    width: float | None = None,
    marks: Mapping[tuple[int, int], str] | None = None,
) -> MathML:
    """A matrix in square brackets; a vector is a matrix of one column.

    Args:
        rows: its entries.
        width: of each column in em, entries flush right: numbers that change then never move. None: as wide as
            the entries need, centred.
        marks: ground colours (CSS) of entries, by row and column from 0.
    """
    align = "center" if width is None else "right"
    size = "" if width is None else f";width:{width:g}em;min-width:{width:g}em"
    grounds = marks or {}

    def cell(r: int, c: int, entry: MathML) -> str:
        paint = f";background:{escape(grounds[r, c], quote=True)}" if (r, c) in grounds else ""
        # Chromium aligns no mathematics in a cell, but it does align HTML within text within a cell.
        return (
            f'<mtd style="padding:.12em .22em{size}{paint}"><mtext style="display:block">'
            f'<span style="display:block;text-align:{align}"><math>{entry}</math></span></mtext></mtd>'
        )

    body = "".join(
        f"<mtr>{''.join(cell(r, c, entry) for c, entry in enumerate(line))}</mtr>" for r, line in enumerate(rows)
    )
    return MathML(f'<mtable style="{_BRACKETS}">{body}</mtable>')
