"""Capsules that stand for the links of an arm: segments with a radius.

A DH table says where the axes are and nothing about bodies, so they are assumed: each link is a tube along its
lengths d and a, the tool a tube from the last frame to the tool point, and what slides is a rod that reaches back
to its joint when it is drawn out. Two links that share a joint touch there, and are never compared, nor are links
that touch in nearly every configuration, such as a forearm and the flange behind a wrist without lengths.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from kin.collision.kernels import distances_of_pairs
from kin.named import robot_of
from kin.robot import Joint, Robot, exact_cos_sin
from kin.transforms import Array

SHARE, THINNEST, STOUTEST = 0.032, 0.014, 0.3  # radius, relative to all lengths, and at most to the shortest one
OFFSET = 0.04  # a length below this share of all is an offset, and not what limits the radius
SAMPLES, ALWAYS = 256, 0.95  # links that touch in more of the random configurations are never compared
_SHORTEST = 1e-6  # m

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Capsule:
    """All points within `radius` of a segment that moves with one link.

    Attributes:
        link: 0 for the base, k for the link that joint k moves.
        row: index of the DH row in whose frame the points are; −1 for the frame before the first row.
        start, end: ends of the segment (m) in that frame.
        radius: m.
    """

    link: int
    row: int
    start: Point
    end: Point
    radius: float


@dataclass(frozen=True, eq=False)
class Bodies:
    """The capsules of an arm as arrays for the kernels, and which of them are compared.

    Attributes:
        capsules: in the order of the links.
        rows: ``(m,)``, as `Capsule.row`.
        shape: ``(m, 7)``: start, end, radius.
        pairs: ``(p, 2)`` indices of capsules that could meet.
    """

    capsules: tuple[Capsule, ...]
    rows: NDArray[np.int64]
    shape: Array
    pairs: NDArray[np.int64]


def capsules(robot: Robot | str) -> tuple[Capsule, ...]:
    """The assumed capsules of an arm, base first."""
    return bodies_of(robot_of(robot)).capsules


@lru_cache(maxsize=64)
def bodies_of(robot: Robot) -> Bodies:
    """The capsules of an arm, and the pairs of links that neither share a joint nor always touch."""
    pieces = _segments(robot)
    lengths = np.array([math.dist(start, end) for _, _, start, end in pieces])
    whole = float(lengths.sum())
    shortest = float(lengths[lengths > OFFSET * whole].min(initial=whole))
    radius = max(min(SHARE * whole, STOUTEST * shortest), THINNEST * whole)
    found = tuple(Capsule(*piece, radius) for piece in pieces)
    rows = np.array([each.row for each in found], np.int64)
    shape = np.array([(*each.start, *each.end, each.radius) for each in found]).reshape(-1, 7)
    pairs = np.array(
        [
            (i, j)
            for i, first in enumerate(found)
            for j, second in enumerate(found)
            if second.link > first.link + 1
        ],
        np.int64,
    ).reshape(-1, 2)
    q = robot.random_q(np.random.default_rng(1), SAMPLES)
    touching = distances_of_pairs(robot.model, rows, shape, pairs, q) < 0.0
    links = np.array([each.link for each in found])
    kept = np.ones(len(pairs), bool)
    couples = links[pairs]
    for couple in {tuple(couple) for couple in couples.tolist()}:
        these = (couples == couple).all(axis=1)
        kept[these] = touching[:, these].any(axis=1).mean() < ALWAYS
    return Bodies(found, rows, shape, np.ascontiguousarray(pairs[kept]))


def _segments(robot: Robot) -> list[tuple[int, int, Point, Point]]:
    """(link, row, start, end) along the lengths of the table."""
    found: list[tuple[int, int, Point, Point]] = []
    zero = (0.0, 0.0, 0.0)

    def add(link: int, row: int, start: Point, end: Point) -> None:
        if math.dist(start, end) > _SHORTEST:
            found.append((link, row, start, end))

    link = 0
    for i, row in enumerate(robot.rows):
        rod = _rod(row)
        if robot.convention == "modified":
            add(link, i - 1, zero, (row.a, 0.0, 0.0))
            link += row.kind != "fixed"
            add(link, i, (0.0, 0.0, -row.d - rod), zero)
            continue
        link += row.kind != "fixed"
        # Seen from the frame behind Tx(a) Rx(α).
        c, s = exact_cos_sin(row.alpha)
        corner = (-row.a, 0.0, 0.0)
        back = row.d + rod
        add(link, i, (-row.a, -s * back, -c * back), corner)
        add(link, i, corner, zero)
    add(link, len(robot.rows) - 1, zero, tuple(robot.T_last_tool[:3, 3].tolist()))
    return found


def _rod(row: Joint) -> float:
    """Length of what slides: as far as it is drawn out at most."""
    return max(map(abs, row.limits)) if row.kind == "prismatic" and row.limits else 0.0
