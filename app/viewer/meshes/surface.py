"""Surfaces: meshes of one colour each, and how they travel from the process that parses them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Rgb = tuple[int, int, int]
Points = NDArray[np.float32]
Faces = NDArray[np.uint32]
GREY = (128, 128, 128)  # what a surface without a colour is compared as


class Surface(NamedTuple):
    """One mesh of one colour (None: nothing names one)."""

    color: Rgb | None
    points: Points
    faces: Faces

    @property
    def size(self) -> int:
        """Its bytes."""
        return self.points.nbytes + self.faces.nbytes


def by_color(pieces: Sequence[Surface], most: int) -> list[Surface]:
    """The surfaces joined to one per colour, those of the rarer colours with the closest of the `most` others."""
    groups: dict[Rgb | None, list[Surface]] = {}
    for piece in pieces:
        groups.setdefault(piece.color, []).append(piece)
    largest = sorted(groups, key=lambda color: -sum(len(piece.faces) for piece in groups[color]))
    for color in largest[most:]:
        near = min(largest[:most], key=lambda other: _distance(color, other))
        groups[near] += groups.pop(color)
    return [_joined(color, group) for color, group in groups.items()]


def _distance(color: Rgb | None, other: Rgb | None) -> int:
    return sum(abs(a - b) for a, b in zip(color or GREY, other or GREY, strict=True))


def _joined(color: Rgb | None, pieces: Sequence[Surface]) -> Surface:
    offsets = np.cumsum([0, *(len(piece.points) for piece in pieces[:-1])])
    faces = [piece.faces + np.uint32(offset) for piece, offset in zip(pieces, offsets, strict=True)]
    return Surface(color, np.vstack([piece.points for piece in pieces]), np.vstack(faces))


class LinkBody(NamedTuple):
    """What a link looks like: a surface for each colour, and points ``(k, 3)`` spread over them."""

    surfaces: Sequence[Surface]
    cover: Points


def pack(links: Sequence[LinkBody], triangles: int = 0, fits: Sequence[object] = ()) -> bytes:
    """Finished links as bytes: a line of JSON with all sizes, and the arrays one after the other.

    Args:
        triangles: how many there were before they were simplified.
        fits: more that goes into the line.
    """
    sizes = [
        [len(link.cover), [[surface.color, len(surface.points), len(surface.faces)] for surface in link.surfaces]]
        for link in links
    ]
    parts = [json.dumps({"triangles": triangles, "links": sizes, "fits": fits}).encode(), b"\n"]
    for link in links:
        parts.append(np.ascontiguousarray(link.cover, dtype="<f4").tobytes())
        for surface in link.surfaces:
            parts.append(np.ascontiguousarray(surface.points, dtype="<f4").tobytes())
            parts.append(np.ascontiguousarray(surface.faces, dtype="<u4").tobytes())
    return b"".join(parts)


def unpack(packed: bytes, most: int) -> tuple[list[LinkBody], int]:
    """What `pack` has packed, and its number of triangles; every size and index is checked.

    Args:
        most: triangles that there may be in all.

    Raises:
        ValueError: it is not what `pack` has packed, or it is too much.
    """
    head, _, data = packed.partition(b"\n")
    sizes = json.loads(head)
    at, left = 0, most

    def array(count: object, kind: str) -> NDArray[Any]:
        nonlocal at
        if not isinstance(count, int) or not 0 <= count <= len(data):
            raise ValueError("a size that is no size")
        found = np.frombuffer(data, kind, 3 * count, at).reshape(count, 3)
        at += found.nbytes
        if not np.isfinite(found).all():
            raise ValueError("numbers that are not finite")
        return found

    links = []
    for cover, surfaces in sizes["links"]:
        points_of_link = array(cover, "<f4")
        found = []
        for color, points, faces in surfaces:
            surface = Surface(_checked(color), array(points, "<f4"), array(faces, "<u4"))
            left -= len(surface.faces)
            if left < 0 or (len(surface.faces) and int(surface.faces.max()) >= len(surface.points)):
                raise ValueError("triangles that there may not be")
            found.append(surface)
        links.append(LinkBody(found, points_of_link))
    if at != len(data):
        raise ValueError("more than was announced")
    return links, int(sizes["triangles"])


def unpack_fits(packed: bytes) -> Any:
    """The `fits` that `pack` has packed, unchecked; raises `ValueError`."""
    return json.loads(packed.partition(b"\n")[0])["fits"]


def _checked(color: object) -> Rgb | None:
    match color:
        case None:
            return None
        case [int(red), int(green), int(blue)] if all(0 <= value <= 255 for value in (red, green, blue)):
            return red, green, blue
    raise ValueError("no colour")
