"""`Robot` → URDF: one joint per DH row, each about the z axis of its link."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kin.axes import screw_x, screw_z
from kin.errors import InputError
from kin.files.names import distinct, quoted, unused
from kin.files.write import rpy_of
from kin.named import robot_of
from kin.robot import Joint, Robot
from kin.transforms import Array

_UNKNOWN = 0.0  # velocity and effort are required by URDF
_URDF_1_2 = ("acceleration", "jerk")  # which older readers ignore


def robot_to_urdf(robot: Robot | str) -> str:
    """The arm as a URDF without bodies: links ``base``, one per row, and ``tool``.

    A row that follows a joint has `<mimic>`.
    A velocity or effort that is not known is written as 0. An arm whose mounting or floor is stated has a link
    ``world`` too, to which a fixed joint mounts its base. An element ``<kinboard>`` states what it is mounted on,
    and how high the floor is. Other programs ignore that element, and `load_robot` reads it.

    Args:
        robot: the arm, or the id of a built-in one.

    Returns:
        The text of the URDF, in metres and radians.

    Raises:
        InputError: a slide without limits, which URDF cannot describe, or a joint whose limits leave no motion.

    Examples:
        >>> import kin
        >>> kin.robot_to_urdf("ur5").startswith("<?xml")
        True
    """
    robot = robot_of(robot)
    lines = ['<?xml version="1.0" encoding="utf-8"?>', f"<robot name={quoted(robot.id)}>"]
    names = distinct([row.name for row in robot.rows])
    links = ["base", *(f"link_{k + 1}" for k in range(len(robot.rows))), "tool"]
    taken, T = names, robot.T_world_base
    if robot.mounting is not None or robot.floor is not None:
        mounted = unused("mounting", names)
        lines += [_stated(robot), '  <link name="world"/>']
        lines += _joint(Joint(mounted, kind="fixed"), mounted, "world", "base", T)
        taken, T = [*names, mounted], np.eye(4)
    lines += [f"  <link name={quoted(link)}/>" for link in links]
    for k, (row, name) in enumerate(zip(robot.rows, names, strict=True)):
        x, z = screw_x(row.a, row.alpha), screw_z(row.theta, row.d)
        standard = robot.convention == "standard"
        lines += _joint(_bounded(robot, row), name, links[k], links[k + 1], T @ z if standard else T @ x @ z)
        if row.follows:
            leader = names[[each.name for each in robot.rows].index(row.follows)]
            mimic = f'    <mimic joint={quoted(leader)} multiplier={quoted(repr(row.ratio))} offset="0.0"/>'
            lines.insert(len(lines) - 1, mimic)
        T = x if standard else np.eye(4)
    end = unused("tool" if "tool" not in taken else "tool end", taken)
    lines += _joint(Joint(end, kind="fixed"), end, links[-2], links[-1], T @ robot.T_last_tool)
    return "\n".join([*lines, "</robot>", ""])


def _bounded(robot: Robot, row: Joint) -> Joint:
    """The row; a slide that follows a joint has the limits which that leaves it."""
    if not row.follows or row.kind != "prismatic" or row.limits is not None:
        return row
    leader = next(joint for joint in robot.joints if joint.name == row.follows)
    ends = None if leader.limits is None else sorted(row.ratio * end for end in leader.limits)
    return row if ends is None else replace(row, limits=(ends[0], ends[1]))


def _stated(robot: Robot) -> str:
    """What the arm is mounted on, and the height of the floor, as far as they are stated."""
    mounting = "" if robot.mounting is None else f' mounting="{robot.mounting}"'
    floor = "" if robot.floor is None else f' floor="{robot.floor!r}"'
    return f"  <kinboard{mounting}{floor}/>"


def _joint(row: Joint, name: str, parent: str, child: str, T: Array) -> list[str]:
    kind = "continuous" if row.kind == "revolute" and row.limits is None else row.kind
    lines = [
        f'  <joint name={quoted(name)} type="{kind}">',
        f"    <parent link={quoted(parent)}/>",
        f"    <child link={quoted(child)}/>",
        f'    <origin xyz="{_numbers(T[:3, 3])}" rpy="{_numbers(rpy_of(T))}"/>',
    ]
    if row.kind != "fixed":
        lines.append('    <axis xyz="0 0 1"/>')
        limits = ""
        if row.limits is not None:
            if not row.limits[0] < row.limits[1]:
                expected = "lower below upper: a joint that does not move is a fixed row"
                raise InputError(f"limits of {row.name}", row.limits, expected)
            limits = f'lower="{row.limits[0]!r}" upper="{row.limits[1]!r}" '
        elif row.kind == "prismatic":
            raise InputError(f"limits of {row.name}", None, "limits: URDF has no slide without them")
        effort, velocity = (_UNKNOWN if value is None else value for value in (row.effort, row.velocity))
        more = "".join(f' {key}="{value!r}"' for key in _URDF_1_2 if (value := getattr(row, key)) is not None)
        lines.append(f'    <limit {limits}effort="{effort!r}" velocity="{velocity!r}"{more}/>')
    return [*lines, "  </joint>"]


def _numbers(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)
