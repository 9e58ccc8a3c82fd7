"""Axes with ticks and numbers along three edges of a box around the workspace."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import viser

from app.exports.svg import tick_labels
from app.viewer.labels import add_label
from app.viewer.scene.floor import INK_DARK, INK_LIGHT
from app.viewer.tabs.workspace.roots import new_root
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


class Axes:
    """The axes of one visitor's scene.

    Attributes:
        corners: the ends of the axes and the places of their titles ``(n, 3)``; None: no axes are shown.
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._top: viser.FrameHandle | None = None
        self._shown: tuple[Robot, Units, bool] | None = None
        self.corners: Array | None = None

    def show(self, robot: Robot | None, units: Units, dark: bool) -> None:
        """Draw the axes of this arm's workspace; None: no axes."""
        wanted = None if robot is None else (robot, units, dark)
        if wanted == self._shown:
            return
        self.remove()
        self._shown = wanted
        if robot is not None:
            self._draw(*box_of(robot), units, INK_DARK if dark else INK_LIGHT)

    def remove(self) -> None:
        """Remove the axes."""
        if self._top is not None:
            self._top.remove()
        self._top = self._shown = self.corners = None

    def _draw(self, low: Array, high: Array, units: Units, ink: tuple[int, int, int]) -> None:
        root, scene, unit = new_root(), self._scene, units.lengths
        self._top = scene.add_frame(root, show_axes=False)
        size = float((high - low).max())
        segments, titles = [], []
        for axis, letter in enumerate("xyz"):
            start = low.copy()
            # The vertical axis stands at another corner than that where x and y meet: their numbers are apart.
            start[1] = high[1] if axis == 2 else start[1]
            end = start.copy()
            end[axis] = high[axis]
            out = np.zeros(3)
            out[1 if axis != 1 else 0] = 0.02 * size * (1.0 if axis == 2 else -1.0)
            segments.append([start, end])
            if high[axis] - low[axis] >= LEAST:
                for value, text in tick_labels(float(low[axis]), float(high[axis]), unit.scale):
                    at = start.copy()
                    at[axis] = value
                    segments.append([at, at + out])
                    name = f"{root}/{letter}{text}"
                    add_label(scene, name, text, position=at + 2.4 * out, scale=0.75, anchor="center-center")
            title = f"{letter} ({unit.name})"
            beyond = end + 0.05 * size * np.eye(3)[axis]
            titles.append(beyond)
            add_label(scene, f"{root}/{letter}", title, position=beyond, scale=0.9, anchor="center-center")
        self.corners = np.vstack([low, *titles])
        lines = np.array(segments, np.float32)
        scene.add_line_segments(f"{root}/lines", lines, ink, thickness=1.5, thickness_units="screen")
