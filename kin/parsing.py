"""Readers of JSON, TOML and CSV whose time and memory are bounded whatever a text contains; the writer of TOML.

The parsers of the standard library bound neither. `json.loads` runs in C and lets no other thread of the process
run before it has finished, and sixteen megabytes of nested lists take it half a minute. `tomllib` needs time and
memory that grow with the square of the parts of a dotted key. A row of a CSV file may have as many cells as the
file has commas.

So the texts are measured first, in linear time, by what is left of them without strings and comments: the marks
that separate values (commas, colons, equals signs, opening brackets), and how deep brackets and dotted keys are
nested. A parser stops at the first error of a text, and up to there both see the same structure.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from itertools import accumulate
from typing import Any, Final, NamedTuple

import tomli_w

from kin.errors import shorten


class Limits(NamedTuple):
    """What a text may have.

    Attributes:
        size: characters; bytes, if it is read from bytes.
        values: numbers, texts, lists and tables, counted by the marks between them.
        depth: lists and tables within each other, and parts of a dotted key.
    """

    size: int
    values: int
    depth: int = 32


class TextError(ValueError):
    """A text exceeds a limit, or has a syntax error.

    Attributes:
        value, expected: what was given and what would be valid, as `kin.InputError` takes them.
        syntax: whether it is no text of its format, rather than beyond a limit.
    """

    def __init__(self, value: str, expected: str, syntax: bool = False) -> None:
        super().__init__(f"{value}, expected {expected}")
        self.value, self.expected, self.syntax = value, expected, syntax


# The end of a string is optional: an open one must not be searched again from each quotation mark within it.
_JSON_STRING = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"?', re.DOTALL)
_TOML_STRING = re.compile(
    r'"""(?:[^"\\]++|\\.|"{1,2}(?!"))*+"{0,5}'
    r"|'''(?:[^']++|'{1,2}(?!'))*+'{0,5}"
    r'|"(?:[^"\\\n]++|\\[^\n])*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
# A list of numbers and texts as tomli_w writes it: each on a line of its own.
_TOML_LIST = re.compile(r"\[\n((?: +[^\s\[{\]][^\n]*,\n)+) *\]")
_LONGEST_LINE = 100  # characters, as in tomli_w
_NO_BRACKETS = re.compile(r"[^][{}]++")
_STEPS = {"[": 1, "{": 1, "]": -1, "}": -1}


def read_json(text: str | bytes, limits: Limits, finite: bool = False) -> Any:
    """The value of a JSON text.

    Args:
        text: a text, or its bytes in UTF-8; a byte order mark is skipped.
        limits: what it may have.
        finite: refuse ``NaN`` and ``Infinity``, which are no JSON, but which Python reads, and what is beyond the
            range of floats.

    Raises:
        TextError: it exceeds a limit, or is no JSON.
    """
    given = _decoded(text, limits, "JSON").removeprefix("\ufeff")
    _measure(_JSON_STRING.sub("_", given), ",:[{", limits)
    try:
        return json.loads(given, **(_FINITE if finite else {}))
    except (ValueError, RecursionError) as error:  # an integer of too many digits is a ValueError
        raise TextError(str(error), "valid JSON", syntax=True) from None


def read_toml(text: str | bytes, limits: Limits) -> dict[str, Any]:
    """The table of a TOML text.

    Args:
        text: a text, or its bytes in UTF-8; a byte order mark is skipped.
        limits: what it may have.

    Raises:
        TextError: it exceeds a limit, or is no TOML.
    """
    given = _decoded(text, limits, "TOML").removeprefix("\ufeff")
    bare = _TOML_STRING.sub("_", given)
    _measure(bare, ",=[{", limits)
    if re.search(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{limits.depth}}}", bare):
        raise TextError(f"a key of more than {limits.depth} parts", f"at most {limits.depth} parts")
    try:
        return tomllib.loads(given)
    except (ValueError, RecursionError) as error:
        raise TextError(str(error), "valid TOML", syntax=True) from None


def to_toml(data: Mapping[str, Any]) -> str:
    """The TOML text of a table; short lists, such as limits and positions, on one line."""
    return _TOML_LIST.sub(_on_one_line, tomli_w.dumps(data))


def has_comments(text: str) -> bool:
    """Whether a TOML text has comments, which are lost when its data is written again."""
    return any(found[0].startswith("#") for found in _TOML_STRING.finditer(text))


def _on_one_line(found: re.Match[str]) -> str:
    line = "[" + ", ".join(item.strip()[:-1] for item in found[1][:-1].split("\n")) + "]"
    return line if len(line) <= _LONGEST_LINE else found[0]


def read_csv(data: bytes, limits: Limits) -> Iterator[tuple[int, list[str]]]:
    """The rows of a CSV file in UTF-8, each with the number of its last line, from 1.

    Args:
        data: a file; a byte order mark is skipped.
        limits: `size` of the file, `values` are the characters of a row.

    Raises:
        TextError: it exceeds a limit, or is no CSV.
    """
    lines, taken = io.StringIO(_decoded(data, limits, "CSV").removeprefix("\ufeff"), newline=""), 0

    def bounded() -> Iterator[str]:  # a row within quotation marks goes over many lines
        nonlocal taken
        while line := lines.readline(limits.values + 1):
            taken += len(line)
            if taken > limits.values:
                raise TextError(
                    f"a row of more than {limits.values} characters", f"at most {limits.values} characters"
                )
            yield line

    rows = csv.reader(bounded(), strict=True)
    try:
        for row in rows:
            taken = 0
            yield rows.line_num, row
    except csv.Error as error:
        raise TextError(str(error), "valid CSV", syntax=True) from None


def _decoded(text: str | bytes, limits: Limits, kind: str) -> str:
    if len(text) > limits.size:
        unit = "characters" if isinstance(text, str) else "bytes"
        raise TextError(f"{len(text)} {unit}", f"at most {limits.size} {unit}")
    try:
        return text if isinstance(text, str) else text.decode()
    except UnicodeDecodeError as error:
        raise TextError(str(error), f"{kind} in UTF-8", syntax=True) from None


def _measure(bare: str, marks: str, limits: Limits) -> None:
    """Raises `TextError` for too many values, or brackets within each other, in a text without strings."""
    if max(sum(map(bare.count, marks)), bare.count("]") + bare.count("}")) > limits.values:
        raise TextError(f"more than {limits.values} values", f"at most {limits.values} values")
    steps = map(_STEPS.__getitem__, _NO_BRACKETS.sub("", bare))
    if max(accumulate(steps), default=0) > limits.depth:
        raise TextError(f"nested more than {limits.depth} deep", f"at most {limits.depth} deep")


def _refuse(constant: str) -> float:
    raise ValueError(f"{shorten(constant)} is no finite number")


def _finite(text: str) -> float:
    return value if math.isfinite(value := float(text)) else _refuse(text)


_FINITE: Final[dict[str, Any]] = {"parse_constant": _refuse, "parse_float": _finite}
