"""Picking a point of a cloud with a click.

Point clouds do not receive clicks in the browser; the page sends the ray under the pointer instead. The ray hits
the points whose discs it passes through, and of these the one nearest to the eye is picked. If it hits none, the
point at the smallest angle from the ray is picked, within a finger's width. The search gives an index only; the
configuration is recomputed from it, exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

import kin
from app.shared.clouds import Cloud, Clouds
from app.shared.computations import SharedComputation
from app.viewer.declared.scene import Node
from app.viewer.panel import Post
from app.viewer.tabs.workspace.cloud import Drawn, Shown
from kin import InputError
from kin.transforms import Array, finite_array

MARK_COLOUR = (213, 94, 0)
PIXEL = math.radians(0.06)  # with a field of view of 38°
HIT, NEAR = 2.5 * PIXEL, 14.0 * PIXEL  # angles from the ray, seen from the eye


@dataclass(frozen=True)
class Candidate:
    """A point that may be picked. The smallest candidate wins.

    Attributes:
        hit: whether the ray passes through its disc.
        value: distance from the eye (m) for a hit, angle from the ray (rad) otherwise.
        index: of the point in its cloud.
        point: ``(3,)``.
    """

    hit: bool
    value: float
    index: int
    point: Array

    def before(self, other: Candidate | None) -> bool:
        """Whether this one wins over the other."""
        return other is None or (not self.hit, self.value, self.index) < (not other.hit, other.value, other.index)


class Clicks:
    """Receives clicks into a scene; posts ``"click"`` with the origin and the direction of the ray."""

    def __init__(self, scene: viser.SceneApi, post: Post) -> None:
        self._scene, self._post = scene, post
        self._callback: Callable[[viser.SceneClickEvent], None] | None = None

    def listen(self, active: bool) -> None:
        """Start or stop receiving clicks."""
        if self._callback is not None and not active:
            self._scene.remove_click_callback(self._callback)
            self._callback = None
        elif self._callback is None and active:

            async def clicked(event: viser.SceneClickEvent) -> None:
                self._post("click", (event.ray_origin, event.ray_direction))

            self._callback = self._scene.on_click()(clicked)  # type: ignore[arg-type]


class Click(NamedTuple):
    """A click into a cloud.

    Attributes:
        cloud, parts: the cloud, and how many of its parts are drawn.
        visible: which of some points the cut shows.
        origin, direction: of the ray ``(3,)``, a unit vector.
        size: diameter of a drawn point (m).
    """

    cloud: Cloud
    parts: int
    visible: Callable[[NDArray[np.float32]], NDArray[np.bool_] | None]
    origin: Array
    direction: Array
    size: float

    @classmethod
    def of(cls, ray: object, drawn: Drawn, shown: Shown, size: float) -> Click:
        """The click of a ray that the page has sent; `shown`: the visible slabs of a cut. Raises `InputError`."""
        if not isinstance(ray, tuple) or len(ray) != 2:
            raise InputError("ray", ray, "its origin and direction")
        origin, direction = finite_array("ray", ray[0], (3,)), finite_array("ray", ray[1], (3,))
        length = float(np.linalg.norm(direction))
        if not length > 0.0:
            raise InputError("ray", ray, "a direction that is not zero")
        cut, slabs = drawn.look.cut, shown(drawn.look.cut)

        def visible(points: NDArray[np.float32]) -> NDArray[np.bool_] | None:
            return None if cut is None or slabs is None else slabs[cut.slabs(points)]

        return cls(drawn.measured, drawn.parts, visible, origin, direction / length, size)


@dataclass(frozen=True, eq=False)
class Picked:
    """The clicked point of a cloud: its index, its configuration ``(n,)`` and the point ``(3,)`` itself."""

    cloud: Cloud
    index: int
    q: Array
    point: Array

    def mark(self, size: float) -> Node:
        """A ball at the point; `size`: diameter of a drawn point (m)."""
        radius = max(1.2 * size, 0.008 * self.cloud.robot.reach)
        return Node("icosphere", "picked", {"radius": radius, "color": MARK_COLOUR}, self.point, keep=False)


def search(computation: SharedComputation[Any], clouds: Clouds, click: Click) -> Picked | None:
    """The clicked point; None: there is none near the ray."""
    cloud, best = click.cloud, None
    for i in range(click.parts):
        computation.check()  # another click, or the cloud was removed
        chunk = clouds.part(cloud, i).result()
        visible = click.visible(chunk.points)
        found = nearest(chunk.points, chunk.start, visible, click.origin, click.direction, click.size)
        if found is not None and found.before(best):
            best = found
    if best is None:
        return None
    seed, strategy = cloud.seed, cloud.strategy
    q = kin.workspace.workspace_configurations(
        cloud.robot, best.index, seed=seed, strategy=strategy, constraints=cloud.constraints
    )
    return Picked(cloud, best.index, q, kin.fk(cloud.robot, q)[:3, 3])


def nearest(
    points: NDArray[np.float32],
    start: int,
    visible: NDArray[np.bool_] | None,
    origin: Array,
    direction: Array,
    size: float,
) -> Candidate | None:
    """The point of a part that a ray picks, None if all are far from it.

    Args:
        points: ``(k, 3)``.
        start: index of the first one.
        visible: which points ``(k,)`` are visible, None for all.
        origin, direction: of the ray ``(3,)``, a unit vector.
        size: diameter of a drawn point (m).
    """
    seen = points - origin.astype(np.float32)
    depth = seen @ direction.astype(np.float32)
    square = np.maximum(np.einsum("ki,ki->k", seen, seen) - depth**2, 0.0)
    close = square < np.maximum(NEAR * depth, 0.5 * size) ** 2
    close &= depth > 0.0
    if visible is not None:
        close &= visible
    near = np.flatnonzero(close)
    if not len(near):
        return None
    aside, depth = np.sqrt(square[near]), depth[near]
    hits = aside <= np.maximum(HIT * depth, 0.5 * size)
    hit = bool(hits.any())
    values = np.where(hits, depth, np.inf) if hit else aside / depth
    best = int(np.argmin(values))
    which = int(near[best])
    return Candidate(hit, float(values[best]), start + which, points[which].astype(np.float64))
