"""The walk through a DH table in the scene: a large moving frame, the completed frames, and the present parameter.

Links hide their own axes. So rotations are drawn as arcs at a distance from the joint, and lengths as in an
engineering drawing: next to what they measure, between two extension lines. The table in the other convention is
drawn as a skeleton to one side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import viser
from numpy.typing import NDArray

from app.exercises.rows import Factor
from app.viewer.labels import add_label
from app.viewer.lessons.dh.steps import (
    ORDERS,
    Place,
    amount,
    axis,
    coaxial_joints,
    coinciding,
    elementary,
    expression,
    frames_name,
    reread,
)
from app.viewer.lessons.dh.views import ABOUT_X, ABOUT_Z, TITLES
from app.viewer.lessons.figure_shapes import GREY, Segments, clear_of
from app.viewer.lessons.figures import Angle, Dimension, Figure
from app.viewer.lessons.label_room import label_room
from app.viewer.scene.bodies.parts import joint_color
from app.viewer.scene.camera import DIRECTION
from app.viewer.scene.meshes import body
from kin import Robot
from kin.axes import inverse
from kin.transforms import Array, wxyz_from_rotation
from kin.units import Units

AXES = ((204, 0, 0), (51, 153, 0), (0, 0, 204))  # x, y, z, as viser paints the axes of a frame
# In units of the arm's thickness.
MOVING, PLACED = 8.0, 4.5
FRAME = "frame 0"  # a label of usual length
HEIGHTS = (1.2, -0.6, 1.7, -1.2, 0.6)  # of a frame's label, in lengths of its z axis


def triads(frames: Array, size: float) -> Segments:
    """x, y and z of frames ``(k, 4, 4)`` as lines ``(3k, 2, 3)``."""
    origins = np.repeat(frames[:, None, :3, 3], 3, axis=1)
    tips = origins + size * np.swapaxes(frames[:, :3, :3], 1, 2)
    return np.stack([origins, tips], axis=2).reshape(-1, 2, 3).astype(np.float32)


def triad_colors(count: int) -> NDArray[np.uint8]:
    """Colours of the lines of `count` `triads`."""
    axes = np.array([linear(color) for color in AXES])
    return np.tile(np.repeat(axes[:, None], 2, axis=1), (count, 1, 1))


def linear(color: tuple[int, int, int]) -> NDArray[np.uint8]:
    """A screen colour as viser needs it at the ends of lines: it takes those as linear intensities."""
    return np.round(255.0 * (np.array(color) / 255.0) ** 2.2).astype(np.uint8)


def skeleton(robot: Robot, frames: Array) -> Segments:
    """The links as lines ``(2 rows, 2, 3)``: along z by d and along x by a, in the convention's order."""
    start = np.concatenate([robot.T_world_base[None], frames[:-1]])
    origin, end = start[:, :3, 3], frames[:, :3, 3]
    if robot.convention == "standard":
        bend = origin + start[:, :3, 2] * ((end - origin) * start[:, :3, 2]).sum(1, keepdims=True)
    else:
        bend = origin + start[:, :3, 0] * ((end - origin) * start[:, :3, 0]).sum(1, keepdims=True)
    return (
        np.stack([np.stack([origin, bend], 1), np.stack([bend, end], 1)], 1).reshape(-1, 2, 3).astype(np.float32)
    )


def joint_axis(robot: Robot, frames: Array, joint: int, reach: float) -> Segments:
    """The axis of a moving joint ``(1, 2, 3)``, to a distance `reach` on both sides."""
    row = robot.joint_rows[joint]
    # In a standard table a joint turns about z of the frame before its row.
    line = row - 1 if robot.convention == "standard" else row
    T = frames[line] if line >= 0 else robot.T_world_base
    return np.array([[T[:3, 3] - reach * T[:3, 2], T[:3, 3] + reach * T[:3, 2]]], dtype=np.float32)


