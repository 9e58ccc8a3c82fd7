"""Where the drawn arm passes through what it is mounted on, or through the floor.

The drawn parts are covered by spheres along their centre lines, each fixed to the frame of a DH row. One test of a
configuration takes about 20 µs: 100–250 spheres against a plane and a few blocks. Links are not tested against
each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from app.viewer.scene.bodies.drawing import Drawing, drawing
from app.viewer.scene.bodies.parts import Part
from app.viewer.scene.chain import Link
from app.viewer.scene.meshes import Body, body
from app.viewer.scene.mounting import FOOT, Holder
from app.viewer.scene.shapes import spaced
from kin import Robot, link_frames
from kin.transforms import Array

FLOOR: Holder = "floor"
DEPTH = 0.2  # relative to the thickness of a link: what is less deep only touches
# A sphere beside the base that is in the mount or the floor in most configurations belongs to the mounting.
SAMPLES, MOST = 100, 0.6


@dataclass(frozen=True)
class Contact:
    """The deepest place where a drawn part is inside an obstacle.

    Attributes:
        link: index of the row that moves the part, among those that move; their number for the gripper.
        point: centre of the sphere that is inside ``(3,)``, m.
    """

    obstacle: Holder
    link: int
    point: Array

    def text(self, robot: Robot) -> str:
        """The contact as a sentence."""
        part = "The gripper" if self.link == len(robot.moving_rows) else f"Link {self.link + 1}"
        return f"{part} passes through the {self.obstacle}."


class Clearance:
    """The test for one robot's drawn body. Immutable, so visitors share it."""

    def __init__(self, robot: Robot, made: Body, drawn: Drawing | None) -> None:
        self._robot = robot
        rows, points, radii, self._links = _spheres(robot, made, drawn)
        self._rows, self._points, self._radii = rows, np.column_stack([points, np.ones(len(points))]), radii
        mount = made.mount
        self._mount, self._slack = mount, DEPTH * made.size
        self._floor = mount.floor + radii  # lowest height of each centre that is clear of the floor
        # Spheres beyond these bounds, in the frame of the mount, are clear of it.
        far = max((block.far for block in mount.blocks), default=-math.inf)
        self._aside = np.where(far + radii > 0.0, far + radii, 0.0) ** 2
        self._above = max((block.high for block in mount.blocks), default=-math.inf) + radii
        q = robot.random_q(np.random.default_rng(11), SAMPLES)
        places = [self._place(frames) for frames in link_frames(robot, q)]
        held, below, off, every = [], [], [], np.arange(len(radii))
        for points in places:
            local = self._local(points)
            off.append(np.hypot(local[:, 0], local[:, 1]))
            beside = off[-1] < FOOT * made.size + radii
            held.append(beside & (self._inside(local, every) > 0.0))
            below.append(beside & (points[:, 2] < self._floor))
        # What only turns about the mount's axis and slides along it is guided by the mount: a lift in its column.
        guided = (np.ptp(off, axis=0) < 1e-6) & (np.max(off, axis=0) < FOOT * made.size + radii)
        self._aside[guided | (np.mean(held, axis=0) > MOST)] = -1.0
        self._floor[guided | (np.mean(below, axis=0) > MOST)] = -math.inf

    def at(self, q: Array) -> Contact | None:
        """The deepest contact at a configuration ``(n,)``; None if there is none."""
        points = self._place(link_frames(self._robot, q))
        below = self._floor - points[:, 2]
        k = int(below.argmax())
        deepest, obstacle = float(below[k]), FLOOR
        local = self._local(points)
        x, y, z = local.T
        near = np.flatnonzero((x * x + y * y < self._aside) & (z < self._above))
        if len(near):
            inside = self._inside(local, near)
            i = int(inside.argmax())
            if inside[i] > deepest:
                deepest, obstacle, k = float(inside[i]), self._mount.holder, int(near[i])
        if deepest <= self._slack:
            return None
        return Contact(obstacle, int(self._links[k]), points[k])

    def _local(self, points: Array) -> Array:
        """Points ``(k, 3)`` in the frame of the mount."""
        local: Array = (points - self._mount.frame[:3, 3]) @ self._mount.frame[:3, :3]
        return local

    def _place(self, frames: Array) -> Array:
        """Centres ``(k, 3)`` of the spheres."""
        centres: Array = (frames[self._rows, :3] @ self._points[:, :, None])[:, :, 0]
        return centres

    def _inside(self, local: Array, chosen: NDArray[np.int64]) -> Array:
        """How deep each chosen sphere is inside the mount, at most its radius; negative outside.

        `local`: centres ``(k, 3)`` in the frame of the mount.
        """
        x, y, z = local[chosen].T
        nearest = np.full(len(z), np.inf)
        for block in self._mount.blocks:
            across = block.across(x, y)
            along = np.maximum(np.maximum(block.low - z, z - block.high), 0.0)
            nearest = np.minimum(nearest, across * across + along * along)
        depth: Array = self._radii[chosen] - np.sqrt(nearest)
        return depth


