"""Poses of exercises: elementary motions, errors between poses, and sentences about them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from app.exercises import cell
from app.exercises.cell import Declared
from app.exercises.expressions import Expression
from app.exercises.fields import MOST_ITEMS, Fields
from app.exercises.variant import Variant
from kin import wxyz_from_rotation
from kin.transforms import Array, rotation_angle
from kin.units import Units, fixed

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Elementary(Declared):
    """A turn about one axis, or a slide along it, by an expression: ``{ turn = "z", by = "t1" }``."""

    turn: str = cell.choice("Turn about", "", AXES, "")
    slide: str = cell.choice("Slide along", "", AXES, "")
    by: Expression = cell.expression("By", "An angle or a length.")

    def check(self, table: Fields) -> None:
        if bool(self.turn) == bool(self.slide):
            raise table.refuse("turn", table.table, "either turn or slide, with the axis x, y or z")

    @property
    def turns(self) -> bool:
        """Whether it is a turn."""
        return bool(self.turn)

    @property
    def axis(self) -> int:
        """The index of its axis."""
        return AXES.index(self.turn or self.slide)

    def matrix(self, variant: Variant, factor: float = 1.0) -> Array:
        """The motion as a transform ``(4, 4)``; a factor of −1 is the motion the other way."""
        return elementary(self.turns, self.axis, factor * variant.number(self.by))

    def text(self, variant: Variant, units: Units) -> str:
        """``turn by 30° about z``."""
        value, name = variant.number(self.by), AXES[self.axis]
        amount = units.of(self.turns).brief(value)
        return f"turn by {amount} about {name}" if self.turns else f"slide by {amount} along {name}"


def list_of_motions(least: int, most: int = MOST_ITEMS) -> Any:
    """A list of elementary motions, as a field of a kind."""
    fresh = {"turn": "z", "by": "90*deg"}
    return cell.rows(Elementary, "Motions", "In their order; each turns or slides.", "motion", fresh, least, most)


def elementary(turns: bool, axis: int, value: float) -> Array:
    """A turn about, or a slide along, one axis of the frame ``(4, 4)``."""
    T = np.eye(4)
    if not turns:
        T[axis, 3] = value
        return T
    i, j = (axis + 1) % 3, (axis + 2) % 3
    c, s = math.cos(value), math.sin(value)
    T[i, i] = T[j, j] = c
    T[i, j], T[j, i] = -s, s
    return T


def product(matrices: list[Array]) -> Array:
    """The product of transforms, in this order."""
    return reduce(np.matmul, matrices, np.eye(4))


def errors(given: Array, right: Array) -> tuple[float, float]:
    """Distance of the origins (m) and angle between the orientations (rad)."""
    return (
        float(np.linalg.norm(given[:3, 3] - right[:3, 3])),
        float(rotation_angle(given[:3, :3], right[:3, :3])),
    )


def as_numbers(T: Array) -> list[float]:
    """A pose as x, y, z and a quaternion w, x, y, z."""
    return [*map(float, T[:3, 3]), *map(float, wxyz_from_rotation(T[:3, :3]))]


def point_text(point: Array, units: Units) -> str:
    """``x = 10 mm, y = 20 mm, z = 30 mm``."""
    return ", ".join(f"{axis} = {units.lengths.text(float(v), 1)}" for axis, v in zip(AXES, point, strict=True))


def pose_text(T: Array, units: Units) -> str:
    """Where a frame is, and where its axes point."""
    return f"{point_text(T[:3, 3], units)}; {axes_text(T)}"


def axes_text(T: Array) -> str:
    """Where the axes of a frame point."""
    columns = (f"{axis} = ({', '.join(fixed(float(v), 2) for v in T[:3, j])})" for j, axis in enumerate(AXES))
    return f"its axes: {', '.join(columns)}"
