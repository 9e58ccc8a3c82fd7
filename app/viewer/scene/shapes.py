"""The solids of an arm: solids of revolution, tubes and boxes.

The browser smooths shading across vertices that faces share. So a round side shares its vertices, and a sharp edge
has its vertices twice.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kin.transforms import Array, frame_from_approach

Faces = NDArray[np.int64]
SEGMENTS = 28
MOST_POINTS = 100
DIRECTIONS = 28  # corners of an outline
# The corners of a unit box, and three of them for each of its triangles, counter-clockwise as seen from outside.
_CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
_SIDES = np.array(
    [
        [1, 3, 0],
        [4, 1, 0],
        [0, 3, 2],
        [2, 4, 0],
        [1, 7, 3],
        [5, 1, 4],
        [5, 7, 1],
        [3, 7, 2],
        [6, 4, 2],
        [2, 7, 6],
        [6, 5, 4],
        [7, 5, 6],
    ]
)


class Solid(NamedTuple):
    """The triangles of a mesh: points ``(k, 3)``, and three rows of them for each triangle ``(m, 3)``."""

    vertices: NDArray[np.floating]
    faces: NDArray[np.integer]

    @property
    def bounds(self) -> Array:
        """Its lowest and highest coordinates ``(2, 3)``."""
        return np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)], dtype=float)


def lathe(profile: ArrayLike) -> Solid:
    """The solid of revolution about z of a profile ``(k, 2)`` of (radius, z), bottom to top, with sharp edges."""
    angles = np.linspace(0.0, 2 * np.pi, SEGMENTS, endpoint=False)
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    return loft([np.column_stack([r * ring, np.full(SEGMENTS, z)]) for r, z in np.asarray(profile, dtype=float)])


def loft(rings: Sequence[Array]) -> Solid:
    """The surface through closed outlines ``(k, 3)`` of as many points each, with sharp edges at the outlines."""
    count = len(rings[0])
    faces = [_band(2 * i * count, (2 * i + 1) * count, count) for i in range(len(rings) - 1)]
    return Solid(np.vstack([ring for pair in pairwise(rings) for ring in pair]), np.vstack(faces))


def outline(discs: ArrayLike, inset: float = 0.0) -> Array:
    """The convex hull of discs ``(k, 3)`` of (u, v, radius), made smaller by `inset`: points ``(DIRECTIONS, 2)``.

    Each point is the farthest one in one of as many directions, so that points of different outlines correspond.
    """
    centers = np.asarray(discs, dtype=float)
    angles = np.linspace(0.0, 2 * np.pi, DIRECTIONS, endpoint=False)
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    radii = centers[:, 2] - inset
    farthest = (directions @ centers[:, :2].T + radii).argmax(axis=1)
    points: Array = centers[farthest, :2] + radii[farthest, None] * directions
    return points


def cylinder(radius: float, low: float, high: float, bevel: float = 0.12) -> Solid:
    """A cylinder about z between two heights, its rims bevelled by a fraction of the radius."""
    b = min(bevel * radius, 0.4 * (high - low))
    return lathe(
        [(0, low), (radius - b, low), (radius, low + b), (radius, high - b), (radius - b, high), (0, high)]
    )


def cone(radius: float, low: float, high: float) -> Solid:
    """A cone about z with its tip at `high`."""
    return lathe([(0, low), (radius, low), (0, high)])


def ball(radius: float, center: ArrayLike = (0.0, 0.0, 0.0)) -> Solid:
    """A sphere."""
    return tube(np.asarray([center]), radius)


def box(low: ArrayLike, high: ArrayLike) -> Solid:
    """A box between two corners, with sharp edges."""
    ends = np.array([low, high], dtype=float)
    corners = ends[0] + _CORNERS * np.ptp(ends, axis=0)
    return Solid(corners[_SIDES.ravel()], np.arange(_SIDES.size, dtype=np.int64).reshape(-1, 3))


def tube(path: Array, radius: float) -> Solid:
    """A round tube with hemispherical ends along a centre line ``(k, 3)``, its corners rounded.

    One point gives a sphere.
    """
    line = _rounded(path, 2.2 * radius) if len(path) > 2 else path
    ends = np.linspace(np.pi / 2, 0.0, 6)[:-1]
    if len(line) == 1:
        up = np.array([0.0, 0.0, 1.0])
        tangents = np.array([up, up])
        line = np.vstack([line, line])
    else:
        steps = np.diff(line, axis=0)
        steps /= np.linalg.norm(steps, axis=1, keepdims=True)
        tangents = np.vstack([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
        lengths = np.linalg.norm(tangents, axis=1, keepdims=True)
        # Where the centre line doubles back, the mean direction is undefined.
        before = np.vstack([steps[:1], steps])
        tangents = np.where(lengths > 1e-6, tangents / np.maximum(lengths, 1e-6), before)
    centers, radii = [], []
    centers += [line[0] - tangents[0] * radius * np.sin(a) for a in ends]
    radii += [radius * np.cos(a) for a in ends]
    centers += list(line)
    radii += [radius] * len(line)
    centers += [line[-1] + tangents[-1] * radius * np.sin(a) for a in ends[::-1]]
    radii += [radius * np.cos(a) for a in ends[::-1]]
    directions = np.vstack([[tangents[0]] * len(ends), tangents, [tangents[-1]] * len(ends)])

    angles = np.linspace(0.0, 2 * np.pi, SEGMENTS, endpoint=False)
    side = frame_from_approach(directions[0])[:, 0]
    rings, faces = [], []
    for k, (center, r, direction) in enumerate(zip(centers, radii, directions, strict=True)):
        # Parallel transport of the side vector, so that the tube does not twist.
        side = side - direction * (side @ direction)
        norm = float(np.linalg.norm(side))
        side = side / norm if norm > 1e-6 else frame_from_approach(direction)[:, 0]
        other = np.cross(direction, side)
        rings.append(center + r * (np.outer(np.cos(angles), side) + np.outer(np.sin(angles), other)))
        if k:
            faces.append(_band((k - 1) * SEGMENTS, k * SEGMENTS))
    return Solid(np.vstack(rings), np.vstack(faces))


def merged(parts: list[Solid]) -> Solid:
    """Several solids as one mesh."""
    offsets = np.cumsum([0, *(len(p.vertices) for p in parts[:-1])])
    return Solid(
        np.vstack([p.vertices for p in parts]),
        np.vstack([p.faces + o for p, o in zip(parts, offsets, strict=True)]),
    )


def placed(mesh: Solid, T: Array) -> Solid:
    """A copy of the mesh moved by a transform ``(4, 4)``."""
    return Solid(mesh.vertices @ T[:3, :3].T + T[:3, 3], np.asarray(mesh.faces))


def spaced(path: Array, step: float) -> Array:
    """Points on a polyline ``(k, 3)``, at most `step` apart, farther where that takes over `MOST_POINTS`."""
    pieces = [path[:1]]
    for start, end in pairwise(path):
        count = math.ceil(min(MOST_POINTS, max(1.0, float(np.linalg.norm(end - start)) / step)))
        pieces.append(start + (end - start) * (np.arange(1, count + 1) / count)[:, None])
    return np.vstack(pieces)


def _band(low: int, high: int, count: int = SEGMENTS) -> Faces:
    i = np.arange(count)
    j = (i + 1) % count
    return np.vstack(
        [np.column_stack([low + i, low + j, high + j]), np.column_stack([low + i, high + j, high + i])]
    )


def _rounded(path: Array, radius: float, steps: int = 7) -> Array:
    """The polyline with each corner replaced by a parabola that touches both sides."""
    points = [path[0]]
    for before, corner, after in zip(path[:-2], path[1:-1], path[2:], strict=True):
        a, b = before - corner, after - corner
        la, lb = float(np.linalg.norm(a)), float(np.linalg.norm(b))
        cut = min(radius, 0.45 * la, 0.45 * lb)
        p, r = corner + a / la * cut, corner + b / lb * cut
        t = np.linspace(0.0, 1.0, steps)[:, None]
        points += list((1 - t) ** 2 * p + 2 * t * (1 - t) * corner + t**2 * r)
    points.append(path[-1])
    return np.array(points)
