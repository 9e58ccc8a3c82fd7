"""The number that matters most while a target is missed, beside the target in the scene."""

from __future__ import annotations

import numpy as np
import viser

from kin.transforms import Array

_ABOVE = 0.16  # height of the text above the target, relative to the radius of the sphere around the arm


class KeyNumber:
    """A short text above the target. Not thread-safe: the visitor's worker calls it."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._label = scene.add_label("/key-number", "", anchor="bottom-center", visible=False)

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
