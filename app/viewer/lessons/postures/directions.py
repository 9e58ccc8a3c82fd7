"""The cone of approach directions: the directions from which a five-joint arm can reach a point.

Point and approach direction have five dimensions, as many as the arm has joints. So at a given point, the
directions that the limits allow are a region on the unit sphere. It is found by solving the closed form for a fine
mesh of directions in one batch.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kin
from kin import Robot
from kin.tolerances import TOLERANCES
from kin.transforms import Array

SUBDIVISIONS = 4
_TURN = 2.0 * math.pi
_FAR = 1e6  # stands in for a missing joint limit


class Sphere(NamedTuple):
    """Directions ``(m, 3)``, triangles between them ``(k, 3)``, and frames with those z axes ``(m, 4, 4)``."""

    directions: Array
    faces: NDArray[np.int64]
    frames: Array


@lru_cache(maxsize=1)
def sphere() -> Sphere:
    """An icosphere: about 2600 directions, 4° apart."""
    from trimesh.creation import icosphere  # its import takes a quarter of a second

    ball = icosphere(subdivisions=SUBDIVISIONS)
    directions = np.array(ball.vertices, dtype=float)
    frames = np.tile(np.eye(4), (len(directions), 1, 1))
    aside = np.where(np.abs(directions[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    x = np.cross(aside, directions)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    frames[:, :3, :3] = np.stack([x, np.cross(directions, x), directions], axis=2)
    return Sphere(directions, np.array(ball.faces, dtype=np.int64), frames)


def has_cone(robot: Robot) -> bool:
    """Whether the cone can be computed: for arms of five joints with a closed form."""
    return robot.n == 5 and bool(kin.branch_names(robot))


def reachable(robot: Robot, point: Array) -> NDArray[np.bool_]:
    """Which of the sphere's directions ``(m,)`` are possible at `point` ``(3,)`` within the limits."""
    targets = sphere().frames.copy()
    targets[:, :3, 3] = point
    q = kin.ik_branches(robot, targets)
    # Each angle, modulo 2π, nearest to the middle of its limits; NaN fails the comparison.
    lower, upper = np.maximum(robot.lower, -_FAR), np.minimum(robot.upper, _FAR)
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    off = q - middle
    off -= _TURN * np.rint(off / _TURN)
    fits = np.asarray((np.abs(off) <= half + TOLERANCES.limit).all(axis=2))
    return np.asarray(fits.any(axis=1))


def patch(mask: NDArray[np.bool_]) -> tuple[Array, NDArray[np.int64]]:
    """The triangles whose corners are all reachable: vertices ``(v, 3)`` on the unit sphere, faces ``(k, 3)``."""
    directions, faces, _ = sphere()
    kept = faces[mask[faces].all(axis=1)]
    used, renumbered = np.unique(kept, return_inverse=True)
    return directions[used], renumbered.reshape(-1, 3).astype(np.int64)


def share(mask: NDArray[np.bool_]) -> float:
    """The share of all directions that are possible."""
    return float(mask.mean())
