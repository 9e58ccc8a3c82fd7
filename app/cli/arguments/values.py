"""Numbers and names as they are typed on the command line."""

from __future__ import annotations

import argparse


def number(text: str) -> float:
    """A finite number; the minus sign may be the typographic one."""
    value = float(text.replace("−", "-"))
    if not abs(value) <= 1e6:
        raise argparse.ArgumentTypeError(f"{text.strip()!r} is not a number between -1e6 and 1e6")
    return value


def whole_number(text: str) -> int:
    """A whole number in digits."""
    return int(text.replace("−", "-"))


def count(text: str) -> int:
    """A whole number, which may be written as 1e6."""
    value = float(text)
    if not value.is_integer():
        raise ValueError
    return int(value)


def named_number(text: str) -> tuple[str, float]:
    """``NAME=VALUE``, or a bare value with an empty name."""
    name, _, value = text.rpartition("=")
    return name.strip(), number(value)


def named_numbers(text: str) -> tuple[str, list[float]]:
    """``NAME=VALUE:VALUE…``."""
    name, _, values = text.rpartition("=")
    return name.strip(), [number(value) for value in values.split(":")]


def workpiece(text: str) -> tuple[str, list[float]]:
    """``NAME=X:Y:Z`` or ``NAME=X:Y:Z:ROLL:PITCH:YAW``."""
    name, values = named_numbers(text)
    if not name or len(values) not in (3, 6):
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=X:Y:Z or NAME=X:Y:Z:ROLL:PITCH:YAW")
    return name, [*values, 0.0, 0.0, 0.0][:6]


# argparse reports "invalid <name> value".
whole_number.__name__ = count.__name__ = "whole number"
named_number.__name__ = named_numbers.__name__ = "value"
