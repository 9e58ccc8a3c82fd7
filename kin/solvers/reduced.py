"""The arm that is left when some joints are fixed."""

from __future__ import annotations

from dataclasses import replace

from kin.robot import Joint, Robot


def fixed(robot: Robot, values: dict[int, float]) -> Robot:
    """The arm with some of its joints, and what follows them, fixed at these values."""
    rows = list(robot.rows)
    for joint, value in values.items():
        k = robot.joint_rows[joint]
        row = rows[k]
        name = row.name
        rows = [held(each, each.ratio * value) if each.follows == name else each for each in rows]
        rows[k] = held(row, value)
    home = tuple(x for i, x in enumerate(robot.home) if i not in values)
    return replace(robot, rows=tuple(rows), home=home)


def held(row: Joint, value: float) -> Joint:
    """A moving row as a fixed one."""
    turned, slid = (value, 0.0) if row.kind == "revolute" else (0.0, value)
    return Joint(row.name, row.theta + turned, row.d + slid, row.a, row.alpha, "fixed")
