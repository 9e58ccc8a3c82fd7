"""`Robot` → MJCF: one body per joint, with its capsules, and masses that are assumed.

A table says nothing about masses, and MuJoCo needs them. Each capsule has the density of water, and a link without
one is a ball; a comment in the file says so. Replace them before simulating forces.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kin.axes import inverse, screw_x, screw_z
from kin.collision.bodies import Bodies, bodies_of
from kin.errors import InputError
from kin.files.mjcf.convert import FLOOR, MOUNTING
from kin.files.names import distinct, quoted, unused
from kin.fk import link_frames
from kin.named import robot_of
from kin.robot import Joint, Robot
from kin.transforms import Array, wxyz_from_rotation

DENSITY = 1000.0  # kg/m³ of a capsule
BALL = 0.1, 0.03  # kg and m of a link without a capsule
ASSUMED = (
    f"Masses and inertia are assumed: {DENSITY:g} kg/m3 in each capsule, and a ball of {BALL[0]:g} kg for a link "
    "without one. Replace them before simulating forces."
)
_SHORTEST = 1e-9  # m: a shorter capsule is a sphere


def robot_to_mjcf(robot: Robot | str) -> str:
    """The arm as MJCF, for MuJoCo: joints, limits, capsules, the tool as a site, the home as a keyframe.

    A floor whose height is stated is a plane. All links but the first, which turns close to it, touch it. The
    height, and what the arm is mounted on, are custom data too, which `load_robot` reads.

    The values of the joints are those of the arm. A row that follows a joint is a joint of its own there, with an
    equality. Links that are not compared for collisions here are
    excluded from contacts. An effort limits the force of its joint.

    Args:
        robot: the arm, or the id of a built-in one.

    Returns:
        The text of the file.

    Raises:
        InputError: a joint whose limits leave no motion.
        UnknownRobotError: an id that does not exist.

    Examples:
        >>> text = robot_to_mjcf("planar2r")
        >>> text.count("<joint ")
        2
    """
    robot = robot_of(robot)
    bodies = bodies_of(robot)
    moving = [robot.rows[index] for index in robot.moving_rows]
    names = distinct([row.name for row in moving])
    base = unused("base", set(names))
    links = [base, *names]
    lines = [
        '<?xml version="1.0" encoding="utf-8"?>',
        f"<mujoco model={quoted(robot.id)}>",
        f"  <!-- {ASSUMED} -->",
        '  <compiler angle="radian" autolimits="true"/>',
        f'  <default><geom density="{DENSITY:g}"/></default>',
        *_stated(robot),
        "  <worldbody>",
        *_floor(robot),
        f"    <body name={quoted(base)}>",
        *_geoms(robot, bodies, 0, robot.T_world_base, "      "),
    ]
    lines += _nested(robot, bodies, moving, names)
    lines += ["  </worldbody>", *_contacts(bodies, links, robot.floor is not None)]
    lines += [*_equalities(robot, moving, names), "  <keyframe>"]
    lines.append(f'    <key name="home" qpos="{_numbers(robot.expand(robot.q_home))}"/>')
    return "\n".join([*lines, "  </keyframe>", "</mujoco>", ""])


def _nested(robot: Robot, bodies: Bodies, moving: Sequence[Joint], names: Sequence[str]) -> list[str]:
    """The bodies that move, each in the one before, and the tool in the last; with the ends of all bodies."""
    frames, lines = _frames(robot), []
    before = np.eye(4)
    for k, (joint, name) in enumerate(zip(moving, names, strict=True), 1):
        indent = "    " + "  " * k
        lines += [
            f"{indent}<body name={quoted(name)}{_placed(inverse(before) @ frames[k - 1])}>",
            f"{indent}  {_joint(joint, name)}",
            *_geoms(robot, bodies, k, frames[k - 1], indent + "  "),
        ]
        if not any(each.link == k for each in bodies.capsules):
            lines.append(f"{indent}  {_ball()}")
        before = frames[k - 1]
    tool = link_frames(robot, np.zeros(robot.n))[-1] @ robot.T_last_tool
    indent = "    " + "  " * (len(moving) + 1)
    lines.append(f'{indent}<site name="tool"{_placed(inverse(before) @ tool)}/>')
    lines += ["    " + "  " * k + "</body>" for k in range(len(moving), -1, -1)]
    return lines


def _frames(robot: Robot) -> list[Array]:
    """The frames of the joints in the world ``(4, 4)`` at zero, each joint about or along z."""
    found, T = [], robot.T_world_base
    for row in robot.rows:
        x, z = screw_x(row.a, row.alpha), screw_z(row.theta, row.d)
        standard = robot.convention == "standard"
        at = T @ z if standard else T @ x @ z
        if row.moves:
            found.append(at)
        T = at @ x if standard else at
    return found


def _joint(joint: Joint, name: str) -> str:
    kind = "slide" if joint.kind == "prismatic" else "hinge"
    text = f'<joint name={quoted(name)} type="{kind}" axis="0 0 1"'
    if joint.limits is not None:
        if not joint.limits[0] < joint.limits[1]:
            raise InputError(
                f"limits of {joint.name}", joint.limits, "lower below upper: MuJoCo takes no other range"
            )
        text += f' range="{_numbers(joint.limits)}"'
    if joint.effort is not None:
        text += f' actuatorfrcrange="{_numbers((-joint.effort, joint.effort))}"'
    return text + "/>"


def _ball() -> str:
    """The mass of a link without a capsule."""
    mass, radius = BALL
    diagonal = " ".join([repr(0.4 * mass * radius**2)] * 3)
    return f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="{diagonal}"/>'


def _geoms(robot: Robot, bodies: Bodies, link: int, T_world_body: Array, indent: str) -> Iterator[str]:
    """The capsules of a link in the frame of its body."""
    frames = link_frames(robot, np.zeros(robot.n))
    for each in bodies.capsules:
        if each.link != link:
            continue
        T = inverse(T_world_body) @ (robot.T_world_base if each.row < 0 else frames[each.row])
        if link == 0:
            T = T_world_body @ T  # the body of the base stands in the world
        start, end = (T[:3, :3] @ np.array(point) + T[:3, 3] for point in (each.start, each.end))
        if float(np.linalg.norm(end - start)) < _SHORTEST:
            yield f'{indent}<geom type="sphere" pos="{_numbers(start)}" size="{each.radius!r}"/>'
        else:
            ends = _numbers([*start, *end])
            yield f'{indent}<geom type="capsule" fromto="{ends}" size="{each.radius!r}"/>'


def _stated(robot: Robot) -> list[str]:
    """What the arm is mounted on, and the height of the floor, as far as they are stated."""
    lines = []
    if robot.mounting is not None:
        lines.append(f'    <text name="{MOUNTING}" data="{robot.mounting}"/>')
    if robot.floor is not None:
        lines.append(f'    <numeric name="{FLOOR}" data="{robot.floor!r}"/>')
    return ["  <custom>", *lines, "  </custom>"] if lines else []


def _floor(robot: Robot) -> Iterator[str]:
    if robot.floor is not None:
        yield f'    <geom name="floor" type="plane" pos="0 0 {robot.floor!r}" size="0 0 0.05"/>'


def _contacts(bodies: Bodies, links: Sequence[str], floor: bool) -> list[str]:
    """Pairs of links that are not compared; those that share a joint, where MuJoCo would compare them."""
    present = sorted({each.link for each in bodies.capsules})
    compared = {(bodies.capsules[i].link, bodies.capsules[j].link) for i, j in bodies.pairs.tolist()}
    lines = [
        f"    <exclude body1={quoted(links[i])} body2={quoted(links[j])}/>"
        for i in present
        for j in present
        if i < j and (i, j) not in compared and (j > i + 1 or i == 0)
    ]
    if floor:
        lines.append(f'    <exclude body1="world" body2={quoted(links[1])}/>')
    return ["  <contact>", *lines, "  </contact>"] if lines else []


def _equalities(robot: Robot, moving: Sequence[Joint], names: Sequence[str]) -> list[str]:
    """The rows that follow joints."""
    places = {row.name: name for row, name in zip(moving, names, strict=True) if row.driven}
    lines = [
        f'    <joint joint1={quoted(name)} joint2={quoted(places[row.follows])} polycoef="0 {row.ratio!r} 0 0 0"/>'
        for row, name in zip(moving, names, strict=True)
        if row.follows
    ]
    return ["  <equality>", *lines, "  </equality>"] if lines else []


def _placed(T: Array) -> str:
    return f' pos="{_numbers(T[:3, 3])}" quat="{_numbers(wxyz_from_rotation(T[:3, :3]))}"'


def _numbers(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)
