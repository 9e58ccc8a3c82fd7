"""Reads what visitors type: joint values and cells of tables. `kin.poses` reads targets, `kin.typed` numbers.

An error names what is wrong and what is valid. Numbers are in the units on screen unless a unit follows them.
"""

from __future__ import annotations

from kin.typed import EntryError, ReadError, cut, example, read
from kin.units import Unit, general

LARGEST = 1e6  # rad or m: a value in a table, as in robot files
LIMIT_DIGITS = 2  # decimals of a degree or a millimetre in which limits are shown


def read_value(text: str, name: str, unit: Unit, limits: tuple[float, float]) -> float:
    """A typed joint value in radians or metres.

    Args:
        name: of the joint, as on screen.
        unit: of numbers without a unit.
        limits: lower and upper limit (rad or m).

    Raises:
        EntryError: not a number, or outside the limits.
    """
    low, high = (unit.shown(limit, LIMIT_DIGITS) for limit in limits)
    title = f"{name} was not changed"
    valid = f"Valid: {general(low, 10)} … {general(high, 10)}{unit.suffix}."
    slack = 1e-9 * max(1.0, abs(low), abs(high))
    try:
        value = read(text, unit, (unit.read(low - slack), unit.read(high + slack)))
    except ReadError as error:
        raise EntryError(title, f"{error.sentence} {valid}", error.readings) from None
    if not low - slack <= value * unit.scale <= high + slack:
        raise EntryError(title, f"“{cut(text)}” is outside the limits of this joint. {valid}")
    # The shown limit may be rounded outwards.
    return min(max(value, limits[0]), limits[1])


def read_cell(text: str, unit: Unit) -> float:
    """A cell of a table in radians or metres; raises `ReadError`, whose reason says what is valid."""
    try:
        return read(text, unit, largest=LARGEST)
    except ReadError as error:
        raise ReadError(
            error.reason if error.readings else f"{error.reason}; try {example(unit)}", error.readings
        ) from None
