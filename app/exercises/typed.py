"""Typed answers: a number, or a headline and a sentence that say why it was not read."""

from __future__ import annotations

import math
import re
import sys
from typing import TypeGuard

from kin.typed import EntryError, ReadError, read, valid
from kin.units import METRES, PLAIN, Unit

# Units of one quantity each, and what one of them is in SI units. Angles and lengths are in `kin.units`.
QUANTITIES: tuple[dict[str, float], ...] = (
    {f"{name}/s": size for name, size in METRES.items()},
    {"rad/s": 1.0, "°/s": math.radians(1.0), "deg/s": math.radians(1.0)},
    {f"{name}/rad": size for name, size in METRES.items()},
    {"N·m": 1.0, "N·mm": 1e-3},
    {"N": 1.0, "kN": 1e3},
    {"s": 1.0, "ms": 1e-3},
    {"kg": 1.0, "g": 1e-3},
    {"J": 1.0, "kJ": 1e3},
)


def is_number(value: object) -> TypeGuard[int | float]:
    """Whether it is a finite number; not an integer of more digits than floats have, which JSON may bring."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max  # type: ignore[arg-type]


def read_number(text: str, unit: Unit) -> float:
    """A typed number in radians, metres or SI units.

    Args:
        unit: of numbers without a unit.

    Raises:
        EntryError: not a number, or another kind of unit.
    """
    known = units_like(unit)
    try:
        if not known:
            return read(text, unit)
        name, number = _unit_at_end(text, known)
        return read(number, PLAIN) * known[name or unit.name]
    except ReadError as error:
        names = f"{valid(PLAIN)}; units: {', '.join(known)}" if known else valid(unit)
        said = error.sentence.replace("; units: none", "") if known else error.sentence
        detail = said if error.readings else f"{said} Valid: {names}."
        raise EntryError("The answer was not read", detail, error.readings) from None


def units_like(unit: Unit) -> dict[str, float]:
    """The units of the same quantity, and what one of them is in SI units; none for angles, lengths and counts."""
    return next((known for known in QUANTITIES if unit.name in known), {})


def _unit_at_end(text: str, known: dict[str, float]) -> tuple[str, str]:
    """The unit that ends a text, or "", and the text before it. ``N m`` is ``N·m``; blanks may be anywhere."""
    for name in sorted(known, key=len, reverse=True):
        pattern = name.replace("/", r"\s*/\s*").replace("·", r"\s*[·⋅∙.*]?\s*")
        if found := re.search(rf"(?<![a-zA-Zµ°/·]){pattern}\s*$", text):
            return name, text[: found.start()]
    return "", text
