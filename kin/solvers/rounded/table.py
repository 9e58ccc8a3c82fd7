"""The nominal arm of a rounded table: its nearly parallel axes are parallel, its nearly right angles right."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kin.axes import NEARLY, Lines, Links, cross, inverse, lines_of, links_of, screw_x, screw_z, size
from kin.fk import fk
from kin.robot import Joint, Robot
from kin.solvers.general5.completion import link_to
from kin.solvers.reversed import table_of
from kin.transforms import Array

SHORT = 3e-4  # of the arm's size: a shorter offset beside exact ones was not meant
_CLOSE = 2e-2  # of the arm's size: the two arms put their tools at most so far apart
_EXACT = 1e-10  # radians, shares of the arm's size: rounding that does not matter
_SEEN = 2e-9  # the most that matching takes as exact


class IntendedArm(NamedTuple):
    """The arm that a table stands for.

    Attributes:
        table: the arm with exact relations between its axes, with the joint values of the robot.
        off: the largest angle or share of the arm's size that was changed.
        hidden: whether the table is off by an amount that matching takes as exact, but solutions do not.
    """

    table: Robot
    off: float
    hidden: bool


def intended_arm(robot: Robot) -> IntendedArm | None:
    """The nominal arm of a rounded table; None if the table is exact, or the arm another one."""
    if robot.n < 2:
        return None
    scale = size(robot)
    lines = lines_of(robot, as_counted=True)
    lines, turned = _parallel(lines)
    links = links_of(_along(robot, lines), (1,) * (robot.n - 1))
    links, changed = _snapped(links, scale)
    changes = np.abs(np.concatenate([turned, changed]))
    changes = changes[changes > _EXACT]
    if not len(changes):
        return None
    table = table_of(robot, links, ())
    q = np.random.default_rng(7).uniform(-2.0, 2.0, (8, robot.n)) * np.where(robot.revolute, 1.0, 0.1 * scale)
    apart = np.abs(fk(table, q) - fk(robot, q))
    if apart[:, :3, :3].max() > _CLOSE or apart[:, :3, 3].max() > _CLOSE * scale:
        return None
    return IntendedArm(table, float(changes.max()), bool((changes < _SEEN).any()))


def _parallel(lines: Lines) -> tuple[Lines, Array]:
    """The lines with nearly parallel neighbours made parallel, and the angles by which they were turned.

    What comes after a joint is turned with its axis, about the point of the axis that is nearest to the point of
    the one before: common normals of nearly parallel lines are far away.
    """
    z, points, end = lines.z.copy(), lines.points.copy(), lines.T_base_tool.copy()
    turned = np.zeros(len(z))
    for i in range(1, len(z)):
        points[i] += ((points[i - 1] - points[i]) @ z[i]) * z[i]
        across = cross(z[i], z[i - 1])
        sine = float(np.linalg.norm(across))
        if not 0.0 < sine < NEARLY:
            continue
        turned[i] = sine
        R = _rotation(across / sine, math.copysign(math.asin(sine), z[i] @ z[i - 1]))
        z[i:] = z[i:] @ R.T
        z[i] = math.copysign(1.0, z[i] @ z[i - 1]) * z[i - 1]
        points[i + 1 :] = points[i] + (points[i + 1 :] - points[i]) @ R.T
        end[:3, 3] = points[i] + R @ (end[:3, 3] - points[i])
        end[:3, :3] = R @ end[:3, :3]
    return Lines(z, points, lines.sign, end), turned


def _rotation(axis: Array, angle: float) -> Array:
    """The rotation ``(3, 3)`` about a unit vector."""
    K = np.cross(np.eye(3), axis)
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K))


def _along(robot: Robot, lines: Lines) -> Robot:
    """A table with these joint axes."""
    frame, rows = robot.T_world_base.copy(), []
    for i, joint in enumerate(robot.joints):
        link = link_to(inverse(frame), lines.z[i], lines.points[i])
        theta, d, a, alpha = link
        frame = frame @ screw_z(theta, d) @ screw_x(a, alpha)
        rows += [
            Joint(f"{joint.name} link", *link, kind="fixed"),
            Joint(joint.name, 0.0, 0.0, 0.0, 0.0, joint.kind),
        ]
    tool = inverse(frame) @ lines.T_base_tool
    return replace(
        robot,
        convention="standard",
        rows=tuple(rows),
        home=(0.0,) * robot.n,
        tool=tuple(tuple(row) for row in tool.tolist()),
    )


def _snapped(links: Links, scale: float) -> tuple[Links, Array]:
    """Links with right angles, also of the tool, and without tiny lengths, and what was changed."""
    a, d, alpha, tool = links.a.copy(), links.d.copy(), links.alpha.copy(), links.tool.copy()
    quarter = 0.5 * math.pi
    off = np.where(np.abs(np.abs(alpha) - quarter) < NEARLY, np.abs(alpha) - quarter, 0.0)
    alpha -= np.sign(alpha) * off
    changed = [off]
    for lengths in (a, d, tool[:3, 3]):
        tiny = np.abs(lengths) < SHORT * scale
        changed.append(lengths[tiny] / scale)
        lengths[tiny] = 0.0
    x, y, z = tool[:3, 2].tolist()
    # Nearly along the last axis, or nearly perpendicular to it.
    wanted = (
        np.array([x, y, 0.0]) / math.hypot(x, y) if abs(z) < 0.5 else np.array([0.0, 0.0, math.copysign(1.0, z)])
    )
    across = cross(tool[:3, 2], wanted)
    sine = float(np.linalg.norm(across))
    if 0.0 < sine < NEARLY:
        tool[:3, :3] = _rotation(across / sine, math.asin(sine)) @ tool[:3, :3]
        changed.append(np.array([sine]))
    return links._replace(a=a, d=d, alpha=alpha, tool=tool), np.concatenate(changed)
