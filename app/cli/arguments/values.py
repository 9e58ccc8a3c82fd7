"""Names and plain numbers as they are typed on the command line.

Other numbers stay texts here: their units depend on the arm, and `app.cli.terminal` reads them.
"""

from __future__ import annotations

import argparse


def whole_number(text: str) -> int:
    """A whole number in digits."""
    return int(_ascii(text.replace("−", "-")))


def count(text: str) -> int:
    """A whole number, which may be written as 1e6."""
    value = float(_ascii(text))
    if not value.is_integer():
        raise ValueError
    return int(value)


def positive(text: str) -> float:
    """A number above 0."""
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise ValueError
    return value


def _ascii(text: str) -> str:
    if not text.isascii():  # Python takes the digits of every script
        raise ValueError
    return text


def named(text: str) -> tuple[str, list[str]]:
    """``NAME=VALUE:VALUE…``; the name is empty if there is none."""
    name, _, values = text.rpartition("=")
    return name.strip(), values.split(":")


def workpiece(text: str) -> tuple[str, list[str]]:
    """``NAME=X:Y:Z`` or ``NAME=X:Y:Z:ROLL:PITCH:YAW``."""
    name, _, values = text.rpartition("=")
    if not name.strip() or len(values.split(":")) not in (3, 6):
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=X:Y:Z or NAME=X:Y:Z:ROLL:PITCH:YAW")
    return name.strip(), frame(values)


def frame(text: str) -> list[str]:
    """``X:Y:Z`` or ``X:Y:Z:ROLL:PITCH:YAW``, as six texts."""
    values = text.split(":")
    if len(values) not in (3, 6):
        raise argparse.ArgumentTypeError(f"{text!r} is not X:Y:Z or X:Y:Z:ROLL:PITCH:YAW")
    return [*values, "0", "0", "0"][:6]


# argparse reports "invalid <name> value".
whole_number.__name__ = count.__name__ = "whole number"
positive.__name__ = "number above 0"
