"""Numbers that people type: one reader for the fields of the page and for the command line.

    sum      = product { ("+" | "-") product }
    product  = signed { ("*" | "/") signed }
    signed   = { "+" | "-" } measured
    measured = power [ unit ]
    power    = atom [ "^" exponent ]
    atom     = number [ "pi" ] | "pi" | "(" sum ")"

A number without a unit is in the unit of its field. In a field for an angle ``pi`` is in radians, whatever that
unit, so that ``pi/2`` is always a right angle; elsewhere it is the number 3.14…. A unit after a product is that of
the product: ``pi/2 rad``, ``3/4 m``.

A comma may be a decimal point, separate thousands, or separate the numbers of a list. Such a text is read in every
way. The way that gives a valid value for the field is taken. If several do, or only that of thousands, the text is
refused, and the error lists the ways, each written so that it can be read in one way only.
"""

from __future__ import annotations

import itertools
import math
import re
import unicodedata
from collections.abc import Callable, Iterator
from typing import NamedTuple, TypeVar

from kin.errors import KinematicsError
from kin.units import ANGLES, LENGTH_UNITS, NAMES, RADIANS, Unit, family

T = TypeVar("T")

LONGEST = 100  # characters of a number
LONGEST_LIST = 2000  # characters of a list of numbers
_DEEPEST = 20  # brackets within each other
_CUT = 24  # characters of a wrong text in a message
_READING = 100  # characters of a reading in a message
# An angle of 1000° or a length of 1000 m is no reading of a comma: 1,250 m is 1.25 m.
_MOST_TURN, _MOST_LENGTH = math.radians(1000.0), 1000.0

