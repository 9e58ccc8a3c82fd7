r"""Numbers as files and programs write them, in ASCII digits.

Python's `int`, `float`, `str.isdecimal` and regular expressions take the digits of every script, and `int` fails
beyond 4300 of them. Numbers that people type are read by :mod:`kin.typed`, which translates other digits.
"""

from __future__ import annotations

import math
import re

LARGEST = 1e6  # metres, radians, N·m: a number in a file is smaller
LONGEST = 60  # characters
NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"  # each text matches in one way only
_NUMBER = re.compile(NUMBER)
_DIGITS = re.compile(r"[0-9]{1,15}")
_INFINITE = re.compile(r"[-+]?inf(?:inity)?", re.IGNORECASE)


def number_of(text: str) -> float:
    """The number that a text is, ±inf included; nan if it is none, or has more than `LONGEST` characters."""
    text = text.strip()
    known = len(text) <= LONGEST and (_NUMBER.fullmatch(text) or _INFINITE.fullmatch(text))
    return float(text) if known else math.nan


def index_of(text: object, count: int) -> int | None:
    """The number from 0 to `count` − 1 whose digits a text is; None if it is none of them."""
    if not isinstance(text, str) or not _DIGITS.fullmatch(text):
        return None
    index = int(text)
    return index if index < count else None


def scaled(value: float, scale: float) -> float:
    """A number in a unit as metres or radians.

    Units of length are divided by their whole number per metre: 102 mm is 0.102 m, not 0.10200000000000001 m.
    """
    per = 1.0 / scale
    return value / per if per.is_integer() else value * scale
