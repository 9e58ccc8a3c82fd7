"""The sizes of a workspace in numbers.

Extremes are exact. Volume and surface are estimates with an error: where joint 1 turns all the way, the workspace
is a body of revolution and both follow from its (r, z) section (Pappus and Guldin), computed at two resolutions;
where not, from points tried in a grid of cubes (:mod:`kin.workspace.facts.survey`).
"""

from __future__ import annotations

import math

import numpy as np

from kin.ik.problem import Limits, Locks
from kin.robot import Robot
from kin.solvers.common import TURN
from kin.workspace.facts.extremes import along, base_line, from_line, from_point
from kin.workspace.facts.survey import volume_and_surface
from kin.workspace.region import Region, whole
from kin.workspace.results import Estimate, Section, WorkspaceFacts
from kin.workspace.sections.cut import profile

_SQUARES = 24  # along the longer side of the section, per unit of effort


def workspace_facts(
    robot: Robot,
    *,
    limits: Limits | None = None,
    locked: Locks | None = None,
    effort: int = 4,
    volume: bool = True,
) -> WorkspaceFacts:
    """Bounding box, reach, holes, volume and surface of the points the tool reaches.

    Args:
        robot: the arm.
        limits, locked: as in `kin.solve_ik`.
        effort: 2 to 64: points tried per cube, or the resolution of the section in steps of 24 squares. Errors of
            volume shrink with its root, or with its square where joint 1 turns all the way.
        volume: whether volume and surface are wanted; the rest takes a tenth of a second, these some seconds.

    Raises:
        InputError: naming the wrong argument.
    """
    region = Region.of(robot, limits, locked)
    tries = whole("effort", effort, 2, 64, "a whole number from 2 to 64")
    point, axis, shoulder = base_line(region)
    x, y, z = (along(region, direction) for direction in np.eye(3))
    size = (
        (None, None)
        if not volume
        else _revolved(region, tries)
        if _turns(region)
        else volume_and_surface(region, tries)
    )
    return WorkspaceFacts(
        x=x,
        y=y,
        z=z,
        axis_point=point,
        axis=axis,
        shoulder=shoulder,
        radius=from_line(region, point, axis),
        reach=from_point(region, shoulder),
        volume=size[0],
        surface=size[1],
    )


def _turns(region: Region) -> bool:
    """Whether joint 1 turns all the way."""
    low, high = region.bounds[0]
    return region.robot.joints[0].kind == "revolute" and high - low >= TURN - 1e-9


def _revolved(region: Region, effort: int) -> tuple[Estimate, Estimate]:
    """Volume (m³) and area (m²) from sections at a resolution and half of it."""
    coarse, fine = (profile(region, _SQUARES * effort // part) for part in (2, 1))
    method = f"(r, z) section with squares of {fine.step:.3g} m, and of twice that, revolved"
    pairs = zip(_pappus(coarse), _pappus(fine), strict=True)
    volume, surface = (Estimate(b, abs(b - a), method) for a, b in pairs)
    return volume, surface


def _pappus(found: Section) -> tuple[float, float]:
    """Volume and area that the section's curves sweep in a full turn."""
    volume = surface = 0.0
    for curve in found.curves:
        r, z = curve.T
        s, t = np.roll(r, -1), np.roll(z, -1)
        volume += math.pi / 3.0 * float(((r * t - s * z) * (r + s)).sum())
        surface += math.pi * float(((r + s) * np.hypot(s - r, t - z)).sum())
    return volume, surface
