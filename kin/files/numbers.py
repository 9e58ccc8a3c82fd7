"""Numbers as robot files and URDF write them."""

from __future__ import annotations

import math
import re

LARGEST = 1e6  # metres, radians, N·m: a number in a file is smaller
LONGEST = 60  # characters
NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"  # each text matches in one way only
_NUMBER = re.compile(NUMBER)
_INFINITE = re.compile(r"[-+]?inf(?:inity)?", re.IGNORECASE)


def number_of(text: str) -> float:
    """The number that a text is, ±inf included; nan if it is none, or has more than `LONGEST` characters."""
    text = text.strip()
    known = len(text) <= LONGEST and (_NUMBER.fullmatch(text) or _INFINITE.fullmatch(text))
    return float(text) if known else math.nan


def scaled(value: float, scale: float) -> float:
    """A number in a unit as metres or radians.

    Units of length are divided by their whole number per metre: 102 mm is 0.102 m, not 0.10200000000000001 m.
    """
    per = 1.0 / scale
    return value / per if per.is_integer() else value * scale
