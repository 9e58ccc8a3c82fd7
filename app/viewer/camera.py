"""A default view that fits the arm's size and the window's shape."""

from __future__ import annotations

import math

import numpy as np
import viser

from app.viewer.meshes import Body
from kin.transforms import Array

FOV = math.radians(38)
DIRECTION = np.array([0.80, 0.92, 0.46])


def view(body: Body, aspect: float, sheet: bool = False) -> tuple[Array, Array]:
    """Camera position and look-at point ``(3,)`` that show the whole of the arm in a window of this aspect.

    In a portrait window the width is what limits. On a phone the panel is a `sheet` that covers the lower part:
    there the arm goes above it.
    """
    half, center = FOV / 2, body.center
    if aspect < 1.0:
        half = math.atan(math.tan(half) * aspect)
    if sheet and aspect < 1.0:
        center = center - np.array([0.0, 0.0, 0.57 * body.radius / aspect])
    distance = 1.06 * body.radius / math.sin(half)
    return center + DIRECTION / np.linalg.norm(DIRECTION) * distance, center


def aim(camera: viser.CameraHandle, body: Body, sheet: bool = False) -> None:
    """Move a visitor's camera to the default view; `sheet` as for `view`."""
    width, height = camera.image_width, camera.image_height
    position, look_at = view(body, width / height if width > 0 and height > 0 else 1.6, sheet)
    camera.fov = FOV
    camera.near, camera.far = body.radius / 50, body.radius * 200
    camera.position = position
    camera.look_at = look_at
