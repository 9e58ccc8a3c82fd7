"""Names of branches: what one sees of a posture, in the robot's own base and with its own joint values.

A row of a closed form is a choice of signs in formulas. A name must be true of every configuration of its branch,
so each part of it says one thing that has the same sign on the whole branch:

- **front, back**: on which side of axis 1, along the direction perpendicular to axes 1 and 2. Joint 1 *faces* the
  side that the x axis of the robot's base points to at θ1 = 0 (if x has no share in that direction, the y axis).
- **left, right**: seen along the arm with axis 1 upright. *Up* is the sense of axis 1 that goes up in the base
  frame; if the axis is horizontal, the one away from the robot's own base, as if the arm stood on the floor.
- **up, down**: height in the base frame, only where axis 1 is vertical (on the floor or under a ceiling).
- **positive, negative** and **no-flip, flip**: the sign of a joint's value, counted from where the links that it
  joins are in line; of the two values where they are, from the one that is nearer to the joint's zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from kin.robot import Robot
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_FRONT = "in front of axis 1, on the side that joint 1 faces"
_BACK = "behind axis 1, seen as joint 1 faces"


class Part(NamedTuple):
    """Two words of which one holds on each branch: (word, its meaning) for a positive and for a negative sign."""

    positive: tuple[str, str]
    negative: tuple[str, str]

    def times(self, sign: float) -> Part:
        """The same where the sign in the formulas is `sign` times the one that is meant here."""
        return self if sign > 0.0 else Part(self.negative, self.positive)


class Names(NamedTuple):
    """The names of all branches, and what each part of them means."""

    branches: tuple[str, ...]
    meanings: tuple[tuple[str, str], ...]


class Stance(NamedTuple):
    """How the frame of a closed form stands in the robot's base.

    Attributes:
        facing: 1.0 if joint 1 faces along x of the frame that turns with axis 1, −1.0 if against it.
        up: 1.0 if z of that frame is up, −1.0 if it is down.
        vertical: whether axis 1 is vertical in the base frame.
    """

    facing: float
    up: float
    vertical: bool


def names_of(parts: tuple[Part, ...], rows: Iterable[tuple[float, ...]]) -> Names:
    """The names of branches that are rows of signs, one sign per part."""
    branches = tuple(
        " · ".join(
            (part.positive if sign > 0.0 else part.negative)[0] for part, sign in zip(parts, row, strict=True)
        )
        for row in rows
    )
    return Names(branches, tuple(meaning for part in parts for meaning in part))


def eight() -> Iterable[tuple[float, float, float]]:
    """Signs of eight branches whose index has one bit per sign, set where that is negative."""
    return [(1.0 - 2 * (i >> 2), 1.0 - 2 * (i >> 1 & 1), 1.0 - 2 * (i & 1)) for i in range(8)]


def stance_of(robot: Robot, inverse_base: Array, theta1: float, sense1: float) -> Stance:
    """How a closed form stands: its base⁻¹ ``(≥ 3, ≥ 3)``, its θ1 where joint 1 is at 0, and the joint's sense."""
    own, R = robot.T_world_base[:3, :3], inverse_base[:3, :3].T
    near = math.sqrt(TOLERANCES.geometry)
    forward = R @ np.array([math.cos(theta1), math.sin(theta1), 0.0])
    ahead = next((x for x in (forward @ own[:, 0], forward @ own[:, 1]) if abs(x) > near), 1.0)
    up = next((z for z in (R[2, 2], R[:, 2] @ own[:, 2]) if abs(z) > near), sense1)
    return Stance(math.copysign(1.0, ahead), math.copysign(1.0, up), 1.0 - abs(R[2, 2]) < TOLERANCES.geometry)


def front_or_back(stance: Stance, what: str = "the wrist centre") -> Part:
    """Where something is, from the sign of its x in the frame that turns with axis 1."""
    front, back = ("shoulder front", f"{what} is {_FRONT}"), ("shoulder back", f"{what} is {_BACK}")
    return Part(front, back).times(stance.facing)


def left_or_right(stance: Stance, noun: str, what: str, end: str = "the wrist centre") -> Part:
    """On which side of the arm something is, from a sign that is positive on the left where z is up."""
    seen = f"seen from axis 1 towards {end}" + ("" if stance.vertical else " with axis 1 upright")
    left, right = ((f"{noun} {side}", f"{what} is on the {side}, {seen}") for side in ("left", "right"))
    return Part(left, right).times(stance.up)


def up_or_down(stance: Stance) -> Part:
    """Which elbow is the higher one, from a sign that is positive where z of the closed form's frame is up."""
    up, down = (
        (f"elbow {word}", f"the elbow is {where} the line from the shoulder to the wrist centre")
        for word, where in (("up", "above"), ("down", "below"))
    )
    return Part(up, down).times(stance.up)


def bent(joint: int, sense: float, offset: float) -> Part:
    """The sign of the joint at the elbow, from the sign of the sine of ``θ = sense q + offset``."""
    number, aligned = f"θ{joint + 1}", _aligned(sense, offset)
    positive, negative = (
        (f"elbow {word}", f"{number} is on the {word} side of where the arm is {straight}")
        for straight in ("straight" if aligned > 0.0 else "folded",)
        for word in ("positive", "negative")
    )
    return Part(positive, negative).times(sense * aligned)


def flipped(joint: int, sense: float, offset: float, aligned: str) -> Part:
    """The sign of the joint in the middle of the wrist, from the sign of the sine of ``θ = sense q + offset``.

    `aligned`: a clause that says what is in line where the sine is 0.
    """
    number = f"θ{joint + 1}"
    no_flip, flip = (
        (f"wrist {word}", f"{number} is on the {side} side of where {aligned}")
        for word, side in (("no-flip", "positive"), ("flip", "negative"))
    )
    return Part(no_flip, flip).times(sense * _aligned(sense, offset))


def _aligned(sense: float, offset: float) -> float:
    """1.0 if of θ = 0 and θ = π, with ``θ = sense q + offset``, the first has the smaller |q|, else −1.0."""
    at_zero, at_half_turn = (abs(math.remainder(x, 2.0 * math.pi)) for x in (offset, math.pi - offset))
    return 1.0 if at_zero <= at_half_turn + TOLERANCES.geometry else -1.0
