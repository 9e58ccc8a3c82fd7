"""Joint axes as lines, and the common normal of two of them."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from app.exercises.rows import Line
from app.viewer.lessons.axes import axes_at
from kin import Robot
from kin.axes import NEARLY, cross
from kin.transforms import Array

Relation = Literal["skew", "meet", "parallel", "one"]


class Normal(NamedTuple):
    """The common normal of two lines.

    Attributes:
        relation: parallel lines have any number of normals, lines that are one have none.
        start, end: its feet ``(3,)`` on the first and the second line.
        x: unit vector ``(3,)`` from the first line to the second; where they meet, perpendicular to both (first ×
            second); zero if they are one line.
    """

    relation: Relation
    start: Array
    end: Array
    x: Array


def common_normal(first: Line, second: Line, near: float, through: Array | None = None) -> Normal:
    """The common normal of two lines.

    Args:
        near: distance (m) below which lines meet.
        through: of parallel lines, the normal through the point of the first line nearest to this one.
    """
    across = cross(first.z, second.z)
    sine = float(np.linalg.norm(across))
    if sine < NEARLY:
        start = first.nearest(first.point if through is None else through)
        end = second.nearest(start)
        far = float(np.linalg.norm(end - start))
        if far < near:
            return Normal("one", start, start, np.zeros(3))
        return Normal("parallel", start, end, (end - start) / far)
    between = second.point - first.point
    start = first.point + first.z * float(cross(between, second.z) @ across) / sine**2
    end = second.point + second.z * float(cross(between, first.z) @ across) / sine**2
    far = float(np.linalg.norm(end - start))
    if far < near:
        return Normal("meet", start, start, across / sine)
    return Normal("skew", start, end, (end - start) / far)


def axis_lines(robot: Robot, q: Array) -> tuple[Line, ...]:
    """The axes of all joints at a configuration ``(n,)``, in the positive direction of each joint."""
    return tuple(map(Line, *axes_at(robot, q)))


def angle_about(axis: Array, start: Array, end: Array) -> float:
    """The angle from one direction to another about an axis, all ``(3,)``; 180° rather than −180°."""
    angle = math.atan2(float(cross(start, end) @ axis), float(start @ end))
    return math.pi if angle < -math.pi + 1e-9 else angle
