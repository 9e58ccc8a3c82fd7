"""The figure of a step in the scene."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from app.viewer.declared.scene import Node
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import AMBER, BLUE, GREEN, GREY, LINE, PURPLE, SKY, VERMILION
from app.viewer.lessons.inverse.arm import Arm
from app.viewer.lessons.inverse.shapes import Angle, Face, Length, Line, Point, Shape, shapes
from app.viewer.lessons.inverse.sheet import Derivation, StepKey
from app.viewer.lessons.inverse.words import sub
from app.viewer.scene.camera import Sphere
from app.viewer.scene.meshes import body
from kin.transforms import Array
from kin.units import Units

LABELS = {
    "w": "wrist centre w",
    "p": "tool point p",
    "S": "shoulder S",
    "E": "elbow E",
    "2": "axis 2",
    "t": "tool",
    "z0": "axis 1",
    "x0": "x₀",
    "x3": "x₃",
    "y3": "y₃",
    "z3": "z₃",
    "down": "",
    "SW": "",
    "tilt": "",
    "tilt2": "",
    "circle": "",
    "k": "",
}
COLORS = {"a": VERMILION, "x3": GREY, "y3": GREY, "z3": BLUE, "z0": GREY, "X": GREEN, "β": PURPLE, "D": VERMILION}
QUIET = ("tilt", "tilt2", "circle")  # arcs without a value
FOUND = ("r", "D", "ρ")  # lengths that a step finds; the others are given
BONE, THIN = 0.5, 0.2  # width


def room(arm: Arm, found: Derivation, keys: Iterable[StepKey]) -> list[Sphere]:
    """What a view has to show besides the arm: the ends of the lines of all steps, where their names are."""
    T, reach = arm.T_base_lesson, 4.0 * body(arm.robot).size
    lines = [
        shape for key in keys for shape in shapes(arm, found, key) if isinstance(shape, Line) and not shape.bone
    ]
    return [(T[:3, :3] @ line.end + T[:3, 3], reach) for line in lines]


def figure(arm: Arm, found: Derivation, key: StepKey, made: FigureNodes, units: Units, opened: bool) -> list[Node]:
    """The figure of a step; if it is not `opened`, the values that it asks for are left out."""
    # The labels of lengths can give way best.
    drawn = sorted(shapes(arm, found, key), key=lambda shape: isinstance(shape, Length))
    with made:
        return [node for shape in drawn for node in _nodes(arm, shape, made, units, opened)]


def _nodes(arm: Arm, shape: Shape, made: FigureNodes, units: Units, opened: bool) -> list[Node]:
    R, name = arm.T_base_lesson[:3, :3], shape.name

    def at(point: Array) -> Array:
        return np.asarray(R @ point + arm.T_base_lesson[:3, 3])

    key, color, text = f"{type(shape).__name__}-{name}", COLORS.get(name), LABELS.get(name, sub(name))
    asked = None if opened else f"{sub(name)} = ?"
    match shape:
        case Point():
            text = "end of link 2" if name == "w" and arm.family == "planar" else text
            return made.point(key, at(shape.at), text, color or AMBER)
        case Line(bone=True):
            return made.line(key, at(shape.start), at(shape.end), "", SKY, BONE)
        case Line():
            width = THIN if name in ("down", "SW", "x0") else LINE
            return made.line(key, at(shape.start), at(shape.end), text, color or GREY, width)
        case Length():
            words = asked if name in FOUND else None
            ends = at(shape.start), at(shape.end)
            return made.dimension(key, *ends, text, units, R @ shape.aside, color or BLUE, words)
        case Angle():
            words = "" if name in QUIET else asked
            start, about, size = R @ shape.start, R @ shape.about, shape.size
            corner, color = at(shape.corner), color or GREEN
            return made.angle(key, corner, start, about, size, text, units, color, shape.radius, words)
        case Face():
            return made.face(key, [at(corner) for corner in shape.corners], BLUE)
