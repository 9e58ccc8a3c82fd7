"""Viewpoints: standard directions, what a picture contains, and the way from one viewpoint to another.

A viewpoint ``(3, 3)`` has the rows camera position, look-at point, and up direction.
"""

from __future__ import annotations

import math
from typing import Final, Literal, get_args

import numpy as np

from kin.transforms import Array

Side = Literal["Front", "Side", "Top", "Corner"]
SIDES: Final[tuple[Side, ...]] = get_args(Side)
FOV = math.radians(38)
UP = np.array([0.0, 0.0, 1.0])
GLIDE = 0.45  # seconds from one viewpoint to another
# From the arm to the camera. The arm faces x. From the top, y is up in the picture: a camera that looks straight
# down has no upright.
DIRECTIONS: dict[Side, tuple[float, float, float]] = {
    "Front": (1.0, 0.0, 0.0),
    "Side": (0.0, -1.0, 0.0),
    "Top": (0.0, -0.002, 1.0),
    "Corner": (1.0, 1.0, 1.0),
}


def contains(viewpoint: Array, aspect: float, points: Array, margin: float) -> bool:
    """Whether the picture from this viewpoint contains spheres of radius `margin` about points ``(n, 3)``."""
    seen = _seen(viewpoint, points)
    half = math.tan(FOV / 2.0)
    room = seen[:, 2:] * np.array([half * aspect, half]) - margin
    return bool((seen[:, 2] > margin).all() and (np.abs(seen[:, :2]) <= room).all())


def distance_to_see(viewpoint: Array, aspect: float, points: Array, share: float) -> float:
    """Least distance to the look-at point, in the viewpoint's direction, that shows all these points ``(n, 3)``.

    They are within this share (0–1) of the picture's width and height.
    """
    seen = _seen(viewpoint, points)
    half = share * math.tan(FOV / 2.0)
    ahead = seen[:, 2] - float(np.linalg.norm(viewpoint[1] - viewpoint[0]))  # of the look-at point
    return float(((np.abs(seen[:, :2]) / (half * aspect, half)).max(axis=1) - ahead).max())


def places(viewpoint: Array, aspect: float, points: Array) -> Array:
    """Where points ``(n, 3)`` are in the picture, and how long a metre is there: rows of x, y, length ``(n, 3)``.

    x is to the right of, and y above, the middle. The unit is half of the picture's narrow side, so that a place
    does not change with the picture's shape. A point behind the camera is far outside.
    """
    seen = _seen(viewpoint, points)
    unit = np.maximum(seen[:, 2:], 1e-9) * math.tan(FOV / 2.0) * min(aspect, 1.0)
    found: Array = np.hstack([seen[:, :2], np.ones((len(points), 1))]) / unit
    return found


def _seen(viewpoint: Array, points: Array) -> Array:
    """Points ``(n, 3)`` in the camera's frame: to the right, up, and forward."""
    position, look_at, up = viewpoint
    forward = look_at - position
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, up)
    right = right / max(float(np.linalg.norm(right)), 1e-9)
    seen: Array = (points - position) @ np.column_stack([right, np.cross(right, forward), forward])
    return seen


def between(start: Array, end: Array, share: float) -> Array:
    """The viewpoint after a share (0–1) of the way, which begins and ends gently."""
    t = share * share * (3.0 - 2.0 * share)
    look_at = (1.0 - t) * start[1] + t * end[1]
    out = [v[0] - v[1] for v in (start, end)]
    far = [max(float(np.linalg.norm(o)), 1e-9) for o in out]
    direction = (1.0 - t) * out[0] / far[0] + t * out[1] / far[1]
    size = float(np.linalg.norm(direction))
    if size < 1e-3:  # opposite sides
        return end
    back = direction / size * far[0] ** (1.0 - t) * far[1] ** t
    return np.stack([look_at + back, look_at, end[2]])
