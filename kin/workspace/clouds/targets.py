"""Draws that go by where the point is, not by the joints: even in space, or on the envelope.

Each draw aims at a random point of a random cube of the map (:mod:`kin.workspace.facts.atlas`) and descends
towards it.

- ``volume`` keeps the points it can reach. Random points of all cubes that the workspace touches, those out of
  reach
  rejected: that is the even distribution over the workspace itself, whatever the density of the joints. It says
  nothing about how often which posture is drawn where many reach a point.
- ``boundary`` keeps those it cannot reach, by up to a cube's side: the descent then ends on the envelope, at the
  reachable point nearest to the one aimed at, outer faces, inner walls and the edges of holes alike. The points
  aimed at fill a layer of about one thickness, so the draws are about even over the area.

A draw that found nothing in `_TRIES` tries keeps the last end of a descent (a workspace without volume is drawn by
these projections). What the map does not show is not drawn: parts that the survey's points missed, slivers of less
than a quarter of a cube; a hole inside cubes whose tries all were reached has no boundary draws.
"""

from __future__ import annotations

import numpy as np

from kin.kernels.compile import jit
from kin.transforms import Array
from kin.workspace.clouds.numbers import Words, fraction, hashed, word
from kin.workspace.facts.atlas import nearest_from, to_point
from kin.workspace.facts.descent import room
from kin.workspace.facts.survey import CLOSE, survey
from kin.workspace.region import Region

_TRIES = 64
_AIM = 0xA13  # stream of the places aimed at
ALIKE = {"volume": 3, "boundary": 2}  # descents that must end alike before a point counts as missed


@jit
def _aim(
    model: Array, low: Array, high: Array, corners: Array, edge: Array, seeds: Array, key: Words, index: Words,
    tolerance: float, depth: float, alike: int, tries: int, out: Array,
) -> None:  # fmt: skip
    """out ``(k, n)`` ← draws `index` ``(k,)``: reached if depth is 0, else missed by up to depth."""
    n = low.shape[0]
    work = room(n)
    q, f = np.empty(n), np.empty(15)
    to_point(f)
    for i in range(out.shape[0]):
        draw = hashed(key[0], index[i])
        for t in range(tries):
            place = hashed(draw, np.uint64(t))
            cube = int(fraction(hashed(place, np.uint64(3))) * corners.shape[0])
            first = int(fraction(hashed(place, np.uint64(4))) * seeds.shape[1])
            for r in range(3):
                f[9 + r] = corners[cube, r] + fraction(hashed(place, np.uint64(r))) * edge[r]
            missed = nearest_from(model, low, high, seeds[cube], first, f, tolerance, alike, q, out[i], work)
            if (missed <= tolerance) if depth == 0.0 else (tolerance < missed <= depth):
                break


def aimed(region: Region, strategy: str, seed: int, index: Words) -> Array:
    """The draws `index` ``(k,)`` of the strategy ``"volume"`` or ``"boundary"``: configurations ``(k, n)``."""
    done = survey(region)
    found, size = done.map, done.map.size
    rows = done.outer if strategy == "boundary" else done.reached
    tries = _TRIES
    if not len(rows) or (strategy == "volume" and len(done.reached) < 0.02 * len(found.corners)):
        rows, tries = np.flatnonzero(found.occupied), 1
    out = np.empty((len(index), region.robot.n))
    _aim(
        region.robot.model, region.lower, region.upper, found.corners[rows], found.edge, found.seeds[rows],
        np.array([word(seed, _AIM)], dtype=np.uint64), index, CLOSE * size,
        size if strategy == "boundary" else 0.0, ALIKE[strategy], tries, out,
    )  # fmt: skip
    return out
