"""Surfaces of files and solids → what each link of an arm looks like.

Imported by the process that parses meshes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from app.viewer.meshes.archive import MeshError, TooLargeError
from app.viewer.meshes.surface import LinkBody, Points, Rgb, Surface, by_color

PLAIN: Rgb = (196, 201, 208)  # of what nothing gives a colour
COLORS = 8  # of one link
FARTHEST = 10.0  # times the reach of the arm: a mesh beyond is not in metres
COVER = 150  # points of a link that are tested against pedestal and floor
LOOKED_AT = 20_000  # points of a link among which these are chosen
MOST_DRAWN = 120_000  # triangles of an arm, its boxes, cylinders and spheres included


class Body(NamedTuple):
    """The collision bodies of one link, which become capsules.

    Attributes:
        pieces: of each, the name of its shape, its numbers, and the upper three rows of its pose in the link, 12
            numbers; the first number of a mesh is its path.
        most: capsules at most.
    """

    pieces: Sequence[tuple[str, Sequence[object], Sequence[float]]]
    most: int


class Fit(NamedTuple):
    """The capsules of a link: start, end and radius, 7 numbers each, and what of its bodies is missing."""

    capsules: Sequence[Sequence[float]]
    missing: Sequence[str]


class Piece(NamedTuple):
    """One visible body.

    Attributes:
        source: the path of a mesh, as a URDF names it, or the index of a solid.
        carrier: how many joints move it.
        pose: the upper three rows of its pose in the link, 12 numbers.
        color: where a mesh has none of its own.
        link: name of its link, for messages.
    """

    source: str | int
    carrier: int
    pose: Sequence[float]
    scale: Sequence[float] = (1.0, 1.0, 1.0)
    color: Sequence[int] | None = None
    link: str = ""


@dataclass(frozen=True, eq=False)
class Shapes:
    """The visible bodies of an arm with so many links (the base included) and this reach (m).

    Attributes:
        solids: boxes, cylinders and spheres.
        bodies: what becomes capsules.
    """

    pieces: Sequence[Piece]
    solids: Sequence[Surface]
    links: int
    reach: float
    bodies: Sequence[Body] = ()

    @property
    def files(self) -> dict[str, int]:
        """The paths of the meshes, and how often each is drawn."""
        paths = [piece.source for piece in self.pieces if isinstance(piece.source, str)]
        return {path: paths.count(path) for path in dict.fromkeys(paths)}


def placed(shapes: Shapes, files: Mapping[str, Sequence[Surface]]) -> list[LinkBody]:
    """What each link looks like, in its own coordinates.

    Args:
        files: the surfaces of all meshes, by their path.

    Raises:
        MeshError: a mesh is far too large, as one in millimetres is.
    """
    links: list[list[Surface]] = [[] for _ in range(shapes.links)]
    drawn = 0
    for piece in shapes.pieces:
        surfaces = files[piece.source] if isinstance(piece.source, str) else [shapes.solids[piece.source]]
        for surface in surfaces:
            drawn += len(surface.faces)
            if drawn > MOST_DRAWN:
                expected = f"at most {MOST_DRAWN} with all shapes"
                raise TooLargeError("meshes: triangles to draw", f"more than {MOST_DRAWN}", expected)
            moved = _moved(surface, piece)
            _check_extent(float(np.abs(moved.points).max()), piece, shapes.reach)
            links[piece.carrier].append(moved)
    joined = [by_color(surfaces, COLORS) for surfaces in links]
    return [LinkBody(surfaces, _cover([surface.points for surface in surfaces])) for surfaces in joined]


def _moved(surface: Surface, piece: Piece) -> Surface:
    """A surface in the coordinates of its link; the colours of a mesh file come before that of the URDF."""
    scale = np.array(piece.scale, dtype=np.float32)
    pose = np.array(piece.pose, dtype=np.float32).reshape(3, 4)
    points = np.asarray((surface.points * scale) @ pose[:, :3].T + pose[:, 3], dtype=np.float32)
    faces = surface.faces[:, ::-1] if scale.prod() < 0.0 else surface.faces
    color = PLAIN if piece.color is None else (piece.color[0], piece.color[1], piece.color[2])
    return Surface(surface.color or color, points, faces)


def _check_extent(extent: float, piece: Piece, reach: float) -> None:
    if extent <= FARTHEST * max(reach, 0.01):
        return
    name = f"mesh {piece.source}" if isinstance(piece.source, str) else f"a shape of link {piece.link}"
    expected = f"at most {FARTHEST:g} times the reach of {reach:.3g} m"
    hint = "; is it in millimetres? Then give it the scale 0.001 0.001 0.001"
    raise MeshError(f"{name}: size", f"{extent:.3g} m", expected + hint)


def _cover(clouds: Sequence[Points]) -> Points:
    """Some points ``(k, 3)`` of the surfaces, spread evenly."""
    if not clouds:
        return np.empty((0, 3), dtype=np.float32)
    points = np.vstack(clouds)
    points = points[:: max(1, len(points) // LOOKED_AT)]
    low, high = points.min(axis=0), points.max(axis=0)
    cell = float((high - low).max()) / 8.0 or 1.0
    x, y, z = np.floor((points - low) / cell).astype(np.int64).T
    _, first = np.unique((x << 32) | (y << 16) | z, return_index=True)
    chosen = points[np.sort(first)]
    return chosen[:: max(1, len(chosen) // COVER)]
