"""The frames of an arm: the axes at its base, and the frame of every DH row with its name."""

from __future__ import annotations

import numpy as np
import viser

from app.viewer.labels import add_label
from app.viewer.scene.meshes import Body
from kin import Robot, link_frames
from kin.transforms import Array, wxyz_from_rotation

BASE_AXES = 5.0  # length of the axes at the base, in thicknesses of the arm: beyond the pedestal's flange


class ArmFrames:
    """Frames and names, hidden at first, but for the axes at the base.

    Args:
        longest: length of the axes at the tool, whose gizmo is on top of them.

    Attributes:
        base: the axes of the base frame.
        base_up: the letter of their z axis.
    """

    def __init__(self, scene: viser.SceneApi, root: str, robot: Robot, body: Body, longest: float) -> None:
        self._scene = scene
        self._robot = robot
        self._body = body
        self._longest = longest
        home = link_frames(robot, robot.q_home)
        self._origins = np.vstack([robot.T_world_base[None, :3, 3], home[:, :3, 3]])
        self._frames: list[viser.SceneNodeHandle] = []
        self._labels: list[viser.SceneNodeHandle] = []
        T, length = robot.T_world_base, BASE_AXES * body.size
        self.base = scene.add_frame(
            f"{root}/base",
            axes_length=length,
            axes_radius=0.07 * body.size,
            position=T[:3, 3],
            wxyz=wxyz_from_rotation(T[:3, :3]),
        )
        self.base_up: viser.SceneNodeHandle
        places = 1.15 * length * np.eye(3) + T[:3, :3].T @ body.mount.aside
        for place, letter in zip(places, "xyz", strict=True):
            name = f"{self.base.name}/{letter}"
            self.base_up = add_label(scene, name, letter, position=place, anchor="center-center", depth_test=True)

    def add(self, parent: str, row: int, T: Array) -> None:
        """Add the frame of a DH row, at the pose ``(4, 4)`` in its parent; row −1 is the base frame."""
        rows = len(self._robot.rows)
        length = 4.0 * self._body.size
        if row + 1 == rows:
            length = min(length, self._longest)
        name = f"{parent}/frame-{row + 1}"
        self._frames.append(
            self._scene.add_frame(
                name,
                axes_length=length,
                axes_radius=0.09 * self._body.size,
                position=T[:3, 3],
                wxyz=wxyz_from_rotation(T[:3, :3]),
                visible=False,
            )
        )
        text = "base" if row < 0 else "tool" if row + 1 == rows else f"frame {row + 1}"
        # At the tip of z, each further out than the last: the frames of one wrist share their origin.
        before, origin = self._origins[: row + 1], self._origins[row + 1]
        crowd = int((np.linalg.norm(before - origin, axis=1) < 1e-6).sum())
        place = (0.0, 0.0, (1.15 + 0.6 * crowd) * length)
        label = add_label(
            self._scene,
            f"{name}/label",
            text,
            position=place,
            anchor="center-center",
            depth_test=True,
            visible=True,
        )
        self._labels.append(label)

    def show(self, visible: bool) -> None:
        """Show or hide the frames."""
        for node in self._frames:
            node.visible = visible

    def show_labels(self, visible: bool) -> None:
        """Show or hide the names."""
        for node in self._labels:
            node.visible = visible
