"""The frames of a page: workpieces that the visitor has named, and the frame in which poses are shown and typed.

They live in the visitor's page and its link. Links come from anybody: `unpack` keeps what is valid.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import viser

from app.viewer.labels import add_label
from app.viewer.own_arm import clean
from kin import InputError, Robot, frame_pose, pose_from_xyz_rpy
from kin.frames import BASE, FRAMES, TOOL, WORLD
from kin.transforms import Array, wxyz_from_rotation

MOST = 8  # workpieces of a page
NAME = 24  # characters
FARTHEST = 1000.0  # m
TITLES = {WORLD: "world", BASE: "base: frame 0 of the arm"}
_DIGITS = 12  # of metres and radians in a link


class Workpiece(NamedTuple):
    """A frame with a name: x, y, z (m), roll, pitch and yaw (rad) in the world frame."""

    name: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class Frames:
    """The frames of a page.

    Attributes:
        workpieces: those that the visitor has named.
        shown: the frame in which the read-out shows the tool's pose, and in which targets are typed.
    """

    workpieces: tuple[Workpiece, ...] = ()
    shown: str = field(default=WORLD)

    @cached_property
    def poses(self) -> Mapping[str, Array]:
        """Poses ``(4, 4)`` of the workpieces in the world frame, by name."""
        return {each.name: pose_from_xyz_rpy(each.values[:3], each.values[3:]) for each in self.workpieces}

    @property
    def names(self) -> tuple[str, ...]:
        """The frames in which poses can be shown."""
        return (WORLD, BASE, *(each.name for each in self.workpieces))

    def pose(self, robot: Robot, q: Array, relative: bool = False) -> Array:
        """The frame on show in the world frame ``(4, 4)``; if `relative`, the frame of the tool at `q` instead."""
        return frame_pose(robot, TOOL if relative else self.shown, self.poses, q)

    def choose(self, name: object) -> Frames:
        """Show poses in another frame; raises `kin.InputError` for an unknown one."""
        if not isinstance(name, str) or name not in self.names:
            raise InputError("frame", name, "one of " + ", ".join(self.names))
        return replace(self, shown=name)

    def add(self, point: Array) -> Frames:
        """One more workpiece: upright, at a point ``(3,)`` of the world frame, to the millimetre."""
        taken = self.names
        name = next(name for k in range(1, MOST + 2) if (name := "table" if k == 1 else f"table {k}") not in taken)
        values = (*(round(float(v), 3) + 0.0 for v in point), 0.0, 0.0, 0.0)
        return replace(self, workpieces=(*self.workpieces, Workpiece(name, values)))

    def remove(self, index: int) -> Frames:
        """Without the workpiece at this place."""
        gone = self.workpieces[index].name
        kept = tuple(each for each in self.workpieces if each.name != gone)
        return Frames(kept, WORLD if self.shown == gone else self.shown)

    def rename(self, index: int, name: str) -> Frames:
        """Another name; raises `kin.InputError` for one that is empty or taken."""
        name, old = str(clean(name, NAME)), self.workpieces[index]
        others = {*FRAMES, *(each.name for i, each in enumerate(self.workpieces) if i != index)}
        if not name or name in others:
            raise InputError("name", name, "a name that no other frame has")
        shown = name if self.shown == old.name else self.shown
        return Frames(self._with(index, Workpiece(name, old.values)), shown)

    def move(self, index: int, axis: int, value: float) -> Frames:
        """Another value (m, rad) of x, y, z, roll, pitch or yaw; raises `kin.InputError` if it is too far away."""
        if axis < 3 and not abs(value) <= FARTHEST:
            raise InputError("xyz"[axis], f"{value:g} m", f"at most {FARTHEST:g} m")
        name, values = self.workpieces[index]
        changed = Workpiece(name, (*values[:axis], value, *values[axis + 1 :]))
        return replace(self, workpieces=self._with(index, changed))

    def _with(self, index: int, changed: Workpiece) -> tuple[Workpiece, ...]:
        return (*self.workpieces[:index], changed, *self.workpieces[index + 1 :])


def pack(frames: Frames) -> list[object]:
    """The frames as JSON: the one that is shown, and a list of name and values for each workpiece."""
    rows = [[each.name, *(round(v, _DIGITS) + 0.0 for v in each.values)] for each in frames.workpieces]
    return [frames.shown, *rows]


def unpack(value: object) -> Frames:
    """The frames of a link, as far as they are valid."""
    shown, *rows = value if isinstance(value, list) and value else [WORLD]
    found: list[Workpiece] = []
    for row in rows[:MOST]:
        match row:
            case [str(name), *values] if len(values) == 6 and all(map(_is_number, values)):
                name = clean(name, NAME)
                known = {*FRAMES, *(each.name for each in found)}
                if name and name not in known and all(abs(v) <= FARTHEST for v in values):
                    found.append(Workpiece(name, tuple(map(float, values))))
    frames = Frames(tuple(found))
    return replace(frames, shown=shown) if shown in frames.names else frames


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < math.inf


class FrameAxes:
    """The axes of the workpieces, and of the world frame if the arm does not stand there. The worker calls it."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._nodes: list[viser.FrameHandle] = []
        self._shown: object = None
        self._count = 0

    def show(self, frames: Frames, robot: Robot, size: float, aside: Array) -> None:
        """Draw the frames of a page with axes of this length (m); `aside` is that of `mounting.Mount`."""
        poses = dict(frames.poses)
        if not np.array_equal(robot.T_world_base, np.eye(4)):
            poses[WORLD] = np.eye(4)
        wanted = (frames.workpieces, WORLD in poses, size, tuple(aside.tolist()))
        if wanted == self._shown:
            return
        self._shown = wanted
        for node in self._nodes:
            node.remove()
        self._count += 1  # the browser keeps the pose of a removed node for the next one of its name
        beside = {WORLD: aside}  # the arm may be mounted there; workpieces are where the visitor has put them
        self._nodes = [
            self._add(f"/frame-{self._count}-{i}", name, T, size, beside.get(name, np.zeros(3)))
            for i, (name, T) in enumerate(poses.items())
        ]

    def _add(self, root: str, name: str, T: Array, size: float, aside: Array) -> viser.FrameHandle:
        node = self._scene.add_frame(
            root,
            axes_length=size,
            axes_radius=0.014 * size,
            position=T[:3, 3],
            wxyz=wxyz_from_rotation(T[:3, :3]),
        )
        place = np.array([0.0, 0.0, 1.15 * size]) + T[:3, :3].T @ aside
        add_label(self._scene, f"{root}/name", name, position=place, anchor="bottom-center", depth_test=True)
        return node
