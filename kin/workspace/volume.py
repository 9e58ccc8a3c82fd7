"""Volume and surface area of a workspace, with their errors.

Where joint 1 turns all the way the workspace is a body of revolution, and both follow from its (r, z) section
(Pappus and Guldin), computed at two resolutions. Elsewhere both are estimated from random points in the cells of
the map (:mod:`kin.workspace.search.probes`).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from kin.ik.problem import never_cancel
from kin.transforms import Array
from kin.workspace.region import Region
from kin.workspace.results import Estimate, Section
from kin.workspace.search.cells import SEEDS
from kin.workspace.search.probes import LAYER, TOUCH, probe_cells
from kin.workspace.sections.cut import profile

_SQUARES = 24  # along the longer side of the section, per unit of effort


def from_probes(
    region: Region, tries: int, cancel: Callable[[], None] = never_cancel
) -> tuple[Estimate, Estimate]:
    """Volume (m³) and surface area (m²) from `tries` random points in each cell of the map."""
    probes = probe_cells(region, tries, SEEDS, cancel)
    size = probes.map.size
    if (probes.map.edge == 0.0).any():
        flat = "the workspace is flat"
        return Estimate(0.0, 0.0, flat), Estimate(0.0, 0.0, flat)
    cube = float(np.prod(probes.map.edge))
    volume, error = _stratified(np.asarray(probes.distance <= TOUCH * size, dtype=np.float64), cube)
    # Layers of two depths, extrapolated to depth 0.
    out = probes.distance > TOUCH * size
    depth = LAYER * size
    thick = (out & (probes.distance <= depth)) / depth
    thin = (out & (probes.distance <= 0.5 * depth)) / (0.5 * depth)
    area, spread = _stratified(2.0 * thin - thick, cube)
    bend = cube * float((thin - thick).mean(axis=1).sum())
    tried = f"{probes.distance.size} points tried in the {len(probes.distance)} cubes of a grid of {size:.3g} m"
    return (
        Estimate(volume, error, tried),
        Estimate(
            area, math.hypot(spread, 0.5 * bend), f"layers of {0.5 * depth:.3g} m and {depth:.3g} m, {tried}"
        ),
    )


def _stratified(values: Array, cube: float) -> tuple[float, float]:
    """The sum of cube · mean over the cubes ``(m, tries)``, and its standard error."""
    total = cube * float(values.mean(axis=1).sum())
    return total, cube * math.sqrt(float(values.var(axis=1, ddof=1).sum()) / values.shape[1])


def from_section(
    region: Region, effort: int, cancel: Callable[[], None] = never_cancel
) -> tuple[Estimate, Estimate]:
    """Volume (m³) and surface area (m²) from (r, z) sections at a resolution and half of it."""
    coarse, fine = (profile(region, _SQUARES * effort // part, cancel=cancel) for part in (2, 1))
    method = f"(r, z) section with squares of {fine.step:.3g} m, and of twice that, revolved"
    pairs = zip(_revolved(coarse), _revolved(fine), strict=True)
    volume, surface = (Estimate(b, abs(b - a), method) for a, b in pairs)
    return volume, surface


def _revolved(found: Section) -> tuple[float, float]:
    """Volume and area that the section's curves sweep in a full turn."""
    volume = surface = 0.0
    for curve in found.curves:
        r, z = curve.T
        s, t = np.roll(r, -1), np.roll(z, -1)
        volume += math.pi / 3.0 * float(((r * t - s * z) * (r + s)).sum())
        surface += math.pi * float(((r + s) * np.hypot(s - r, t - z)).sum())
    return volume, surface
