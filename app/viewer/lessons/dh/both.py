"""The camera while both readings of a table are on show: farther away, until the comparison ends."""

from __future__ import annotations

import numpy as np

from app.viewer.feature import Stage
from app.viewer.lessons.dh.drawing import aside
from app.viewer.scene import camera
from app.viewer.scene.meshes import body
from kin import Robot
from kin.transforms import Array


class BothInView:
    """Moves the visitor's camera, and moves it back unless the visitor has moved it since."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._view: tuple[Array, Array, Array] | None = None  # position and target before, and where it was put

    def forget(self) -> None:
        """The page has moved the camera itself."""
        self._view = None

    def show(self, robot: Robot) -> None:
        """Move the camera back until arm and skeleton are in view, without changing its direction."""
        eye = self._stage.client.camera
        aspect = eye.image_width / eye.image_height if eye.image_height > 0 else 1.6
        position, look_at = camera.view(body(robot), aspect)
        before = (np.array(eye.position), np.array(eye.look_at))
        out = before[0] - before[1]
        far = max(float(np.linalg.norm(out)), 1.5 * float(np.linalg.norm(position - look_at)))
        look_at = look_at + aside(robot) / 2
        eye.position = look_at + far * out / np.linalg.norm(out)
        eye.look_at = look_at
        self._view = (*before, np.array(eye.position))

    def restore(self) -> None:
        """Undo `show`, unless the visitor has moved the camera since."""
        if self._view is None:
            return
        position, look_at, left_at = self._view
        self._view = None
        eye = self._stage.client.camera
        if np.allclose(eye.position, left_at, atol=1e-3):
            eye.position, eye.look_at = position, look_at
