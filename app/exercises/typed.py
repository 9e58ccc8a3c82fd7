"""Typed answers: a number, or a headline and a sentence that say why it was not read."""

from __future__ import annotations

from kin.typed import ReadError, read, valid
from kin.units import Unit


class EntryError(ReadError):
    """A typed text has no valid value: a headline, and a sentence that says what is valid."""

    def __init__(self, title: str, detail: str, readings: tuple[str, ...] = ()) -> None:
        self.title = title
        self.detail = detail
        super().__init__(f"{title}: {detail}", readings)


def read_number(text: str, unit: Unit) -> float:
    """A typed number in radians, metres, or as it is if `unit` is neither of an angle nor of a length.

    Args:
        unit: of numbers without a unit.

    Raises:
        EntryError: not a number, or another kind of unit.
    """
    try:
        return read(text, unit)
    except ReadError as error:
        detail = error.sentence + ("" if error.readings else f" Valid: {valid(unit)}.")
        raise EntryError("The answer was not read", detail, error.readings) from None
