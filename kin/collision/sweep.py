"""Proof that motions touch nothing: by distances, and by bounds of how far each capsule can move.

While joint j turns by at most Δ_j, a point of a link that it carries moves by at most Δ_j times its lever: the sum
of the lengths of the links between, whatever the posture. So a distance d at the middle of a motion shows that
nothing touches during all of it if d is larger than what the two bodies can move towards each other until either
end. Otherwise each half of the motion is looked at by itself, until it is proven free or something touches. Joints
that carry both of two links move them together and count for neither.

F. Schwarzer, M. Saha, J.-C. Latombe, Exact collision checking of robot paths, WAFR 2002.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.collision.contacts import Contact, Surroundings
from kin.collision.solids import margins
from kin.transforms import Array

CLOSE = 1e-5  # m; a motion that comes closer, but is never seen to touch, counts as touching
MOST = 1 << 20  # configurations looked at; what is not proven by then counts as touching
CHUNK = 1 << 14  # of them between two calls of `cancel`
LOOKS = 64  # for the deepest contact of a motion that touches something
Rows = NDArray[np.int64]


def first_contacts(
    near: Surroundings,
    at: Callable[[Rows, Array], Array],
    moves: Array,
    farthest: Array,
    cancel: Callable[[], None],
) -> Array:
    """The part of each motion ``(k,)``, from 0 to 1, after which something touches first; infinite: never.

    Args:
        at: configurations ``(c, n)`` of motions ``(c,)`` at parts ``(c,)`` of them.
        moves: bounds ``(k, n)`` of the slope of each joint (rad or m) over its motion, of which the part runs from
            0 to 1.
        farthest: the largest absolute joint values ``(n,)`` of all motions.
        cancel: cancels by raising.
    """
    body = near.bodies
    couples, paces = _approach_bounds(near, moves, farthest)
    top = paces.max(axis=1, initial=0.0)
    hit, close = np.full(len(moves), math.inf), np.full(len(moves), math.inf)

    def look(rows: Rows, shares: Array, half: Array) -> Array:
        """The smallest distances, and what is left of them ``(c, 2)``."""
        out = np.empty((len(rows), 2))
        for start in range(0, len(rows), CHUNK):
            cancel()
            part = slice(start, start + CHUNK)
            q = np.ascontiguousarray(at(rows[part], shares[part]))
            parts = np.column_stack([rows[part].astype(float), half[part]])
            margins(near.robot.model, body.rows, body.shape, couples, near.solids, q, parts, paces, out[part])
        return out

    rows: Rows = np.arange(len(moves))
    low, high = np.zeros(len(moves)), np.ones(len(moves))
    hit[look(rows, low, low)[:, 0] < 0.0] = 0.0
    seen = 0
    while len(rows):
        if seen > MOST:
            np.minimum.at(close, rows, low)
            break
        seen += len(rows)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        least, room = look(rows, middle, half).T
        touching = least < 0.0
        fine = top[rows] * half <= CLOSE
        np.minimum.at(hit, rows[touching], middle[touching])
        stuck = ~touching & (room <= 0.0) & fine
        np.minimum.at(close, rows[stuck], middle[stuck])
        left, right = (touching | (room <= 0.0)) & ~fine, ~touching & (room <= 0.0) & ~fine
        rows, low, high = (
            np.concatenate([rows[left], rows[right]]),
            np.concatenate([low[left], middle[right]]),
            np.concatenate([middle[left], high[right]]),
        )
        before = low < hit[rows]
        rows, low, high = rows[before], low[before], high[before]
    return np.where(np.isfinite(hit), hit, close)


def _approach_bounds(near: Surroundings, moves: Array, farthest: Array) -> tuple[Rows, Array]:
    """What is compared ``(c, 2)``, as `margins` takes it, and how far each can come nearer ``(k, c)``."""
    lever, (first, second) = lever_arms(near, farthest), near.pairs.T
    between = np.where(lever[first] > 0.0, 0.0, lever[second])
    watched = near.bodies.moving if len(near.solids) else near.bodies.moving[:0]
    couples = np.concatenate([near.pairs, np.column_stack([watched, np.full_like(watched, -1)])])
    return couples, np.ascontiguousarray(moves @ np.concatenate([between, lever[watched]]).T)


def lever_arms(near: Surroundings, farthest: Array) -> Array:
    """How far a point of the axis of each capsule can be from the axis of each joint ``(m, n)``, m.

    1 for a prismatic joint, 0 for a joint that does not carry the capsule. Rows that follow a joint add theirs,
    times their ratios. `farthest`: the largest absolute joint values ``(n,)``.
    """
    robot, body = near.robot, near.bodies
    modified = robot.convention == "modified"
    out = np.zeros((len(body.rows), robot.n))
    ends = np.maximum(*(np.linalg.norm(body.shape[:, k : k + 3], axis=1) for k in (0, 3)))
    moved = np.abs(robot.expansion)  # how much of each joint's motion each moving row makes
    most = moved @ farthest
    lengths = [math.hypot(row.a, row.d) for row in robot.rows]
    for k, index in enumerate(robot.moving_rows):
        row = robot.rows[index]
        if row.kind == "prismatic":
            lengths[index] = math.hypot(row.a, abs(row.d) + most[k])
    sums = np.concatenate([[0.0], np.cumsum(lengths)])
    for k, index in enumerate(robot.moving_rows):
        row, carried = robot.rows[index], body.rows >= index
        lever = np.ones(int(carried.sum()))
        if row.kind == "revolute":
            # From the axis to the frame behind the row, then along the rows after it.
            start = 0.0 if modified else abs(row.a)
            lever = start + sums[body.rows[carried] + 1] - sums[index + 1] + ends[carried]
        out[carried] += lever[:, None] * moved[k]
    return out


class Touch(NamedTuple):
    """Where a path touches something: at a share from 0 to 1 of the way from row `waypoint` − 1 to it."""

    waypoint: int
    share: float
    contact: Contact


def touches_along(
    near: Surroundings, path: Array, jumps: Collection[int], cancel: Callable[[], None]
) -> tuple[Touch, ...]:
    """Where the straight joint motions between neighbours of a path ``(k, n)`` touch something first.

    Those without a touch are proven free. The contact is the deepest of `LOOKS` along the rest of the motion. Of
    the first row, and of `jumps`, by the row they lead to, only that row is looked at. `cancel` may raise.
    """
    still = np.array([i == 0 or i in jumps for i in range(len(path))])
    start = np.where(still[:, None], path, np.concatenate([path[:1], path[:-1]]))
    ways = path - start
    shares = first_contacts(
        near, lambda rows, s: start[rows] + s[:, None] * ways[rows], np.abs(ways), np.abs(path).max(axis=0), cancel
    )
    found = []
    for i in np.flatnonzero(np.isfinite(shares)).tolist():
        share = 1.0 if still[i] else float(shares[i])
        along = np.linspace(share, 1.0, 1 if still[i] else LOOKS)
        out, which = near.distances(start[i] + along[:, None] * ways[i])
        deepest = int(out.argmin())
        contact = near.contact(float(out[deepest]), int(which[deepest]))
        assert contact is not None
        found.append(Touch(i, share, contact))
    return tuple(found)
