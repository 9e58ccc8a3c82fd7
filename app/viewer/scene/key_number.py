"""The number that matters most beside a point of the scene: what a target misses, or how far it was dragged."""

from __future__ import annotations

from typing import Literal

import viser

from app.viewer.labels import add_label
from app.viewer.viser_patches import assign, show_text
from kin.transforms import Array

Anchor = Literal["bottom-center", "top-center"]
# Height of the text above the point, relative to the radius of the sphere around the arm; or below it, clear of
# the arrows of a gizmo there.
_ABOVE, BELOW = 0.16, 0.3


def place_beside(point: Array, size: float, target: Array | None, radius: float) -> tuple[float, Anchor]:
    """The place of a mark's label: it must not cover the key number of a missed target.

    Args:
        point: where the mark is ``(3,)``.
        size: its distance from its label (m).
        target: the missed target ``(3,)``; None: there is no key number.
        radius: of the sphere around the arm (m).

    Returns:
        The label's height above the mark (m), and its anchor.
    """
    if target is None:
        return size, "bottom-center"
    if point[2] < target[2]:
        return -size, "top-center"
    return max(size, float(target[2] - point[2]) + 2.0 * _ABOVE * radius), "bottom-center"


class KeyNumber:
    """A short text above or below a point. Not thread-safe: the visitor's worker calls it."""

    def __init__(self, scene: viser.SceneApi, name: str = "/key-number", below: bool = False) -> None:
        self._height = -BELOW if below else _ABOVE
        anchor: Anchor = "top-center" if below else "bottom-center"
        self._label = add_label(scene, name, "", anchor=anchor, visible=False)

    def show(self, text: str, point: Array, radius: float) -> None:
        """Write beside a point ``(3,)``, for an arm in a sphere of this radius (m); "" hides the text."""
        if text:
            show_text(self._label, text)
            x, y, z = point.tolist()
            assign(self._label, (x, y, z + self._height * radius))
        if self._label.visible != bool(text):
            self._label.visible = bool(text)

    def hide(self) -> None:
        """Hide the text."""
        if self._label.visible:
            self._label.visible = False
