"""Numbers and choices that callers give, checked: an error names the field, the value and what is valid."""

from __future__ import annotations

import math
from numbers import Integral, Real

from kin.errors import InputError


def finite_number(field: str, value: object) -> float:
    """A finite number as a float; raises `InputError` naming the field."""
    try:
        number = math.nan if isinstance(value, bool) or not isinstance(value, Real) else float(value)
    except OverflowError:  # an integer beyond the largest float
        number = math.inf
    if not math.isfinite(number):
        raise InputError(field, value, "a finite number")
    return number


def whole_number(field: str, value: object, least: int, most: int) -> int:
    """A whole number within bounds; raises `InputError` naming the field."""
    if isinstance(value, bool) or not isinstance(value, Integral) or not least <= int(value) <= most:
        raise InputError(field, value, f"a whole number from {least} to {most}")
    return int(value)


def one_of(*choices: str) -> str:
    """What is valid where one of these texts is."""
    return "one of " + ", ".join(f'"{choice}"' for choice in choices)
