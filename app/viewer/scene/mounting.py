"""What an arm is mounted on, and the floor: the one place that says what holds the base and how deep the floor is.

A robot file may state both (`Robot.mounting`, `Robot.floor`). By default, an arm whose base points up stands on a
short pedestal, which leaves room to work beside it. One whose base points down hangs from a ceiling. The
solids of the mounting are blocks in the frame of the mount: its origin is that of the base, its z axis leads out
of the surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from app.viewer.scene.bodies.parts import Color, Part
from app.viewer.scene.shapes import Solid, box, cylinder, merged, placed
from kin import Robot, link_frames
from kin.robot import Mounting
from kin.transforms import Array

Holder = Literal["pedestal", "base", "floor", "table", "wall", "ceiling"]
COLOR: Color = (126, 134, 147)
PROBES = 8000
PEDESTAL = 0.12  # height of a pedestal, relative to the reach
TABLE, TABLE_REACH = 0.75, 1.2  # height of a table: m, but at most so many reaches
COLUMN, PLATE, FOOT = 1.6, 2.3, 3.4  # radii of column, plate and foot, relative to the thickness of a link
# Half of the side of a table, a wall and a ceiling, relative to the reach.
TABLE_HALF, WALL_HALF, CEILING_HALF = 0.36, 0.55, 0.25
DEEPEST = 1.5  # reaches below the base: a floor that is deeper is not in the picture
_STEP = 0.05  # m, to which the height of a floor is rounded that is not stated
_UPRIGHT = 0.7  # height of the base's z axis, from which it points up


class Block(NamedTuple):
    """A cylinder along z, or a box: centre and half sides across it (m), lower and upper end."""

    low: float
    high: float
    half: tuple[float, float]
    center: tuple[float, float] = (0.0, 0.0)
    round: bool = False

    def across(self, x: Array, y: Array) -> Array:
        """How far points are beside it, seen along z; 0 above, in and below it."""
        x, y = np.abs(x - self.center[0]), np.abs(y - self.center[1])
        if self.round:
            beside: Array = np.maximum(np.hypot(x, y) - self.half[0], 0.0)
        else:
            beside = np.hypot(np.maximum(x - self.half[0], 0.0), np.maximum(y - self.half[1], 0.0))
        return beside

    @property
    def far(self) -> float:
        """Distance of its farthest point from the z axis, or more."""
        return math.hypot(*(abs(c) + h for c, h in zip(self.center, self.half, strict=True)))


@dataclass(frozen=True, eq=False)
class Mount:
    """What holds the base of an arm, and the floor.

    Attributes:
        kind: as stated, or as assumed.
        holder: what the blocks are, in a sentence.
        floor: height of the floor (m) in the world frame.
        frame: of the mount ``(4, 4)`` in the world frame.
        blocks: its solids, in this frame.
        part: their mesh in the world frame.
        foot: where it stands ``(3,)``, or what is below the base; a very deep floor is nearer here.
        aside: from a point beside the base to where its name is written ``(3,)``: far enough from the surface that
            it does not cut the text.
    """

    kind: Mounting
    holder: Holder
    floor: float
    frame: Array
    blocks: tuple[Block, ...]
    part: Part
    foot: Array
    aside: Array

    @property
    def stands(self) -> bool:
        """Whether something leads from the base down to the floor."""
        return self.kind in ("pedestal", "floor", "table")

    def surface(self, x: float, y: float) -> float:
        """Height (m) on which a body stands at x, y: that of the table or of the floor."""
        if self.kind != "table":
            return self.floor
        top = self.blocks[0]
        local = np.array([x, y]) - self.frame[:2, 3]
        on_it = bool(np.all(np.abs(local) <= top.half))
        return float(self.frame[2, 3]) + top.high if on_it else self.floor


def turn_of(kind: Mounting) -> Array:
    """The rotation ``(3, 3)`` from something standing on a floor to something mounted in this way."""
    if kind == "wall":
        return np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    return np.diag([1.0, -1.0, -1.0]) if kind == "ceiling" else np.eye(3)


def mount_of(robot: Robot, size: float) -> Mount:
    """What holds the base of an arm whose links are so thick (m)."""
    up = float(robot.T_world_base[2, 2])
    kind: Mounting = robot.mounting or ("ceiling" if up < -_UPRIGHT else "pedestal")
    floor = _floor(robot, kind, size) if robot.floor is None else robot.floor
    frame = np.eye(4)
    frame[:3, :3] = _wall(robot) if kind == "wall" else turn_of(kind)
    frame[:3, 3] = robot.T_world_base[:3, 3]
    height = max(float(frame[2, 3]) - floor, 0.0)
    holder, blocks = _blocks(kind, size, robot.reach, height)
    foot = np.array([*frame[:2, 3], max(floor, float(frame[2, 3]) - DEEPEST * robot.reach)])
    mesh = merged([placed(_solid(block), frame) for block in blocks])
    if robot.mounting is None and kind == "pedestal" and up <= _UPRIGHT:  # the base is tilted, and so is its plate
        plate = cylinder(PLATE * size, -0.9 * size, 0.0)
        column = [placed(_solid(block), frame) for block in blocks[1:]]
        mesh, blocks = merged([placed(plate, robot.T_world_base), *column]), ()
    # A pedestal is clear of its names, and a ceiling is seen from above, where it hides them whole.
    aside = size * frame[:3, 2] if kind in ("floor", "table", "wall") else np.zeros(3)
    return Mount(kind, holder, floor, frame, blocks, Part("pedestal", mesh, COLOR), foot, aside)


def _blocks(kind: Mounting, size: float, reach: float, height: float) -> tuple[Holder, tuple[Block, ...]]:
    """The solids that hold the base, in the frame of the mount, and the name of their kind."""

    def disc(radius: float, low: float, high: float) -> Block:
        return Block(low, high, (radius * size, radius * size), round=True)

    plate, thick = disc(PLATE, -0.9 * size, 0.0), 0.8 * size
    if kind in ("pedestal", "floor"):
        if height < 1.4 * size:
            return "floor", (disc(PLATE, -height, 0.3 * size - height),)
        column = disc(COLUMN, -height, -0.4 * size), disc(FOOT, -height, 0.5 * size - height)
        return ("base", column) if kind == "floor" else ("pedestal", (plate, *column))
    back = -0.3 * size
    if kind == "ceiling":
        half = max(CEILING_HALF * reach, 1.5 * PLATE * size)
        return "ceiling", (Block(back - thick, back, (half, half)), disc(PLATE, back, 0.0))
    if kind == "wall":
        half = max(WALL_HALF * reach, 2.0 * PLATE * size)
        # The frame's x axis leads down: the wall stands on the floor, if that is not far below.
        below = min(max(height, half), DEEPEST * reach)
        panel = Block(back - thick, back, (0.5 * (below + half), half), (0.5 * (below - half), 0.0))
        return "wall", (panel, disc(PLATE, back, 0.0))
    half = max(TABLE_HALF * reach, 1.5 * PLATE * size)
    leg, at = 0.7 * size, half - size
    top = Block(max(back - thick, min(-height, back - 0.1 * size)), back, (half, half))
    legs = [Block(-height, top.low, (leg, leg), (x, y)) for x in (-at, at) for y in (-at, at) if -height < top.low]
    return "table", (top, disc(PLATE, back, 0.0), *legs)


def _solid(block: Block) -> Solid:
    """The mesh of a block."""
    low, high, (u, v), (x, y), is_round = block
    if is_round:
        return cylinder(u, low, high)
    return box((x - u, y - v, low), (x + u, y + v, high))


def _wall(robot: Robot) -> Array:
    """The rotation of a wall: behind a base that points sideways, else behind the arm at home."""
    out = robot.T_world_base[:2, 2]
    if np.hypot(*out) < 0.3:
        out = (link_frames(robot, robot.q_home)[-1, :3, 3] - robot.T_world_base[:3, 3])[:2]
    length = float(np.hypot(*out))
    c, s = (out / length).tolist() if length > 1e-9 else (1.0, 0.0)
    return np.array([[0.0, -s, c], [0.0, c, s], [-1.0, 0.0, 0.0]])


def _floor(robot: Robot, kind: Mounting, size: float) -> float:
    """Height of a floor that is not stated.

    Below a pedestal it is so deep that the arm at home is above it; an arm that can go deeper may pass through it.
    If the arm hangs or its base is tilted, the floor is below everything the arm reaches.
    """
    base = float(robot.T_world_base[2, 3])
    if kind == "floor":
        return base
    if kind == "table":
        return base - min(TABLE, TABLE_REACH * robot.reach)
    floor = min(_lowest(robot) - 2.5 * size, base - 3 * size)
    if kind == "pedestal" and (robot.mounting is not None or robot.T_world_base[2, 2] > _UPRIGHT):
        home = float(link_frames(robot, robot.q_home)[:, 2, 3].min()) - 1.8 * size
        floor = max(floor, min(base - max(PEDESTAL * robot.reach, 3 * size), home))
    return math.floor(floor / _STEP) * _STEP


def _lowest(robot: Robot) -> float:
    """Lowest height of the arm's frames in a fixed sample of configurations."""
    q = robot.random_q(np.random.default_rng(7), PROBES)
    return float(link_frames(robot, q)[..., 2, 3].min())
