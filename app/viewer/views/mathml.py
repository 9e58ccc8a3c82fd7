"""Typeset mathematics for the panel, as MathML, which browsers render natively.

Each function wraps pieces of markup. A leaf (`ident`, `text`, `op`, `number`) takes plain text and escapes it; all
others take and return :data:`MathML`, so that a type checker keeps the two apart. `math` completes a formula, for
a template or an HTML element of viser.

>>> math(sub(ident("T"), text("02")), op("="), number(-1, 0))[:26]
'<math style="font-size:1em'

Brackets do not stretch with the fonts of most machines: `matrix` draws its own, as borders.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import NewType

from markupsafe import Markup

from kin.units import fixed

MathML = NewType("MathML", str)

# A bracket is a border with two serifs, short lines drawn as gradients in the text colour.
_SERIFS = ",".join(
    f"linear-gradient(currentColor,currentColor) {corner}/.3em .09em no-repeat"
    for corner in ("left top", "left bottom", "right top", "right bottom")
)
_BRACKETS = (
    "border-left:.09em solid currentColor;border-right:.09em solid currentColor;"
    f"background:{_SERIFS};border-spacing:0;padding:0 .2em"
)


def math(*parts: MathML, alt: str = "", size: float = 1.0) -> Markup:
    """A complete formula as HTML. `alt` is the text for screen readers; `size` is in em."""
    label = f' aria-label="{escape(alt, quote=True)}"' if alt else ""
    style = f"font-size:{size:g}em;font-variant-numeric:tabular-nums"
    return Markup(f'<math style="{style}"{label}>{"".join(parts)}</math>')


def ident(name: str) -> MathML:
    """A variable. A single letter is italic, as usual in mathematics, a longer name upright."""
    return MathML(f"<mi>{escape(name)}</mi>")


def text(words: str) -> MathML:
    """Upright words or labels; blanks are kept."""
    return MathML(f"<mtext>{escape(words)}</mtext>")


def op(symbol: str) -> MathML:
    """An operator or bracket, with the spacing of its kind. A hyphen becomes a minus sign."""
    shown = "−" if symbol == "-" else symbol
    return MathML(f'<mo stretchy="false">{escape(shown)}</mo>')


def number(value: float, decimals: int = 3) -> MathML:
    """`fixed` as a piece of a formula."""
    return MathML(f"<mn>{fixed(value, decimals)}</mn>")


def short(value: float, decimals: int = 3) -> MathML:
    """`number` without trailing zeros, for constants."""
    shown = fixed(value, decimals)
    return MathML(f"<mn>{shown.rstrip('0').rstrip('.') if '.' in shown else shown}</mn>")


def row(*parts: MathML) -> MathML:
    """Pieces side by side, as one piece."""
    return MathML(f"<mrow>{''.join(parts)}</mrow>")


def neg(part: MathML) -> MathML:
    """Minus a piece, with the spacing of a sign, not of a difference."""
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
    """A piece on a background of this CSS colour."""
    return MathML(f'<mrow style="background:{escape(color, quote=True)};border-radius:.2em">{part}</mrow>')


def matrix(
    rows: Sequence[Sequence[MathML]],
    width: float | None = None,
    marks: Mapping[tuple[int, int], str] | None = None,
) -> MathML:
    """A matrix in square brackets; a vector is a matrix of one column.

    Args:
        rows: its entries.
        width: of each column in em, with entries aligned right, so that changing numbers never move. None: as wide
            as the entries, centred.
        marks: background colours (CSS) of entries, by row and column from 0.
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
