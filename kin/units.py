"""The units in which people read values: degrees or radians; millimetres, centimetres or metres.

All values inside are in radians and metres. Precision is given in decimals of a degree or of a millimetre; a
larger unit gets as many more decimals as it needs to be equally fine: 0.1 mm is 0.01 cm and 0.0001 m.

Quantities other than plain angles and lengths (speeds, volumes, areas, manipulability) are always in SI units.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal, get_args

Length = Literal["mm", "cm", "m"]
LENGTHS: tuple[Length, ...] = get_args(Length)
_LONG = 0.01  # metres; longer lengths are written without tenths of a millimetre
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_EXPONENT = re.compile(r"(?<=[0-9])e([-+][0-9]+)\b")
_MINUS = re.compile(r"(?<![\w.)])-(?=[0-9])")
_DECIMALS = 1  # of a degree or of a millimetre, in a sentence


def fixed(value: float, decimals: int = 3) -> str:
    """A number with fixed decimals, a true minus sign, and no minus before a zero."""
    shown = f"{value:.{decimals}f}"
    if float(shown) == 0.0:
        shown = shown.lstrip("-")
    return shown.replace("-", "−")


def general(value: float, digits: int = 6) -> str:
    """A number with this many significant digits, without trailing zeros: 12.5, −0.001, 2.5·10⁻⁷."""
    return typeset(f"{value + 0.0:.{digits}g}")


def power(value: float, digits: int = 2) -> str:
    """A number in powers of ten with this many digits, as 3.2·10⁻⁸; 0 as it is."""
    return typeset(f"{value:.{digits - 1}e}") if value else "0"


def grouped(number: int) -> str:
    """A whole number in groups of three digits."""
    return f"{number:,}".replace(",", "\N{NARROW NO-BREAK SPACE}").replace("-", "−")


def raised(exponent: int) -> str:
    """A whole number as an exponent: ⁻³."""
    return str(exponent).translate(_RAISED)


def typeset(text: str) -> str:
    """A text with ASCII numbers, such as a sentence of the core, with true minus signs and powers of ten."""
    text = _EXPONENT.sub(lambda found: f"·10{raised(int(found[1]))}", text)
    return _MINUS.sub("−", text)


@dataclass(frozen=True)
class Unit:
    """A unit of angle or length, and how values in it are written.

    Attributes:
        name: symbol of the unit.
        scale: how many of it make a radian, or a metre.
        finer: additional decimals compared with degrees or millimetres.
        words: its name in full, of more than one.
    """

    name: str
    scale: float
    finer: int
    words: str = ""

    @property
    def suffix(self) -> str:
        """The symbol as it follows a number."""
        return self.name if self.name == "°" else f" {self.name}"

    def per_second(self, times: int = 1) -> Unit:
        """The unit of the first derivative by time, as °/s, or of a further one, as °/s²."""
        return Unit(f"{self.name}/s{raised(times) if times > 1 else ''}", self.scale, self.finer)

    def decimals(self, digits: int) -> int:
        """Decimals as fine as `digits` decimals of a degree or of a millimetre."""
        return digits + self.finer

    def step(self, digits: int) -> float:
        """One unit of the last decimal: the step of a slider."""
        return 10.0 ** -self.decimals(digits)

    @property
    def is_angle(self) -> bool:
        """Whether it is a unit of angles."""
        return self.name in ANGLES

    @property
    def is_length(self) -> bool:
        """Whether it is a unit of lengths."""
        return self.name in LENGTH_UNITS

    def shown(self, value: float, digits: int = 1) -> float:
        """A value (radians or metres) in this unit, rounded for a control."""
        return round(value * self.scale, self.decimals(digits))

    def read(self, shown: float) -> float:
        """A value in this unit, converted to radians or metres: 102 mm is 0.102 m, not 0.10200000000000001 m."""
        return shown / self.scale if self.scale.is_integer() else shown * (1.0 / self.scale)

    def number(self, value: float, digits: int = 1) -> str:
        """A value (radians or metres) with fixed decimals, without the unit."""
        return fixed(value * self.scale, self.decimals(digits))

    def text(self, value: float, digits: int = 1) -> str:
        """`number` with the unit."""
        return self.number(value, digits) + self.suffix

    def value(self, value: float) -> str:
        """A value (radians or metres) for a sentence: one decimal, or in powers of ten if that would show zero."""
        scaled, digits = value * self.scale, self.decimals(_DECIMALS)
        small = 0.0 < abs(scaled) < 0.5 * 10.0**-digits
        return (f"{scaled:.1e}" if small else f"{scaled:.{digits}f}") + self.suffix

    def brief(self, value: float, digits: int = 4) -> str:
        """A round value (radians or metres), such as a chosen step: so many digits, without trailing zeros."""
        return general(value * self.scale, digits) + self.suffix

    def short(self, value: float, digits: int = 1) -> str:
        """`number` without trailing zeros."""
        shown = self.number(value, digits)
        return shown.rstrip("0").rstrip(".") if "." in shown else shown

    def size(self, value: float, digits: int = 1) -> str:
        """The size of a value for a sentence; one that would round to zero is written as ``< 0.1``."""
        size, least = abs(value) * self.scale, self.step(digits)
        if 0.0 < size < least:
            return f"< {least:.{self.decimals(digits)}f}{self.suffix}"
        return f"{size:.{self.decimals(digits)}f}{self.suffix}"


DEGREES, RADIANS = Unit("°", 180.0 / math.pi, 0, "degrees"), Unit("rad", 1.0, 2, "radians")
# Every list of units of length is made of this one, but for that in `static/takehome/numbers.js`.
_OF_LENGTH: dict[Length, Unit] = {
    "mm": Unit("mm", 1e3, 0, "millimetres"),
    "cm": Unit("cm", 1e2, 1, "centimetres"),
    "m": Unit("m", 1.0, 3, "metres"),
}
PLAIN = Unit("", 1.0, 2)  # of counts and ratios
# By the names that people type and read.
ANGLES: dict[str, Unit] = {"°": DEGREES, "deg": DEGREES, "rad": RADIANS}
LENGTH_UNITS: dict[str, Unit] = dict(_OF_LENGTH.items())
METRES = {name: 1.0 / unit.scale for name, unit in reversed(LENGTH_UNITS.items())}  # that one of each is
# For regular expressions.
NAMES = "|".join(sorted((*ANGLES, *LENGTH_UNITS), key=len, reverse=True))


def family(unit: Unit) -> dict[str, Unit]:
    """The units of the same quantity by name: of angles, of lengths, or this one alone."""
    return ANGLES if unit.is_angle else LENGTH_UNITS if unit.is_length else {unit.name: unit}


@dataclass(frozen=True)
class Units:
    """The reader's choice of units.

    Attributes:
        degrees: whether angles are written in degrees, else in radians.
        length: the unit of lengths.
    """

    degrees: bool = True
    length: Length = "mm"

    @property
    def angles(self) -> Unit:
        """The unit of angles."""
        return DEGREES if self.degrees else RADIANS

    @property
    def lengths(self) -> Unit:
        """The unit of lengths."""
        return _OF_LENGTH[self.length]

    def of(self, is_angle: bool) -> Unit:
        """The unit of an angle (a revolute joint, θ, α) or of a length (a prismatic joint, d, a)."""
        return self.angles if is_angle else self.lengths

    def angle(self, radians: float) -> str:
        """The size of an angle for a sentence."""
        return self.angles.size(radians)

    def distance(self, metres: float) -> str:
        """The size of a length for a sentence."""
        long = metres == 0.0 or abs(metres) >= _LONG
        return self.lengths.size(metres, 0 if long else 1)

    def motion(self, is_angle: bool, value: float) -> str:
        """The size of a joint's motion for a sentence."""
        return self.angle(value) if is_angle else self.distance(value)


DEFAULT_UNITS = Units()
