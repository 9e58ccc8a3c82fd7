"""Parts of figures in the scene: lines, dimensions, angles, points and faces, each with its label.

A figure belongs to one arm and one visitor. Its parts are made once and are hidden until they are shown; to show a
part again moves it, so that nothing flickers while the arm is dragged. Everything is in the base frame, in metres
and radians; values are written in the reader's units::

    figure = Figure(stage.client.scene, "/triangle", body(stage.now.robot).size)
    normal, upper = figure.line("x₁", RED), figure.dimension("l₁", BLUE)
    elbow, plane = figure.angle("β", GREEN), figure.face(3, BLUE)
    wrist = figure.point("wrist centre w", AMBER)

    def on_pose(self, T_base_tool):                # and in on_style: the units may have changed
        plane.show([shoulder, elbow_point, wrist_point])
        upper.show(shoulder, elbow_point, units, clear_of(shoulder, elbow_point, joints))
        elbow.show_between(elbow_point, shoulder, wrist_point, units)
        wrist.show(wrist_point)

    def remove(self):
        figure.remove()

The links of an arm hide what is inside them: call ``stage.see_through(True)`` while a figure is on show, and take
another `root` for each figure, because browsers give the pose of a removed node to the next one of its name.
Labels are in front of everything, on a plate of their own, so they are readable in light and dark. Dimensions and
angles are beside what they measure, at a distance from the arm. A label that would cover another one of its
figure, as seen in the default view, takes the next of a few places, and stays there while that is free.
"""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import ArrayLike

from app.viewer.labels import add_label
from app.viewer.lessons.figure_shapes import (
    AMBER,
    ARC,
    ASIDE,
    BLUE,
    GREY,
    LINE,
    MEASURE,
    POINT,
    RADIUS,
    TINY,
    Color,
    above,
    along,
    arc,
    beyond,
    ruler,
    turned,
    unit,
)
from app.viewer.lessons.label_room import Labels
from app.viewer.viser_patches import assign
from kin.axes import cross, perpendicular_to
from kin.transforms import Array
from kin.units import Units


class Figure:
    """Parts that are removed together; the visitor's worker calls it.

    Args:
        root: name of the node of which all parts are children; a new one for each figure.
        size: the arm's thickness (m), ``body(robot).size``, the unit of widths and distances.
    """

    def __init__(self, scene: viser.SceneApi, root: str, size: float) -> None:
        self.scene, self.root, self.size = scene, root, size
        self._top = scene.add_frame(root, show_axes=False)
        self._count = 0
        self.labels = Labels(size)

    def line(self, text: str = "", color: Color = GREY, width: float = LINE) -> Line:
        """A straight line, such as an axis, with its label beyond the end."""
        return Line(self, text, color, width)

    def dimension(self, text: str, color: Color = BLUE) -> Dimension:
        """A dimension line between two points, with its value."""
        return Dimension(self, text, color)

    def angle(self, text: str, color: Color = BLUE) -> Angle:
        """The arc of an angle, with its value."""
        return Angle(self, text, color)

    def point(self, text: str = "", color: Color = AMBER, radius: float = POINT) -> Point:
        """A small ball with a label above it."""
        return Point(self, text, color, radius)

    def face(self, corners: int = 3, color: Color = BLUE, opacity: float = 0.22) -> Face:
        """A translucent triangle, or a plane polygon with this number of corners."""
        return Face(self, corners, color, opacity)

    def remove(self) -> None:
        """Remove all parts from the scene."""
        self._top.remove()

    def name(self) -> str:
        """A name for a new node."""
        self._count += 1
        return f"{self.root}/{self._count}"

    def lines(self, count: int, color: Color, width: float) -> viser.LineSegmentsHandle:
        """A node of `count` lines of one colour, hidden."""
        # One node for each colour: the browser shows colours given per point brighter.
        none = np.zeros((count, 2, 3), np.float32)
        return self.scene.add_line_segments(self.name(), none, color, thickness=width * self.size, visible=False)


class Part:
    """A part of a figure: its nodes, and the label."""

    def __init__(self, figure: Figure, text: str, scale: float = 1.0) -> None:
        self.size = figure.size
        self.text = text
        self._figure = figure
        self.label = add_label(
            figure.scene, figure.name(), text, anchor="center-center", visible=False, scale=scale
        )
        self.nodes: list[viser.SceneNodeHandle] = []

    @property
    def shown(self) -> bool:
        """Whether it is on show."""
        return self.nodes[0].visible

    def hide(self) -> None:
        """Hide the part until it is shown again."""
        for node in (*self.nodes, self.label):
            set_visible(node, False)
        self._figure.labels.leave(self)

    def _write(self, text: str, *places: Array) -> None:
        """Show the nodes, and the label with this text at the first of these points ``(3,)`` that has room."""
        for node in self.nodes:
            set_visible(node, True)
        set_visible(self.label, bool(text))
        if text != self.label.text:
            self.label.text = text
        if not text:
            self._figure.labels.leave(self)
        else:
            assign(self.label, self._figure.labels.place(self, text, places))


class Line(Part):
    """A straight line with its label beyond the end."""

    def __init__(self, figure: Figure, text: str, color: Color, width: float) -> None:
        super().__init__(figure, text)
        self._line = figure.lines(1, color, width)
        self.nodes = [self._line]

    def show(self, start: ArrayLike, end: ArrayLike, text: str | None = None) -> None:
        """Draw it between two points ``(3,)``; `text`: another label from now on."""
        a, b = np.asarray(start, float), np.asarray(end, float)
        self.text = self.text if text is None else text
        self._line.points = np.array([[a, b]], np.float32)
        self._write(self.text, *beyond(a, b, self.size))

    def show_axis(self, point: ArrayLike, direction: ArrayLike, reach: float, text: str | None = None) -> None:
        """Draw an axis through a point ``(3,)``, to a distance `reach` (m) on both sides."""
        at, way = np.asarray(point, float), reach * unit(np.asarray(direction, float))
        self.show(at - way, at + way, text)