class WalkDrawing:
    """The walk on the arm itself. Not thread-safe: the visitor's worker calls it.

    Args:
        root: prefix of all node names; a different one for each arm of a scene.
    """

    def __init__(self, scene: viser.SceneApi, robot: Robot, frames: Array, root: str) -> None:
        self._scene = scene
        self._robot = robot
        self._size = body(robot).size
        self._root = scene.add_frame(root, show_axes=False)
        self._name = root
        self._moving = moving_frame(scene, f"{root}/moving", self._size)
        # One label for all frames of one origin, at the tip of the z axis of one of them.
        self._groups = coinciding(robot)
        self._at = label_places(self._groups, np.concatenate([robot.T_world_base[None], frames]), self._size)
        self._labels = [
            add_label(scene, f"{root}/name-{group[0]}", "", anchor="center-center", visible=False)
            for group in self._groups
        ]
        figure = Figure(scene, f"{root}/present", self._size)
        self._quantities: dict[Factor, Angle | Dimension] = {
            "theta": figure.angle("", ABOUT_Z),
            "d": figure.dimension("", ABOUT_Z),
            "a": figure.dimension("", ABOUT_X),
            "alpha": figure.angle("", ABOUT_X),
        }
        self._placed: viser.LineSegmentsHandle | None = None
        self._count = -1
        self._made = 0

    def show(self, at: Place, frames: Array, units: Units, names: bool) -> None:
        """Show a place, with the arm's ``link_frames``; `names`: update the labels of frames as well."""
        pose(self._moving, at.T_0_now)
        self._show_placed(np.concatenate([self._robot.T_world_base[None], frames[: at.placed]]), names)
        self._show_quantities(at, frames[:, :3, 3], units)

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._root.remove()

    def _show_placed(self, frames: Array, names: bool) -> None:
        points = triads(frames, PLACED * self._size)
        if len(frames) == self._count and self._placed is not None:
            self._placed.points = points
        else:
            if self._placed is not None:
                self._placed.remove()
            self._count = len(frames)
            colors = triad_colors(len(frames))
            self._placed = self._lines("placed", points, colors, 0.26)
            for label, group in zip(self._labels, self._groups, strict=True):
                placed = [number for number in group if number < len(frames)]
                label.visible = bool(placed)
                if placed:
                    label.text = frames_name(placed, len(self._robot.rows))
            names = True
        if not names:
            return
        for label, group, (member, height) in zip(self._labels, self._groups, self._at, strict=True):
            if group[0] < len(frames):
                T = frames[min(member, len(frames) - 1)]
                label.position = T[:3, 3] + height * PLACED * self._size * T[:3, 2]

    def _show_quantities(self, at: Place, origins: Array, units: Units) -> None:
        """The parameters of the row so far, each beside what it measures; the present one with its share."""
        robot = self._robot
        order = ORDERS[robot.convention]
        T = at.T_0_now @ inverse(at.A)  # the frame before the row
        for k, factor in enumerate(order):
            part = self._quantities[factor]
            value = at.values[k]
            if k > at.motion or value == 0.0:
                if part.shown:
                    part.hide()
                continue
            shown = value * (at.share if k == at.motion else 1.0)
            whole = amount(factor, value, units)
            so_far = f"{amount(factor, shown, units)} of " if shown != value else ""
            text = f"{expression(robot, at.row, factor, units)} = {so_far}{whole}"
            p, R, about = T[:3, 3], T[:3, :3], axis(factor)
            if isinstance(part, Angle):
                # About z from x, and about x from z.
                part.show(p, R[:, 2 - about], R[:, about], shown, units, text=text)
            else:
                aside = clear_of(p, p + value * R[:, about], origins)
                part.show(p, p + shown * R[:, about], units, aside, text=text)
            T = T @ elementary(factor, shown)

    def _lines(
        self, name: str, points: Segments, colors: NDArray[np.uint8], width: float
    ) -> viser.LineSegmentsHandle:
        self._made += 1
        return self._scene.add_line_segments(
            f"{self._name}/{name}-{self._made}", points, colors, thickness=width * self._size
        )


