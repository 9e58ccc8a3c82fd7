"""The arm that is left when some joints are fixed."""

from __future__ import annotations

from dataclasses import replace

from kin.robot import Robot


def fixed(robot: Robot, values: dict[int, float]) -> Robot:
    """The arm with some of its joints fixed at these values."""
    rows = list(robot.rows)
    for joint, value in values.items():
        k = robot.joint_rows[joint]
        row = rows[k]
        turned, slid = (value, 0.0) if row.kind == "revolute" else (0.0, value)
        free = replace(row, limits=None, velocity=None, acceleration=None, jerk=None, effort=None)
        rows[k] = replace(free, theta=row.theta + turned, d=row.d + slid, kind="fixed")
    home = tuple(x for i, x in enumerate(robot.home) if i not in values)
    return replace(robot, rows=tuple(rows), home=home)
