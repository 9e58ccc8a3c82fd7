"""Expressions as MathML and LaTeX, by a walk over their tree.

Both take the names apart alike: c23 is c with the index 23, n_x' is n with the index x and a prime. A prime marks
what is seen from a frame further out, x4_y the y coordinate of the x axis of frame 4.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from html import escape

from app.equations.expression import Expression, Name, Negative, Number, Product, Sum, terms

INVISIBLE_TIMES = "\u2062"
GREEK = {"α": r"\alpha", "β": r"\beta", "θ": r"\theta"}

_NAME = re.compile(r"([A-Za-zθ])(.*?)('*)")
_INDEX = re.compile(r"[αβθ]|\d+|[a-z]|[-+,]")


@dataclass(frozen=True, slots=True)
class Glyphs:
    """How a name is written: letter, index in parts, number of primes."""

    letter: str
    index: tuple[str, ...]
    primes: int


def glyphs(name: str) -> Glyphs:
    """A name taken apart; raises ValueError for one that is not of our making."""
    found = _NAME.fullmatch(name)
    if found is None:
        raise ValueError(f"not a name of an equation: {name!r}")
    letter, index, primes = found.groups()
    parts = tuple(_INDEX.findall(re.sub(r"(?<=\d)_", ",", index)))
    return Glyphs(letter, parts, len(primes))


def mathml(expression: Expression, left: str = "") -> str:
    """A whole ``<math>`` element; with `left`, an equation of that name."""
    return _math(_mathml_left(left) + _mathml(expression))


def mathml_inside(expression: Expression) -> str:
    """The pieces of a formula, without ``<math>`` around them."""
    return f"<mrow>{_mathml(expression)}</mrow>"


def mathml_signed(term: Expression) -> str:
    """A whole ``<math>`` element with one term, its sign always written."""
    return _math(f'<mo form="prefix">{"−" if _minus(term) else "+"}</mo>{_mathml(_positive(term))}')


def mathml_name(name: str) -> str:
    """A whole ``<math>`` element with nothing but a name."""
    return _math(_mathml_name(name))


def mathml_terms(expression: Expression, left: str = "") -> list[str]:
    """The same as `mathml`, as one element per term, so that a page can break the line between them."""
    out = []
    for i, term in enumerate(terms(expression)):
        start = (_mathml_left(left) if left else "") if i == 0 else ("" if _minus(term) else "<mo>+</mo>")
        # The sign of the first term has no left neighbour, and without a form it would be spaced as if it had.
        form = "prefix" if i == 0 else "infix"
        sign = f'<mo form="{form}">−</mo>' if _minus(term) else ""
        out.append(_math(start.replace("<mo>+", '<mo form="infix">+') + sign + _mathml(_positive(term))))
    return out


def latex(expression: Expression, left: str = "") -> str:
    """LaTeX for math mode; with `left`, an equation of that name."""
    return (f"{latex_name(left)} = " if left else "") + _latex(expression)


def latex_name(name: str) -> str:
    """A name in LaTeX."""
    given = glyphs(name)
    index = "".join(GREEK.get(part, part) for part in given.index)
    letter = GREEK.get(given.letter, given.letter)
    return letter + "'" * given.primes + (f"_{{{index}}}" if index else "")


def _math(content: str) -> str:
    return f'<math xmlns="http://www.w3.org/1998/Math/MathML"><mrow>{content}</mrow></math>'


def _mathml_left(name: str) -> str:
    return f"{_mathml_name(name)}<mo>=</mo>" if name else ""


def _minus(term: Expression) -> bool:
    return isinstance(term, Negative)


def _positive(term: Expression) -> Expression:
    return term.of if isinstance(term, Negative) else term


def _mathml(expression: Expression) -> str:
    match expression:
        case Name(id=name):
            return _mathml_name(name)
        case Number(value=number):
            return f"<mn>{number}</mn>"
        case Negative(of=inner):
            return f'<mo form="prefix">−</mo>{_mathml_factor(inner)}'
        case Product(factors=factors):
            return f"<mo>{INVISIBLE_TIMES}</mo>".join(map(_mathml_factor, factors))
        case Sum(terms=parts):
            out = _mathml(parts[0])
            for part in parts[1:]:
                out += f"<mo>{'−' if _minus(part) else '+'}</mo>{_mathml(_positive(part))}"
            return out


def _mathml_factor(expression: Expression) -> str:
    inside = _mathml(expression)
    if isinstance(expression, Sum | Negative):
        return f'<mrow><mo stretchy="false">(</mo>{inside}<mo stretchy="false">)</mo></mrow>'
    return inside


def _mathml_name(name: str) -> str:
    given = glyphs(name)
    letter = f"<mi>{escape(given.letter)}</mi>"
    marks = f"<mo>{'′' * given.primes}</mo>" if given.primes else ""
    parts = "".join(_mathml_index(part) for part in given.index)
    index = f"<mrow>{parts}</mrow>" if len(given.index) > 1 else parts
    if index and marks:
        return f"<msubsup>{letter}{index}{marks}</msubsup>"
    if index:
        return f"<msub>{letter}{index}</msub>"
    return f"<msup>{letter}{marks}</msup>" if marks else letter


def _mathml_index(part: str) -> str:
    if part.isdigit():
        return f"<mn>{part}</mn>"
    if part in "+-,":
        return f"<mo>{part.replace('-', '−')}</mo>"
    return f"<mi>{part}</mi>"


def _latex(expression: Expression) -> str:
    match expression:
        case Name(id=name):
            return latex_name(name)
        case Number(value=number):
            return str(number)
        case Negative(of=inner):
            return "-" + _latex_factor(inner)
        case Product(factors=factors):
            return r" \, ".join(map(_latex_factor, factors))
        case Sum(terms=parts):
            out = _latex(parts[0])
            for part in parts[1:]:
                out += f" {'-' if _minus(part) else '+'} {_latex(_positive(part))}"
            return out


def _latex_factor(expression: Expression) -> str:
    inside = _latex(expression)
    return rf"\left({inside}\right)" if isinstance(expression, Sum | Negative) else inside
