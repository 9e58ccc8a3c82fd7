"""Descents on behalf of a question: the closest configuration, the nearest point, the nearest orientation.

A descent ends in a local minimum, so each search starts from many places: the seed, the branches the closed form
knows (whatever the limits say), and points spread evenly over the limits. Of equal minima the one whose start
comes first wins, and the seed comes first: while a target is dragged out of reach the arm does not jump about.
Once several descents have ended at the best minimum known, the search for a better one is over.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.fk import fk
from kin.ik.branches import Flags, measure, solution, solve_branches
from kin.ik.candidates import OVERRUN, POSITION_ERROR, ROTATION_ERROR
from kin.ik.problem import Question
from kin.ik.results import IKSolution
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION
from kin.solvers.numeric import each_of, solve, spread
from kin.tolerances import TOLERANCES
from kin.transforms import Array

ORIENTATION_WEIGHT = 0.1
STARTS = 24
# Starts of `solve_numerically` at most, the E in metres that it takes for exact, and what a radian weighs there: a
# share of the arm's reach, and in metres at least and at most.
BUDGET = 400
_EXACT = 1e-10
_LEVER, _LEAST_LEVER, _MOST_LEVER = 0.3, 0.03, 1.0
# The closest configuration is the best of so many descents at most, or of fewer once the best was met so often.
_MOST_STARTS = 64
_MEETINGS = 12
# What a radian weighs, in metres, and how many of the best descents go on from there. At _HELD descents also begin
# where the point is met: it stays as good as met, and the way is not yet as stiff as with less.
_HELD = 1e-2
_WEIGHTS = ((0.1, 24), (_HELD, 12), (1e-3, 12), (1e-4, 6))
_HAIR = 1e-6
# Minima that close, in metres and radians, are as good as one.
_ALIKE, _ALIKE_ANGLE = 1e-9, 1e-6


class Found(NamedTuple):
    """What `solve_numerically` found.

    Attributes:
        q: configuration ``(n,)`` inside the limits.
        error: its distance E from the target, in metres.
        starts: how many descents that took.
    """

    q: Array
    error: float
    starts: int


def solve_numerically(question: Question, budget: int = BUDGET) -> Found:
    """The first configuration that meets the task: a descent from the seed, then others from all over the limits.

    Needs no closed form. If none of `budget` starts (at least 1) leads to E ≤ 1e-10 m, the best minimum reached.
    The same question always gets the same answer.
    """
    out = question.seed.copy()
    weight = min(max(_LEVER * question.robot.reach, _LEAST_LEVER), _MOST_LEVER)
    goal = (question.T, question.code, question.mask, weight)
    bounds = (question.low, question.high, question.turns)
    error, starts = solve(question.robot.model, goal, bounds, budget, _EXACT * min(1.0, weight), out)
    return Found(out, float(error), int(starts))


def descend(
    question: Question, code: int, starts: Array, weight: float, enough: float = 0.0
) -> tuple[Array, float]:
    """Best configuration ``(n,)`` over descents from the starts ``(k, n)``, and its error E in metres.

    Over no more starts than it takes to end at E ≤ `enough`, or at the best minimum `_MEETINGS` times.
    """
    q, errors = _descend(question, code, starts, weight, enough, _MEETINGS)
    best = 0
    for i, error in enumerate(errors.tolist()):
        # A later start must be better by more than rounding: of equal minima the one nearest to the seed stays, so
        # that the arm does not jump about while a target is dragged out of reach.
        if error < errors[best] * (1.0 - 1e-6) - 1e-12:
            best = i
    return q[best], float(errors[best])


def descend_each(question: Question, code: int, starts: Array, weight: float) -> tuple[Array, Array]:
    """Where each descent ends ``(k, n)``, and its error ``(k,)``."""
    return _descend(question, code, starts, weight, -1.0, len(starts) + 1)


def _descend(
    question: Question, code: int, starts: Array, weight: float, enough: float, meetings: int
) -> tuple[Array, Array]:
    """Where the descents end ``(m, n)``, and their errors ``(m,)``; m < k if the search was over before."""
    q, errors = np.array(starts, order="C"), np.empty(len(starts))
    goal = (question.T, code, question.mask, weight)
    bounds = (question.low, question.high, question.turns)
    count = each_of(question.robot.model, goal, bounds, enough, meetings, q, errors)
    return q[:count], errors[:count]


def starting_points(question: Question, candidates: Array | None = None, count: int = STARTS) -> Array:
    """Where descents begin ``(k, n)``: the seed, the known branches ``(b, n)``, then `count` spread points."""
    rows = [question.seed[None]]
    if candidates is not None:
        rows.append(candidates[~np.isnan(candidates[:, 0])])
    rows.append(spread(question.low, question.high, count))
    return np.concatenate(rows)


def polish(question: Question, q: Array, stats: Array) -> Flags:
    """Descend from the rows ``(k, n)`` that miss by a hair, in place; which of them then are good ``(k,)``.

    Where two branches merge, a rounding error of 1e-16 in the target is 1e-8 in an angle: enough to push another
    joint past its stop or the roll past the closure tolerance.
    """
    good = np.zeros(len(q), dtype=bool)
    miss = stats[:, POSITION_ERROR] + stats[:, ROTATION_ERROR]
    if question.respect:
        miss = miss + stats[:, OVERRUN]
    for i in np.flatnonzero(miss < _HAIR).tolist():
        near, _ = descend(question, question.code, q[i : i + 1], 1.0)
        row, row_stats = measure(question, near[None])
        error = max(row_stats[0, POSITION_ERROR], row_stats[0, ROTATION_ERROR])
        if error <= TOLERANCES.closure_position and (row_stats[0, OVERRUN] == 0.0 or not question.respect):
            q[i], stats[i], good[i] = row[0], row_stats[0], True
    return good


def closest(question: Question, candidates: Array | None) -> IKSolution | None:
    """The configuration inside the limits with the least E, ℓ = 0.1 m per radian; None if a branch has none."""
    starts = starting_points(question, candidates, _MOST_STARTS)
    if question.branches is None:
        q, _ = descend(question, question.code, starts, ORIENTATION_WEIGHT)
    else:
        ends, errors = descend_each(question, question.code, starts, ORIENTATION_WEIGHT)
        best = math.inf
        for end, error in zip(ends, errors.tolist(), strict=True):
            if error < best * (1.0 - 1e-6) - 1e-12 and question.allows(question.branch_of(end)):
                q, best = end, error
        if not math.isfinite(best):
            return None
    found, stats = measure(question, q[None])
    return solution(question, found[0], stats[0], compromise="closest")


def mismatch(found: IKSolution) -> float:
    """The distance E in metres that `closest` minimises."""
    return math.hypot(found.position_error, ORIENTATION_WEIGHT * found.rotation_error)


def is_exact(question: Question, found: IKSolution) -> bool:
    """Whether the closest configuration in fact meets the task."""
    return (
        found.position_error <= TOLERANCES.closure_position
        and found.rotation_error <= TOLERANCES.closure_rotation
        and (found.in_limits or not question.respect)
    )


def nearest_to_point(question: Question, known: IKSolution | None) -> tuple[IKSolution, float]:
    """The configuration nearest to the target's point alone, and the metres that are missing there.

    Of a mask, the coordinates of the point that it keeps.
    """
    if known is not None and (known.position_error <= TOLERANCES.closure_position or question.code == MASK):
        return known, known.position_error if question.code == MASK else 0.0
    starts = starting_points(question, None if known is None else known.q[None], _MOST_STARTS)
    q, distance = descend(question, POSITION, starts, 1.0, enough=1e-11)
    found, stats = measure(question, q[None])
    return solution(question, found[0], stats[0], compromise="closest"), 0.0 if distance <= 1e-7 else distance


def _valleys(errors: Array, alike: float) -> list[int]:
    """Indices of the errors ``(k,)`` by size, of each run of alike ones the first two only.

    Descents that end equally high are mostly in one valley, and one of them would do.
    """
    order = np.argsort(errors, kind="stable").tolist()
    return [i for k, i in enumerate(order) if k < 2 or errors[i] > errors[order[k - 2]] + alike]


def nearest_orientation(question: Question, candidates: Array | None) -> IKSolution | None:
    """The configuration with the exact point and the least rotation error, None if the point is out of reach.

    A radian weighs less and less against a metre: descents from everywhere, later from where the point is met too,
    find the valleys; the best of them are followed to where a radian weighs a tenth of a millimetre. The closed
    form for the orientation found there then makes the point exact.
    """
    q = starting_points(question, candidates)
    met, errors = descend_each(question, POSITION, q, 1.0)
    if errors.min() > 1e-7 and np.count_nonzero(errors <= errors.min() + _ALIKE) >= _MEETINGS:
        return None  # as `nearest_to_point` would find
    met = met[errors <= 1e-7]
    for weight, keep in _WEIGHTS:
        if weight == _HELD:
            q = np.concatenate([q, met])
        q, errors = descend_each(question, question.code, q, weight)
        q = q[_valleys(errors, _ALIKE_ANGLE * weight)[:keep]]
    q, errors = descend_each(question, POSITION, q, 1.0)
    q = np.concatenate([q[errors <= 1e-7], met])
    if not len(q):
        return None
    q = q[int(np.argmin(measure(question, q)[1][:, ROTATION_ERROR].round(9)))]
    T = fk(question.robot, q)
    T[:3, 3] = question.T[:3, 3]
    known = solve_branches(question, T, APPROACH if question.robot.n < 6 else POSE, q)
    if known is not None:
        miss = np.abs(known.q - q).max(axis=1)
        miss[~(known.stats[:, POSITION_ERROR] <= TOLERANCES.closure_position)] = math.inf
        if question.respect:
            miss[known.stats[:, OVERRUN] > 0.0] = math.inf
        best = int(np.argmin(miss))
        if miss[best] < 0.05:
            return solution(question, known.q[best], known.stats[best], best, compromise="rotation")
    # At a stop of the wrist the polished direction may leave the limits by a hair: polish the point alone.
    q, error = descend(question, POSITION, q[None], 1.0)
    if error > TOLERANCES.closure_position:
        return None
    found, stats = measure(question, q[None])
    return solution(question, found[0], stats[0], compromise="rotation")
