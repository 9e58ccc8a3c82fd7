"""Axes with ticks and numbers along three edges of a box around the workspace."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from app.exports.svg import tick_labels
from app.viewer.declared.scene import Node, label, lines
from app.viewer.scene.floor import INK_DARK, INK_LIGHT
from kin import Robot
from kin.transforms import Array
from kin.units import Units
from kin.workspace import workspace_slice

SAMPLES = 4096  # configurations that determine the box
LEAST = 0.02  # m: an axis along which the workspace is thinner has no ticks


@lru_cache(maxsize=256)
def box_of(robot: Robot) -> tuple[Array, Array]:
    """Two corners ``(3,)`` of a box around the workspace, with some room."""
    points = workspace_slice(robot, SAMPLES, 0, SAMPLES, strategy="quasi").points.astype(np.float64)
    low, high = points.min(axis=0), points.max(axis=0)
    room = 0.06 * float((high - low).max())
    return low - room, high + room


@lru_cache(maxsize=256)
def corners_of(robot: Robot) -> Array:
    """The ends of the axes and the places of their titles ``(4, 3)``: what a picture of them has to contain."""
    low, high = box_of(robot)
    return np.vstack([low, *(_title_place(low, high, axis) for axis in range(3))])


def _edge(low: Array, high: Array, axis: int) -> tuple[Array, Array]:
    """The ends ``(3,)`` of an axis of this box."""
    start = low.copy()
    # The vertical axis stands at another corner than that where x and y meet: their numbers are apart.
    start[1] = high[1] if axis == 2 else start[1]
    end = start.copy()
    end[axis] = high[axis]
    return start, end


def _title_place(low: Array, high: Array, axis: int) -> Array:
    """A place ``(3,)`` beyond the end of an axis of this box."""
    place: Array = _edge(low, high, axis)[1] + 0.05 * float((high - low).max()) * np.eye(3)[axis]
    return place


def nodes(robot: Robot, units: Units, dark: bool) -> list[Node]:
    """The axes of this arm's workspace."""
    (low, high), unit = box_of(robot), units.lengths
    size = float((high - low).max())
    segments, labels = list[list[Array]](), list[Node]()
    for axis, letter in enumerate("xyz"):
        start, end = _edge(low, high, axis)
        out = np.zeros(3)
        out[1 if axis != 1 else 0] = 0.02 * size * (1.0 if axis == 2 else -1.0)
        segments.append([start, end])
        if high[axis] - low[axis] >= LEAST:
            for value, text in tick_labels(float(low[axis]), float(high[axis]), unit.scale):
                at = start.copy()
                at[axis] = value
                segments.append([at, at + out])
                labels.append(label(f"{letter}{text}", text, at + 2.4 * out, 0.75))
        labels.append(label(letter, f"{letter} ({unit.name})", _title_place(low, high, axis), 0.9))
    drawn = [lines("lines", segments, INK_DARK if dark else INK_LIGHT, 1.5), *labels]
    # Of its own for each unit: other numbers stand at other places.
    return [Node("frame", f"axes-{unit.name}", {"show_axes": False}, children=drawn, keep=False)]
