"""The shapes of figures in the scene: colours, widths, segments, and the places that their labels may have.

Everything is in one frame, in metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.viewer.lessons.label_room import HEIGHT
from kin.axes import cross, perpendicular_to
from kin.transforms import Array

Color = tuple[int, int, int]
Segments = NDArray[np.float32]

# Okabe and Ito's colours, of middle brightness: they show on a light and on a dark background.
BLUE, VERMILION, GREEN, AMBER, PURPLE, SKY = (
    (0, 114, 178),
    (213, 94, 0),
    (0, 158, 115),
    (230, 159, 0),
    (204, 121, 167),
    (86, 180, 233),
)
GREY = (128, 134, 145)
ARC = 32  # segments
# In units of the arm's thickness.
ASIDE, RADIUS, POINT = 4.0, 6.0, 0.55
LINE, MEASURE = 0.26, 0.42  # thickness
BEYOND = 1.2  # from the end of a line to its label
TINY = 1e-9


def arc(corner: ArrayLike, start: ArrayLike, about: ArrayLike, radius: float, angle: float) -> Segments:
    """A rotation: first and last side, the arc, and its arrow head ``(ARC + 4, 2, 3)``."""
    way = radius * turned(start, about, np.linspace(0.0, angle, ARC + 1))
    ahead = unit(way[-1] - way[-2])
    back = min(0.16 * radius, radius * abs(angle) / 2)
    lines = np.zeros((ARC + 4, 2, 3))
    lines[:2, 1] = 1.12 * way[[0, -1]]
    lines[2:-2, 0], lines[2:-2, 1] = way[:-1], way[1:]
    lines[-2:, 0] = way[-1]
    lines[-2:, 1] = way[-1] - back * ahead + np.array([[-0.5], [0.5]]) * back / radius * way[-1]
    moved: Segments = (lines + np.asarray(corner, float)).astype(np.float32)
    return moved


def ruler(start: Array, end: Array, aside: Array) -> Segments:
    """A distance: two extension lines, the dimension line at `aside` ``(3,)``, and arrow heads ``(7, 2, 3)``."""
    far, length = float(np.linalg.norm(aside)), float(np.linalg.norm(end - start))
    e, y = unit(end - start), unit(aside)
    back = min(0.16 * far, length / 2)
    barbs = [
        (tip + aside, tip + aside + way * back * e + side * 0.4 * back * y)
        for tip, way in ((start, 1.0), (end, -1.0))
        for side in (-1.0, 1.0)
    ]
    witness = [(start, start + 1.12 * aside), (end, end + 1.12 * aside)]
    return np.array([*witness, (start + aside, end + aside), *barbs], dtype=np.float32)


def turned(start: ArrayLike, about: ArrayLike, angles: ArrayLike) -> Array:
    """The direction `start`, perpendicular to `about`, turned by each angle about it ``(k, 3)``."""
    z, x = unit(np.asarray(about, float)), unit(np.asarray(start, float))
    y, each = cross(z, x), np.asarray(angles, float)[:, None]
    return np.asarray(np.cos(each) * x + np.sin(each) * y)


def beyond(start: Array, end: Array, size: float) -> tuple[Array, ...]:
    """Where the label of a line may be, for an arm of a thickness (m): beyond its end, or before its start."""
    way = size * unit(end - start)
    return end + BEYOND * way, end + (BEYOND + HEIGHT) * way, start - BEYOND * way


def above(at: Array, beside: ArrayLike, radius: float, size: float) -> tuple[Array, ...]:
    """Where the label of a ball may be: in the direction `beside` from it, or opposite."""
    way = unit(np.asarray(beside, float))
    near, far = radius + BEYOND * size, radius + (BEYOND + HEIGHT) * size
    return at + near * way, at - near * way, at + far * way, at - far * way


def along(start: Array, end: Array, aside: Array) -> tuple[Array, ...]:
    """Where the label of a dimension may be: at its line, `aside` ``(3,)`` from the points, or beyond it."""
    shares, distances = (0.5, 0.2, 0.8), (1.35, 2.0, 2.7)
    return tuple(start + share * (end - start) + far * aside for far in distances for share in shares)


def clear_of(start: ArrayLike, end: ArrayLike, others: Iterable[ArrayLike]) -> Array:
    """The direction ``(3,)`` perpendicular to a line in which a dimension is clear of points ``(3,)``, such as the
    joints: away from their middle. Where they are on the line themselves, any perpendicular direction.
    """
    a, b = np.asarray(start, float), np.asarray(end, float)
    e = unit(b - a)
    away = (a + b) / 2 - np.mean([np.asarray(each, float) for each in others], axis=0)
    across = away - (away @ e) * e
    far = float(np.linalg.norm(across))
    if far > 1e-3 * max(float(np.linalg.norm(away)), float(np.linalg.norm(b - a)), TINY):
        return np.asarray(across / far)
    return perpendicular_to(e) if e.any() else np.array([0.0, 0.0, 1.0])


def unit(v: Array) -> Array:
    """The unit vector, or zero."""
    length = float(np.linalg.norm(v))
    return np.asarray(v / length if length > TINY else np.zeros(3))
