"""Gaps: waypoints without an exact solution get a close configuration that their neighbours reach without a
jump."""

from __future__ import annotations

import numpy as np

from kin.ik import nearest
from kin.ik.branches import measure
from kin.ik.candidates import POSITION_ERROR, ROTATION_ERROR
from kin.ik.results import Status
from kin.path.configurations import alike
from kin.path.viterbi import shortest
from kin.path.waypoints import PathSettings, Waypoint
from kin.solvers.contract import POSITION
from kin.transforms import Array


def fill_gaps(settings: PathSettings, waypoints: list[Waypoint], q: Array) -> None:
    """Fill the NaN rows of q ``(k, n)``, in place, with close configurations, chosen as one path with its ends.

    Candidates come from descents that start at the configuration before the gap, at the one after it and between
    the two, so that the arm follows a target out of reach and back without changing its posture; and from the
    search of `kin.solve_ik` over all limits.
    """
    gaps = np.flatnonzero(np.isnan(q[:, 0])).tolist()
    home = np.clip(settings.problem.seed, settings.problem.lower, settings.problem.upper)
    forth, back = q.copy(), q.copy()
    for i in gaps:
        if i and not np.isnan(forth[i - 1, 0]):
            forth[i] = _closest(waypoints[i], forth[i - 1])
        elif len(gaps) == len(q):
            forth[i] = _closest(waypoints[i], home)
    for i in reversed(gaps):
        if i + 1 < len(q) and not np.isnan(back[i + 1, 0]):
            back[i] = _closest(waypoints[i], back[i + 1])
    solved = np.flatnonzero(~np.isnan(q[:, 0]))
    layers = [row[None] for row in q]
    for i in gaps:
        sides = [rows[i] for rows in (forth, back) if not np.isnan(rows[i, 0])]
        if len(sides) == 2:
            behind, before = solved[solved > i].min(), solved[solved < i].max()
            share = (i - before) / (behind - before)
            sides.append(_closest(waypoints[i], sides[0] + share * (sides[1] - sides[0])))
        layers[i] = _as_close(waypoints[i], np.array(sides))
    if gaps:
        trellis = shortest(settings, layers, [1] * len(layers), np.zeros(q.shape[1]), settings.max_step)
        q[gaps] = trellis.path(layers)[gaps]


def _closest(waypoint: Waypoint, start: Array) -> Array:
    """A configuration ``(n,)`` as close to the target as a descent from `start` gets.

    Where the point can be met, but not the orientation, the point comes first. Where the descent leaves the
    requested branches, the arm stays.
    """
    problem, q = waypoint.requested, start
    problem.cancel()
    if waypoint.gap is not None and waypoint.gap.status is Status.APPROXIMATE:
        for weight in (nearest.ORIENTATION_WEIGHT, 1e-2, 1e-4):
            q, _ = nearest.descend(problem, problem.code, q[None], weight)
        q, _ = nearest.descend(problem, POSITION, q[None], 1.0)
    else:
        q, _ = nearest.descend(problem, problem.code, q[None], nearest.ORIENTATION_WEIGHT)
    if problem.branches is not None and not problem.allows(problem.branch_of(q)):
        return np.clip(start, problem.lower, problem.upper)
    return q


def _as_close(waypoint: Waypoint, q: Array) -> Array:
    """Those of the configurations ``(m, n)`` that are nearly as close to the target as the best one.

    The waypoint's own answer counts as one of them.
    """
    problem = waypoint.requested
    best = waypoint.gap.best if waypoint.gap is not None else None
    if best is not None:
        q = np.concatenate([q, measure(problem, best.q[None], q[0])[0]])
    q, stats = measure(problem.without_turns(), q)
    miss = np.hypot(stats[:, POSITION_ERROR], nearest.ORIENTATION_WEIGHT * stats[:, ROTATION_ERROR])
    return np.ascontiguousarray(q[alike(miss, float(miss.min()))])
