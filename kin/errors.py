"""Exceptions for invalid input, and the checks of numbers and choices that raise them.

A problem without a solution is not an error: it gives a result with a status and a reason. Invalid input raises.
Every message names the field, the value and what would be valid, so it can be shown to people as it is.
"""

from __future__ import annotations

import math
from numbers import Integral, Real
from reprlib import Repr


class KinematicsError(ValueError):
    """Base class of all errors raised by `kin`."""


class InputError(KinematicsError):
    """An argument is invalid.

    Attributes:
        field: name of the argument, e.g. ``"q[2]"``.
        value: the given value, shortened for display.
        expected: what would be valid.
    """

    def __init__(self, field: str, value: object, expected: str) -> None:
        self.field = field
        self.value = shorten(value)
        self.expected = expected
        super().__init__(f"{field}: got {self.value}, expected {expected}")

    def renamed(self, field: str) -> InputError:
        """The same error under another field."""
        made = InputError(field, None, self.expected)
        made.value = self.value
        made.args = (f"{field}: got {self.value}, expected {self.expected}",)
        return made

    def within(self, place: str) -> InputError:
        """The same error with its field as a part of `place`."""
        return self.renamed(f"{place}{self.field}" if self.field.startswith("[") else f"{place}.{self.field}")


class RobotFileError(KinematicsError):
    """A robot file is invalid; the message names the file, the field, the value and what would be valid."""

    def __init__(self, file: str, field: str, value: object, expected: str) -> None:
        self.file = file
        self.field = field
        self.value = shorten(value)
        self.expected = expected
        super().__init__(f"{file}: {field}: got {self.value}, expected {expected}")


class UnknownRobotError(KinematicsError):
    """No robot has this id; the message lists the valid ids."""

    def __init__(self, robot_id: str, robot_ids: tuple[str, ...]) -> None:
        self.robot_id = robot_id
        self.robot_ids = robot_ids
        super().__init__(f"robot: got {shorten(robot_id)}, expected one of {', '.join(robot_ids)}")


def shorten(value: object, length: int = 80) -> str:
    """`repr` of any value, cut to a length that fits a message.

    Only the first items of a container are read, so huge or deeply nested values cost little.
    """
    try:
        text = _REPR.repr(value)
    except ValueError:  # an integer with more digits than Python converts to text
        text = f"<{type(value).__name__} too long to print>"
    return text if len(text) <= length else text[: length - 1] + "…"


_REPR = Repr()
_REPR.maxlist = _REPR.maxtuple = _REPR.maxdict = _REPR.maxset = 40
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = 200


def finite_number(field: str, value: object, expected: str = "a finite number") -> float:
    """A finite number as a float; raises `InputError` naming the field."""
    try:
        number = math.nan if isinstance(value, bool) or not isinstance(value, Real) else float(value)
    except OverflowError:  # an integer beyond the largest float
        number = math.inf
    if not math.isfinite(number):
        raise InputError(field, value, expected)
    return number


def whole_number(field: str, value: object, least: int, most: int) -> int:
    """A whole number within bounds; raises `InputError` naming the field."""
    if isinstance(value, bool) or not isinstance(value, Integral) or not least <= int(value) <= most:
        raise InputError(field, value, f"a whole number from {least} to {most}")
    return int(value)


def one_of(*choices: str) -> str:
    """What is valid where one of these texts is."""
    return "one of " + ", ".join(f'"{choice}"' for choice in choices)
