"""Parts of figures as nodes: what `figures` draws, declared.

A figure remembers only where its labels are, so that they stay there while there is room::

    self.figure = FigureNodes(body(robot).size)            # for each arm

    def scene(self):
        with self.figure as figure:
            return [*figure.line("normal", a, b, "x₁", RED), *figure.dimension("upper", c, d, "l₁", units, aside)]
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
    above,
    along,
    beyond,
    ruler,
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
        self, key: str, start: ArrayLike, end: ArrayLike, text: str, units: Units, aside: ArrayLike,
        color: Color = BLUE,
    ) -> list[Node]:  # fmt: skip
        """A distance with its value; `aside`: the direction ``(3,)`` to the dimension line, see `clear_of`."""
        a, b = np.asarray(start, float), np.asarray(end, float)
        off = ASIDE * self.size * unit(np.asarray(aside, float))
        parts = ruler(a, b, off)
        words = f"{text} = {units.lengths.text(float(np.linalg.norm(b - a)))}"
        return [
            self._bars(f"{key}-witness", parts[:2], GREY, LINE),
            self._bars(key, parts[2:], color, MEASURE),
            *self._label(key, words, 1.15, along(a, b, off)),
        ]

    def point(
        self, key: str, at: ArrayLike, text: str = "", color: Color = AMBER, beside: ArrayLike = (0.0, 0.0, 1.0)
    ) -> list[Node]:
        """A small ball with a label in the direction `beside` from it."""
        place, radius = np.asarray(at, float), POINT * self.size
        props = {"radius": radius, "color": color, "cast_shadow": False, "receive_shadow": False}
        places = above(place, beside, radius, self.size)
        return [Node("icosphere", key, props, place), *self._label(key, text, 1.0, places)]

    def _bars(self, key: str, points: ArrayLike, color: Color, width: float) -> Node:
        return bars(key, points, color, width * self.size)

    def _label(self, key: str, text: str, scale: float, places: tuple[Array, ...]) -> list[Node]:
        if not text:
            return []
        self._drawn.add(key)
        return [label(f"{key}-label", text, self._labels.place(key, text, places), scale)]
