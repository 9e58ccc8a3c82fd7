"""The cone of approach directions: from where a five-joint arm can come to a point.

Point and approach direction are five demands, met by five joints: at a given point the directions that the limits
allow are a region on the sphere. It is found by solving the closed form for a fine mesh of directions at once.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

import kin
from kin import Robot
from kin.tolerances import TOLERANCES
from kin.transforms import Array

FINENESS = 4
_TURN = 2.0 * math.pi
_FAR = 1e6  # where a joint without stops has them


class Sphere(NamedTuple):
    """Directions ``(m, 3)``, triangles between them ``(k, 3)``, and frames with those z axes ``(m, 4, 4)``."""

    directions: Array
    faces: NDArray[np.int64]
    frames: Array


@lru_cache(maxsize=1)
def sphere() -> Sphere:
    """An icosphere: about 2600 directions, 4° apart."""
    ball = trimesh.creation.icosphere(subdivisions=FINENESS)
    directions = np.array(ball.vertices, dtype=float)
    frames = np.tile(np.eye(4), (len(directions), 1, 1))
    aside = np.where(np.abs(directions[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    x = np.cross(aside, directions)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    frames[:, :3, :3] = np.stack([x, np.cross(directions, x), directions], axis=2)
    return Sphere(directions, np.array(ball.faces, dtype=np.int64), frames)


def has_cone(robot: Robot) -> bool:
    """Whether the arm's approach directions at a point are a matter of limits: five joints in closed form."""
    return robot.n == 5 and bool(kin.branch_names(robot))


def reachable(robot: Robot, point: Array) -> NDArray[np.bool_]:
    """Which of the sphere's directions ``(m,)`` the tool can have at `point` ``(3,)``, inside the limits."""
    targets = sphere().frames.copy()
    targets[:, :3, 3] = point
    q = kin.ik_branches(robot, targets)
    # The image of each angle that is nearest to the middle of its limits; a NaN fits nowhere.
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
    """The share of all directions that can be had."""
    return float(mask.mean())
