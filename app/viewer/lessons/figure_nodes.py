"""Parts of figures in the scene: lines, dimensions, angles, points and faces, each with its label, as nodes.

A figure remembers only where its labels are. A label must not cover another one of its figure in the default view.
It takes the first of a few places that is free, and stays there while it is::

    self.figure = FigureNodes(body(robot).size)            # for each arm

    def scene(self):
        with self.figure as figure:
            return [*figure.line("normal", a, b, "x₁", RED), *figure.dimension("upper", c, d, "l₁", units, aside)]

The links of an arm hide what is inside them: call ``stage.arm.scene.see_through(True)`` while a figure is on show.
Labels are in front of everything, on a plate of their own, so they are readable in light and dark. Dimensions and
angles are beside what they measure, at a distance from the arm, and their values are in the reader's units.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from app.viewer.declared.scene import Color, Node, bars, label
from app.viewer.lessons.figure_shapes import (
    AMBER,
    ASIDE,
    BLUE,
    GREY,
    LINE,
    MEASURE,
    POINT,
    RADIUS,
    above,
    along,
    arc,
    beyond,
    ruler,
    turned,
    unit,
)
from app.viewer.lessons.label_room import Labels
from kin.transforms import Array
from kin.units import Units


class FigureNodes:
    """Makes the nodes of one figure, for one arm. All is in the frame of the node above, in metres.

    Args:
        size: the arm's thickness (m), ``body(robot).size``, the unit of widths and distances.
    """

    def __init__(self, size: float) -> None:
        self.size = size
        self._labels = Labels(size)
        self._drawn: set[str] = set()

    def __enter__(self) -> FigureNodes:
        self._drawn.clear()
        return self

    def __exit__(self, *_: object) -> None:
        """What was not drawn this time takes no room."""
        self._labels.keep(self._drawn)

    def line(
        self, key: str, start: ArrayLike, end: ArrayLike, text: str = "", color: Color = GREY, width: float = LINE
    ) -> list[Node]:
        """A straight line between two points ``(3,)`` with its label beyond the end."""
        a, b = np.asarray(start, float), np.asarray(end, float)
        places = beyond(a, b, self.size)
        return [self._bars(key, np.array([[a, b]]), color, width), *self._label(key, text, 1.0, places)]

    def axis(
        self, key: str, point: ArrayLike, direction: ArrayLike, reach: float, text: str = "", color: Color = GREY
    ) -> list[Node]:
        """An axis through a point ``(3,)``, to a distance `reach` (m) on both sides."""
        at, way = np.asarray(point, float), reach * unit(np.asarray(direction, float))
        return self.line(key, at - way, at + way, text, color)

    def dimension(
        self,
        key: str,
        start: ArrayLike,
        end: ArrayLike,
        text: str,
        units: Units,
        aside: ArrayLike,
        color: Color = BLUE,
        words: str | None = None,
    ) -> list[Node]:
        """A distance with its name and value, as in an engineering drawing; equal points have the label only.

        Args:
            aside: direction ``(3,)`` from the points to the dimension line, such as `clear_of` gives.
            words: the whole label, instead of name and value.
        """
        a, b = np.asarray(start, float), np.asarray(end, float)
        off = ASIDE * self.size * unit(np.asarray(aside, float))
        parts = ruler(a, b, off)
        words = f"{text} = {units.lengths.text(float(np.linalg.norm(b - a)))}" if words is None else words
        return [
            self._bars(f"{key}-witness", parts[:2], GREY, LINE),
            self._bars(key, parts[2:], color, MEASURE),
            *self._label(key, words, 1.15, along(a, b, off)),
        ]

    def angle(
        self,
        key: str,
        corner: ArrayLike,
        start: ArrayLike,
        about: ArrayLike,
        angle: float,
        text: str,
        units: Units,
        color: Color = BLUE,
        radius: float | None = None,
        words: str | None = None,
    ) -> list[Node]:
        """A rotation with its name and value: two sides, and the arc between them with an arrow head.

        Args:
            start, about: directions ``(3,)``: from which, and about which it turns, right-handed.
            angle: signed (rad).
            radius: of the arc (m); otherwise six times the arm's thickness.
            words: the whole label, instead of name and value; "": none.
        """
        at, radius = np.asarray(corner, float), RADIUS * self.size if radius is None else radius
        parts = arc(at, start, about, radius, angle)
        words = f"{text} = {units.angles.text(angle)}" if words is None else words
        ways = turned(start, about, angle * np.array([0.5, 0.15, 0.85]))
        places = tuple(at + far * radius * way for far in (1.3, 1.75, 2.2) for way in ways)
        return [
            self._bars(f"{key}-sides", parts[:2], GREY, LINE),
            self._bars(key, parts[2:], color, MEASURE),
            *self._label(key, words, 1.15, places),
        ]

    def point(
        self,
        key: str,
        at: ArrayLike,
        text: str = "",
        color: Color = AMBER,
        beside: ArrayLike = (0.0, 0.0, 1.0),
        radius: float = POINT,
    ) -> list[Node]:
        """A small ball, of this radius in thicknesses, with a label in the direction `beside` from it."""
        place, radius = np.asarray(at, float), radius * self.size
        props = {"radius": radius, "color": color, "cast_shadow": False, "receive_shadow": False}
        places = above(place, beside, radius, self.size)
        return [Node("icosphere", key, props, place), *self._label(key, text, 1.0, places)]

    def face(self, key: str, corners: ArrayLike, color: Color = BLUE, opacity: float = 0.22) -> list[Node]:
        """A translucent convex polygon with these corners ``(k, 3)``, in order; visible from both sides."""
        points = np.asarray(corners, np.float32)
        fan = np.array([(0, k, k + 1) for k in range(1, len(points) - 1)], np.uint32)
        look = {"side": "double", "flat_shading": True, "cast_shadow": False, "receive_shadow": False}
        return [
            Node(
                "mesh_simple", key, {"vertices": points, "faces": fan, "color": color, "opacity": opacity, **look}
            )
        ]

    def _bars(self, key: str, points: ArrayLike, color: Color, width: float) -> Node:
        return bars(key, points, color, width * self.size)

    def _label(self, key: str, text: str, scale: float, places: tuple[Array, ...]) -> list[Node]:
        if not text:
            return []
        self._drawn.add(key)
        return [label(f"{key}-label", text, self._labels.place(key, text, places), scale)]
