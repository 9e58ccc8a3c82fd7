"""What misuse raises.

A question without an answer is a result with a status and a sentence; only misuse raises. Every error says
which field was wrong, what it was, and what would be valid, so that a message can be shown as it is.
"""

from __future__ import annotations

from reprlib import Repr


class KinematicsError(ValueError):
    """Base of all errors raised by :mod:`kin`."""


class InputError(KinematicsError):
    """A value given to a function is not usable.

    Attributes:
        field: name of the offending argument, e.g. ``"q[2]"``.
        value: what was given, shortened for display.
        expected: what would be valid.
    """

    def __init__(self, field: str, value: object, expected: str) -> None:
        self.field = field
        self.value = shorten(value)
        self.expected = expected
        super().__init__(f"{field}: got {self.value}, expected {expected}")


class RobotFileError(KinematicsError):
    """A robot description is refused: it names the file, the field, the value and what is valid."""

    def __init__(self, file: str, field: str, value: object, expected: str) -> None:
        self.file = file
        self.field = field
        self.value = shorten(value)
        self.expected = expected
        super().__init__(f"{file}: {field}: got {self.value}, expected {expected}")


class UnknownRobotError(KinematicsError):
    """No robot has this id; the message lists those that exist."""

    def __init__(self, robot_id: str, known: tuple[str, ...]) -> None:
        self.robot_id = robot_id
        self.known = known
        super().__init__(f"robot: got {shorten(robot_id)}, expected one of {', '.join(known)}")


def shorten(value: object, length: int = 80) -> str:
    """`repr` of a value cut to a length that fits a message, whatever the caller sent.

    Only the head of a container is looked at, so that refusing a huge or bottomless value costs nothing.
    """
    try:
        text = _REPR.repr(value)
    except ValueError:  # an integer of more digits than Python agrees to print
        text = f"<{type(value).__name__} too long to print>"
    return text if len(text) <= length else text[: length - 1] + "…"


_REPR = Repr()
_REPR.maxlist = _REPR.maxtuple = _REPR.maxdict = _REPR.maxset = 40
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = 200
