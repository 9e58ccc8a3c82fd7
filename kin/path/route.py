"""From layers to a path: search, repair, smoothing, and what is tried while jumps remain.

Samples may miss a narrow passage. Where the shortest way jumps, motions are continued from both sides, each step
to the nearest solution, and join the layers. If jumps remain, the grid is made finer. A slow drift is dear on a
grid, so a second path, searched on a finer grid over every few waypoints, is smoothed too, and the better one is
kept.

Joints without stops or with more than two turns of travel are followed as a circle; their turns are counted
afterwards, and rewound only where a stop asks for it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.path.course import GRID, Course, Way, is_sampled
from kin.path.layers import sampled
from kin.path.smooth import smoothed
from kin.path.trellis import Trellis, shortest
from kin.path.waypoint import continued, nearest, pool, with_images
from kin.solvers.common import TURN
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Rounds of repair, motions continued and pools made in each; radians of motion between the waypoints that a drift
# is searched over.
_REPAIRS, _MOST_CONTINUED, _MOST_POOLS = 3, 24, 4
_DRIFT = 0.6


class DeadEnd(NamedTuple):
    """The last waypoint that a way with a certain number of jumps reaches, and where the best one is there."""

    waypoint: int
    q: Array


def route(course: Course) -> tuple[Array, list[DeadEnd]]:
    """The path ``(s, n)``, and where the ways with 0, 1, … jumps end.

    While samples are coarse, a step as long as the grid's own is no jump. If jumps remain, a finer grid is
    searched, then with other measures of what a jump is; the best path is kept.
    """
    way = course.way
    layers = [stop.layer for stop in course.stops]
    loose = max(way.max_step, 2.0 * way.grid - 0.05)
    found: list[tuple[tuple[int, float], Array]] = []
    ends: list[DeadEnd] = []
    for turn, allowed in enumerate((loose, loose, 2.0 * loose, way.max_step)):
        if turn == 1 and course.free:
            finer = (sampled(stop.question, stop.relaxed, 0.5 * way.grid) for stop in course.stops)
            layers = [new if len(new) else stop.layer for new, stop in zip(finer, course.stops, strict=True)]
        elif turn and allowed == loose:
            continue
        trellis = _searched(course, layers, allowed)
        if allowed == way.max_step:
            ends = [DeadEnd(course.at[s], layers[s][row]) for s, row in trellis.dead_ends()]
        starts = [_unwound(way, trellis.path(layers))]
        if not found:
            starts += _strided(course, starts[0])
        for start in starts:
            q = smoothed(course, start)
            found.append((course.rank(q), q))
        least = min(rank for rank, _ in found)[0]
        if least <= _rewound(way, starts[0]):
            break
    return min(found, key=lambda pair: pair[0])[1], ends


def _searched(course: Course, layers: list[Array], allowed: float) -> Trellis:
    """The shortest way; while it jumps, with continuations of the motions on both sides added to the layers."""
    way = course.way
    way.question.stop()
    trellis = shortest(way, layers, course.spans, way.ring, allowed)
    for _ in range(_REPAIRS):
        way.question.stop()
        if trellis.jumps == 0:
            break
        starts = [(s, row, 1) for s, row in trellis.dead_ends()]
        for s in range(1, len(layers)):
            a, b = trellis.rows[s - 1], trellis.rows[s]
            if trellis.fewest[s][b] > trellis.fewest[s - 1][a]:
                starts += [(s - 1, a, 1), (s, b, -1)]
        motions = [(s, layers[s][row], direction) for s, row, direction in starts[:_MOST_CONTINUED]]
        if not is_sampled(way.question):
            for s in sorted({s for s, _, _ in motions})[:_MOST_POOLS]:
                question = course.stops[s].question
                anywhere = pool(question)
                layers[s] = np.concatenate([layers[s], with_images(question, anywhere)])
                motions += [(s, q, direction) for q in anywhere for direction in (1, -1)]
        for s, start, direction in motions:
            for i, q in continued(course, s, start, direction, allowed):
                layers[i] = np.concatenate([layers[i], with_images(course.stops[i].question, q[None])])
        before = trellis.jumps
        trellis = shortest(way, layers, course.spans, way.ring, allowed)
        if trellis.jumps == before:
            break
    return trellis


def _strided(course: Course, q: Array) -> list[Array]:
    """Another path to smooth, if anything is free: searched over every few waypoints, on a finer grid.

    On a grid a slow drift is made of steps, each paid within one waypoint; over several waypoints it is a drift.
    """
    way = course.way
    speed = math.sqrt(course.rank(q)[1] / len(q))
    stride = min(max(round(_DRIFT / max(speed, 1e-9)), 2), 16, len(q) // 5)
    if not course.free or len(way.question.freedoms) > 1 or stride < 2 or max(course.spans) > 1:
        return []
    anchors = sorted({*range(0, len(q), stride), len(q) - 1})
    chosen = [course.stops[i] for i in anchors]
    layers = [sampled(stop.question, stop.relaxed, 0.5 * GRID) for stop in chosen]
    if not all(len(layer) for layer in layers):
        return []
    trellis = shortest(way, layers, [1, *np.diff(anchors).tolist()], way.ring, way.max_step)
    knots = _unwound(way, trellis.path(layers))
    out = []
    for i, stop in enumerate(course.stops):
        between = np.array([np.interp(i, anchors, x) for x in knots.T])
        found = nearest(way, stop.question, stop.relaxed, between)
        if found is None:
            return []
        out.append(found)
    return [np.array(out)]


def _unwound(way: Way, q: Array) -> Array:
    """Joints that were followed as circles, with their turns counted ``(s, n)``.

    Each stretch that fits between the stops stays whole, at the turn nearest to where the one before ended; where
    it does not fit any longer the joint is rewound.
    """
    q = q.copy()
    for i in np.flatnonzero(way.ring > 0.0).tolist():
        low, high = way.question.lower[i] - TOLERANCES.limit, way.question.upper[i] + TOLERANCES.limit
        x = np.unwrap(q[:, i])
        last, first = float(way.question.seed[i]), 0
        while first < len(x):
            least = np.ceil((low - np.minimum.accumulate(x[first:])) / TURN)
            most = np.floor((high - np.maximum.accumulate(x[first:])) / TURN)
            fits = least <= most
            count = len(fits) if fits.all() else int(np.argmin(fits))
            turn = min(max(round((last - x[first]) / TURN), least[count - 1]), most[count - 1])
            q[first : first + count, i] = x[first : first + count] + turn * TURN
            first += count
            last = float(q[first - 1, i])
    return np.clip(q, way.question.lower, way.question.upper)


def _rewound(way: Way, q: Array) -> int:
    """In how many steps a joint that was followed as a circle is turned back: no other way would save them."""
    return int((np.abs(np.diff(q, axis=0))[:, way.ring > 0.0] > math.pi).any(axis=1).sum())
