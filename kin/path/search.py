"""From layers to a path: search, repair, smoothing, and further attempts while jumps remain.

Samples may miss a narrow passage. Where the shortest path jumps, motions are continued from both sides, each step
to the nearest solution, and added to the layers. If jumps remain, the grid is made finer. A slow drift is
expensive on a grid, so a second path, searched on a finer grid over every few waypoints, is smoothed as well, and
the better one is kept.

Joints without limits or with more than two turns of travel are followed as a circle; their turns are counted
afterwards, and unwound only where a limit requires it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.angles import TURN
from kin.path.configurations import continued, nearest_solution, pool, with_images
from kin.path.crossings import with_crossings
from kin.path.layers import sampled
from kin.path.smoothing import smoothed
from kin.path.viterbi import Trellis, shortest
from kin.path.waypoints import GRID, LayerSequence, PathSettings, is_sampled
from kin.tolerances import TOLERANCES
from kin.transforms import Array

# Rounds of repair, and the most motions and pools of descents in each; radians of motion between the waypoints of
# the search for a drift.
_REPAIRS, _MOST_CONTINUED, _MOST_POOLS = 3, 24, 4
_DRIFT = 0.6


class DeadEnd(NamedTuple):
    """The last waypoint that a path with a certain number of jumps reaches, and its best configuration there."""

    waypoint: int
    q: Array


def best_path(sequence: LayerSequence) -> tuple[Array, list[DeadEnd]]:
    """The path ``(s, n)``, and where the paths with 0, 1, … jumps end.

    While samples are coarse, a step of the grid's own size does not count as a jump. If jumps remain, a finer grid
    is searched, then other sizes of what counts as a jump; the best path is kept.
    """
    settings = sequence.settings
    layers = with_crossings(sequence, [waypoint.layer for waypoint in sequence.waypoints])
    loose = max(settings.max_step, 2.0 * settings.grid - 0.05)
    found: list[tuple[tuple[int, float], Array]] = []
    ends: list[DeadEnd] = []
    for turn, allowed in enumerate((loose, loose, 2.0 * loose, settings.max_step)):
        if turn == 1 and sequence.has_grid:
            layers = [
                finer if len(finer := sampled(w.problem, w.relaxed, 0.5 * settings.grid)) else w.layer
                for w in sequence.waypoints
            ]
        elif turn and allowed == loose:
            continue
        trellis = _searched(sequence, layers, allowed)
        if allowed == settings.max_step:
            ends = [DeadEnd(sequence.at[s], layers[s][row]) for s, row in trellis.dead_ends()]
        starts = [_with_turns(settings, trellis.path(layers))]
        if not found:
            starts += _strided(sequence, starts[0])
        for start in starts:
            q = smoothed(sequence, start)
            found.append((sequence.cost(q), q))
        fewest = min(cost for cost, _ in found)[0]
        if fewest <= _unwinding_steps(settings, starts[0]):
            break
    return min(found, key=lambda pair: pair[0])[1], ends


def _searched(sequence: LayerSequence, layers: list[Array], allowed: float) -> Trellis:
    """The shortest path; while it jumps, continuations of the motions on both sides are added to the layers."""
    settings = sequence.settings
    settings.problem.cancel()
    trellis = shortest(settings, layers, sequence.spans, settings.circle, allowed)
    for _ in range(_REPAIRS):
        settings.problem.cancel()
        if trellis.jumps == 0:
            break
        starts = [(s, row, 1) for s, row in trellis.dead_ends()]
        for s in range(1, len(layers)):
            a, b = trellis.rows[s - 1], trellis.rows[s]
            if trellis.fewest[s][b] > trellis.fewest[s - 1][a]:
                starts += [(s - 1, a, 1), (s, b, -1)]
        motions = [(s, layers[s][row], direction) for s, row, direction in starts[:_MOST_CONTINUED]]
        if not is_sampled(settings.problem):
            for s in sorted({s for s, _, _ in motions})[:_MOST_POOLS]:
                problem = sequence.waypoints[s].problem
                anywhere = pool(problem)
                layers[s] = np.concatenate([layers[s], with_images(problem, anywhere)])
                motions += [(s, q, direction) for q in anywhere for direction in (1, -1)]
        for s, start, direction in motions:
            for i, q in continued(sequence, s, start, direction, allowed):
                layers[i] = np.concatenate([layers[i], with_images(sequence.waypoints[i].problem, q[None])])
        before = trellis.jumps
        trellis = shortest(settings, layers, sequence.spans, settings.circle, allowed)
        if trellis.jumps == before:
            break
    return trellis


def _strided(sequence: LayerSequence, q: Array) -> list[Array]:
    """Another path to smooth, if there is a grid: searched over every few waypoints, on a finer grid.

    On a grid a slow drift is made of large steps between neighbours; across several waypoints it is a drift.
    """
    settings = sequence.settings
    speed = math.sqrt(sequence.cost(q)[1] / len(q))
    stride = min(max(round(_DRIFT / max(speed, 1e-9)), 2), 16, len(q) // 5)
    if not sequence.has_grid or len(settings.problem.redundancies) > 1 or stride < 2 or max(sequence.spans) > 1:
        return []
    anchors = sorted({*range(0, len(q), stride), len(q) - 1})
    chosen = [sequence.waypoints[i] for i in anchors]
    layers = [sampled(waypoint.problem, waypoint.relaxed, 0.5 * GRID) for waypoint in chosen]
    if not all(len(layer) for layer in layers):
        return []
    trellis = shortest(settings, layers, [1, *np.diff(anchors).tolist()], settings.circle, settings.max_step)
    knots = _with_turns(settings, trellis.path(layers))
    out = []
    for i, waypoint in enumerate(sequence.waypoints):
        between = np.array([np.interp(i, anchors, x) for x in knots.T])
        found = nearest_solution(settings, waypoint.problem, waypoint.relaxed, between)
        if found is None:
            return []
        out.append(found)
    return [np.array(out)]


def _with_turns(settings: PathSettings, q: Array) -> Array:
    """Joints that were followed as circles, with their turns counted ``(s, n)``.

    Each stretch that fits between the limits stays in one piece, at the turn nearest to where the one before
    ended; where it no longer fits, the joint is unwound.
    """
    q = q.copy()
    for i in np.flatnonzero(settings.circle > 0.0).tolist():
        low, high = settings.problem.lower[i] - TOLERANCES.limit, settings.problem.upper[i] + TOLERANCES.limit
        x = np.unwrap(q[:, i])
        last, first = float(settings.problem.seed[i]), 0
        while first < len(x):
            least = np.ceil((low - np.minimum.accumulate(x[first:])) / TURN)
            most = np.floor((high - np.maximum.accumulate(x[first:])) / TURN)
            fits = least <= most
            count = len(fits) if fits.all() else int(np.argmin(fits))
            turn = min(max(round((last - x[first]) / TURN), least[count - 1]), most[count - 1])
            q[first : first + count, i] = x[first : first + count] + turn * TURN
            first += count
            last = float(q[first - 1, i])
    return np.clip(q, settings.problem.lower, settings.problem.upper)


def _unwinding_steps(settings: PathSettings, q: Array) -> int:
    """In how many steps a joint that was followed as a circle is unwound: no other path would save them."""
    return int((np.abs(np.diff(q, axis=0))[:, settings.circle > 0.0] > math.pi).any(axis=1).sum())
