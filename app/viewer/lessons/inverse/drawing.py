"""The figure of a step in the scene. Its parts are made when they are first needed, and moved from then on."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import count

import numpy as np
import viser

from app.viewer.lessons import figures
from app.viewer.lessons.figure_shapes import AMBER, BLUE, GREEN, GREY, LINE, PURPLE, SKY, VERMILION
from app.viewer.lessons.figures import Figure
from app.viewer.lessons.inverse.arm import Arm
from app.viewer.lessons.inverse.shapes import Angle, Face, Length, Line, Point, Shape, shapes
from app.viewer.lessons.inverse.sheet import Derivation, StepKey
from app.viewer.lessons.inverse.words import sub
from app.viewer.scene.camera import Sphere
from app.viewer.scene.meshes import body
from kin.transforms import Array
from kin.units import Units

Part = figures.Line | figures.Dimension | figures.Angle | figures.Point | figures.Face
LABELS = {
    "w": "wrist centre w", "p": "tool point p", "S": "shoulder S", "E": "elbow E", "2": "axis 2", "t": "tool",
    "z0": "axis 1", "x0": "x₀", "x3": "x₃", "y3": "y₃", "z3": "z₃", "down": "", "SW": "", "tilt": "", "tilt2": "",
    "circle": "", "k": "",
}  # fmt: skip
COLORS = {"a": VERMILION, "x3": GREY, "y3": GREY, "z3": BLUE, "z0": GREY, "X": GREEN, "β": PURPLE, "D": VERMILION}
QUIET = ("tilt", "tilt2", "circle")  # arcs without a value
BONE, THIN = 0.5, 0.2  # width
_NUMBERS = count(1)


def room(arm: Arm, found: Derivation, keys: Iterable[StepKey]) -> list[Sphere]:
    """What a view has to show besides the arm: the ends of the lines of all steps, where their names are."""
    T, reach = arm.T_base_lesson, 4.0 * body(arm.robot).size
    lines = [
        shape for key in keys for shape in shapes(arm, found, key) if isinstance(shape, Line) and not shape.bone
    ]
    return [(T[:3, :3] @ line.end + T[:3, 3], reach) for line in lines]


class Drawing:
    """The figures for one arm; the visitor's worker calls it."""

    def __init__(self, scene: viser.SceneApi, arm: Arm) -> None:
        self._arm = arm
        self._figure = Figure(scene, f"/inverse-{next(_NUMBERS)}", body(arm.robot).size)
        self._parts: dict[tuple[type, str], Part] = {}

    def show(self, figure: list[Shape], units: Units, hidden: bool) -> None:
        """Show these shapes and no others; `hidden`: their values are asked for."""
        wanted = {(type(shape), shape.name) for shape in figure}
        for key, part in self._parts.items():
            if key not in wanted:
                part.hide()
        for shape in sorted(figure, key=lambda each: isinstance(each, Length)):  # their labels can give way best
            self._show(shape, units, hidden)

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._figure.remove()

    def _show(self, shape: Shape, units: Units, hidden: bool) -> None:
        part = self._parts.get((type(shape), shape.name))
        if part is None:
            part = self._parts[type(shape), shape.name] = self._made(shape)
        name = sub(shape.name)
        match shape, part:
            case Point(), figures.Point():
                part.show(self._at(shape.at))
            case Line(), figures.Line():
                part.show(self._at(shape.start), self._at(shape.end))
            case Length(), figures.Dimension():
                text = f"{name} = ?" if hidden and shape.name in ("r", "D", "ρ") else None
                part.show(self._at(shape.start), self._at(shape.end), units, self._along(shape.aside), text=text)
            case Angle(), figures.Angle():
                words = "" if shape.name in QUIET else f"{name} = ?" if hidden else None
                part.show(
                    self._at(shape.corner),
                    self._along(shape.start),
                    self._along(shape.about),
                    shape.size,
                    units,
                    radius=shape.radius,
                    text=words,
                )
            case Face(), figures.Face():
                part.show([self._at(corner) for corner in shape.corners])

    def _made(self, shape: Shape) -> Part:
        figure, name = self._figure, shape.name
        label, color = LABELS.get(name, sub(name)), COLORS.get(name)
        if name == "w" and self._arm.family == "planar":
            label = "end of link 2"
        match shape:
            case Point():
                return figure.point(label, color or AMBER)
            case Line(bone=True):
                return figure.line("", SKY, BONE)
            case Line():
                return figure.line(label, color or GREY, THIN if name in ("down", "SW", "x0") else LINE)
            case Length():
                return figure.dimension(label, color or BLUE)
            case Angle():
                return figure.angle(label, color or GREEN)
            case Face():
                return figure.face(3, BLUE)

    def _at(self, point: Array) -> Array:
        return np.asarray(self._arm.T_base_lesson[:3, :3] @ point + self._arm.T_base_lesson[:3, 3])

    def _along(self, direction: Array) -> Array:
        return np.asarray(self._arm.T_base_lesson[:3, :3] @ direction)
