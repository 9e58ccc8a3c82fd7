"""What senses and zeros between two tables cost at least, for many tables at once and without matching them.

Each joint turns one link against the one before. Give every link a direction perpendicular to both of its axes:
their common normal if they cross, the way from one to the other if they are parallel. The angle at a joint between
the directions of its two links is its zero: the offset of the joint is the difference of this angle in the two
arms. A common normal changes its sign with the sense of either axis, so the offset depends on the senses of the
joint and of its two neighbours, and the least sum over all senses is found from the base to the tool by dynamic
programming.

The first joint, the last one, slides, and joints at axes that coincide have no such angle, and count as free.

Lengths settle senses too: the distance of two axes, measured along their normal, changes its sign with the
sense of either, and the offset along an axis between its two normals with the sense of that axis.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.comparison.matching import FLIP, OFFSET, QUARTER, Tolerance
from kin.comparison.tables import Invariants, Tables, cross_rows
from kin.robot import KIND_CODES
from kin.transforms import Array

# Links between axes that are nearly parallel, or parallel and nearly one, have no direction: sines, metres.
_LEAST_SINE, _MOST_PARALLEL, _LEAST_WAY = 0.05, 1e-9, 0.01
# Angles and lengths agree up to this multiple of the tolerance of axes, which such links magnify.
_SLACK = 1000.0
_SENSES = np.array([1.0, -1.0])
_FLIPS = np.array([0.0, FLIP])
_UNLIKE = np.array([[0, 1], [1, 0]])  # whether two senses are unlike


class Zeros(NamedTuple):
    """The zeros of many tables.

    Attributes:
        angle: ``(N, n − 2)`` about each inner axis, from the direction of the link before it to that of the link
            behind; NaN where there is none.
        cosine: ``(N, n − 1)`` of the angle between neighbouring axes.
        crossed: ``(N, n − 1)`` whether they are not parallel.
        distance: ``(N, n − 1)`` along the common normal, NaN where there is none.
        offset: ``(N, n)`` along each axis between its common normals, NaN where it has not two, and throughout
            where axes are nearly parallel.
    """

    angle: Array
    cosine: Array
    crossed: NDArray[np.bool_]
    distance: Array
    offset: Array

    @classmethod
    def of(cls, tables: Tables, known: Invariants) -> Zeros:
        """Those of each table, whose invariants are known."""
        rows = tables.joint_rows
        z, p = tables.zero.z[:, 0, rows], tables.zero.z_point[:, 0, rows]
        slides = tables.kinds[:, rows] == KIND_CODES["prismatic"]
        before, behind = z[:, :-1], z[:, 1:]
        normal = cross_rows(before, behind)
        sine = np.sqrt((normal * normal).sum(axis=-1))
        way = p[:, 1:] - p[:, :-1]
        way = way - (way * before).sum(axis=-1, keepdims=True) * before
        apart = np.sqrt((way * way).sum(axis=-1)) > _LEAST_WAY
        crossed, parallel = sine > _LEAST_SINE, sine < _MOST_PARALLEL
        clear = (crossed | parallel).all(axis=1, keepdims=True)
        direction = np.where(crossed[..., None], normal, way)
        one, other, axis = direction[:, :-1], direction[:, 1:], z[:, 1:-1]
        angle = np.arctan2((cross_rows(one, other) * axis).sum(axis=-1), (one * other).sum(axis=-1))
        exists = crossed | (parallel & apart & ~slides[:, :-1] & ~slides[:, 1:])
        exists = exists[:, :-1] & exists[:, 1:] & ~slides[:, 1:-1]
        return cls(
            np.where(exists, angle, math.nan),
            (before * behind).sum(axis=-1),
            crossed,
            np.where(crossed, known.distance, math.nan),
            np.where(clear, known.offset, math.nan),
        )

    def cost(self, others: Zeros, tolerance: Tolerance) -> Array:
        """What the senses and zeros of each of the others onto this single table cost at least ``(N,)``."""
        slack = _SLACK * max(tolerance)
        links = self.cosine.shape[1]
        if links < 1:
            return np.zeros(len(others.cosine))
        # (N, n − 1, 2, 2): of the second axis of a link, by the senses of both.
        alike = _agree(self.cosine, others.cosine, slack) & _agree(self.distance, others.distance, slack)
        own = _agree(self.offset, others.offset, slack)
        pairs = np.where(alike[..., _UNLIKE] & own[:, 1:, None], _FLIPS, math.inf)
        least = _FLIPS[:, None] + pairs[:, 0]  # by the senses of the last two axes
        if links > 1:
            turned = self._turned(others, slack)
            for i in range(links - 1):
                least = (least[..., None] + turned[:, i]).min(axis=1) + pairs[:, i + 1]
        return np.asarray(least.min(axis=(1, 2)))

    def _turned(self, others: Zeros, slack: float) -> Array:
        """What the zeros of the inner joints cost ``(N, n − 2, 2, 2, 2)``, by the senses of three neighbours."""
        offset = _SENSES * self.angle[..., None] - others.angle[..., None]  # by the own sense
        offset = offset[..., None] - np.array([0.0, math.pi])  # and by half a turn
        quarters = offset / (0.5 * math.pi)
        nearest = np.round(quarters)
        near = np.abs(quarters - nearest) <= slack / (0.5 * math.pi)
        cost = np.where(near, np.where(np.remainder(nearest, 4.0) == 0.0, 0.0, QUARTER), OFFSET)
        same = (self.crossed == others.crossed)[:, 1:] & (self.crossed == others.crossed)[:, :-1]
        cost = np.where((same & ~np.isnan(quarters[..., 0, 0]))[..., None, None], cost, 0.0)
        # Half a turn where one of the two directions changes its sign.
        flips = self.crossed[0, :, None, None] & (_UNLIKE == 1)
        half = flips[:-1, :, :, None] ^ flips[1:, None]
        joints = np.arange(len(half))[:, None, None, None]
        return np.asarray(cost[:, joints, np.arange(2)[:, None], half.astype(np.intp)])


def _agree(wanted: Array, values: Array, slack: float) -> NDArray[np.bool_]:
    """Whether values ``(N, k)`` may be the wanted ones ``(1, k)``: as they are, and with the other sign."""
    signed = values[..., None] * _SENSES
    return np.asarray(~(np.abs(signed - wanted[..., None]) > slack))  # NaN agrees with everything
