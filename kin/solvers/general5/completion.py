"""Virtual joints at the tool, which complete an arm to six joints."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from kin.axes import inverse, is_zero, screw_x, screw_z
from kin.differential.metric import extent
from kin.robot import Joint, Robot
from kin.transforms import Array

Axes = tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...]
_X, _Y, _Z, _TOOL = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
# Direction and a point of each virtual axis, in the tool's frame; points in shares of the arm's reach.
ROLL: Axes = ((_Z, _TOOL),)
BALL: Axes = ((_X, _TOOL), (_Y, _TOOL), (_Z, _TOOL))
_ANY: Axes = (
    ((0.53, 0.61, 0.59), (0.11, -0.07, 0.05)),
    ((-0.47, 0.71, 0.52), (-0.06, 0.09, 0.13)),
    ((0.81, -0.35, 0.47), (0.09, 0.12, -0.04)),
)
COMPLETIONS: dict[int, tuple[Axes, ...]] = {3: (BALL, _ANY), 4: (_ANY[:2],), 5: (ROLL, _ANY[:1])}


def completed(robot: Robot, axes: Axes) -> Robot:
    """The arm with virtual joints about these axes."""
    reach = extent(robot)
    frame, rows, tool = np.eye(4), list(robot.rows), robot.T_last_tool
    for k, (direction, place) in enumerate(axes):
        z = tool[:3, :3] @ np.asarray(direction) / np.linalg.norm(direction)
        point = tool[:3, 3] + reach * (tool[:3, :3] @ np.asarray(place))
        theta, d, a, alpha = link_to(inverse(frame), z, point)
        frame = frame @ screw_z(theta, d) @ screw_x(a, alpha)
        name = f"virtual {k + 1}"
        # In either convention the fixed row and the joint's row together are this link, then the joint.
        first = (theta, d, a, alpha) if robot.convention == "standard" else (theta, d, 0.0, 0.0)
        last = (0.0, 0.0, 0.0, 0.0) if robot.convention == "standard" else (0.0, 0.0, a, alpha)
        rows += [Joint(f"{name} link", *first, kind="fixed"), Joint(name, *last)]
    T = inverse(frame) @ tool
    return replace(
        robot,
        rows=tuple(rows),
        home=(*robot.home, *(0.0,) * len(axes)),
        tool=tuple(tuple(row) for row in T.tolist()),
    )


def link_to(back: Array, z: Array, point: Array) -> tuple[float, float, float, float]:
    """(θ, d, a, α) of the link from a frame, given by its inverse, to an axis: Rz(θ) Tz(d) Tx(a) Rx(α)."""
    zx, zy, zz = (back[:3, :3] @ z).tolist()
    px, py, pz = (back[:3, :3] @ point + back[:3, 3]).tolist()
    if is_zero(zx, zy):  # parallel
        return (0.0 if is_zero(px, py) else math.atan2(py, px)), pz, math.hypot(px, py), math.acos(round(zz))
    sine = math.hypot(zx, zy)
    theta = math.atan2(zx, -zy)  # x is perpendicular to both axes
    c, s = math.cos(theta), math.sin(theta)
    a = c * px + s * py
    along = (c * py - s * px) / -sine  # from the foot of the normal to the point
    return theta, pz - along * zz, a, math.atan2(sine, zz)
