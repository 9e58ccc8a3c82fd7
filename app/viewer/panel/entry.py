"""Reads what visitors type: joint values, cells of tables, and the numbers of forms. `kin.poses` reads targets,
`kin.typed` numbers.

An error names what is wrong and what is valid. Numbers are in the units on screen unless a unit follows them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kin.typed import EntryError, ReadError, cut, example, read
from kin.units import Unit, Units, general

LARGEST = 1e6  # rad or m: a value in a table, as in robot files
LIMIT_DIGITS = 2  # decimals of a degree or a millimetre in which limits are shown
DECIMALS = 6  # of a degree or a millimetre, in a field of a form
PERCENT, SECONDS = Unit("%", 100.0, 0), Unit("s", 1.0, 3)


@dataclass(frozen=True)
class NumberField:
    """A number that is typed into a form.

    Attributes:
        title, hint: of the field.
        low, high: what is valid, in SI units; with `above`, not `low` itself.
        unit: its own, or the page's of a length or an angle.
        rate: whether it is per second.
        whole: whether it has no decimals.
        empty: what an empty field means; "": it must not be empty.
        nothing: the value of an empty field.
    """

    title: str
    low: float
    high: float
    unit: Unit | Literal["length", "angle"]
    hint: str = ""
    rate: bool = False
    above: bool = False
    whole: bool = False
    empty: str = ""
    nothing: float | None = None

    def _unit(self, units: Units) -> Unit:
        return self.unit if isinstance(self.unit, Unit) else units.of(self.unit == "angle")

    def cell(self, name: str, value: float | None, units: Units, wrong: str | None = None) -> dict[str, object]:
        """The field for the macro *number* of the templates; `wrong`: a text that was refused."""
        unit = self._unit(units)
        shown = "" if value is None or (self.empty and value == self.nothing) else unit.short(value, DECIMALS)
        return {
            "name": name,
            "field": self,
            "value": shown if wrong is None else wrong,
            "unit": unit.name + "/s" * self.rate,
            "wrong": wrong is not None,
        }

    def read(self, text: str, units: Units) -> float | None:
        """The value of a text; raises `EntryError`, which says what would be valid."""
        unit, title = self._unit(units), "The field stays as it was"
        given = text.replace("/s", "") if self.rate else text
        if self.empty and not given.strip():
            return self.nothing
        low, high = (unit.short(end) for end in (self.low, self.high))
        valid = f"above {low}, at most {high}" if self.above else f"{low} to {high}"
        valid += unit.suffix.rstrip() + "/s" * self.rate + f", or nothing: {self.empty}" * bool(self.empty)
        valid = "a whole number from " * self.whole + valid
        try:
            value = read(given, unit, (self.low, self.high))
        except ReadError as error:
            raise EntryError(title, f"{error.sentence} Valid: {valid}.", error.readings) from None
        within = self.low <= value <= self.high and not (self.above and value == self.low)
        if within and not (self.whole and value != int(value)):
            return int(value) if self.whole else value
        raise EntryError(title, f"“{cut(text)}” is not valid. Valid: {valid}.")


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
