"""An exercise in the scene: frames of its target, of the ghost that the student places and of the right place, and
the arm that a wrong answer is about."""

from __future__ import annotations

from typing import Any

import numpy as np
import viser

from app.viewer.declared.scene import Node, SceneView, label
from app.viewer.panel import Post
from app.viewer.skeleton import ghost
from kin import Robot, fk, wxyz_from_rotation
from kin.transforms import Array

GHOST = ("ghost",)  # the event of a drag of the ghost
SIZE = 0.14  # of a frame's axes, in reaches of the arm
_COLOR = (213, 94, 0)
OPACITY = 0.42  # of a copy of the arm


class Drawing:
    """Draws into one visitor's scene; `post` gets ``("drag", GHOST, number)`` with a `DragEvent`."""

    def __init__(self, scene: viser.SceneApi, post: Post) -> None:
        self._view, self._arm = SceneView(scene, "exercise", post), SceneView(scene, "exercise-arm", post)
        self._nodes: list[Node] = []

    def clear(self) -> None:
        """Remove everything."""
        self.arm(None)
        self._nodes = []
        self._view.remove()

    @property
    def has_ghost(self) -> bool:
        """Whether there is a frame to drag."""
        return any(node.drag for node in self._nodes)

    def goal(self, T: Array, reach: float, words: str) -> None:
        """A frame with a label."""
        size = SIZE * reach
        self._add(_frame(f"goal-{len(self._nodes)}", T, size, words, 0.5 * size))

    def ghost(self, T: Array, reach: float) -> None:
        """A frame that the visitor drags."""
        size = SIZE * reach
        props = {"scale": 1.7 * size, "line_width": 3.0, "depth_test": False}
        frame = _frame("frame", np.eye(4), 1.2 * size, "your ghost", 1.9 * size)
        self._add(Node("transform_controls", "ghost", props, *_place(T), (frame,), drag=GHOST))

    def arm(self, at: tuple[Robot, Array] | None) -> None:
        """A copy of an arm at q ``(n,)``, for which a wrong answer is right; None removes it."""
        if at is None:
            self._arm.remove()
            return
        words = label("words", "the arm of your answer", fk(*at)[:3, 3], anchor=None)
        self._arm.show((ghost("arm", *at, _COLOR, OPACITY), words))

    def place(self, T: Array) -> None:
        """Move the ghost."""
        for node in self._nodes:
            if node.drag:
                node.position, node.wxyz = _place(T)
        self._view.show(self._nodes)

    def _add(self, node: Node) -> None:
        self._nodes.append(node)
        self._view.show(self._nodes)


def _frame(key: str, T: Array, size: float, words: str, above: float) -> Node:
    """The axes of a pose ``(4, 4)``, and words `above` (m) its origin."""
    looks: dict[str, Any] = {"axes_length": size, "axes_radius": 0.05 * size}
    looks |= {"origin_radius": 0.13 * size, "origin_color": _COLOR}
    return Node("frame", key, looks, *_place(T), (label("label", words, (0.0, 0.0, above), anchor=None),))


def _place(T: Array) -> tuple[Array, Array]:
    return T[:3, 3].copy(), wxyz_from_rotation(T[:3, :3])
