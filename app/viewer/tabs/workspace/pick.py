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

import numpy as np
import viser
from numpy.typing import NDArray

import kin
from app.shared.clouds import Cloud
from app.viewer.feature import Stage
from app.viewer.panel import Post
from app.viewer.panel.status import Notice
from app.viewer.tabs.workspace import views
from app.viewer.tabs.workspace.background import run_in_background
from app.viewer.tabs.workspace.cloud_nodes import CloudNodes
from app.viewer.tabs.workspace.roots import new_root
from app.viewer.tabs.workspace.said import Said
from kin import InputError
from kin.transforms import Array, finite_array
from kin.units import grouped

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


class PointPicker:
    """Finds the clicked point and moves the arm to its configuration.

    Posts ``"click"`` and ``"picked"`` to itself; `post` returns them.
    """

    def __init__(self, stage: Stage, said: Said, post: Post) -> None:
        self._stage = stage
        self._said = said
        self._post = post
        self._searches = 0  # number of the newest search; older ones stop
        self._mark: viser.IcosphereHandle | None = None
        self._callback: Callable[[viser.SceneClickEvent], None] | None = None
        # The picked point: its cloud, index, configuration and position.
        self._picked: tuple[Cloud, int, Array, Array] | None = None

    def listen(self, active: bool) -> None:
        """Start or stop receiving clicks."""
        scene = self._stage.client.scene
        if self._callback is not None and not active:
            scene.remove_click_callback(self._callback)
            self._callback = None
        elif self._callback is None and active:

            async def clicked(event: viser.SceneClickEvent) -> None:
                self._post("click", (event.ray_origin, event.ray_direction))

            self._callback = scene.on_click()(clicked)  # type: ignore[arg-type]

    def search(self, ray: object, nodes: CloudNodes, size: float) -> None:
        """Search the cloud for the clicked point, in a background thread; `size` of a point (m)."""
        if not isinstance(ray, tuple) or len(ray) != 2:
            return
        origin, direction = finite_array("ray", ray[0], (3,)), finite_array("ray", ray[1], (3,))
        length = float(np.linalg.norm(direction))
        if not length > 0.0:
            raise InputError("ray", ray, "a direction that is not zero")
        self._searches += 1
        number = self._searches
        cloud, parts, visible = nodes.cloud, nodes.parts, nodes.visible_points()

        def search() -> None:
            best: Candidate | None = None
            for i in range(parts):
                if number != self._searches:
                    return  # another click, or the cloud was removed
                chunk = self._stage.clouds.part(cloud, i).result()
                found = nearest(chunk.points, chunk.start, visible(chunk.points), origin, direction / length, size)
                if found is not None and found.before(best):
                    best = found
            q = None
            if best is not None:
                q = kin.workspace.workspace_configurations(
                    cloud.robot,
                    best.index,
                    seed=cloud.seed,
                    strategy=cloud.strategy,
                    constraints=cloud.constraints,
                )
            self._post("picked", (number, cloud, best, q, size))

        run_in_background(search, "pick", self._post)

    def take(self, number: int, cloud: Cloud, found: Candidate | None, q: Array | None, size: float) -> None:
        """Take the result of a search: mark the point, and move the arm there."""
        if number != self._searches:
            return
        if found is None or q is None:
            self._picked = None
            self._said.picked = views.nothing_picked()
            return
        point = kin.fk(cloud.robot, q)[:3, 3]
        self._remove_mark()
        radius = max(1.2 * size, 0.008 * cloud.robot.reach)
        self._mark = self._stage.client.scene.add_icosphere(
            new_root(), radius=radius, color=MARK_COLOUR, position=point
        )
        self._picked = (cloud, found.index, q, point)
        self.refresh()
        title = f"Moved to point {grouped(found.index)}"
        self._stage.move_to(q, Notice("hand", title, "The configuration that produced this point."))

    def refresh(self) -> None:
        """Show the picked point in the present units."""
        if self._picked is not None:
            cloud, index, q, point = self._picked
            units = self._stage.units
            self._said.picked = views.picked(cloud.robot, cloud.constraints, index, q, point, units)

    def clear(self) -> None:
        """Forget the picked point, and stop a search."""
        self._searches += 1
        self._remove_mark()
        self._picked = None
        self._said.picked = ""

    def _remove_mark(self) -> None:
        if self._mark is not None:
            self._mark.remove()
            self._mark = None


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
