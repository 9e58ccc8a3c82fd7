"""An exercise in the scene: frames of its target, of the ghost that the student places and of the right place, and
the arm that a wrong answer is about."""

from __future__ import annotations

from collections.abc import Hashable
from itertools import count
from typing import Any

import numpy as np
import viser

from app.viewer.declared.scene import SceneView, label
from app.viewer.panel import Post
from app.viewer.skeleton import ghost
from kin import Robot, fk, wxyz_from_rotation
from kin.transforms import Array

GHOST: Hashable = "ghost"
SIZE = 0.14  # of a frame's axes, in reaches of the arm
_NUMBERS = count(1)
_COLOR = (213, 94, 0)
OPACITY = 0.42  # of a copy of the arm


class Drawing:
    """Draws into one visitor's scene; `post` gets the ghost's pose under `GHOST`."""

    def __init__(self, scene: viser.SceneApi, post: Post) -> None:
        self._scene, self._post = scene, post
        self._nodes: list[Any] = []
        self._ghost: viser.TransformControlsHandle | None = None
        self._arm = SceneView(scene, "exercise-arm", post)

    def clear(self) -> None:
        """Remove everything."""
        self.arm(None)
        for node in reversed(self._nodes):
            node.remove()
        self._nodes.clear()
        self._ghost = None

    @property
    def has_ghost(self) -> bool:
        """Whether there is a frame to drag."""
        return self._ghost is not None

    def goal(self, T: Array, reach: float, label: str) -> None:
        """A frame with a label."""
        name, size = f"/exercise-{next(_NUMBERS)}", SIZE * reach
        frame = self._scene.add_frame(
            name,
            axes_length=size,
            axes_radius=0.05 * size,
            origin_radius=0.13 * size,
            origin_color=_COLOR,
            wxyz=wxyz_from_rotation(T[:3, :3]),
            position=T[:3, 3],
        )
        self._nodes += [frame, self._scene.add_label(f"{name}/label", label, position=(0.0, 0.0, 0.5 * size))]

    def ghost(self, T: Array, reach: float) -> None:
        """A frame that the visitor drags."""
        name, size = f"/exercise-{next(_NUMBERS)}", SIZE * reach
        handle = self._scene.add_transform_controls(
            name,
            scale=1.7 * size,
            line_width=3.0,
            depth_test=False,
            wxyz=wxyz_from_rotation(T[:3, :3]),
            position=T[:3, 3],
        )
        frame = self._scene.add_frame(
            f"{name}/frame",
            axes_length=1.2 * size,
            axes_radius=0.06 * size,
            origin_radius=0.15 * size,
            origin_color=_COLOR,
        )
        self._nodes += [
            handle,
            frame,
            self._scene.add_label(f"{name}/label", "your ghost", position=(0.0, 0.0, 1.9 * size)),
        ]
        self._ghost = handle

        @handle.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.client is not None:
                self._post(GHOST, (event.target.position.tolist(), event.target.wxyz.tolist()))

    def arm(self, at: tuple[Robot, Array] | None) -> None:
        """A copy of an arm at q ``(n,)``, for which a wrong answer is right; None removes it."""
        if at is None:
            self._arm.remove()
            return
        words = label("words", "the arm of your answer", fk(*at)[:3, 3], anchor=None)
        self._arm.show((ghost("arm", *at, _COLOR, OPACITY), words))

    def place(self, T: Array) -> None:
        """Move the ghost."""
        if self._ghost is not None:
            self._ghost.position = np.array(T[:3, 3])
            self._ghost.wxyz = wxyz_from_rotation(T[:3, :3])
