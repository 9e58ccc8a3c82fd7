"""Gaps: where no configuration is exact, one about as close as can be that the neighbours reach without a leap."""

from __future__ import annotations

import numpy as np

from kin.ik import nearest
from kin.ik.branches import measure
from kin.ik.candidates import POSITION_ERROR, ROTATION_ERROR
from kin.ik.results import Status
from kin.path.course import Stop, Way
from kin.path.trellis import shortest
from kin.path.waypoint import alike
from kin.solvers.contract import POSITION
from kin.transforms import Array


def fill_gaps(way: Way, stops: list[Stop], q: Array) -> None:
    """The rows of q ``(k, n)`` that are NaN, in place: close configurations, chosen as one way with their ends.

    Candidates come from descents that start where the arm is before, where it is behind and in between, so that it
    follows a target out of reach and back without turning over; and from `kin.solve_ik`'s search over all limits.
    """
    gaps = np.flatnonzero(np.isnan(q[:, 0])).tolist()
    home = np.clip(way.question.seed, way.question.lower, way.question.upper)
    forth, back = q.copy(), q.copy()
    for i in gaps:
        if i and not np.isnan(forth[i - 1, 0]):
            forth[i] = _closest(stops[i], forth[i - 1])
        elif len(gaps) == len(q):
            forth[i] = _closest(stops[i], home)
    for i in reversed(gaps):
        if i + 1 < len(q) and not np.isnan(back[i + 1, 0]):
            back[i] = _closest(stops[i], back[i + 1])
    solved = np.flatnonzero(~np.isnan(q[:, 0]))
    layers = [row[None] for row in q]
    for i in gaps:
        sides = [rows[i] for rows in (forth, back) if not np.isnan(rows[i, 0])]
        if len(sides) == 2:
            behind, before = solved[solved > i].min(), solved[solved < i].max()
            share = (i - before) / (behind - before)
            sides.append(_closest(stops[i], sides[0] + share * (sides[1] - sides[0])))
        layers[i] = _as_close(stops[i], np.array(sides))
    if gaps:
        trellis = shortest(way, layers, [1] * len(layers), np.zeros(q.shape[1]), way.max_step)
        q[gaps] = trellis.path(layers)[gaps]


def _closest(stop: Stop, start: Array) -> Array:
    """A configuration ``(n,)`` as close to the target as a descent from `start` gets.

    Where the point can be met, but not the orientation, the point comes first. Where the descent leaves the
    branches asked for, the arm stays.
    """
    question, q = stop.asked, start
    question.stop()
    if stop.gap is not None and stop.gap.status is Status.APPROXIMATE:
        for weight in (nearest.ORIENTATION_WEIGHT, 1e-2, 1e-4):
            q, _ = nearest.descend(question, question.code, q[None], weight)
        q, _ = nearest.descend(question, POSITION, q[None], 1.0)
    else:
        q, _ = nearest.descend(question, question.code, q[None], nearest.ORIENTATION_WEIGHT)
    if question.branches is not None and not question.allows(question.branch_of(q)):
        return np.clip(start, question.lower, question.upper)
    return q


def _as_close(stop: Stop, q: Array) -> Array:
    """Of the configurations ``(m, n)`` and the best one known those about as close to the target as the best."""
    question = stop.asked
    best = stop.gap.best if stop.gap is not None else None
    if best is not None:
        q = np.concatenate([q, measure(question, best.q[None], q[0])[0]])
    q, stats = measure(question.without_turns(), q)
    miss = np.hypot(stats[:, POSITION_ERROR], nearest.ORIENTATION_WEIGHT * stats[:, ROTATION_ERROR])
    return np.ascontiguousarray(q[alike(miss, float(miss.min()))])