@lru_cache(maxsize=32)
def clearance(robot: Robot, skeleton: bool = False) -> Clearance:
    """The test for a robot with its own drawn body, or for its skeleton; the same object for every visitor."""
    return Clearance(robot, body(robot), None if skeleton else drawing(robot))


def clearance_of(robot: Robot, drawn: Drawing | None) -> Clearance:
    """The test for a robot with any drawn body; None: for its skeleton."""
    if drawn is None or drawn is drawing(robot):
        return clearance(robot, drawn is None)
    return Clearance(robot, body(robot), drawn)


def _spheres(
    robot: Robot, made: Body, drawn: Drawing | None
) -> tuple[NDArray[np.int64], Array, Array, NDArray[np.int64]]:
    """The spheres that cover the moving parts: DH row, centre in the frame of that row, radius, and link."""
    rows: list[int] = []
    points: list[Array] = []
    radii: list[float] = []
    links: list[int] = []

    def add(link: Link, centres: Array, radius: Array | float, index: int) -> None:
        row, T_link_row = link.frames[-1]
        local = (centres - T_link_row[:3, 3]) @ T_link_row[:3, :3]
        rows.extend([row] * len(local))
        points.append(local)
        radii.extend(np.broadcast_to(radius, len(local)).tolist())
        links.extend([index] * len(local))

    moving = [link for link in made.chain.links[1:] if link.frames]
    if drawn is not None:
        for link in moving:
            cover = drawn.spheres[link.index + 1]
            add(link, cover[:, :3], cover[:, 3], link.index)
        return np.array(rows, int), np.vstack(points), np.array(radii), np.array(links, int)
    tool = made.chain.T_last_tool
    hand = next(part for part in made.gripper if part.name == "gripper")
    for link in moving:
        parts = made.parts[link.index + 1]
        if any(part.name == "link" for part in parts):
            radius = made.radii[link.index + 1]
            centres = spaced(link.path, radius)
            if link is moving[-1]:  # the gripper replaces the end of the tube
                centres = centres[np.linalg.norm(centres - tool[:3, 3], axis=1) > -hand.mesh.bounds[0, 2]]
            add(link, centres, radius, link.index)
        for part in parts:
            if part.name in ("housing", "link-bar") and not part.fixed_to_parent:
                add(link, *_core(part), link.index)
    if moving:
        centres, radius = _core(hand)
        add(moving[-1], centres @ tool[:3, :3].T + tool[:3, 3], radius, len(robot.moving_rows))
    return np.array(rows, int), np.vstack(points), np.array(radii), np.array(links, int)


def _core(part: Part) -> tuple[Array, float]:
    """Centres ``(k, 3)`` and radius of spheres that fill a part along z."""
    low, high = part.mesh.bounds
    radius = float(min((high - low)[:2])) / 2.0
    middle, half = (low + high) / 2.0, max((high - low)[2] / 2.0 - radius, 0.0)
    ends = np.array([[*middle[:2], middle[2] - half], [*middle[:2], middle[2] + half]])
    return (spaced(ends, radius) if half > 0.0 else ends[:1]), radius
