"""Sampling by place instead of by joints: evenly in space, or on the envelope.

Each sample takes a random point of a random cube of the map (:mod:`kin.workspace.search.cells`) as its target and
descends towards it.

- ``volume`` keeps the targets that can be reached. Random points of all cubes that the workspace touches, with
  those out of reach rejected, are distributed evenly over the workspace, whatever the density of the joints. Where
  several postures reach a point, nothing is said about how often each is drawn.
- ``boundary`` keeps the targets that are missed by up to a cube's side: the descent then ends on the envelope, at
  the reachable point nearest to the target, on outer faces, inner walls and the edges of holes alike. The targets
  fill a layer of about one thickness, so the samples are about even over the area.

A sample that found no such target in `_TRIES` tries keeps the end of its last descent (a workspace without volume
is drawn by these projections). What the map misses is not drawn: parts that the probes missed, slivers of less
than a quarter of a cube; a hole inside cubes whose targets were all reached has no boundary samples.
"""

from __future__ import annotations

import numpy as np

from kin.kernels.compile import jit
from kin.transforms import Array
from kin.workspace.region import BoundedArm, Region
from kin.workspace.sampling.streams import Words, fraction, hashed, stream_key
from kin.workspace.search.descent import make_scratch
from kin.workspace.search.nearest import Cells, nearest_from, squared_distance
from kin.workspace.search.probes import CLOSE, sampling_probes

_TRIES = 64
_STREAM = 0xA13  # of the targets
ALIKE = {"volume": 3, "boundary": 2}  # descents that have to end alike before a point counts as missed


@jit
def _descend_to_targets(
    arm: BoundedArm,
    cells: Cells,
    streams: Words,
    tolerance: float,
    depth: float,
    alike: int,
    tries: int,
    out: Array,
) -> None:
    """out ``(k, n)`` ← samples whose target is reached if depth is 0, else missed by up to depth.

    Args:
        arm: the arm and its limits.
        cells: the cubes that targets are taken from.
        streams: ``(k,)`` the random stream of each sample.
        tolerance: a target that is missed by less counts as reached.
        depth, alike, tries: see above.
        out: configurations.
    """
    n = arm.lower.shape[0]
    work = make_scratch(n)
    f = np.empty(15)
    squared_distance(f)
    for i in range(out.shape[0]):
        for t in range(tries):
            place = hashed(streams[i], np.uint64(t))
            cube = int(fraction(hashed(place, np.uint64(3))) * cells.corners.shape[0])
            first = int(fraction(hashed(place, np.uint64(4))) * cells.seeds.shape[1])
            for r in range(3):
                f[9 + r] = cells.corners[cube, r] + fraction(hashed(place, np.uint64(r))) * cells.edge[r]
            missed = nearest_from(arm, cells.seeds[cube], first, f, tolerance, alike, out[i], work)
            if (missed <= tolerance) if depth == 0.0 else (tolerance < missed <= depth):
                break


@jit
def _sample_streams(key: Words, index: Words) -> Words:
    """The random stream ``(k,)`` of each sample."""
    streams = np.empty(index.shape[0], dtype=np.uint64)
    for i in range(index.shape[0]):
        streams[i] = hashed(key[0], index[i])
    return streams


def targeted(region: Region, strategy: str, seed: int, index: Words) -> Array:
    """Configurations ``(k, n)`` of the samples `index` ``(k,)`` of the strategy ``"volume"`` or ``"boundary"``."""
    probes = sampling_probes(region)
    found, size = probes.map, probes.map.size
    rows = probes.outer if strategy == "boundary" else probes.reached
    tries = _TRIES
    if not len(rows) or (strategy == "volume" and len(probes.reached) < 0.02 * len(found.corners)):
        rows, tries = np.flatnonzero(found.occupied), 1
    streams = _sample_streams(np.array([stream_key(seed, _STREAM)], dtype=np.uint64), index)
    out = np.empty((len(index), region.robot.n))
    depth = size if strategy == "boundary" else 0.0
    _descend_to_targets(region.arm, found.cells(rows), streams, CLOSE * size, depth, ALIKE[strategy], tries, out)
    return out
