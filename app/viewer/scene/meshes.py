"""Meshes of any arm, generated from its DH parameters alone.

Each link is a smooth tube along its DH centre line. Each joint is a coloured housing around its axis, whose shape
shows how the joint moves:

- a **hinge** (the link leaves at right angles to the axis) is a drum across the arm;
- a **roll** joint (the link leaves along the axis) is a collar round the tube;
- a **slide** (prismatic) is a square sleeve with a square bar through it.

Wrists and shoulders have several joints at one point. There a collar moves outward along its own axis until it
clears its neighbour, and each further drum is slimmer and longer than the one before, like nested gimbals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from app.viewer.scene.bodies.drawing import drawing
from app.viewer.scene.bodies.fingers import Finger
from app.viewer.scene.bodies.parts import Color, Part, joint_color
from app.viewer.scene.chain import Chain, Link, chain, link_poses
from app.viewer.scene.mounting import Mount, mount_of
from app.viewer.scene.shapes import Solid, ball, box, cone, cylinder, merged, placed, tube
from kin import Robot, link_frames
from kin.transforms import Array

LINK_COLOR: Color = (214, 218, 224)
TRIM_COLOR: Color = (58, 64, 74)
TOOL_COLOR: Color = (136, 144, 158)  # three times as light as a dark page, and as dark as a light one
APPROACH_COLOR: Color = (214, 39, 120)
MOST_AT_A_POINT = 4  # drums at one point, beyond which no further one is longer
GRIPPERS = frozenset({"so100"})  # arms with a gripper whose tables state no motors


@dataclass(frozen=True, eq=False)
class Body:
    """All meshes of a robot.

    Attributes:
        chain: the links.
        parts: per link (base first), its meshes.
        gripper: the tool's meshes in the tool frame, z being the approach direction.
        palm, fingers: the first of these in parts, of an arm whose gripper opens: the palm in the tool frame, the
            fingers in that of the last link. Of others there are no fingers.
        mount: what holds the base, and the floor.
        center, radius: the sphere ``(3,)``, m that the camera should show.
        size: radius of the thickest link (m), the unit of all decoration.
        radii: radius (m) of each link's tube, base first.
    """

    chain: Chain
    parts: tuple[tuple[Part, ...], ...]
    gripper: tuple[Part, ...]
    palm: Part
    fingers: tuple[Finger, ...]
    mount: Mount
    center: Array
    radius: float
    size: float
    radii: tuple[float, ...]


@lru_cache(maxsize=32)
def body(robot: Robot) -> Body:
    """The robot's meshes; the same object for every visitor."""
    links = chain(robot)
    size = _thickness(robot, links)
    grip = _grip_length(links, size, robot)
    tip = _tip(links, size)
    radii = tuple(size * _taper(link.index, len(links.links) - 1, tip) for link in links.links)
    parts = []
    crowd = 0
    for link in links.links:
        crowded = link.index > 0 and np.linalg.norm(link.T_parent_axis[:3, 3]) < 1e-6
        crowd = min(crowd + 1, MOST_AT_A_POINT) if crowded else 0
        held = grip if all(len(after.path) < 2 for after in links.links[link.index + 2 :]) else 0.0
        parts.append(_link_parts(link, radii[link.index + 1], crowd, held, links))
    mount = mount_of(robot, size)
    center, radius = _view_sphere(robot, mount, size)
    hand = _hand(min(size, grip / 2), grip)
    whole = Part("gripper", merged([hand.palm, *hand.fingers]), TOOL_COLOR)
    return Body(
        chain=links,
        parts=tuple(parts),
        gripper=(whole, Part("approach", hand.approach, APPROACH_COLOR)),
        palm=Part("gripper", hand.palm, TOOL_COLOR),
        fingers=_fingers(hand, links) if _opens(robot) else (),
        mount=mount,
        center=center,
        radius=radius,
        size=size,
        radii=radii,
    )


def _thickness(robot: Robot, links: Chain) -> float:
    """Tube radius: a fixed share of the reach, but no thicker than short links allow."""
    steps = [np.linalg.norm(np.diff(link.path, axis=0), axis=1) for link in links.links]
    lengths = np.concatenate([*steps, [robot.reach]])
    size = max(robot.reach, 0.05)
    shortest = float(lengths[lengths > 0.04 * size].min(initial=robot.reach))  # shorter steps are only offsets
    return max(min(0.032 * size, 0.3 * shortest), 0.014 * size)


