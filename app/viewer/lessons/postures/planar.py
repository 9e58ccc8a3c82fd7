"""Both postures of two links by hand: the ring that it reaches, the cosine rule, the other elbow."""

from __future__ import annotations

import math

import numpy as np

from app.exercises.variant import Quantity
from app.viewer.lessons.guide.outline import Pose
from app.viewer.lessons.guide.poses import as_configuration
from kin import Robot
from kin.robot import IDENTITY
from kin.transforms import Array
from kin.units import Units

STRAIGHT = 0.05  # rad: an elbow bent by less is no example


def is_planar(robot: Robot) -> bool:
    """Whether the table is that of two or three links in the plane of x₀ and y₀, with the elbow bent at home."""
    flat = all(row.kind == "revolute" and row.theta == row.d == row.alpha == 0.0 < row.a for row in robot.rows)
    bent = robot.n in (2, 3) and abs(math.sin(robot.q_home[1])) > STRAIGHT
    return flat and bent and robot.convention == "standard" and robot.base == robot.tool == IDENTITY


def other_elbow(robot: Robot) -> Array:
    """The configuration ``(n,)`` with the other elbow, for the tool point that the arm has at home."""
    l1, l2 = robot.rows[0].a, robot.rows[1].a
    q = robot.q_home.copy()
    # The angle from the first link to the line from axis 1 to the point.
    beside = math.atan2(l2 * math.sin(q[1]), l1 + l2 * math.cos(q[1]))
    q[0], q[1] = math.remainder(q[0] + 2.0 * beside, 2.0 * math.pi), -q[1]
    return q


def facts(robot: Robot, units: Units) -> tuple[dict[str, float | Quantity], dict[str, str]]:
    """The numbers and the words of the steps by hand, for the tool point at home.

    For an arm that is not planar they mean nothing, and no text uses them.
    """
    l1, l2 = (robot.rows[0].a, robot.rows[1].a) if is_planar(robot) else (0.0, 0.0)
    q = robot.q_home if is_planar(robot) else np.zeros(2)
    x, y = l1 * math.cos(q[0]) + l2 * math.cos(q[0] + q[1]), l1 * math.sin(q[0]) + l2 * math.sin(q[0] + q[1])
    length = units.lengths
    numbers: dict[str, float | Quantity] = {
        "l1": Quantity(l1, "length"),
        "l2": Quantity(l2, "length"),
        "far": Quantity(math.hypot(x, y), "length"),
        "theta1": float(q[0]),
        "other_theta1": float(other_elbow(robot)[0]) if is_planar(robot) else 0.0,
    }
    return numbers, {
        "ring_inside": length.text(abs(l1 - l2)),
        "ring_outside": length.text(l1 + l2),
        "theta2_sign": "positive" if q[1] > 0.0 else "negative",
        "place": f"({length.number(x)}, {length.number(y)}){length.suffix}",
    }


def poses(robot: Robot) -> dict[str, Pose]:
    """The poses of these steps."""
    stretched = robot.q_home.copy()
    stretched[1] = min(max(0.0, robot.lower[1]), robot.upper[1])
    other = Pose(as_configuration(other_elbow(robot)))
    return {"stretched": Pose(as_configuration(stretched)), "the other elbow": other}
