"""Reads a cell of the table: a number or a simple expression such as ``pi/2``, ``-90°``, ``2*0.35``, ``1/3``.

    sum      = product { ("+" | "-") product }
    product  = signed { ("*" | "/") signed }
    signed   = { "+" | "-" } measured
    measured = atom [ unit ]
    atom     = number [ "pi" ] | "pi" | "(" sum ")"

A comma is a decimal point, except where it may separate thousands.

A number without a unit is in the unit of the page. In a cell for an angle ``pi`` is in radians, whatever the unit
of the page, so that ``pi/2`` is always a right angle; in a cell for a length it is the number 3.14….
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from kin.files.numbers import scaled
from kin.units import Unit

LONGEST = 60  # characters of a cell
LARGEST = 1e6  # rad or m: as in robot files
_TOKEN = re.compile(r"\s*(?:((?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)|([a-zA-Zπ]+|°)|([-+*/()]))")
_SIGNS = str.maketrans({"−": "-", "–": "-", "×": "*", "·": "*", "÷": "/", ",": ".", "\u00a0": " ", "º": "°"})
# 1,000 may be 1000 or 1.000. Not so 0,125 or 1234,567.
_THOUSANDS = re.compile(r"(?<![\d.,])[1-9]\d{0,2}(?:,\d{3})+(?![\d,])(?:\.\d*)?", re.ASCII)
_ANGLES = {"°": math.pi / 180, "deg": math.pi / 180, "rad": 1.0}
_LENGTHS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
_EXAMPLES = {
    "°": "-90 or pi/2",
    "rad": "-1.57 or pi/2",
    "mm": "350 or 2*175",
    "cm": "35 or 70/2",
    "m": "0.35 or 0.7/2",
}
_CUT = 24  # characters of a wrong text in a message


class ExpressionError(ValueError):
    """A text that is no number; the message says what is wrong and what would be valid."""


class _Value(NamedTuple):
    """A number, and whether it has a unit: then it is in radians or metres."""

    number: float
    measured: bool = False


def read(text: str, unit: Unit, is_angle: bool) -> float:
    """The value of a text in radians or metres.

    Args:
        text: a number or an expression.
        unit: of numbers without a unit.
        is_angle: whether the cell is for an angle, else for a length.

    Raises:
        ExpressionError: with what is wrong.
    """
    example = _EXAMPLES[unit.name]
    if not text.strip():
        raise ExpressionError(f"the cell is empty; try 0, {example}")
    if len(text) > LONGEST:
        raise ExpressionError(f"“{cut(text)}” is too long; valid are {LONGEST} characters")
    if unclear := _THOUSANDS.search(text):
        number = unclear[0]
        other = f" or {number.replace(',', '.')}" if number.count(",") == 1 and "." not in number else ""
        valid = f"{cut(number.replace(',', ''))}{other}"
        raise ExpressionError(f"the comma in “{cut(number)}” may separate thousands or decimals; type {valid}")
    try:
        value = _Reader(text, unit, is_angle).read()
    except _SyntaxError as error:
        why = f" ({error})" if str(error) else ""
        raise ExpressionError(f"“{cut(text)}” is not a number{why}; try {example}") from None
    except ZeroDivisionError:
        raise ExpressionError(f"“{cut(text)}” divides by zero; try {example}") from None
    if not abs(value) < LARGEST:
        raise ExpressionError(f"“{cut(text)}” is too large; try {example}")
    return value + 0.0  # no −0


def cut(text: str) -> str:
    """The beginning of a typed text, for a message: without line breaks and invisible characters."""
    text = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return text if len(text) <= _CUT else text[: _CUT - 1] + "…"


class _SyntaxError(Exception):
    """The text does not follow the grammar."""


class _Reader:
    """A recursive-descent reader. Its depth is bounded by the length of the text."""

    def __init__(self, text: str, unit: Unit, is_angle: bool) -> None:
        self._scale = math.pi / 180 if unit.name == "°" else 1.0 / unit.scale
        self._is_angle = is_angle
        self._units = _ANGLES if is_angle else _LENGTHS
        self._tokens = _tokens(text.translate(_SIGNS).strip())

    def read(self) -> float:
        value = self._in_si(self._sum())
        if self._tokens:
            raise self._unexpected()
        return value.number

    def _next(self, *valid: str) -> str | None:
        """Take the next token if it is one of these."""
        return self._tokens.pop(0) if self._tokens and self._tokens[0] in valid else None

    def _unexpected(self) -> _SyntaxError:
        word = self._tokens[0] if self._tokens else ""
        return _SyntaxError(f"unknown: {cut(word)}" if word.isalpha() and word not in ("pi", "π") else "")

    def _in_si(self, value: _Value) -> _Value:
        return value if value.measured else _Value(scaled(value.number, self._scale), True)

    def _sum(self) -> _Value:
        value = self._product()
        while operator := self._next("+", "-"):
            other = self._product()
            if value.measured or other.measured:
                value, other = self._in_si(value), self._in_si(other)
            value = value._replace(number=value.number + (other.number if operator == "+" else -other.number))
        return value

    def _product(self) -> _Value:
        value = self._signed()
        while operator := self._next("*", "/"):
            other = self._signed()
            if other.measured and (value.measured or operator == "/"):
                raise _SyntaxError("units do not cancel here")
            number = value.number * other.number if operator == "*" else value.number / other.number
            value = _Value(number, value.measured or other.measured)
        return value

    def _signed(self) -> _Value:
        sign = 1.0
        while operator := self._next("+", "-"):
            sign = -sign if operator == "-" else sign
        value = self._measured()
        return value._replace(number=sign * value.number)

    def _measured(self) -> _Value:
        value = self._atom()
        if unit := self._next(*self._units):
            if value.measured:
                raise _SyntaxError("a unit after a unit")
            value = _Value(scaled(value.number, self._units[unit]), True)
        return value

    def _atom(self) -> _Value:
        if self._next("("):
            value = self._sum()
            if not self._next(")"):
                raise _SyntaxError("a bracket is open")
            return value
        number = 1.0
        if written := bool(self._tokens) and self._tokens[0][0] in "0123456789.":
            number = float(self._tokens.pop(0))
        if self._next("pi", "π"):
            return _Value(number * math.pi, self._is_angle)
        if not written:
            raise self._unexpected()
        return _Value(number)


def _tokens(text: str) -> list[str]:
    found, at = [], 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise _SyntaxError
        number, word, sign = match.groups()
        found.append(number or (word or "").lower() or sign)
        at = match.end()
    return found