def _tip(links: Chain, size: float) -> float:
    """Thickness of the last link relative to the first: slim enough for a flange close to the wrist."""
    path = links.links[-1].path
    if len(path) < 2:
        return 0.62
    return max(min(0.62, 0.27 * float(np.linalg.norm(path[1] - path[0])) / size), 0.1)


def _taper(index: int, n: int, tip: float) -> float:
    return 1.0 - (1.0 - tip) * max(index, 0) / max(n - 1, 1)


def _grip_length(links: Chain, size: float, robot: Robot) -> float:
    path = links.links[-1].path
    length = min(3.2 * size, 0.11 * max(robot.reach, 0.05))
    if len(path) < 2:
        strokes = [j.limits[1] - j.limits[0] for j in robot.joints if j.kind == "prismatic" and j.limits]
        return min(length, 0.4 * min(strokes, default=math.inf))  # short enough to leave its sleeve
    return min(length, 0.62 * float(np.linalg.norm(path[-1] - path[-2])))


def _link_parts(link: Link, r: float, crowd: int, grip: float, links: Chain) -> tuple[Part, ...]:
    """A link's meshes. `grip` is the gripper's length if nothing but the gripper follows, 0 otherwise."""
    path = link.path
    if grip > 0.0 and len(path) > 1 and link is links.links[-1]:
        step = path[-1] - path[-2]
        length = float(np.linalg.norm(step))
        if step @ links.T_last_tool[:3, 2] > 0.9 * length:  # the gripper replaces the end of the tube
            path = np.vstack([path[:-1], path[-1] - step / length * min(grip, 0.95 * length)])
    parts = [Part("link", tube(path, r), LINK_COLOR)] if len(path) > 1 else []
    if link.joint is None:
        return tuple(parts)
    color = joint_color(link.leader)
    if link.joint.kind == "prismatic":
        return (*parts, *_slide(link, r, color, grip))
    along = _leaves_along(link)
    if along:
        middle = 0.85 * r + (1.75 * r if crowd else 0.15 * r)
        if link is links.links[-1]:  # clear of the fingers
            middle = max(min(middle, float(np.linalg.norm(link.path[1])) - 0.45 * grip - 0.85 * r), 0.85 * r)
        return (*parts, *_collar(r, along, along * middle, color))
    ahead = float(links.T_last_tool[2, 2])
    if grip > 0.0 and len(path) < 2 and link is links.links[-1] and abs(ahead) > 0.9:
        # The joint turns the gripper about the gripper's own axis: its collar sits behind the gripper.
        return (*parts, *_collar(r, 1, -math.copysign(grip + 0.7 * r, ahead), color))
    return (*parts, *_drum(r, crowd, color))


def _leaves_along(link: Link) -> int:
    """+1 or −1 if the link leaves its joint along the axis, 0 for a hinge."""
    if len(link.path) < 2:
        return 0
    step = link.path[1] - link.path[0]
    share = float(step[2] / np.linalg.norm(step))
    return int(math.copysign(1, share)) if abs(share) > 0.9 else 0


def _drum(r: float, crowd: int, color: Color) -> list[Part]:
    radius, half = r * 1.62 * 0.8**crowd, r * 1.6 * 1.32**crowd
    caps = merged([cylinder(0.72 * radius, s * half - 0.1 * r, s * half + 0.1 * r) for s in (-1.0, 1.0)])
    mark = box((radius * 0.6, -0.16 * r, -0.82 * half), (radius * 1.06, 0.16 * r, 0.82 * half))
    return [
        Part("housing", cylinder(radius, -half, half), color),
        Part("trim", merged([caps, mark]), TRIM_COLOR),
        Part("axis", rod(r, -half - 1.5 * r, half + 2.1 * r), color),
    ]


def _collar(r: float, along: int, middle: float, color: Color) -> list[Part]:
    """A collar around a height of the axis; the link leaves upward or downward."""
    radius, half = r * 1.42, r * 0.85
    rims = [cylinder(radius * 1.06, middle + s * half - 0.13 * r, middle + s * half + 0.13 * r) for s in (-1, 1)]
    mark = box((radius * 0.8, -0.16 * r, middle - 0.8 * half), (radius * 1.07, 0.16 * r, middle + 0.8 * half))
    # The tube hides the axis on one side; it shows behind the joint, and through the collar as its rims.
    behind = -along * 3.4 * r
    return [
        Part("housing", cylinder(radius, middle - half, middle + half), color),
        Part("trim", merged([*rims, mark]), TRIM_COLOR),
        Part("axis", rod(r, min(behind, 0.0), max(behind, 0.0), arrow=along < 0), color),
    ]


