"""The room between labels of a scene, and the places that they take.

Their size on screen is constant; here it is that of a small window.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable, Sequence

import numpy as np

from app.viewer.scene.camera import DIRECTION
from app.viewer.scene.viewpoints import UP
from kin.axes import cross
from kin.transforms import Array

LETTER, HEIGHT = 0.55, 1.6  # width of a letter and height of a label, in units of the arm's thickness
_RIGHT = cross(-DIRECTION, UP) / np.linalg.norm(cross(-DIRECTION, UP))
_UPWARDS = cross(_RIGHT, -DIRECTION) / np.linalg.norm(DIRECTION)


def label_room(between: Array, one: str, other: str, size: float) -> float:
    """How far apart two labels are, as seen in the default view: below 1 they overlap.

    Args:
        between: from the middle of the other label to that of the one ``(3,)`` (m).
        size: the arm's thickness (m).
    """
    width = LETTER * (len(one) + len(other)) / 2.0 + 0.5
    return max(abs(float(between @ _RIGHT)) / width, abs(float(between @ _UPWARDS)) / HEIGHT) / size


class Labels:
    """Where the labels of one figure are. Each has a few places, and stays in one while there is room.

    Args:
        size: the arm's thickness (m).
    """

    def __init__(self, size: float) -> None:
        self._size = size
        self._shown: dict[Hashable, tuple[int, Array, str]] = {}

    def place(self, key: Hashable, text: str, places: Sequence[Array]) -> Array:
        """The first of these points ``(3,)`` that has room for a label; where it is comes first."""
        first = self._shown[key][0] if key in self._shown else 0
        rooms = {}
        for k in (first, *(k for k in range(len(places)) if k != first)):
            rooms[k] = self._room(key, text, places[k])
            if rooms[k] >= 1.0:
                break
        best = max(rooms, key=rooms.__getitem__)
        self._shown[key] = best, places[best], text
        return places[best]

    def keep(self, keys: Collection[Hashable]) -> None:
        """Only these labels are on show."""
        for key in [key for key in self._shown if key not in keys]:
            del self._shown[key]

    def _room(self, key: Hashable, text: str, at: Array) -> float:
        """The room of a label at a point ``(3,)``: below 1 it covers another one in the default view."""
        others = (shown for other, shown in self._shown.items() if other != key)
        rooms = (label_room(at - place, text, words, self._size) for _, place, words in others)
        return min(rooms, default=math.inf)
