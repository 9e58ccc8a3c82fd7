"""Rows of a DH table that somebody has typed, and how far the frames they lead to are from the arm's joint axes.

The exercises and the lesson on DH judge rows with it. A row that puts z on the axis of the next joint is right,
wherever on the axis its origin is; the lesson asks besides for what the student has chosen there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Literal, NamedTuple

import numpy as np

from app.exercises.typed import read_number
from kin import InputError, Joint
from kin.axes import screw_x, screw_z
from kin.robot import Convention
from kin.transforms import Array
from kin.typed import LONGEST, EntryError
from kin.units import Units

Factor = Literal["theta", "d", "a", "alpha"]
FACTORS: tuple[Factor, ...] = ("theta", "d", "a", "alpha")


NAMES = ("θ", "d", "a", "α")


def turns(factor: Factor) -> bool:
    """Whether a parameter is an angle, else a length."""
    return factor in ("theta", "alpha")


ANGULAR = tuple(map(turns, FACTORS))


class Accepted(NamedTuple):
    """Largest accepted errors: of angles (rad) and lengths (m)."""

    angle: float
    length: float

    def is_near(self, factor: Factor, one: float, other: float) -> bool:
        """Whether two values of a parameter are equal within these errors, angles up to whole turns."""
        if turns(factor):
            return abs(math.remainder(one - other, math.tau)) <= self.angle
        return abs(one - other) <= self.length


@dataclass(frozen=True)
class Row:
    """The values of a row (rad, m): its constants, or with the joint's value added to θ or d."""

    theta: float
    d: float
    a: float
    alpha: float

    @classmethod
    def of(cls, row: Joint, value: float = 0.0) -> Row:
        """A row of an arm, with the value of its joint added."""
        turned, slid = (value, 0.0) if row.kind == "revolute" else (0.0, value)
        return cls(row.theta + turned, row.d + slid, row.a, row.alpha)

    def matrix(self, convention: Convention) -> Array:
        """Its product of four motions ``(4, 4)``."""
        first, second = screw_z(self.theta, self.d), screw_x(self.a, self.alpha)
        return np.asarray(first @ second if convention == "standard" else second @ first)

    def differing(self, other: Row, accepted: Accepted) -> tuple[Factor, ...]:
        """The parameters in which two rows differ by more than the accepted errors."""
        return tuple(f for f in FACTORS if not accepted.is_near(f, getattr(self, f), getattr(other, f)))


class Line(NamedTuple):
    """A point ``(3,)`` and the unit vector ``(3,)`` of a line."""

    point: Array
    z: Array

    def nearest(self, point: Array) -> Array:
        """The point of the line that is nearest to another one."""
        return np.asarray(self.point + ((point - self.point) @ self.z) * self.z)

    def missed_by(self, frame: Array) -> Miss:
        """How far z of a frame ``(4, 4)`` is from this line, which it may follow in either direction."""
        angle = angle_between(frame[:3, 2], self.z)
        distance = float(np.linalg.norm(frame[:3, 3] - self.nearest(frame[:3, 3])))
        return Miss(min(angle, math.pi - angle), distance)


class Miss(NamedTuple):
    """How far a frame is from where it belongs: angle of z (rad), distance of the origin (m)."""

    angle: float
    distance: float


def angle_between(one: Array, other: Array) -> float:
    """The angle between two directions ``(3,)``, 0 to π."""
    return math.atan2(float(np.linalg.norm(np.cross(one, other))), float(one @ other))


def typed_rows(rows: Sequence[Row]) -> list[list[str]]:
    """Rows as a student may type them: with all digits, in the units of a student without a choice."""
    return [
        [repr(value * Units().of(angular).scale) for value, angular in zip(astuple(row), ANGULAR, strict=True)]
        for row in rows
    ]


def read_rows(given: object, count: int, first: int, units: Units) -> list[Row]:
    """Typed rows; a number without a unit is in the reader's.

    Args:
        count: how many rows there have to be.
        first: the index of the first one, for messages.

    Raises:
        InputError: not this many rows of four texts.
        EntryError: a text is no number; it names the cell.
    """
    if not isinstance(given, list | tuple) or len(given) != count:
        raise InputError("answer", given, f"{count} rows of the texts θ, d, a, α")
    rows: list[Row] = []
    for i, row in enumerate(given):
        if not isinstance(row, list | tuple) or len(row) != 4 or not all(isinstance(x, str) for x in row):
            raise InputError(f"answer[{i}]", row, "four texts θ, d, a, α")
        values = []
        for text, name, angular in zip(row, NAMES, ANGULAR, strict=True):
            try:
                values.append(read_number(text[: LONGEST + 1], units.of(angular)))
            except EntryError as error:
                raise EntryError(f"{name} of row {first + i + 1} was not read", error.detail) from None
        rows.append(Row(*values))
    return rows
