"""The number that matters most while a target is missed, beside the target in the scene."""

from __future__ import annotations

from typing import Literal

import numpy as np
import viser

from app.viewer.labels import add_label
from kin.transforms import Array

Anchor = Literal["bottom-center", "top-center"]
_ABOVE = 0.16  # height of the text above the target, relative to the radius of the sphere around the arm


def place_beside(point: Array, size: float, target: Array | None, radius: float) -> tuple[float, Anchor]:
    """Where a label of a mark is, so that it does not cover the key number of a missed target.

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
    """A short text above the target. Not thread-safe: the visitor's worker calls it."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._label = add_label(scene, "/key-number", "", anchor="bottom-center", visible=False)

    def show(self, text: str, target: Array, radius: float) -> None:
        """Write above a target point ``(3,)``, for an arm in a sphere of this radius (m); "" hides the text."""
        if text:
            if self._label.text != text:
                self._label.text = text
            self._label.position = target + np.array([0.0, 0.0, _ABOVE * radius])
        if self._label.visible != bool(text):
            self._label.visible = bool(text)

    def hide(self) -> None:
        """Hide the text."""
        if self._label.visible:
            self._label.visible = False