def _slide(link: Link, r: float, color: Color, grip: float) -> list[Part]:
    """A sleeve, and a bar long enough to stay in the sleeve at both ends of the stroke."""
    assert link.joint is not None
    low, high = link.joint.limits or (0.0, 8 * r)
    bar = 0.75 * r
    back, front = -max(high, 0.0) - 1.2 * r, -min(low, 0.0) + (1.2 * r if grip == 0.0 else -0.9 * grip)
    return [
        Part("link-bar", box((-bar, -bar, back), (bar, bar, front)), LINK_COLOR),
        Part("housing", box((-1.3 * r, -1.3 * r, -r), (1.3 * r, 1.3 * r, r)), color, fixed_to_parent=True),
        Part("axis", rod(r, front, front + 2.4 * r), color),
    ]


def rod(r: float, low: float, high: float, arrow: bool = True) -> Solid:
    """A thin rod along z; its arrow head shows the positive direction."""
    rod = cylinder(0.13 * r, low, high)
    return merged([rod, cone(0.38 * r, high - 0.2 * r, high + 0.8 * r)]) if arrow else rod


@dataclass(frozen=True, eq=False)
class _Hand:
    """The meshes of the tool in its frame: the fingers are as far apart as they can be.

    Attributes:
        stroke: how far (m) each finger is from where it meets the other.
    """

    palm: Solid
    fingers: tuple[Solid, Solid]
    stroke: float
    approach: Solid


def _hand(size: float, grip: float) -> _Hand:
    w = 0.62 * size  # half the opening
    t = 0.2 * size
    palm = box((-w - 2 * t, -0.5 * size, -0.78 * grip), (w + 2 * t, 0.5 * size, -0.5 * grip))
    flange = cylinder(0.8 * size, -grip, -0.78 * grip)
    right, left = (
        box((min(a, b), -0.34 * size, -0.5 * grip), (max(a, b), 0.34 * size, 0.0))
        for a, b in ((w, w + 1.4 * t), (-w, -w - 1.4 * t))
    )
    arrow = merged([cylinder(0.11 * size, 0.0, 2.2 * size), cone(0.34 * size, 2.1 * size, 3.1 * size)])
    return _Hand(merged([flange, palm]), (right, left), w, merged([ball(0.2 * size), arrow]))


def _opens(robot: Robot) -> bool:
    """Whether the arm has a gripper: a motor that moves no joint."""
    return robot.id in GRIPPERS or any(not motor.joint for motor in robot.motors)


def _fingers(hand: _Hand, links: Chain) -> tuple[Finger, ...]:
    """The fingers of the tool in the frame of the last link, which slide along the x axis of the tool."""
    T, found = links.T_last_tool, []
    for solid, side in zip(hand.fingers, (1.0, -1.0), strict=True):
        axis = np.zeros((4, 4))
        axis[2, 0], axis[1, 1], axis[0, 2], axis[3, 3] = -side, 1.0, side, 1.0  # its z is ±x of the tool
        part = Part("finger", placed(solid, T), TOOL_COLOR)
        found.append(Finger(len(links.links) - 1, (part,), T @ axis, True, -hand.stroke, 0.0))
    return tuple(found)


def _view_sphere(robot: Robot, mount: Mount, size: float) -> tuple[Array, float]:
    """A sphere around the arm at home and what it is mounted on."""
    points = [robot.T_world_base[None, :3, 3], link_frames(robot, robot.q_home)[:, :3, 3]]
    points.append(mount.foot[None])
    if mount.kind in ("table", "ceiling"):
        points.append(np.maximum(mount.part.mesh.bounds, [-np.inf, -np.inf, mount.foot[2]]))
    drawn = drawing(robot)
    if drawn is not None:
        poses = link_poses(robot, robot.q_home[None])[0]
        for T, spheres in zip(poses, drawn.spheres, strict=True):
            points.append(spheres[:, :3] @ T[:3, :3].T + T[:3, 3])
    every = np.vstack(points)
    center = (every.min(axis=0) + every.max(axis=0)) / 2.0
    radius = max(float(np.linalg.norm(every - center, axis=1).max()) + 3 * size, 0.45 * robot.reach)
    return center, radius
