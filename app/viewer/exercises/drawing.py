"""An exercise in the scene: frames of its target, of the ghost that the student places and of the right place, and
the arm that a wrong answer is about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from app.viewer.declared.scene import Node, label
from app.viewer.skeleton import ghost
from kin import Robot, fk, wxyz_from_rotation
from kin.transforms import Array

GHOST = ("on_ghost",)  # the event of a drag of the ghost
SIZE = 0.14  # of a frame's axes, in reaches of the arm
_COLOR = (213, 94, 0)
OPACITY = 0.42  # of a copy of the arm


def goal(key: str, T: Array, reach: float, words: str) -> Node:
    """A frame at a pose ``(4, 4)`` with a label."""
    size = SIZE * reach
    return _frame(key, T, size, words, 0.5 * size)


def own_frame(T: Array, reach: float) -> Node:
    """The frame that the visitor drags, at a pose ``(4, 4)``."""
    size = SIZE * reach
    props = {"scale": 1.7 * size, "line_width": 3.0, "depth_test": False}
    frame = _frame("frame", np.eye(4), 1.2 * size, "your ghost", 1.9 * size)
    return Node("transform_controls", "ghost", props, *_place(T), (frame,), drag=GHOST)


def mistaken_arm(robot: Robot, q: Array) -> Sequence[Node]:
    """A copy of an arm at q ``(n,)``, for which a wrong answer is right."""
    words = label("words", "the arm of your answer", fk(robot, q)[:3, 3], anchor=None)
    return [replace(node, keep=False) for node in (ghost("arm", robot, q, _COLOR, OPACITY), words)]


def _frame(key: str, T: Array, size: float, words: str, above: float) -> Node:
    """The axes of a pose ``(4, 4)``, and words `above` (m) its origin."""
    looks: dict[str, Any] = {"axes_length": size, "axes_radius": 0.05 * size}
    looks |= {"origin_radius": 0.13 * size, "origin_color": _COLOR}
    return Node("frame", key, looks, *_place(T), (label("label", words, (0.0, 0.0, above), anchor=None),))


def _place(T: Array) -> tuple[Array, Array]:
    return T[:3, 3].copy(), wxyz_from_rotation(T[:3, :3])
