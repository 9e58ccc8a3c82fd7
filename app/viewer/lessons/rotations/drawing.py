"""Frames beside the arm: a turned one with the axes of its turns, or a chain of frames."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import viser

from app.viewer.labels import add_label
from app.viewer.lessons.figures import AMBER, BLUE, GREEN, GREY, PURPLE, Figure
from app.viewer.lessons.rotations.conventions import Angles, Convention, axis_angle
from app.viewer.lessons.rotations.frames import MOST
from app.viewer.scene.camera import Sphere
from app.viewer.scene.meshes import body
from kin import Robot
from kin.transforms import Array, wxyz_from_rotation

# In radii of the arm.
ASIDE, LENGTH, ROOM = 1.15, 0.42, 0.62
THICK, THIN = 0.045, 0.02  # of an axis, as shares of its length
ORDER = ("1st", "2nd", "3rd")


class Drawing:
    """The frames of the lesson, below the node `root`; the visitor's worker calls it."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, root: str) -> None:
        shape = body(robot)
        self.length = LENGTH * shape.radius
        anchor = np.array(shape.center, dtype=np.float64)
        anchor[1] += ASIDE * shape.radius
        self.room: Sphere = (anchor, ROOM * shape.radius)
        self._top = scene.add_frame(root, show_axes=False, position=anchor)
        self._figure = Figure(scene, f"{root}/figure", shape.size)
        self._fixed = self._frame(scene, f"{root}/fixed", 0.8, THIN)
        self._turned = self._frame(scene, f"{root}/turned", 1.0, THICK)
        self._fixed_label = add_label(scene, f"{root}/fixed-name", "{0}", anchor="center-center")
        self._label = add_label(scene, f"{root}/turned-name", "{1}", anchor="center-center")
        self._axes = [self._figure.line("", color) for color in (BLUE, GREEN, AMBER)]
        self._axis = self._figure.line("axis", PURPLE)
        self._links = [self._figure.line("", GREY) for _ in range(MOST)]
        self._chain = [self._frame(scene, f"{root}/chain-{k}", 0.5, THICK) for k in range(MOST)]
        self._names = [
            add_label(scene, f"{root}/name-{k}", f"{{{k + 1}}}", anchor="center-center") for k in range(MOST)
        ]

    def _frame(self, scene: viser.SceneApi, name: str, share: float, thick: float) -> viser.FrameHandle:
        length = share * self.length
        return scene.add_frame(name, axes_length=length, axes_radius=thick * length)

    def show_rotation(self, convention: Convention, angles: Angles) -> None:
        """Draw the turned frame, the axes of the three turns, and the axis of the whole rotation."""
        R = convention.rotation(angles)
        self._turned.visible = True
        self._turned.wxyz = wxyz_from_rotation(R)
        self._label.visible = True
        self._label.position = 1.12 * self.length * R[:, 2]
        self._fixed_label.position = np.array([0.0, 0.0, 0.92 * self.length])
        for k, (line, way) in enumerate(zip(self._axes, convention.axes_now(angles), strict=True)):
            line.show_axis(np.zeros(3), way, (1.15 + 0.1 * k) * self.length, f"{ORDER[k]} {convention.axes[k]}")
        axis, angle = axis_angle(R)
        if angle > 1e-6:
            self._axis.show_axis(np.zeros(3), axis, 1.5 * self.length)
        else:
            self._axis.hide()
        self._hide_chain(0)

    def show_chain(self, places: Array) -> None:
        """Draw the frames ``(k + 1, 4, 4)`` and the way between their origins."""
        self._turned.visible = self._label.visible = False
        for part in (*self._axes, self._axis):
            part.hide()
        self._fixed_label.position = np.array([0.0, 0.0, 0.92 * self.length])
        for k, (before, T) in enumerate(pairwise(places)):
            node, name = self._chain[k], self._names[k]
            node.visible = name.visible = True
            node.position, node.wxyz = T[:3, 3], wxyz_from_rotation(T[:3, :3])
            name.position = T[:3, 3] + 0.6 * self.length * T[:3, 2]
            if np.linalg.norm(T[:3, 3] - before[:3, 3]) > 1e-6:
                self._links[k].show(before[:3, 3], T[:3, 3])
            else:
                self._links[k].hide()
        self._hide_chain(len(places) - 1)

    def _hide_chain(self, first: int) -> None:
        for k in range(first, MOST):
            self._chain[k].visible = self._names[k].visible = False
            self._links[k].hide()

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._figure.remove()
        self._top.remove()
