"""The convex hull of a cloud as a solid for other programs, for instance to plan a fence around the arm.

Only the corners found so far are kept, so the cloud may be as large as one likes. The hull is that of points
inside the workspace and grows towards the true one with their number, fastest with points on the envelope.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import trimesh

from kin import InputError
from kin.workspace import WorkspaceChunk

SUFFIXES = ("stl", "ply", "obj", "off", "glb")


def kind_of(path: str) -> str:
    """The file type of a file name; raises `InputError`."""
    kind = Path(path).suffix.removeprefix(".").lower()
    if kind not in SUFFIXES:
        raise InputError("--hull", path, "a name that ends in " + ", ".join(f".{name}" for name in SUFFIXES))
    return kind


def hull(chunks: Iterable[WorkspaceChunk]) -> trimesh.Trimesh:
    """The convex hull of all points, metres, facing outwards.

    Raises:
        InputError: fewer than four points, or all in one plane: there is no body.
        ImportError: scipy, which has the algorithm (Qhull), is not installed.
    """
    from scipy.spatial import ConvexHull, QhullError

    corners = np.empty((0, 3))
    solid = False
    for chunk in chunks:
        points = np.concatenate([corners, chunk.points.astype(np.float64)])
        try:
            corners, solid = points[ConvexHull(points).vertices], True
        except (QhullError, ValueError):  # flat so far
            corners, solid = points, False
    if not solid:
        raise InputError("hull", f"{len(corners)} points", "at least four that are not in one plane")
    body: trimesh.Trimesh = trimesh.convex.convex_hull(corners)
    return body
