"""Capsules around the collision bodies of an arm, in the process that parses meshes, and how they travel."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from app.viewer.meshes.archive import MeshError, TooLargeError
from app.viewer.meshes.placing import Body, Fit
from app.viewer.meshes.surface import Surface
from kin.files.read import MAX_CAPSULES
from kin.files.urdf.collisions import Fitted, LinkPieces, Piece, Pill, fitted, most_of
from kin.files.urdf.visuals import Box, Cylinder, MeshFile, Shape, Sphere
from kin.fitting import Segment
from kin.transforms import Array

SHAPES: dict[str, Callable[..., Shape | Pill]] = {
    shape.__name__: shape for shape in (Box, Cylinder, MeshFile, Pill, Sphere)
}
WORDS = 300  # characters of what is missing


def bodies_of(links: Sequence[LinkPieces]) -> list[Body]:
    """The collision bodies of all URDF links as plain data."""
    most = most_of(len(links))
    return [
        Body([(type(s).__name__, list(s), pose[:3].ravel().tolist()) for s, pose in link.pieces], most)
        for link in links
    ]


def fit_all(bodies: Sequence[Body], reach: float, surfaces_of: Callable[[str], Sequence[Surface]]) -> list[Fit]:
    """The capsules of bodies.

    Args:
        surfaces_of: reads a mesh.

    Raises:
        TooLargeError: a mesh is larger than any that is read.
    """

    def triangles_of(path: str) -> Array:
        try:
            surfaces = surfaces_of(path)
        except TooLargeError:
            raise
        except MeshError as error:
            raise LookupError(f"{error.value}") from None
        return np.concatenate([surface.points.astype(float)[surface.faces] for surface in surfaces])

    found = []
    for body in bodies:
        pieces = []
        for name, numbers, pose in body.pieces:
            T = np.vstack([np.array(pose).reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])
            pieces.append(Piece(SHAPES[name](*numbers), T))
        fit = fitted(pieces, body.most, reach, triangles_of)
        found.append(Fit([[*each.start, *each.end, each.radius] for each in fit.capsules], fit.missing))
    return found


def checked(fits: object, bodies: Sequence[Body]) -> list[Fitted]:
    """The answer of the process; raises `ValueError` or `TypeError` if it cannot be one."""
    if not isinstance(fits, list) or len(fits) != len(bodies):
        raise ValueError("another number of bodies")
    found = []
    for given in fits:
        capsules, missing = given
        if len(capsules) > MAX_CAPSULES:
            raise ValueError("more capsules than there may be")
        segments = []
        for x, y, z, u, v, w, r in capsules:
            x, y, z, u, v, w, r = numbers = [float(value) for value in (x, y, z, u, v, w, r)]
            if not (all(map(math.isfinite, numbers)) and r > 0.0):
                raise ValueError("numbers that are not finite")
            segments.append(Segment((x, y, z), (u, v, w), r))
        found.append(Fitted(segments, [str(words)[:WORDS] for words in missing]))
    return found
