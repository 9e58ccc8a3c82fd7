"""Configurations that the steps of lessons are about."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from app.viewer.lessons.guide.outline import Configuration
from app.viewer.scene.clearance import clearance
from kin import Robot
from kin.collision.contacts import surroundings
from kin.transforms import Array


def as_configuration(q: Array) -> Configuration:
    """A configuration ``(n,)`` as a step takes it."""
    return tuple(float(value) for value in q)


def touches(robot: Robot, q: Array) -> bool:
    """Whether the arm passes through floor or mounting at q ``(n,)``, or a link of known shape through another."""
    inside = clearance(robot, skeleton=True).at(q) is not None
    return inside or bool(robot.capsules and surroundings(robot).touches(q))


def first_clear(robot: Robot, tried: Iterable[Array]) -> Array | None:
    """The first configuration ``(n,)`` at which nothing touches, else the first of all; None if there is none."""
    first = None
    for q in tried:
        if not touches(robot, q):
            return q
        first = q if first is None else first
    return first


def moved(robot: Robot, joint: int, amount: float) -> tuple[Array, float]:
    """Home with one joint moved by `amount` (rad or m), or by as much the other way; returns the amount too.

    Where the limits allow neither, it is moved to the farther limit.
    """
    q = robot.q_home.copy()
    low, high = float(robot.lower[joint] - q[joint]), float(robot.upper[joint] - q[joint])
    if low <= amount <= high:
        taken = amount
    elif low <= -amount <= high:
        taken = -amount
    else:
        taken = high if high >= -low else low
    q[joint] += taken
    return q, taken


def distance(a: Array, b: Array) -> float:
    """Between the origins of two frames ``(4, 4)``."""
    return float(np.linalg.norm(a[:3, 3] - b[:3, 3]))
