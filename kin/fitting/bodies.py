"""Boxes, cylinders, spheres and capsules as triangles and balls, as `capsules_around` takes them."""

from __future__ import annotations

import itertools

import numpy as np

from kin.transforms import Array

SIDES = 24  # of a cylinder: a prism around it, whose corners are 0.9 % farther out
_CORNERS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
_FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))


def box(x: float, y: float, z: float) -> Array:
    """The triangles ``(12, 3, 3)`` of a box about the origin with these sides."""
    corners = _CORNERS * (x, y, z)
    return np.array([corners[[a, *pair]] for a, *rest in _FACES for pair in (rest[:2], rest[1:])])


def cylinder(radius: float, length: float) -> Array:
    """Triangles ``(k, 3, 3)`` of a prism around a cylinder about z, with its middle at the origin."""
    angle = np.arange(SIDES) * 2.0 * np.pi / SIDES
    out = radius / np.cos(np.pi / SIDES)
    rim = np.column_stack([out * np.cos(angle), out * np.sin(angle), np.full(SIDES, 0.5 * length)])
    top, bottom = rim, rim * (1.0, 1.0, -1.0)
    following = np.roll(top, -1, axis=0), np.roll(bottom, -1, axis=0)
    middle = np.broadcast_to([0.0, 0.0, 0.5 * length], rim.shape)
    return np.concatenate(
        [
            np.stack([top, bottom, following[0]], axis=1),
            np.stack([bottom, following[0], following[1]], axis=1),
            np.stack([top, following[0], middle], axis=1),
            np.stack([bottom, following[1], -middle], axis=1),
        ]
    )


def balls(radius: float, length: float = 0.0) -> Array:
    """The balls ``(1, 2, 4)`` at the ends of a capsule about z; `length` is that of its axis."""
    return np.array([[[0.0, 0.0, -0.5 * length, radius], [0.0, 0.0, 0.5 * length, radius]]])


def moved(points: Array, T: Array) -> Array:
    """Points ``(..., 3)`` moved by a transform; of balls ``(..., 4)`` their centres."""
    out = points.copy()
    out[..., :3] = points[..., :3] @ T[:3, :3].T + T[:3, 3]
    return out
