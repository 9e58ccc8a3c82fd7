"""A chain of frames: translations and rotations, each about the own or about the fixed axes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from app.viewer.declared.fields import rows
from app.viewer.scene.chain import rotation, translation
from kin import InputError
from kin.transforms import Array

MOST = 8  # motions of a chain
FARTHEST = 10.0  # m


@dataclass(frozen=True)
class Motion:
    """One motion of a frame.

    Attributes:
        turns: whether it is a rotation, else a translation.
        axis: 0, 1, 2 for x, y, z.
        amount: in radians or metres.
        own: whether the axis is the frame's own one, else the fixed one.
    """

    turns: bool
    axis: int
    amount: float
    own: bool

    @property
    def matrix(self) -> Array:
        """Its transform ``(4, 4)``."""
        return rotation(self.axis, self.amount) if self.turns else translation(self.axis, self.amount)

    def after(self, T: Array) -> Array:
        """The frame `T` ``(4, 4)`` after this motion: own axes multiply from the right, fixed from the left."""
        return np.asarray(T @ self.matrix if self.own else self.matrix @ T)


def places(motions: tuple[Motion, ...]) -> Array:
    """Where the frame is before the first motion and after each ``(k + 1, 4, 4)``."""
    found = [np.eye(4)]
    for motion in motions:
        found.append(motion.after(found[-1]))
    return np.array(found)


def factors(motions: tuple[Motion, ...]) -> list[int]:
    """The motions in the order in which their matrices stand in the product, by index."""
    order: list[int] = []
    for k, motion in enumerate(motions):
        order.insert(len(order) if motion.own else 0, k)
    return order


def swapped(motions: tuple[Motion, ...]) -> tuple[Motion, ...]:
    """The same chain with the last two motions in the other order."""
    return motions if len(motions) < 2 else (*motions[:-2], motions[-1], motions[-2])


def as_json(motions: tuple[Motion, ...]) -> list[list[object]]:
    """For a link."""
    return [[m.turns, m.axis, m.amount, m.own] for m in motions]


def from_json(entry: object) -> tuple[Motion, ...]:
    """What `as_json` made; raises `InputError` for anything else."""
    motions = []
    for item in rows("chain", entry, MOST):
        match item:
            case [bool(turns), int(axis), float() | int() as amount, bool(own)] if axis in (0, 1, 2):
                most = 2.0 * math.pi if turns else FARTHEST
                if isinstance(axis, bool) or isinstance(amount, bool) or not abs(amount) <= most:
                    raise InputError("chain", item, f"an angle or a length of at most {most:g}")
                motions.append(Motion(turns, axis, float(amount), own))
            case _:
                raise InputError("chain", item, "whether it turns, axis 0 to 2, amount, whether about own axes")
    return tuple(motions)
