"""Where options lead, for the lessons that draw them: directions from a point, axes, and frames."""

from __future__ import annotations

import numpy as np

from app.viewer.lessons.guide.outline import Bar, Triad
from kin import Robot
from kin.transforms import Array

SIZE = 0.35  # of a bar that shows a direction, in reaches of the arm
SMALL = 1e-9
UP, DOWN = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])


def bar(start: Array, end: Array) -> Bar:
    """From one point ``(3,)`` to another."""
    return Bar(tuple(map(float, start)), tuple(map(float, end)))


def direction(robot: Robot, start: Array, way: Array) -> Bar | None:
    """From a point ``(3,)`` along a direction ``(3,)`` of any length; None for no direction."""
    length = float(np.linalg.norm(way))
    return None if length < SMALL else bar(start, start + SIZE * robot.reach / length * way)


def line(robot: Robot, point: Array, way: Array) -> Bar:
    """A line on both sides of a point ``(3,)`` along a direction ``(3,)`` of length 1."""
    half = SIZE * robot.reach * way
    return bar(point - half, point + half)


def level(way: Array) -> Array:
    """The horizontal part of a direction ``(3,)``; x of the world if it has none."""
    flat = np.array([way[0], way[1], 0.0])
    return flat if np.linalg.norm(flat) > 1e-6 else np.array([1.0, 0.0, 0.0])


def up_or_down(robot: Robot, point: Array, way: Array, least: float) -> dict[str, Bar | None]:
    """The leads up, level and down from a point; the one that is true of a direction ``(3,)`` has it.

    Args:
        least: the smallest vertical part of a unit direction that is not level.
    """
    found: dict[str, Array] = {"up": UP, "level": level(way), "down": DOWN}
    rise = float(way[2]) / max(float(np.linalg.norm(way)), SMALL)
    found["up" if rise > least else "down" if rise < -least else "level"] = way
    return {name: direction(robot, point, each) for name, each in found.items()}


def place(T: Array, length: float) -> Triad:
    """A frame at a pose ``(4, 4)``."""
    return Triad(tuple(tuple(map(float, row)) for row in T), length)
