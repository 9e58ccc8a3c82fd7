"""Configurations that meet one waypoint: near a configuration, near some places, at every whole turn.

Everything a path is made of comes from here, and all of it has been measured by forward kinematics: rows of the
closed form where there is one, ends of descents where there is none.
"""

from __future__ import annotations

import numpy as np

from kin.ik import nearest as search
from kin.ik.branches import Branches, Flags, is_closed, measure, solve_branches
from kin.ik.candidates import OVERRUN, POSITION_ERROR, ROLL, ROTATION_ERROR, select
from kin.ik.problem import Question
from kin.path.course import WIDE, Course, Way, has_closed_form
from kin.solvers.common import TURN
from kin.tolerances import TOLERANCES
from kin.transforms import Array

POOL = 24  # starts of descents, and most of their ends that are kept
LEAP = 0.125  # a motion between neighbouring waypoints that makes one look for a nearer solution
_HAIR = 1e-6


def branches_near(question: Question, seed: Array, values: tuple[float, ...] | None = None) -> Branches:
    """The branches nearest to a seed ``(n,)``, of a question that a closed form answers."""
    question.stop()
    found = solve_branches(question, question.T, question.code, seed, values)
    assert found is not None
    return found


def meeting(question: Question, relaxed: bool, q: Array, near: Array) -> Array:
    """Of whole sets of branches ``(sets · b, n)`` what meets the task inside the limits.

    The rows come at the whole turns nearest to `near`; of rows that give up the roll (`relaxed`) those that give
    up least.
    """
    if question.branches is not None:
        assert question.match is not None
        count = len(question.match.branches)
        q = q[[question.allows(i % count) for i in range(len(q))]]
    q, stats = measure(question, q[~np.isnan(q[:, 0])], near)
    good = _meets(stats)
    miss = stats[:, POSITION_ERROR] + stats[:, ROTATION_ERROR] + stats[:, OVERRUN]
    hair = np.flatnonzero(~good & (miss < _HAIR))[:8]
    if len(hair):
        missed, figures = q[hair], stats[hair]
        good[hair] = search.polish(question.near(near), missed, figures)
        q[hair], stats[hair] = missed, figures
    if relaxed and good.any():
        roll = np.abs(stats[:, ROLL])
        good &= alike(roll, float(roll[good].min()))
    return np.asarray(q[good])


def _meets(stats: Array) -> Flags:
    return np.asarray(is_closed(stats) & (stats[:, OVERRUN] == 0.0))


def alike(miss: Array, least: float) -> Flags:
    """Which misses are nearly as good as the least one: a path had better not leap for the difference."""
    return np.asarray(miss <= 1.05 * least + 1e-3)


def descended(question: Question, starts: Array) -> Array:
    """Configurations ``(m, n)`` that meet the question, where descents from the starts end: each once."""
    question.stop()
    if not len(starts):
        return starts
    q, _ = search.descend_each(question, question.code, starts, 1.0)
    q, stats = measure(question.without_turns(), q)
    q = q[_meets(stats)]
    if question.branches is not None:
        q = q[[question.allows(question.branch_of(row)) for row in q]]
    return distinct(q, question.seed)[:POOL]


def pool(question: Question) -> Array:
    """Configurations ``(m, n)`` that meet the question, found from all over the limits."""
    return descended(question, search.starting_points(question, count=POOL))


def distinct(q: Array, near: Array) -> Array:
    """The rows ``(m, n)``, each once, the nearest to `near` first."""
    kept, count = select(np.ascontiguousarray(q), np.linalg.norm(q - near, axis=1))
    return np.asarray(q[kept[:count]])


def with_images(question: Question, q: Array) -> Array:
    """Every row ``(m, n)`` at all its whole-turn images inside the limits; circles as they are."""
    for i in np.flatnonzero(question.turns > 0.0).tolist():
        low, high = question.lower[i], question.upper[i]
        if not TURN - 1e-8 <= high - low <= WIDE:
            continue
        first = np.ceil((low - TOLERANCES.limit - q[:, i]) / TURN)
        count = (np.floor((high + TOLERANCES.limit - q[:, i]) / TURN) - first + 1.0).astype(np.int64)
        rows = np.repeat(np.arange(len(q)), count)
        turn = first[rows] + np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count)
        q = q[rows]
        q[:, i] = np.clip(q[:, i] + TURN * turn, low, high)
    return np.ascontiguousarray(q)


def nearest(way: Way, question: Question, relaxed: bool, q: Array) -> Array | None:
    """The configuration nearest to q ``(n,)`` that meets the question."""
    found = np.empty((0, len(q)))
    if has_closed_form(question):
        found = meeting(question, relaxed, branches_near(question, q).q, q)
    if not len(found) or way.moves(found, q).max(axis=1).min() > LEAP:
        found = np.concatenate([found, descended(question, q[None])])
    return np.asarray(found[np.argmin(way.moves(found, q).max(axis=1))]) if len(found) else None


def continued(course: Course, s: int, q: Array, direction: int, allowed: float) -> list[tuple[int, Array]]:
    """The motion that goes on from q at waypoint s of the course, to the nearest solution, until it leaps.

    Pairs of a waypoint of the course and the configuration there; `direction` is 1 or −1.
    """
    out = []
    while 0 <= s + direction < len(course.stops):
        span = course.spans[max(s, s + direction)]
        s += direction
        stop = course.stops[s]
        found = nearest(course.way, stop.question, stop.relaxed, q)
        if found is None or course.way.farthest(found, q) > allowed * span:
            break
        q = found
        out.append((s, found))
    return out
