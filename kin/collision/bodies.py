"""Capsules that stand for the links of an arm: segments with a radius.

Robot files may state them. A DH table says where the axes are and nothing about bodies, so for other arms they
are assumed: each link is a tube along its lengths d and a, and what slides is a rod that reaches back to its joint
when it is drawn out. A tool that no stated capsule reaches is a tube from the last frame to the tool point.

Which links are compared: not two that share a joint, nor two that touch in nearly every configuration, such as a
forearm and the flange behind a wrist without lengths, nor two that touch at the home configuration, nor two with
one link between them that overlap by less than half of the thinner radius, whatever the configuration: capsules
are not exact enough for what is so close. Against obstacles, all that some joint moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from kin.collision.kernels import distances_of_pairs, least_distance
from kin.named import robot_of
from kin.robot import Capsule, Joint, Robot, exact_cos_sin
from kin.transforms import Array

SHARE, THINNEST, STOUTEST = 0.032, 0.014, 0.3  # radius, relative to all lengths, and at most to the shortest one
OFFSET = 0.04  # a length below this share of all is an offset, and not what limits the radius
SAMPLES, ALWAYS = 256, 0.95  # links that touch in more of the random configurations are never compared
SHALLOW = 0.5  # of the thinner radius: what links with one link between them may overlap
_SHORTEST = 1e-6  # m
_STILL = 1e-9  # m

Point = tuple[float, float, float]
_ORIGIN = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Bodies:
    """The capsules of an arm as arrays for the kernels, and which of them are compared.

    Attributes:
        capsules: in the order of the links.
        rows: ``(m,)``, as `Capsule.row`.
        shape: ``(m, 8)``: start, end, radius, radius of a ball around it.
        pairs: ``(p, 2)`` indices of capsules that could meet.
        moving: ``(w,)`` indices of the capsules that some joint moves.
    """

    capsules: tuple[Capsule, ...]
    rows: NDArray[np.int64]
    shape: Array
    pairs: NDArray[np.int64]
    moving: NDArray[np.int64]


def capsules(robot: Robot | str) -> tuple[Capsule, ...]:
    """The capsules of an arm, base first: those of its robot file, else assumed ones."""
    return bodies_of(robot_of(robot)).capsules


@lru_cache(maxsize=64)
def bodies_of(robot: Robot) -> Bodies:
    """The capsules of an arm, and the pairs of links that are compared."""
    found = _with_tool(robot) if robot.capsules else _assumed(robot)
    rows = np.array([each.row for each in found], np.int64)
    shape = np.array(
        [(*c.start, *c.end, c.radius, c.radius + 0.5 * math.dist(c.start, c.end)) for c in found]
    ).reshape(-1, 8)
    pairs = np.array(
        [
            (i, j)
            for i, first in enumerate(found)
            for j, second in enumerate(found)
            if second.link > first.link + 1
        ],
        np.int64,
    ).reshape(-1, 2)
    q = np.vstack([robot.q_home[None], robot.random_q(np.random.default_rng(1), SAMPLES)])
    apart = distances_of_pairs(robot.model, rows, shape, pairs, q)
    touching = apart < 0.0
    deep = np.asarray((apart < -SHALLOW * shape[pairs, 6].min(axis=1)).any(axis=0))
    links = np.array([each.link for each in found])
    kept = np.ones(len(pairs), bool)
    couples = links[pairs]
    for couple in {tuple(couple) for couple in couples.tolist()}:
        these = (couples == couple).all(axis=1)
        meet = np.asarray(touching[:, these].any(axis=1))
        kept[these] = not meet[0] and meet[1:].mean() < ALWAYS and (couple[1] > couple[0] + 2 or deep[these].any())
    ends = np.empty((8, len(found), 6))
    for at, each in zip(ends, q, strict=False):  # without pairs, only the ends are computed
        least_distance(robot.model, rows, shape, pairs[:0], np.ascontiguousarray(each), at, np.empty(7))
    moving = np.flatnonzero(np.ptp(ends, axis=0).max(axis=1, initial=0.0) > _STILL)
    return Bodies(found, rows, shape, np.ascontiguousarray(pairs[kept]), moving.astype(np.int64))


def _assumed(robot: Robot) -> tuple[Capsule, ...]:
    """Tubes along the lengths of the table."""
    pieces = _segments(robot)
    radius = _radius(pieces)
    return tuple(Capsule(*piece, radius) for piece in pieces)


def _with_tool(robot: Robot) -> tuple[Capsule, ...]:
    """The stated capsules, and a tube to a tool point that they do not reach."""
    tool, last = robot.T_last_tool[:3, 3], len(robot.rows) - 1
    own = [each for each in robot.capsules if each.row == last]
    if any(_distance(each, tool) <= 0.0 for each in own) or float(np.linalg.norm(tool)) <= _SHORTEST:
        return robot.capsules
    radius = min([_radius(_segments(robot)), *(each.radius for each in own)])
    x, y, z = tool.tolist()
    return (*robot.capsules, Capsule(robot.n, last, _ORIGIN, (x, y, z), radius))


def _distance(capsule: Capsule, point: Array) -> float:
    """Of a point in the frame of a capsule from its surface, negative inside."""
    start, way = np.array(capsule.start), np.subtract(capsule.end, capsule.start)
    square = float(way @ way)
    t = min(max(float((point - start) @ way) / square, 0.0), 1.0) if square > 0.0 else 0.0
    return float(np.linalg.norm(point - start - t * way)) - capsule.radius


def _radius(pieces: list[tuple[int, int, Point, Point]]) -> float:
    """The radius of assumed tubes."""
    lengths = np.array([math.dist(start, end) for _, _, start, end in pieces])
    whole = float(lengths.sum())
    shortest = float(lengths[lengths > OFFSET * whole].min(initial=whole))
    return max(min(SHARE * whole, STOUTEST * shortest), THINNEST * whole)


def _segments(robot: Robot) -> list[tuple[int, int, Point, Point]]:
    """(link, row, start, end) along the lengths of the table."""
    found: list[tuple[int, int, Point, Point]] = []

    def add(link: int, row: int, start: Point, end: Point) -> None:
        if math.dist(start, end) > _SHORTEST:
            found.append((link, row, start, end))

    link = 0
    for i, row in enumerate(robot.rows):
        rod = _rod(row)
        if robot.convention == "modified":
            add(link, i - 1, _ORIGIN, (row.a, 0.0, 0.0))
            link += row.kind != "fixed"
            add(link, i, (0.0, 0.0, -row.d - rod), _ORIGIN)
            continue
        link += row.kind != "fixed"
        # Seen from the frame behind Tx(a) Rx(α).
        c, s = exact_cos_sin(row.alpha)
        corner = (-row.a, 0.0, 0.0)
        back = row.d + rod
        add(link, i, (-row.a, -s * back, -c * back), corner)
        add(link, i, corner, _ORIGIN)
    add(link, len(robot.rows) - 1, _ORIGIN, tuple(robot.T_last_tool[:3, 3].tolist()))
    return found


def _rod(row: Joint) -> float:
    """Length of what slides: as far as it is drawn out at most."""
    return max(map(abs, row.limits)) if row.kind == "prismatic" and row.limits else 0.0