_NUMBER = r"(?:\d+(?:_\d+)*\.?(?:\d+(?:_\d+)*)?|\.\d+)(?:e[+-]?\d+)?"
_WORD = r"[a-zµ]+|°|π"
_SIGN = r"\*\*|[-+*/^()]"
_PARTS = re.compile(rf"(\s*)({_NUMBER}|{_WORD}|{_SIGN}|[,;|\[\]{{}}])")
_SIGNS = {
    **dict.fromkeys("−–‐‑‒﹣", "-"),
    **dict.fromkeys("×·⋅∙∗", "*"),
    **dict.fromkeys("÷∕⁄", "/"),
    **dict.fromkeys("º˚", "°"),
    **dict.fromkeys("\u200b\u2060\ufeff", ""),  # no width
    "٫": ".",
}
_RAISED = str.maketrans("⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "+-0123456789")
_POWER = re.compile("[⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+")
_GROUPED = re.compile(r"(?<=[0-9])[\u2009\u202f](?=[0-9]{3}(?![0-9]))")  # as `kin.units.grouped` writes it
_WORDS = {"pi", "π", *ANGLES, *LENGTH_UNITS}  # in a list
_ARRAY = re.compile(r"\b(?:(?:np|numpy)\.)?array\b")
_DECIMAL = re.compile(r",(?=[0-9])")
_THOUSANDS = re.compile(r"(?<![0-9.,])[1-9][0-9]{0,2}(?:,[0-9]{3})+(?![0-9,])")  # 1,000; not 0,125 or 1234,567
# 1.234,5 or 1.234.567
_POINTS = re.compile(r"(?<![0-9.,])[1-9][0-9]{0,2}(?:(?:\.[0-9]{3})+,[0-9]+|(?:\.[0-9]{3}){2,})(?![0-9.,])")
_EXAMPLES = {
    "°": "-90 or pi/2",
    "rad": "-1.57 or pi/2",
    "mm": "350 or 2*175",
    "cm": "35 or 70/2",
    "m": "0.35 or 0.7/2",
}


class ReadError(KinematicsError):
    """A typed text has no value, or more than one.

    Attributes:
        reason: what is wrong, without what would be valid; it begins with a small letter or a quotation mark.
        readings: texts that may have been meant, if the given one can be read in more than one way.
    """

    def __init__(self, reason: str, readings: tuple[str, ...] = ()) -> None:
        self.reason = reason
        self.readings = readings
        super().__init__(reason)

    @property
    def sentence(self) -> str:
        """The reason as a sentence."""
        return f"{self.reason[:1].upper()}{self.reason[1:]}."


class EntryError(ReadError):
    """A typed text has no valid value: a headline, and a sentence that says what is valid."""

    def __init__(self, title: str, detail: str, readings: tuple[str, ...] = ()) -> None:
        self.title = title
        self.detail = detail
        super().__init__(f"{title}: {detail}", readings)


def read(
    text: str, unit: Unit, limits: tuple[float, float] = (-math.inf, math.inf), largest: float = math.inf
) -> float:
    """The value of a text in radians, in metres, or in a unit that is neither of an angle nor of a length.

    Args:
        unit: of numbers without a unit.
        limits: the valid values. They decide between readings of a comma; values outside are returned too.
        largest: size above which a value is refused.

    Raises:
        ReadError: no number, or more than one reading.
    """
    if len(text) > LONGEST:
        raise ReadError(f"“{cut(text)}” is too long; valid are {LONGEST} characters")
    cleaned = clean(_GROUPED.sub("", text))
    low, high = _plausible(unit, limits)
    decimal = cleaned.replace(",", ".")
    plain = _tried(decimal, unit)
    grouped = {way: value for way in _grouped_ways(cleaned) if (value := _tried(way, unit)) is not None}
    ways = tuple(way for way, value in grouped.items() if plain is None or low <= value <= high)
    if not ways:
        value = _value(decimal, unit, text)
        if not abs(value) <= largest:
            raise ReadError(f"“{cut(text)}” is too large")
        return value + 0.0  # no −0
    readings = (decimal, *ways) if plain is not None and low <= plain <= high else ways
    shown = " or ".join(map(cut, readings))
    raise ReadError(f"“{cut(text)}” may be written with thousands or with decimals; type {shown}", readings)


def read_element(text: str, unit: Unit) -> float:
    """The value of one of `elements`, in radians, metres or the unit itself; raises `ReadError`."""
    return _value(text, unit, text)


def elements(text: str) -> list[str]:
    """The texts of the numbers of a list; `read_element` reads each.

    Brackets, commas, semicolons, line breaks and spaces separate numbers. Round brackets around one number belong
    to it, as in ``2*(3+4)``. A sign with a space before it and none after it begins a number.

    Raises:
        ReadError: an unknown character, or a sign between spaces.
    """
    tokens = _tokens(_ARRAY.sub(" ", clean(text)), (), text)
    for token in tokens:
        if token.text[0].isalpha() and token.text not in _WORDS:
            raise ReadError(f"“{cut(token.text)}” is not a number")
    ends = _ends(tokens, text)
    inner = _grouping(tokens, ends)
    found = [""]
    for k, token in enumerate(tokens):
        if token.text in ",;|[]{}" or (token.text in "()" and k not in inner):
            found.append("")
            continue
        found[-1] += " " * (token.spaced and found[-1] != "") + token.text
        if k in ends:
            found.append("")
    return [text for text in found if text]


def interpret(text: str, evaluate: Callable[[str], T], same: Callable[[T, T], bool]) -> T:
    """What a text with several numbers means: the only reading of its commas that `evaluate` takes.

    Args:
        evaluate: the value of a text in which a comma only separates; raises `ReadError` for an invalid one.
        same: whether two values are the same.

    Raises:
        ReadError: of `evaluate`, or because several readings are valid.
    """
    bound(text)
    cleaned = clean(text)
    found: list[tuple[str, T]] = []
    errors: list[ReadError] = []
    for way in _list_ways(cleaned):
        try:
            found.append((way, evaluate(way)))
        except ReadError as error:
            errors.append(error)
    if not found:
        raise next((error for error in errors if error.readings), errors[0])
    first, value = found[0]
    if first != _without_thousands(cleaned) and all(same(value, other) for _, other in found[1:]):
        return value
    readings = tuple(" ".join(elements(way)) for way, _ in found)
    shown = " or as ".join(f"“{each if len(each) <= _READING else each[:_READING] + '…'}”" for each in readings)
    raise ReadError(f"“{cut(text)}” can be read as {shown}; type the one that you mean", readings)


def bound(text: str) -> None:
    """Raises `ReadError` for a text that is too long for a list of numbers."""
    if len(text) > LONGEST_LIST:
        raise ReadError(f"the text is too long; valid are {LONGEST_LIST} characters")


def unit_at_end(text: str) -> str:
    """The name of the unit that ends the text of a number or a matrix, or ""."""
    found = re.search(rf"(?:°|(?<![a-zµ])(?:{NAMES}))$", text)
    return found[0] if found else ""


def example(unit: Unit) -> str:
    """Two texts that are valid in a field with this unit."""
    return _EXAMPLES.get(unit.name, "12.5 or 1/3")


def valid(unit: Unit) -> str:
    """What is valid in a field with this unit."""
    names = [name for name in family(unit) if name]
    return f"a number such as {example(unit)}" + (f"; units: {', '.join(names)}" if names else "")


def cut(text: str) -> str:
    """The beginning of a typed text, for a message: without line breaks and invisible characters."""
    text = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return text if len(text) <= _CUT else text[: _CUT - 1] + "…"


def _plausible(unit: Unit, limits: tuple[float, float]) -> tuple[float, float]:
    most = _MOST_TURN if unit.is_angle else _MOST_LENGTH if unit.is_length else math.inf
    return max(limits[0], math.nextafter(-most, 0.0)), min(limits[1], math.nextafter(most, 0.0))


def _grouped_ways(text: str) -> Iterator[str]:
    """The readings of a number in which commas or points separate thousands."""
    for pattern, mark in ((_THOUSANDS, ","), (_POINTS, ".")):
        if pattern.search(text):
            yield "".join(_without(mark, pattern, text)).replace(",", ".")


def _list_ways(text: str) -> Iterator[str]:
    """The readings of the commas in a list, each as a text in which a comma only separates."""
    decimal = _DECIMAL.sub(".", text)
    may_be_decimal = decimal != text and not re.search(r"[0-9]\.|\.[0-9]", text)  # nobody writes both
    if not (may_be_decimal and _one_per_cell(decimal)):
        yield text
    if may_be_decimal:
        yield decimal
    if (grouped := _without_thousands(text)) is not None:
        yield grouped


def _one_per_cell(text: str) -> bool:
    """Whether semicolons alone separate the numbers of a list."""
    try:
        return ";" in text and all(len(elements(cell)) == 1 for cell in text.split(";"))
    except ReadError:
        return False


def _without_thousands(text: str) -> str | None:
    """A list without commas that may separate thousands; None if there are none."""
    return "".join(_without(",", _THOUSANDS, text)) if _THOUSANDS.search(text) else None


def _without(mark: str, pattern: re.Pattern[str], text: str) -> Iterator[str]:
    """The parts of a text, without this character inside what the pattern finds."""
    at = 0
    for found in pattern.finditer(text):
        yield text[at : found.start()]
        yield found[0].replace(mark, "")
        at = found.end()
    yield text[at:]


def clean(text: str) -> str:
    """A text in lower-case ASCII, as far as its characters have a counterpart there."""
    text = _POWER.sub(lambda raised: "^" + raised[0].translate(_RAISED), text)
    return "".join(map(_plain, text)).lower().strip()


def _plain(character: str) -> str:
    if character in _SIGNS:
        return _SIGNS[character]
    if "\uff01" <= character <= "\uff5e":  # full width
        return chr(ord(character) - 0xFEE0)
    if character.isdecimal():
        return str(unicodedata.decimal(character))
    return " " if character.isspace() else character


class _Token(NamedTuple):
    text: str
    spaced: bool  # a space is before it

    @property
    def is_number(self) -> bool:
        return self.text[0] in "0123456789."

    @property
    def begins(self) -> bool:
        """Whether a number may begin here."""
        return self.is_number or self.text in ("pi", "π", "(")

    @property
    def ends(self) -> bool:
        """Whether a number may end here."""
        return self.is_number or self.text == ")" or self.text[0].isalpha() or self.text == "°"


def _tokens(text: str, units: tuple[str, ...], typed: str) -> list[_Token]:
    """The parts of a cleaned text; `units`: names that are one part although they contain other signs."""
    compound = "|".join(re.escape(name) for name in sorted(units, key=len, reverse=True))
    pattern = re.compile(rf"(\s*)((?:{compound})(?![a-zµ]))") if units else None
    found, at, depth = [], 0, 0
    while at < len(text):
        match = (pattern.match(text, at) if pattern else None) or _PARTS.match(text, at)
        if match is None:
            raise ReadError(f"“{cut(typed)}” is not a number")
        found.append(_Token(match[2], bool(match[1])))
        depth = max(0, depth + (match[2] == "(") - (match[2] == ")"))
        if depth > _DEEPEST:
            raise ReadError(f"“{cut(typed)}” is not a number (more than {_DEEPEST} open brackets)")
        at = match.end()
    return found


def _ends(tokens: list[_Token], text: str) -> set[int]:
    """The indices of tokens after which the next number of a list begins without a comma or bracket."""
    found = set()
    for k, (left, right) in enumerate(itertools.pairwise(tokens)):
        if not (left.ends and right.spaced):
            continue
        if right.text in ("+", "-"):
            after = tokens[k + 2] if k + 2 < len(tokens) else None
            if after is not None and after.spaced:
                pair = f"{left.text} {right.text} {after.text}"
                raise ReadError(
                    f"“{pair}” in “{cut(text)}” may be one number or two; type ({pair}) or "
                    f"{left.text} {right.text}{after.text}"
                )
            found.add(k)
        elif right.begins:
            found.add(k)
    return found


def _grouping(tokens: list[_Token], ends: set[int]) -> set[int]:
    """The indices of round brackets that are part of one number; the others separate."""
    found: set[int] = set()
    opened: list[int] = []
    for k, token in enumerate(tokens):
        if token.text == "(":
            opened.append(k)
        elif token.text == ")" and opened:
            start = opened.pop()
            within = range(start + 1, k)
            if not any(i in ends or tokens[i].text in ",;|[]{}" for i in within) and k > start + 1:
                found |= {start, k}
    return found


_BARE, _OF_PI, _MEASURED = range(3)  # in the unit of the field; radians because of pi; has a unit


class _Value(NamedTuple):
    number: float  # in radians or metres unless it is bare
    state: int = _BARE
    written: tuple[float, Unit] | None = None  # a number directly followed by a unit


def _value(text: str, unit: Unit, typed: str) -> float:
    """The value of a cleaned text without commas; raises `ReadError`."""
    if not text:
        raise ReadError("the field is empty")
    try:
        value = _Reader(text, unit, typed).read()
    except _SyntaxError as error:
        raise ReadError(f"“{cut(typed)}” is not a number" + (f" ({error})" if str(error) else "")) from None
    except ZeroDivisionError:
        raise ReadError(f"“{cut(typed)}” divides by zero") from None
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise ReadError(f"“{cut(typed)}” is too large")
    return value


def _tried(text: str, unit: Unit) -> float | None:
    """The value of a cleaned text without commas; None if it has none."""
    try:
        return _value(text, unit, text)
    except ReadError:
        return None


class _SyntaxError(Exception):
    """The text does not follow the grammar."""


class _Reader:
    """A recursive-descent reader; `_DEEPEST` bounds its depth."""

    def __init__(self, text: str, unit: Unit, typed: str) -> None:
        self._unit, self._typed = unit, typed
        self._units = {clean(name): each for name, each in family(unit).items()}
        compound = tuple(name for name in self._units if name and not re.fullmatch(_WORD, name))
        self._tokens = [token.text for token in _tokens(text, compound, typed)]

    def read(self) -> float:
        value = self._in_si(self._sum())
        if self._tokens:
            raise self._unexpected()
        return value.number

    def _next(self, *wanted: str) -> str | None:
        """Take the next token if it is one of these."""
        return self._tokens.pop(0) if self._tokens and self._tokens[0] in wanted else None

    def _unexpected(self) -> Exception:
        word = self._tokens[0] if self._tokens else ""
        if not (word.isalpha() or word == "°") or word in ("pi", "π"):
            return _SyntaxError()
        if word in (*ANGLES, *LENGTH_UNITS, "s"):
            what = "an angle" if self._unit.is_angle else "a length" if self._unit.is_length else "this number"
            names = ", ".join(filter(None, family(self._unit))) or "none"
            return ReadError(f"“{word}” in “{cut(self._typed)}” is not a unit of {what}; units: {names}")
        return _SyntaxError(f"unknown: {cut(word)}")

    def _in_si(self, value: _Value) -> _Value:
        return _Value(self._unit.read(value.number), _MEASURED) if value.state == _BARE else value

    def _sum(self) -> _Value:
        value = self._product()
        while operator := self._next("+", "-"):
            other = self._product()
            if value.state or other.state:
                value, other = self._in_si(value), self._in_si(other)
            number = value.number + (other.number if operator == "+" else -other.number)
            value = _Value(number, max(value.state, other.state))
        return value

    def _product(self) -> _Value:
        value = self._signed()
        while operator := self._next("*", "/"):
            other = self._signed()
            state = max(value.state, other.state)
            if other.written and (value.state == _BARE or (value.state == _OF_PI and other.written[1] is RADIANS)):
                number = _combined(value.number, operator, other.written[0])
                value = _Value(other.written[1].read(number), state)
            elif other.state and (value.state or operator == "/"):
                raise _SyntaxError("units do not cancel here")
            else:
                value = _Value(_combined(value.number, operator, other.number), state)
        return value

    def _signed(self) -> _Value:
        sign = 1.0
        while operator := self._next("+", "-"):
            sign = -sign if operator == "-" else sign
        number, state, written = self._measured()
        return _Value(sign * number, state, None if written is None else (sign * written[0], written[1]))

    def _measured(self) -> _Value:
        value = self._power()
        if name := self._next(*self._units):
            unit = self._units[name]
            if value.state == _MEASURED or (value.state == _OF_PI and unit is not RADIANS):
                raise _SyntaxError("a unit after a unit")
            value = _Value(unit.read(value.number), _MEASURED, (value.number, unit))
        return value

    def _power(self) -> _Value:
        value = self._atom()
        if not self._next("^", "**"):
            return value
        sign = -1.0 if (self._next("+", "-") == "-") else 1.0
        if value.state or not self._tokens or not _Token(self._tokens[0], False).is_number:
            raise _SyntaxError("a power needs a number without a unit, and a number as its exponent")
        exponent = sign * float(self._tokens.pop(0))
        if value.number == 0.0 and exponent < 0.0:
            raise ZeroDivisionError
        try:
            return _Value(math.pow(value.number, exponent))
        except ValueError:
            raise _SyntaxError("a root of a negative number") from None

    def _atom(self) -> _Value:
        if self._next("("):
            value = self._sum()
            if not self._next(")"):
                raise _SyntaxError("a bracket is open")
            return value._replace(written=None)
        number = 1.0
        if written := bool(self._tokens) and _Token(self._tokens[0], False).is_number:
            number = float(self._tokens.pop(0))
        if self._next("pi", "π"):
            return _Value(number * math.pi, _OF_PI if self._unit.is_angle else _BARE)
        if not written:
            raise self._unexpected()
        return _Value(number)


def _combined(left: float, operator: str, right: float) -> float:
    return left * right if operator == "*" else left / right
