"""Numbers that people type, with or without a unit. Wrong input is named, with what would be valid."""

from __future__ import annotations

import math
import re

from kin.units import Unit

LONGEST = 2000  # characters
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
ANGLE_UNITS = {"°": math.pi / 180, "deg": math.pi / 180, "rad": 1.0}
LENGTH_UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}


class EntryError(ValueError):
    """A typed text has no valid value: a headline, and a sentence that says what is valid."""

    def __init__(self, title: str, detail: str) -> None:
        self.title = title
        self.detail = detail
        super().__init__(f"{title}: {detail}")


def read_number(text: str, unit: Unit) -> float:
    """A typed number in radians, metres, or as it is if `unit` is neither of an angle nor of a length.

    Args:
        unit: of numbers without a unit.

    Raises:
        EntryError: not a number, or another kind of unit.
    """
    scales = next(
        (scales for scales in (ANGLE_UNITS, LENGTH_UNITS) if unit.name in scales), {unit.name: 1.0 / unit.scale}
    )
    units = ", ".join(filter(None, scales)) or "none"
    title = "The answer was not read"
    number, suffix = number_and_unit(text, title, f"Valid: a number, such as 12.5. Units: {units}.")
    if not math.isfinite(number):
        raise EntryError(title, "The number is too large.")
    if suffix and suffix not in scales:
        raise EntryError(title, f"“{cut(suffix)}” is not a unit of this answer. Valid: {units}.")
    return number * scales[suffix] if suffix else unit.read(number)


def number_and_unit(text: str, title: str, valid: str) -> tuple[float, str]:
    """A typed number and the unit after it, if any; an error has this title and says what is valid."""
    cleaned = clean(text)
    match = re.fullmatch(rf"({NUMBER.pattern})\s*(\D*)", cleaned.replace(",", "."))
    if not cleaned:
        raise EntryError(title, f"The field was empty. {valid}")
    if match is None:
        raise EntryError(title, f"“{cut(text)}” is not a number. {valid}")
    return float(match[1]), match[2].strip()


def clean(text: str) -> str:
    if len(text) > LONGEST:
        raise EntryError("The text is too long", f"Valid: up to {LONGEST} characters.")
    return text.strip().replace("−", "-").replace("\u00a0", " ")


def cut(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 24 else text[:23] + "…"
