"""Which point of a cloud was clicked on.

Point clouds do not take clicks in the browser; the page tells the ray under the pointer instead. Points whose disc
the ray goes through are hit, and the hit nearest to the eye is meant; where none is hit, the point nearest to the
ray as seen by the eye is, within a finger's width. Only an index is found so: the configuration is recomputed
from it, exactly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kin.transforms import Array

PIXEL = math.radians(0.06)  # of a picture 38° high
HIT, NEAR = 2.5 * PIXEL, 14.0 * PIXEL  # from the ray, seen from the eye


@dataclass(frozen=True)
class Candidate:
    """A point that may be meant. The least candidate is the one.

    Attributes:
        hit: whether the ray goes through its disc.
        value: distance from the eye (m) of a hit, angle from the ray (rad) of the others.
        index: of the point in its cloud.
        point: ``(3,)``.
    """

    hit: bool
    value: float
    index: int
    point: Array

    def before(self, other: Candidate | None) -> bool:
        """Whether this one is meant rather than the other."""
        return other is None or (not self.hit, self.value, self.index) < (not other.hit, other.value, other.index)


def nearest(
    points: NDArray[np.float32],
    start: int,
    visible: NDArray[np.bool_] | None,
    origin: Array,
    direction: Array,
    size: float,
) -> Candidate | None:
    """The point of a part that a ray means, None if all are far from it.

    Args:
        points: ``(k, 3)``.
        start: index of the first one.
        visible: which ``(k,)`` are seen, None for all.
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
