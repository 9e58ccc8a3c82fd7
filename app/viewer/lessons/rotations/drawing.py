"""Frames beside the arm: a turned one with the axes of its turns, or a chain of frames."""

from __future__ import annotations

from collections.abc import Hashable
from itertools import pairwise

import numpy as np

from app.viewer.declared.scene import Node, axes, frame, label
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import AMBER, BLUE, GREEN, PURPLE
from app.viewer.lessons.rotations.conventions import axis_angle
from app.viewer.lessons.rotations.facts import RotationsFacts
from app.viewer.scene.camera import Sphere
from app.viewer.scene.meshes import body
from kin import Robot
from kin.transforms import Array

# In radii of the arm.
ASIDE, LENGTH, ROOM = 1.15, 0.42, 0.62
THICK, THIN = 0.045, 0.02  # of an axis, as shares of its length
BESIDE = 0.97  # cosine up to which two directions leave room for the names at their ends
ORDER = ("1st", "2nd", "3rd")
COLORS = BLUE, GREEN, AMBER


def room(robot: Robot) -> Sphere:
    """Where the frames are."""
    return anchor(robot), ROOM * body(robot).radius


def frames(facts: RotationsFacts, figure: FigureNodes, click: tuple[Hashable, ...]) -> list[Node]:
    """The frames that the settings show; `click` is the event of a click on the turned frame."""
    length = LENGTH * body(facts.robot).radius
    with figure:
        shown = (
            _chain(facts, figure, length) if facts.settings.chained else _rotation(facts, figure, length, click)
        )
    fixed = _frame("fixed", np.eye(4), 0.8 * length, THIN)
    tip = 0 if facts.settings.chained else 2  # frames of a chain are often above the fixed one
    name = label("fixed-name", "{0}", 0.92 * length * np.eye(3)[tip])
    return [frame("beside", fixed, name, *shown, position=anchor(facts.robot))]


def anchor(robot: Robot) -> Array:
    """Where the frames begin, beside the arm ``(3,)``."""
    shape = body(robot)
    anchor = np.array(shape.center, dtype=np.float64)
    anchor[1] += ASIDE * shape.radius
    return anchor


def _frame(key: str, T: Array, length: float, thick: float) -> Node:
    return axes(key, T, length, thick * length)


def _rotation(
    facts: RotationsFacts, figure: FigureNodes, length: float, click: tuple[Hashable, ...]
) -> list[Node]:
    """The turned frame, and as the settings say the axes of the three turns and of the whole rotation."""
    T = np.eye(4)
    T[:3, :3] = R = facts.R
    turned = _frame("turned", T, length, THICK)
    turned.click = click
    shown = facts.settings.axes
    turns = facts.convention.axes_now(facts.settings.angles) if shown in ("all", "turns") else ()
    tip = 0 if any(abs(way @ R[:, 2]) > BESIDE for way in turns) else 2  # an axis of a turn has its name there
    nodes = [turned, label("turned-name", "{1}", 1.12 * length * R[:, tip])]
    for k, way in enumerate(turns):
        # About fixed axes, later turns carry the axis of an earlier one along.
        text = f"{ORDER[k]} {facts.convention.axes[k]}{', carried' if facts.convention.fixed and k < 2 else ''}"
        nodes += figure.axis(f"turn-{k}", np.zeros(3), way, (1.15 + 0.1 * k) * length, text, COLORS[k])
    axis, angle = axis_angle(R)
    if angle > 1e-6 and shown in ("all", "whole"):
        nodes += figure.axis("axis", np.zeros(3), axis, 1.5 * length, "axis", PURPLE)
    return nodes


def _chain(facts: RotationsFacts, figure: FigureNodes, length: float) -> list[Node]:
    """The frames of the chain and the way between their origins."""
    nodes = []
    for k, (before, T) in enumerate(pairwise(facts.places)):
        nodes.append(_frame(f"chain-{k}", T, 0.5 * length, THICK))
        nodes.append(label(f"name-{k}", f"{{{k + 1}}}", T[:3, 3] + 0.6 * length * T[:3, 2]))
        if np.linalg.norm(T[:3, 3] - before[:3, 3]) > 1e-6:
            nodes += figure.line(f"way-{k}", before[:3, 3], T[:3, 3])
    return nodes
