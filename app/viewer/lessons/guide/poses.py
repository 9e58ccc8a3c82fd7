"""Configurations that the steps of lessons are about."""

from __future__ import annotations

import numpy as np

from app.viewer.lessons.guide.outline import Configuration
from kin import Robot
from kin.transforms import Array


def as_configuration(q: Array) -> Configuration:
    """A configuration ``(n,)`` as a step takes it."""
    return tuple(float(value) for value in q)


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
