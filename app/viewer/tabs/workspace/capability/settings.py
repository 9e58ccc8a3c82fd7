"""The settings of a capability map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.shared.maps import MapRequest
from app.viewer.declared.fields import Settings, choice, memory, number
from app.viewer.declared.work import Result
from app.viewer.tabs.workspace.capability.voxels import LEVELS, By, Look, Voxels
from app.viewer.tabs.workspace.colours import MAPS
from app.viewer.tabs.workspace.cut import Cut
from kin import Robot
from kin.workspace import CapabilityMap

SIZES = {"15 voxels long": 15, "25 voxels long": 25, "40 voxels long": 40}
DIRECTIONS = {"12": 12, "24": 24, "48": 48, "96": 96}
BY: dict[str, By] = {"Directions": "share", "Manipulability": "manipulability"}


def default_directions(robot: Robot) -> int:
    """Enough that a map says something.

    An arm with fewer than six joints reaches most places from a few per cent of all directions only. The Pioneer
    arm has at least one of 24 directions in 23 % of its voxels, and of 96 in 60 %.
    """
    return 24 if robot.n >= 6 else 96


GRID_HINT = "Voxels along the longest side of the workspace; doubling them takes eight times as long"
DIRECTIONS_HINT = (
    "Number of evenly spread approach directions, tested at each voxel's centre. Arms with fewer than six joints "
    "need many: they reach a place from a few directions only"
)
BY_HINT = (
    "Directions: share of possible approach directions. Manipulability: the best w of the pose. The colours are "
    "those chosen above."
)
LEAST_HINT = "Hides voxels below this share of the map's best value"


@dataclass(frozen=True)
class MapSettings(Settings):
    """The settings of a map.

    Attributes:
        resolution, directions: of the map.
        by: the coloured quantity.
        least: the smallest visible value, relative to the map's largest, 0 to 1.
        colours, cut, shown: those of the tab: the colour map, the cut, and its slabs that are seen.
        request: the map that was started last.
        stopped: what it had come to when the visitor stopped it.
        unseen: whether the visitor has started it and has seen nothing of it.
        drawn: what the scene shows of the map.
        picked: the map and the row of the clicked voxel.
    """

    resolution: int = choice("Grid", SIZES, 25, hint=GRID_HINT)
    directions: int = choice("Directions", DIRECTIONS, default_directions, hint=DIRECTIONS_HINT)
    by: By = choice("Voxels show", BY, "share", hint=BY_HINT)
    least: float = number(
        "Hide voxels below (% of the best)",
        0.0,
        (0.0, 1.0),
        hint=LEAST_HINT,
        slider=(0.0, (LEVELS - 1) / LEVELS),
        scale=100.0,
        step=100.0 / LEVELS,
        digits=6,
        clip=True,
    )
    colours: str = memory(next(iter(MAPS)), renew=False)
    cut: Cut | None = memory()
    shown: NDArray[np.bool_] | None = memory()
    request: MapRequest | None = memory()
    stopped: Result | None = memory()
    unseen: bool = memory(False)
    drawn: Voxels | None = memory()
    picked: tuple[CapabilityMap, int] | None = memory()

    @property
    def look(self) -> Look:
        """How the map is to be drawn."""
        return Look(self.by, self.colours, self.cut, self.shown)
