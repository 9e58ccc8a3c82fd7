"""Parts of figures as nodes: what `figures` draws, declared.

A figure remembers only where its labels are, so that they stay there while there is room::

    self.figure = FigureNodes(body(robot).size)            # for each arm

    def scene(self):
        with self.figure as figure:
            return [*figure.line("normal", a, b, "x₁", RED), *figure.dimension("upper", c, d, "l₁", units, aside)]
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from app.viewer.declared.scene import Color, Node, bars, label
from app.viewer.lessons.figures import AMBER, ASIDE, BEYOND, BLUE, GREY, LINE, MEASURE, POINT, ruler
from app.viewer.lessons.label_room import HEIGHT, label_room
from kin.transforms import Array
from kin.units import Units

_TINY = 1e-9


class FigureNodes:
    """Makes the nodes of one figure, for one arm. All is in the frame of the node above, in metres.

    Args:
        size: the arm's thickness (m), ``body(robot).size``, the unit of widths and distances.
    """

    def __init__(self, size: float) -> None:
        self.size = size
        self._labels: dict[str, tuple[Array, str]] = {}
        self._places: dict[str, int] = {}
        self._drawn: set[str] = set()

    def __enter__(self) -> FigureNodes:
        self._drawn.clear()
        return self

    def __exit__(self, *_: object) -> None:
        """What was not drawn this time takes no room."""
        for key in set(self._labels) - self._drawn:
            del self._labels[key], self._places[key]

    def line(
        self, key: str, start: ArrayLike, end: ArrayLike, text: str = "", color: Color = GREY, width: float = LINE
    ) -> list[Node]:
        """A straight line between two points ``(3,)`` with its label beyond the end."""
        a, b = np.asarray(start, float), np.asarray(end, float)
        way = self.size * _unit(b - a)
        at = b + BEYOND * way, b + (BEYOND + HEIGHT) * way, a - BEYOND * way
        return [self._bars(key, np.array([[a, b]]), color, width), *self._label(key, text, 1.0, *at)]

    def axis(
        self, key: str, point: ArrayLike, direction: ArrayLike, reach: float, text: str = "", color: Color = GREY
    ) -> list[Node]:
        """An axis through a point ``(3,)``, to a distance `reach` (m) on both sides."""
        at, way = np.asarray(point, float), reach * _unit(np.asarray(direction, float))
        return self.line(key, at - way, at + way, text, color)

    def dimension(
        self, key: str, start: ArrayLike, end: ArrayLike, text: str, units: Units, aside: ArrayLike,
        color: Color = BLUE,
    ) -> list[Node]:  # fmt: skip
        """A distance with its value; `aside`: the direction ``(3,)`` to the dimension line, see `clear_of`."""
        a, b = np.asarray(start, float), np.asarray(end, float)
        off = ASIDE * self.size * _unit(np.asarray(aside, float))
        parts = ruler(a, b, off)
        words = f"{text} = {units.lengths.text(float(np.linalg.norm(b - a)))}"
        at = (a + share * (b - a) + far * off for far in (1.35, 2.0, 2.7) for share in (0.5, 0.2, 0.8))
        return [
            self._bars(f"{key}-witness", parts[:2], GREY, LINE),
            self._bars(key, parts[2:], color, MEASURE),
            *self._label(key, words, 1.15, *at),
        ]

    def point(
        self, key: str, at: ArrayLike, text: str = "", color: Color = AMBER, beside: ArrayLike = (0.0, 0.0, 1.0)
    ) -> list[Node]:
        """A small ball with a label in the direction `beside` from it."""
        place, way, radius = np.asarray(at, float), _unit(np.asarray(beside, float)), POINT * self.size
        props = {"radius": radius, "color": color, "cast_shadow": False, "receive_shadow": False}
        near, far = radius + BEYOND * self.size, radius + (BEYOND + HEIGHT) * self.size
        places = place + near * way, place - near * way, place + far * way, place - far * way
        return [Node("icosphere", key, props, place), *self._label(key, text, 1.0, *places)]

    def _bars(self, key: str, points: ArrayLike, color: Color, width: float) -> Node:
        return bars(key, points, color, width * self.size)

    def _label(self, key: str, text: str, scale: float, *places: Array) -> list[Node]:
        """The label at the first of these points ``(3,)`` that has room; where it is comes first."""
        if not text:
            return []
        first = self._places.get(key, 0)
        rooms = {}
        for k in (first, *(k for k in range(len(places)) if k != first)):
            rooms[k] = self._room(key, text, places[k])
            if rooms[k] >= 1.0:
                break
        best = self._places[key] = max(rooms, key=rooms.__getitem__)
        self._labels[key] = places[best], text
        self._drawn.add(key)
        return [label(f"{key}-label", text, places[best], scale)]

    def _room(self, key: str, text: str, at: Array) -> float:
        """The room of a label at a point ``(3,)``: below 1 it covers another one in the default view."""
        others = (other for name, other in self._labels.items() if name != key)
        return min((label_room(at - place, text, words, self.size) for place, words in others), default=math.inf)


def _unit(v: Array) -> Array:
    """The unit vector, or zero."""
    length = float(np.linalg.norm(v))
    return np.asarray(v / length if length > _TINY else np.zeros(3))
