"""Surfaces: meshes of one colour each, and how they travel from the process that parses them."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Rgb = tuple[int, int, int]
Points = NDArray[np.float32]
Faces = NDArray[np.uint32]
GREY = (128, 128, 128)  # what a surface without a colour is compared as
_NONE = (-1, -1, -1)


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


def pack(files: Mapping[str, Sequence[Surface]], triangles: int) -> bytes:
    """The surfaces of files as a file of NumPy.

    Args:
        triangles: how many there were before they were simplified.
    """
    arrays: dict[str, NDArray[np.generic]] = {"triangles": np.array(triangles)}
    for i, surfaces in enumerate(files.values()):
        for k, surface in enumerate(surfaces):
            arrays[f"{i} {k} points"], arrays[f"{i} {k} faces"] = surface.points, surface.faces
            arrays[f"{i} {k} color"] = np.array(_NONE if surface.color is None else surface.color)
    stream = io.BytesIO()
    np.savez(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()


def unpack(names: Sequence[str], packed: bytes) -> tuple[dict[str, list[Surface]], int]:
    """What `pack` has packed, for files of these names."""
    found: dict[str, list[Surface]] = {name: [] for name in names}
    with np.load(io.BytesIO(packed), allow_pickle=False) as arrays:
        for key in arrays.files:
            if key.endswith(" points"):
                i, k, _ = key.split()
                red, green, blue = arrays[f"{i} {k} color"].tolist()
                color = None if (red, green, blue) == _NONE else (red, green, blue)
                found[names[int(i)]].append(Surface(color, arrays[key], arrays[f"{i} {k} faces"]))
        return found, int(arrays["triangles"])
