"""A capability map in the scene: boxes slightly smaller than their cells, so that the inside is visible.

The voxels are sorted by value into levels, one node of the scene each. So moving the threshold only changes which
levels are hidden. Everything else, a growing map, other colours or the cut, creates new nodes of some hundred
kilobytes; the caller therefore does it a few times a second at most.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from app.viewer.scene.shapes import box
from app.viewer.tabs.workspace.capability.settings import By
from app.viewer.tabs.workspace.colours import Scale, paint
from app.viewer.tabs.workspace.cut import Cut
from kin import CapabilityMap
from kin.transforms import Array

LEVELS = 25
FILL = 0.7  # side of a box, relative to its cell
LIT = 0.7  # factor on colours: with the scene's light, faces then look like the legend
PICKED = (213, 94, 0)
ARROW_LENGTH = 2.6  # cells

# Receives the clicked node's level and the instance.
Clicked = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Look:
    """How the map is drawn: quantity, colours, cut, and the visible slabs."""

    by: By
    map: str
    cut: Cut | None = None
    shown: NDArray[np.bool_] | None = None


def values_of(found: CapabilityMap, by: By) -> NDArray[np.float32]:
    """The coloured quantity of each voxel ``(k,)``."""
    return found.share if by == "share" else found.manipulability


def largest(found: CapabilityMap, by: By) -> float:
    """The largest of these values; 0 without voxels."""
    return float(values_of(found, by).max(initial=0.0))


def levels(values: NDArray[np.float32]) -> NDArray[np.int64]:
    """The level ``(k,)`` of each value, 0 to ``LEVELS − 1``, in equal steps up to the largest."""
    most = max(float(values.max(initial=0.0)), 1e-12)
    # Shares are fractions: a value on the boundary of two levels belongs to the upper one.
    return np.minimum(LEVELS * (values.astype(np.float64) / most) + 1e-4, LEVELS - 1).astype(np.int64)


def first_level(least: float) -> int:
    """The lowest visible level for a threshold `least`, relative to the largest value."""
    return min(round(LEVELS * least), LEVELS - 1)


def uncut(found: CapabilityMap, look: Look) -> NDArray[np.bool_]:
    """Which voxels ``(k,)`` the cut shows: those with a visible centre."""
    if look.cut is None or look.shown is None:
        return np.ones(len(found.index), dtype=bool)
    return look.shown[look.cut.slabs(found.centres.astype(np.float32))]


class Voxels:
    """One map in one visitor's scene. Not thread-safe: the visitor's worker calls it.

    Args:
        root: prefix of all node names, never used before in this scene.
        clicked: called from any thread with a voxel's level and its index there.
    """

    def __init__(
        self, scene: viser.SceneApi, root: str, found: CapabilityMap, look: Look, least: float, clicked: Clicked
    ) -> None:
        self.found = found
        values = values_of(found, look.by)
        level = levels(values)
        seen = uncut(found, look)
        colours = paint(
            values.astype(np.float64), Scale("one", 0.0, max(largest(found, look.by), 1e-12)), look.map
        )
        colours = np.rint(LIT * colours).astype(np.uint8)
        half = 0.5 * FILL * found.grid.voxel
        cube = box([-half] * 3, [half] * 3)
        self.sent = int(seen.sum())
        self._top = scene.add_frame(root, show_axes=False)
        self._nodes: dict[int, viser.BatchedMeshHandle] = {}
        self._rows = [np.flatnonzero(seen & (level == k)) for k in range(LEVELS)]
        for k, rows in enumerate(self._rows):
            if len(rows):
                node = self._nodes[k] = scene.add_batched_meshes_simple(
                    f"{root}/{k}",
                    cube.vertices,
                    cube.faces,
                    batched_wxyzs=np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (len(rows), 1)),
                    batched_positions=found.centres[rows].astype(np.float32),
                    batched_colors=colours[rows],
                    lod="off",
                    flat_shading=True,
                    cast_shadow=False,
                    receive_shadow=False,
                    visible=k >= first_level(least),
                )
                self._listen(node, k, clicked)

    def show(self, least: float) -> None:
        """Hide voxels below this share of the largest value."""
        first = first_level(least)
        for k, node in self._nodes.items():
            if node.visible != (k >= first):
                node.visible = k >= first

    def voxel(self, level: int, instance: int) -> int | None:
        """The voxel's row in the map, None if there is none."""
        if 0 <= level < LEVELS and 0 <= instance < len(self._rows[level]):
            return int(self._rows[level][instance])
        return None

    def remove(self) -> None:
        """Remove the map from the scene."""
        self._top.remove()

    def _listen(self, node: viser.BatchedMeshHandle, level: int, clicked: Clicked) -> None:
        @node.on_click
        async def _(event: viser.SceneNodePointerEvent[viser.BatchedMeshHandle]) -> None:
            if event.instance_index is not None:
                clicked(level, event.instance_index)


def mark(scene: viser.SceneApi, root: str, found: CapabilityMap, row: int) -> viser.FrameHandle:
    """Mark a voxel: its edges, and an arrow to its centre along each possible approach direction."""
    centre, side = found.centres[row], found.grid.voxel
    top = scene.add_frame(root, show_axes=False, position=centre)
    scene.add_line_segments(f"{root}/cage", edges(side).astype(np.float32), PICKED, thickness=0.06 * side)
    along = found.grid.directions[found.approachable[row]]
    if len(along):
        arrows = np.stack([-ARROW_LENGTH * side * along, -0.1 * side * along], axis=1)
        scene.add_arrows(
            f"{root}/arrows",
            arrows.astype(np.float32),
            PICKED,
            shaft_radius=0.05 * side,
            head_radius=0.14 * side,
            head_length=0.4 * side,
        )
    return top


def edges(side: float) -> Array:
    """The twelve edges ``(12, 2, 3)`` of a cube about the origin."""
    corners = 0.5 * side * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    pairs = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]
    return np.array([[corners[a], corners[b]] for a, b in pairs])
