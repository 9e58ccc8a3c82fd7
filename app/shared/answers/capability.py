"""Answers about capability maps: their numbers, and their voxels one by one."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.shared.answers.answer import Answer
from app.shared.answers.fk import Matrix
from kin.workspace import CapabilityMap


class CapabilityAnswer(Answer):
    """Figures of a capability map: from which directions the tool reaches the voxels of the workspace."""

    robot: str
    """Id of the arm."""
    method: Literal["closed form", "sweep", "search"]
    """How directions were tested. "closed form": exactly; "sweep": at some rolls about each, so that a direction
    that is possible at few rolls may be missed; "search": numerically, which misses a few."""
    directions: int
    """Number of tested directions, spread evenly over the sphere."""
    voxel: float
    """Side of a voxel in metres."""
    origin: list[float]
    """The corner of the grid with the smallest x, y, z, in metres."""
    shape: list[int]
    """Number of voxels along x, y, z."""
    reachable: int
    """Number of voxels whose centre the tool point reaches, with any orientation."""
    volume: float
    """Their volume in m³."""
    mean_share: float
    """Mean share of the directions along which the tool can approach their centres, 0 to 1."""
    best_share: float
    """The largest share."""
    best_share_at: list[float] | None
    """Centre of the voxel with the largest share, in metres; null if no direction is possible anywhere."""
    best_manipulability: float
    """The largest manipulability (pose) found at any centre, as `all` in the answer of `jacobian`."""
    best_manipulability_at: list[float] | None
    """Centre of that voxel, in metres; null if it is 0 everywhere."""


class VoxelAnswer(Answer):
    """The reachable voxels of a capability map, one entry each, in the same order in all lists."""

    centres: Matrix
    """Their centres: x, y, z in metres."""
    share: list[float]
    """Share of the directions along which the tool can approach the centre, 0 to 1; 0 if only directions between
    the tested ones are possible."""
    manipulability: list[float]
    """The largest manipulability (pose) found there."""
    approachable: list[str] | None
    """Possible directions, "1" or "0" for each; null unless requested."""


class CapabilityMapAnswer(Answer):
    """A capability map: figures, directions, voxels."""

    summary: CapabilityAnswer
    """Figures of the map."""
    directions: Matrix
    """The tested directions of the tool's z axis, unit vectors in the world frame."""
    voxels: VoxelAnswer
    """The reachable voxels; all others of the grid are unreachable."""


def capability_answer(found: CapabilityMap) -> CapabilityAnswer:
    """Figures of a map by `kin.workspace.capability_map`."""
    return CapabilityAnswer.of(
        found.grid,
        robot=found.grid.robot.id,
        directions=found.grid.count,
        reachable=len(found.index),
        volume=found.volume,
        mean_share=float(found.share.mean(dtype=np.float64)) if len(found.share) else 0.0,
        best_share=float(found.share.max(initial=0.0)),
        best_share_at=_centre_of_best(found, found.share),
        best_manipulability=float(found.manipulability.max(initial=0.0)),
        best_manipulability_at=_centre_of_best(found, found.manipulability),
    )


def capability_map_answer(found: CapabilityMap, approachable: bool = False) -> CapabilityMapAnswer:
    """A whole map by `kin.workspace.capability_map`; `approachable`: include the directions of each voxel."""
    fits = ["".join("01"[fit] for fit in row) for row in found.approachable.tolist()] if approachable else None
    return CapabilityMapAnswer(
        summary=capability_answer(found),
        directions=found.grid.directions.tolist(),
        voxels=VoxelAnswer.of(found, approachable=fits),
    )


def _centre_of_best(found: CapabilityMap, values: NDArray[np.float32]) -> list[float] | None:
    """Centre of the voxel with the largest value, None if that is 0 or there is no voxel."""
    if not values.max(initial=0.0) > 0.0:
        return None
    centre: list[float] = found.centres[int(np.argmax(values))].tolist()
    return centre
