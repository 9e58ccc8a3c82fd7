"""The room between labels of a scene. Their size on screen is constant; here it is that of a small window."""

from __future__ import annotations

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