class OtherDrawing:
    """The table in the other convention: a skeleton next to the arm, and on both the joint axes that differ."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, root: str) -> None:
        self.robot = reread(robot)
        self._pair = (robot, self.robot)
        self._size = body(robot).size
        self.offset = aside(robot)
        self._root = scene.add_frame(root, show_axes=False)
        other = f"{root}/other"
        scene.add_frame(other, show_axes=False, position=self.offset)
        self._moving = moving_frame(scene, f"{other}/moving", self._size)
        k = len(robot.rows)
        nothing = np.zeros((1, 2, 3), np.float32)
        self._bones = scene.add_line_segments(
            f"{other}/bones", np.repeat(nothing, 2 * k, 0), GREY, thickness=1.1 * self._size
        )
        colors = triad_colors(k + 1)
        self._frames = scene.add_line_segments(
            f"{other}/frames", np.repeat(nothing, 3 * k + 3, 0), colors, thickness=0.26 * self._size
        )
        reach = 3.0 * self._size
        for reading, parent in zip(self._pair, (root, other), strict=True):
            base = reading.T_world_base[:3, 3] - np.array([0.0, 0.0, reach])
            add_label(scene, f"{parent}/title", TITLES[reading.convention], position=base, anchor="top-center")
        joints = sorted({j for r in self._pair for k in coaxial_joints(r) for j in (k, k + 1)})
        self._lines = []
        for reading, parent in zip(self._pair, (root, other), strict=True):
            coaxial = coaxial_joints(reading)
            for j in joints:
                # Two joints on one axis have one label, at the outer tip.
                name = f"joints {j} and {j + 1}: one axis" if j - 1 in coaxial else f"joint {j + 1}"
                text = "" if j in coaxial else name
                line = scene.add_line_segments(
                    f"{parent}/line-{j + 1}", nothing, joint_color(j), thickness=0.3 * self._size
                )
                label = add_label(
                    scene, f"{parent}/line-{j + 1}-name", text, anchor="center-left", visible=bool(text)
                )
                self._lines.append((reading, j, line, label))

    def show(self, at: Place, frames: Array, frames_other: Array, names: bool) -> None:
        """Show a place of the other table, with the ``link_frames`` of both; `names`: as for `WalkDrawing`."""
        pose(self._moving, at.T_0_now)
        self._bones.points = skeleton(self.robot, frames_other)
        all_frames = np.concatenate([self.robot.T_world_base[None], frames_other])
        self._frames.points = triads(all_frames, PLACED * self._size)
        for reading, joint, line, label in self._lines:
            points = joint_axis(
                reading, frames_other if reading is self.robot else frames, joint, 11.0 * self._size
            )
            line.points = points
            if names:
                # At the outer end: what is drawn at the arm and at the skeleton must not meet in the middle.
                ends = points[0] @ self.offset.astype(np.float32)
                label.position = points[0, int(ends.argmax() if reading is self.robot else ends.argmin())]

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._root.remove()


def moving_frame(scene: viser.SceneApi, name: str, size: float) -> viser.FrameHandle:
    """A large frame with labelled axes."""
    frame = scene.add_frame(
        name,
        axes_length=MOVING * size,
        axes_radius=0.17 * size,
        origin_radius=0.4 * size,
        origin_color=(230, 159, 0),
    )
    for tip, letter in zip(np.eye(3), "xyz", strict=True):
        add_label(scene, f"{name}/{letter}", letter, position=1.1 * MOVING * size * tip, anchor="center-center")
    return frame


def pose(node: viser.SceneNodeHandle, T: Array) -> None:
    """Set a node's pose ``(4, 4)``. viser ignores changes below 1e-5, which are invisible here."""
    node.position = T[:3, 3]
    node.wxyz = wxyz_from_rotation(T[:3, :3])


def aside(robot: Robot) -> Array:
    """The place ``(3,)`` of the other arm: to the left of the arm in the default view, out of its reach."""
    left = np.array([DIRECTION[1], -DIRECTION[0], 0.0])
    return 1.4 * body(robot).radius * left / np.linalg.norm(left)


def label_places(groups: Sequence[Sequence[int]], frames: Array, size: float) -> list[tuple[int, float]]:
    """Where the label of each group of `frames` ``(k, 4, 4)`` is: at the z axis of which one, at how many lengths.

    It is the first place with room for a label, or else the one farthest from all labels before.
    """
    chosen: list[tuple[int, float]] = []
    taken: list[Array] = []
    for group in groups:
        best, most = (group[0], HEIGHTS[0]), -1.0
        for member, height in ((member, height) for height in HEIGHTS for member in group):
            point = frames[member, :3, 3] + height * PLACED * size * frames[member, :3, 2]
            room = min((label_room(point - other, FRAME, FRAME, size) for other in taken), default=math.inf)
            if room > most:
                best, most = (member, height), room
            if room >= 1.0:
                break
        chosen.append(best)
        taken.append(frames[best[0], :3, 3] + best[1] * PLACED * size * frames[best[0], :3, 2])
    return chosen
