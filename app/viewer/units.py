"""The units a visitor reads and types: degrees or radians; millimetres, centimetres or metres.

Inside, all is radians and metres. A place that shows a value says how finely it means it, in decimals of a degree
or of a millimetre; a larger unit gets as many more as it needs to say the same: 0.1 mm are 0.01 cm and 0.0001 m.

What is no plain angle or length stays in SI units whatever was chosen: speeds, volumes, surfaces, manipulability.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal, get_args

from app.viewer.views.mathml import fixed

Length = Literal["mm", "cm", "m"]
LENGTHS: tuple[Length, ...] = get_args(Length)
# A size in a sentence of the core's, which speaks of degrees and millimetres: digits, exponent, unit.
_SIZE = re.compile(r"(\d+(?:\.(\d+))?)(e[+-]?\d+)?(°| mm\b)")
_LONG = 0.01  # m; from here on tenths of a millimetre are left out of a sentence


@dataclass(frozen=True)
class Unit:
    """How angles or lengths are written.

    Attributes:
        name: of the unit.
        scale: how many of it are a radian, or a metre.
        finer: how many decimals more than degrees or millimetres it needs.
    """

    name: str
    scale: float
    finer: int

    @property
    def suffix(self) -> str:
        """The name as it follows a number."""
        return self.name if self.name == "°" else f" {self.name}"

    def decimals(self, digits: int) -> int:
        """Decimals that tell as much as `digits` of a degree or of a millimetre."""
        return digits + self.finer

    def step(self, digits: int) -> float:
        """The last of these decimals, in this unit: a slider's step."""
        return 10.0 ** -self.decimals(digits)

    def shown(self, value: float, digits: int = 1) -> float:
        """A value in radians or metres as a control shows it."""
        return round(value * self.scale, self.decimals(digits))

    def read(self, shown: float) -> float:
        """What a control shows, in radians or metres."""
        return shown / self.scale

    def number(self, value: float, digits: int = 1) -> str:
        """A value in radians or metres with fixed decimals, without its unit."""
        return fixed(value * self.scale, self.decimals(digits))

    def text(self, value: float, digits: int = 1) -> str:
        """The same with its unit."""
        return self.number(value, digits) + self.suffix

    def brief(self, value: float) -> str:
        """A value in radians or metres that somebody has chosen, so a round one: without zeros at its end."""
        return f"{value * self.scale:.4g}{self.suffix}".replace("-", "−")

    def size(self, value: float, digits: int = 1) -> str:
        """The size of a value for a sentence: never rounded down to a zero that it is not."""
        size, least = abs(value) * self.scale, self.step(digits)
        if 0.0 < size < least:
            return f"< {least:.{self.decimals(digits)}f}{self.suffix}"
        return f"{size:.{self.decimals(digits)}f}{self.suffix}"


DEGREES, RADIANS = Unit("°", 180.0 / math.pi, 0), Unit("rad", 1.0, 2)
_OF_LENGTH: dict[Length, Unit] = {"mm": Unit("mm", 1e3, 0), "cm": Unit("cm", 1e2, 1), "m": Unit("m", 1.0, 3)}


@dataclass(frozen=True)
class Units:
    """What a visitor has chosen. A control's events carry the units it was made in: see `panel`.

    Attributes:
        degrees: whether angles are told in degrees, else in radians.
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

    def of(self, turning: bool) -> Unit:
        """The unit of what turns (a revolute joint, θ, α), or of what slides."""
        return self.angles if turning else self.lengths

    def angle(self, radians: float) -> str:
        """The size of an angle for a sentence."""
        return self.angles.size(radians)

    def distance(self, metres: float) -> str:
        """The size of a length for a sentence."""
        long = metres == 0.0 or abs(metres) >= _LONG
        return self.lengths.size(metres, 0 if long else 1)

    def motion(self, turning: bool, value: float) -> str:
        """The size of a joint's motion for a sentence."""
        return self.angle(value) if turning else self.distance(value)

    def retold(self, sentence: str) -> str:
        """A sentence of the core's, which tells degrees and millimetres, with these units instead."""

        def told(found: re.Match[str]) -> str:
            number, decimals, exponent, name = found.groups(default="")
            turning = name == "°"
            plain, unit = (DEGREES if turning else _OF_LENGTH["mm"]), self.of(turning)
            if unit == plain:
                return found[0]
            value = plain.read(float(number + exponent)) * unit.scale
            if exponent:
                return f"{value:.{len(decimals)}e}{unit.suffix}"
            return f"{value:.{unit.decimals(len(decimals))}f}{unit.suffix}"

        return _SIZE.sub(told, sentence)


USUAL = Units()