class Dimension(Part):
    """A distance as in an engineering drawing: two extension lines, and the dimension line between them."""

    def __init__(self, figure: Figure, text: str, color: Color) -> None:
        super().__init__(figure, text, scale=1.15)
        self._witness = figure.lines(2, GREY, LINE)
        self._measure = figure.lines(5, color, MEASURE)
        self.nodes = [self._measure, self._witness]

    def show(
        self,
        start: ArrayLike,
        end: ArrayLike,
        units: Units,
        aside: ArrayLike,
        *,
        value: float | None = None,
        text: str | None = None,
    ) -> None:
        """Draw it between two points ``(3,)``; equal points have no dimension line, only the label.

        Args:
            aside: direction ``(3,)`` from the points to the dimension line, such as `clear_of` gives.
            value: what the label says (m), where it has a sign; otherwise the distance.
            text: the whole label, instead of the name and the value.
        """
        a, b = np.asarray(start, float), np.asarray(end, float)
        off = ASIDE * self.size * unit(np.asarray(aside, float))
        lines = ruler(a, b, off)
        self._witness.points, self._measure.points = lines[:2], lines[2:]
        value = float(np.linalg.norm(b - a)) if value is None else value
        words = f"{self.text} = {units.lengths.text(value)}" if text is None else text
        self._write(words, *along(a, b, off))


class Angle(Part):
    """An angle: its two sides, and the arc between them with an arrow head."""

    def __init__(self, figure: Figure, text: str, color: Color) -> None:
        super().__init__(figure, text, scale=1.15)
        self._sides = figure.lines(2, GREY, LINE)
        self._arc = figure.lines(ARC + 2, color, MEASURE)
        self.nodes = [self._arc, self._sides]

    def show(
        self,
        corner: ArrayLike,
        start: ArrayLike,
        about: ArrayLike,
        angle: float,
        units: Units,
        *,
        radius: float | None = None,
        text: str | None = None,
    ) -> None:
        """Draw a rotation from the direction `start` ``(3,)`` about the axis `about` ``(3,)``, right-handed.

        Args:
            angle: signed (rad); its label is `name = value`, unless `text` is the whole label.
            radius: of the arc (m); otherwise six times the arm's thickness.
        """
        at, radius = np.asarray(corner, float), RADIUS * self.size if radius is None else radius
        lines = arc(at, start, about, radius, angle)
        self._sides.points, self._arc.points = lines[:2], lines[2:]
        words = f"{self.text} = {units.angles.text(angle)}" if text is None else text
        ways = turned(start, about, angle * np.array([0.5, 0.15, 0.85]))
        self._write(words, *(at + far * radius * way for far in (1.3, 1.75, 2.2) for way in ways))

    def show_between(
        self,
        corner: ArrayLike,
        one: ArrayLike,
        other: ArrayLike,
        units: Units,
        *,
        radius: float | None = None,
        text: str | None = None,
    ) -> None:
        """Draw the angle at a corner of a triangle, between the sides to two points ``(3,)``."""
        at = np.asarray(corner, float)
        a, b = unit(np.asarray(one, float) - at), unit(np.asarray(other, float) - at)
        normal = cross(a, b)
        sine = float(np.linalg.norm(normal))
        about = normal / sine if sine > TINY else perpendicular_to(a)
        self.show(at, a, about, math.atan2(sine, float(a @ b)), units, radius=radius, text=text)


class Point(Part):
    """A small ball with a label above it."""

    def __init__(self, figure: Figure, text: str, color: Color, radius: float) -> None:
        super().__init__(figure, text)
        self._radius = radius * figure.size
        self._ball = figure.scene.add_icosphere(
            figure.name(), self._radius, color, cast_shadow=False, receive_shadow=False, visible=False
        )
        self.nodes = [self._ball]

    def show(self, at: ArrayLike, beside: ArrayLike = (0.0, 0.0, 1.0), text: str | None = None) -> None:
        """Draw it at a point ``(3,)``, the label in the direction `beside` from it."""
        point = np.asarray(at, float)
        self.text = self.text if text is None else text
        assign(self._ball, point)
        self._write(self.text, *above(point, beside, self._radius, self.size))


class Face:
    """A translucent plane polygon, visible from both sides."""

    def __init__(self, figure: Figure, corners: int, color: Color, opacity: float) -> None:
        fan = [(0, k, k + 1) for k in range(1, corners - 1)]
        self.node = figure.scene.add_mesh_simple(
            figure.name(),
            np.zeros((corners, 3), np.float32),
            np.array(fan, np.uint32),
            color=color,
            opacity=opacity,
            side="double",
            flat_shading=True,
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )

    def show(self, corners: ArrayLike) -> None:
        """Draw it with these corners ``(k, 3)``, in order, convex."""
        self.node.vertices = np.asarray(corners, np.float32)
        set_visible(self.node, True)

    def hide(self) -> None:
        """Hide it until it is shown again."""
        set_visible(self.node, False)


def set_visible(node: viser.SceneNodeHandle, visible: bool) -> None:
    """Show or hide a node; nothing is sent if it is so already."""
    if node.visible != visible:
        node.visible = visible
