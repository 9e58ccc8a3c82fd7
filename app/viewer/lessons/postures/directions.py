"""The cone of approach directions: the directions from which a five-joint arm can reach a point.

Point and approach direction have five dimensions, as many as the arm has joints. So at a given point, the
directions that the limits allow are a region on the unit sphere. It is found by solving the closed form for a fine
mesh of directions in one batch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kin
from app.viewer.declared.scene import Node, frame, lines, mesh
from app.viewer.scene.meshes import body
from app.viewer.scene.shapes import Solid
from app.viewer.views.templates import render
from kin import Robot
from kin.angles import images_near
from kin.tolerances import TOLERANCES
from kin.transforms import Array

SUBDIVISIONS = 4
COLOR = (0, 158, 115)
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
    off = images_near(q - middle)
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


@dataclass(frozen=True, eq=False)
class Patch:
    """The possible directions at a point ``(3,)``, one of the sphere's each in `mask` ``(m,)``."""

    robot: Robot
    point: Array
    mask: NDArray[np.bool_]

    @property
    def share(self) -> float:
        """The share of all directions that are possible."""
        return share(self.mask)

    @cached_property
    def solid(self) -> Solid:
        """What is drawn of them, about the origin."""
        vertices, faces = patch(self.mask)
        return Solid(_radius(self.robot) * vertices, faces)


@dataclass(frozen=True, eq=False)
class Cone:
    """The possible directions at the target, and the present one.

    Attributes:
        T: the target ``(4, 4)``.
        patch: the directions at its point; the same object while only the direction changes.
        number: of the patch among those that were drawn.
    """

    T: Array
    patch: Patch
    number: int = 1

    @classmethod
    def of(cls, robot: Robot, T: Array) -> Cone:
        """The cone at a target ``(4, 4)``."""
        return cls(T, Patch(robot, T[:3, 3], reachable(robot, T[:3, 3])))

    def at(self, T: Array) -> Cone:
        """The cone of the same arm at another target ``(4, 4)``."""
        robot = self.patch.robot
        if self._same_point(T):
            return replace(self, T=T)
        return Cone(T, Patch(robot, T[:3, 3], reachable(robot, T[:3, 3])), self.number + 1)

    def is_near(self, T: Array) -> bool:
        """Whether a target ``(4, 4)`` has the same cone, as far as one sees."""
        return self._same_point(T) and bool((T[:3, 2].round(3) == self.T[:3, 2].round(3)).all())

    def _same_point(self, T: Array) -> bool:
        return bool((T[:3, 3].round(4) == self.T[:3, 3].round(4)).all())

    def nodes(self) -> list[Node]:
        """The cone in the scene."""
        robot, T = self.patch.robot, self.T
        now = np.array([[np.zeros(3), _radius(robot) * T[:3, 2]]])
        nodes, solid = [lines("now", now, COLOR, 2.5)], self.patch.solid
        if len(solid.faces):
            looks = {"opacity": 0.32, "side": "double", "receive_shadow": False}
            # A new node for each patch: vertices and faces change together.
            nodes.append(replace(mesh(f"patch-{self.number}", solid, COLOR, **looks), keep=False))
        return [frame("cone", *nodes, position=T[:3, 3])]


def cone_html(share: float) -> str:
    """The share of all directions that are possible."""
    return render("postures/cone", share=f"{share:.3f}", percent=f"{100.0 * share:.0f}")


def _radius(robot: Robot) -> float:
    return 0.34 * body(robot).radius
