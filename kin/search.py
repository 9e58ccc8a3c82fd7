"""Descents on behalf of a question: the closest configuration, the nearest point, the nearest orientation.

A descent ends in a local minimum, so each search starts from many places: the seed, the branches the closed form
knows (whatever the limits say), and points spread evenly over the limits. Of equal minima the one whose start
comes first wins, and the seed comes first: while a target is dragged out of reach the arm does not jump about.
"""

from __future__ import annotations

import math

import numpy as np

from kin.branches import Branches, Flags, measure, solution, solve_branches
from kin.finish import OVERRUN, POSITION_ERROR, ROTATION_ERROR
from kin.fk import fk
from kin.question import Question
from kin.results import IKSolution
from kin.solvers.common import APPROACH, MASK, POSE, POSITION
from kin.solvers.numeric import best_of, each_of, spread
from kin.tolerances import TOLERANCES
from kin.transforms import Array

ORIENTATION_WEIGHT = 0.1
STARTS = 24
# What a radian weighs, in metres, and how many of the best descents go on from there. Below _HELD the point is as
# good as held, so that descents may begin where it is met.
_HELD = 1e-3
_WEIGHTS = ((0.1, 24), (1e-2, 12), (_HELD, 12), (1e-4, 6))
_HAIR = 1e-6


def descend(
    question: Question, code: int, starts: Array, weight: float, enough: float = 0.0
) -> tuple[Array, float]:
    """Best configuration ``(n,)`` over descents from the starts ``(k, n)``, and its error E in metres."""
    out = np.empty(question.robot.n)
    error = best_of(
        question.robot.model, question.T, code, question.mask, weight, question.low, question.high,
        np.ascontiguousarray(starts), enough, out,
    )  # fmt: skip
    return out, float(error)


def descend_each(question: Question, code: int, starts: Array, weight: float) -> tuple[Array, Array]:
    """Where each descent ends ``(k, n)``, and its error ``(k,)``."""
    q, errors = np.array(starts, order="C"), np.empty(len(starts))
    each_of(question.robot.model, question.T, code, question.mask, weight, question.low, question.high, q, errors)
    return q, errors


def starting_points(question: Question, candidates: Array | None = None, count: int = STARTS) -> Array:
    """Where descents begin ``(k, n)``: the seed, the known branches ``(b, n)``, then `count` spread points."""
    rows = [question.seed[None]]
    if candidates is not None:
        rows.append(candidates[~np.isnan(candidates[:, 0])])
    rows.append(spread(question.low, question.high, count))
    return np.concatenate(rows)


def polish(question: Question, branches: Branches) -> Flags:
    """Descend from the rows that miss by a hair, in place; which of them then are good ``(k,)``.

    Where two branches merge, a rounding error of 1e-16 in the target is 1e-8 in an angle: enough to push another
    joint past its stop or the roll past the closure tolerance.
    """
    q, stats = branches.q, branches.stats
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
    starts = starting_points(question, candidates)
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
    starts = starting_points(question, None if known is None else known.q[None])
    q, distance = descend(question, POSITION, starts, 1.0, enough=1e-11)
    found, stats = measure(question, q[None])
    return solution(question, found[0], stats[0], compromise="closest"), 0.0 if distance <= 1e-7 else distance


def nearest_orientation(question: Question, candidates: Array | None) -> IKSolution | None:
    """The configuration with the exact point and the least rotation error, None if the point is out of reach.

    A radian weighs less and less against a metre: descents from everywhere, later from where the point is met too,
    find the valleys; the best of them are followed to where a radian weighs a tenth of a millimetre. The closed
    form for the orientation found there then makes the point exact.
    """
    q = starting_points(question, candidates)
    met, errors = descend_each(question, POSITION, q, 1.0)
    met = met[errors <= 1e-7]
    for weight, keep in _WEIGHTS:
        if weight == _HELD:
            q = np.concatenate([q, met])
        q, errors = descend_each(question, question.code, q, weight)
        q = q[np.argsort(errors.round(9), kind="stable")[:keep]]
    q, errors = descend_each(question, POSITION, np.concatenate([q, met]), 1.0)
    q = q[errors <= 1e-7]
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
