"""Searches by descent for targets without an exact solution: closest configuration, nearest point and orientation.

A descent ends in a local minimum, so each search starts from many configurations: the seed, the branches of the
closed form (inside the limits or not), and points spread evenly over the limits. Of equal minima, the one with the
earliest start is taken, and the seed is the first start: the arm does not jump while a target is dragged out of
reach. A search ends when several descents have ended at the best minimum so far.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kin.angles import TURN
from kin.axes import size
from kin.fk import fk
from kin.ik.branches import Flags, measure, solution, solve_branches
from kin.ik.candidates import OVERRUN, POSITION_ERROR, ROTATION_ERROR
from kin.ik.problem import IKProblem
from kin.ik.results import IKSolution
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION
from kin.solvers.numeric import each_of, solve, spread
from kin.solvers.numeric.error import Goal
from kin.solvers.numeric.nearby import move_nearer
from kin.solvers.numeric.step import Bounds
from kin.solvers.numeric.valley import follow
from kin.tolerances import TOLERANCES
from kin.transforms import Array

ORIENTATION_WEIGHT = 0.1
_NEAR = 100.0  # tolerances: rows that miss a target by less are refined
STARTS = 24
# Settings of `solve_numerically`: the largest number of starts, the error E in metres that counts as exact, and
# the metres per radian of its error: a share of the arm's reach, between two bounds.
BUDGET = 400
_EXACT = 1e-10
_LEVER, _LEAST_LEVER, _MOST_LEVER = 0.3, 0.03, 1.0
# Valleys are followed from so many ends of descents, if they miss the target by less than this share of the size.
_VALLEYS = 24
_BESIDE = 1e-3
# At most _MOST_STARTS descents; the search stops when _MEETINGS of them have ended at the best minimum.
_MOST_STARTS = 64
_MEETINGS = 12
# Starts of a search without limits.
_WIDE_BUDGET = 60
# Stages of `nearest_orientation`: the metres per radian, and how many of the best descents continue. From
# _POINT_KEPT on, descents also start from configurations that meet the point: at this weight they stay close to
# the point, and the problem is better conditioned than at smaller weights.
_POINT_KEPT = 1e-2
_STAGES = ((0.1, 24), (_POINT_KEPT, 12), (1e-3, 12), (1e-4, 6))


class Found(NamedTuple):
    """The result of `solve_numerically`.

    Attributes:
        q: configuration ``(n,)`` inside the limits.
        error: its distance E from the target, in the arm's unit of length.
        starts: number of descents.
    """

    q: Array
    error: float
    starts: int


class _Search(NamedTuple):
    """What descents have in common: goal and bounds as in `kin.solvers.numeric`, and the error E in metres that
    counts as exact.
    """

    goal: Goal
    bounds: Bounds
    enough: float


def solve_numerically(problem: IKProblem, budget: int = BUDGET) -> Found:
    """The first configuration that meets the task: by a descent from the seed, then from points over the limits.

    Needs no closed form. If none of `budget` starts (at least 1) leads to E ≤ 1e-10 m, the result is the best
    minimum reached. The search is deterministic.
    """
    out = problem.seed.copy()
    weight = min(max(_LEVER * problem.robot.reach / problem.unit, _LEAST_LEVER), _MOST_LEVER)
    search = _search(problem, problem.code, weight)
    error, starts = solve(problem.robot.model, search.goal, search.bounds, budget, search.enough, out)
    if error > search.enough:
        q, errors = out[None], np.array([error])
        if error < _beside(problem):
            more, others = descend_each(problem, problem.code, starting_points(problem), weight)
            q, errors = np.concatenate([q, more]), np.concatenate([errors, others * problem.unit])
        followed = _followed(problem, search, q, errors)
        if followed is not None:
            out, error = followed, 0.0
    return Found(out, float(error) / problem.unit, int(starts))


def _search(problem: IKProblem, code: int, weight: float) -> _Search:
    """Descents to the target in a task, at so many units of length per radian; what they count in is metres."""
    goal = (problem.T, code, problem.mask, weight * problem.unit)
    bounds = (problem.low, problem.high, problem.turns)
    return _Search(goal, bounds, _EXACT * problem.unit * min(1.0, weight))


def _followed(problem: IKProblem, search: _Search, q: Array, errors: Array) -> Array | None:
    """The configuration ``(n,)`` that meets the task along weakly controllable directions from ``(k, n)``, if any.

    None if a descent met the task itself.
    """
    order = np.argsort(errors, kind="stable").tolist()
    if errors[order[0]] <= search.enough:
        return None
    beside = _beside(problem)
    near = [q[i] for i in order if errors[i] < beside]
    for row in _apart(near)[:_VALLEYS]:
        problem.cancel()
        there, error = follow(problem.robot.model, *search, row)
        if error <= search.enough:
            return there
    return None


def at_floor(problem: IKProblem, q: Array, weight: float) -> tuple[Array, float]:
    """The closest configuration along the weakly controllable directions from q ``(n,)``, and its error E."""
    return follow(problem.robot.model, *_search(problem, problem.code, weight), q)


def moved_nearer(problem: IKProblem, q: Array) -> Array:
    """Configurations ``(k, n)`` that meet a task which leaves a motion, moved towards the seed.

    Each ends where no configuration around it is nearer; what does not meet the task stays.
    """
    goal, _, _ = _search(problem, problem.code, 1.0)
    low, high = (problem.lower, problem.upper) if problem.respect else (problem.low, problem.high)
    scale, found = problem.requirement.weights**-2.0, np.clip(q, low, high)
    for there, row in zip(found, q, strict=True):
        if not move_nearer(problem.robot.model, goal, low, high, problem.seed, scale, there):
            there[:] = row
    return found


def _beside(problem: IKProblem) -> float:
    """The error in metres below which weakly controllable directions may lead from a descent to the target."""
    return _BESIDE * size(problem.robot)


def _is_decided(problem: IKProblem) -> bool:
    """Whether an exact closed form lists all configurations that meet the task: no search finds another one."""
    form = problem.closed_form
    return form is not None and form.off == 0.0 and form.exact_ranges and form.handles(problem.code)


def _apart(rows: list[Array]) -> list[Array]:
    """Configurations without those that differ little from one before."""
    found: list[Array] = []
    for row in rows:
        if all(np.abs(row - other).max() > TOLERANCES.same_branch for other in found):
            found.append(row)
    return found


def descend(
    problem: IKProblem, code: int, starts: Array, weight: float, enough: float = 0.0
) -> tuple[Array, float]:
    """Best configuration ``(n,)`` over descents from the starts ``(k, n)``, and its error E in units of length.

    Stops early at E ≤ `enough`, or when `_MEETINGS` descents have ended at the best minimum.
    """
    q, errors = _descend(problem, code, starts, weight, enough, _MEETINGS)
    best = _best(errors)
    return q[best], float(errors[best])


def _best(errors: Array) -> int:
    """The first of the smallest errors ``(k,)``."""
    best = 0
    for i, error in enumerate(errors.tolist()):
        if _is_better(error, errors[best]):
            best = i
    return best


def _is_better(error: float, best: float) -> bool:
    """Whether an error is smaller than the best one so far by more than rounding."""
    return error < best * (1.0 - TOLERANCES.better_minimum_share) - TOLERANCES.better_minimum


def descend_each(problem: IKProblem, code: int, starts: Array, weight: float) -> tuple[Array, Array]:
    """Where each descent ends ``(k, n)``, and its error ``(k,)``."""
    return _descend(problem, code, starts, weight, -1.0, len(starts) + 1)


def _descend(
    problem: IKProblem, code: int, starts: Array, weight: float, enough: float, meetings: int
) -> tuple[Array, Array]:
    """Where the descents end ``(m, n)``, and their errors ``(m,)``; m < k if the search stopped early.

    Errors are in the arm's unit of length, as is `enough`.
    """
    q, errors = np.array(starts, order="C"), np.empty(len(starts))
    goal, bounds, _ = _search(problem, code, weight)
    count = each_of(problem.robot.model, goal, bounds, enough * problem.unit, meetings, q, errors)
    return q[:count], errors[:count] / problem.unit


def starting_points(problem: IKProblem, candidates: Array | None = None, count: int = STARTS) -> Array:
    """Starts of descents ``(k, n)``: the seed, known branches ``(b, n)``, then `count` points over the limits."""
    rows = [problem.seed[None]]
    if candidates is not None:
        rows.append(candidates[~np.isnan(candidates[:, 0])])
    rows.append(spread(problem.low, problem.high, count))
    return np.concatenate(rows)


def beyond_limits(problem: IKProblem, code: int) -> Array:
    """Configurations ``(k, n)`` that meet a task outside the limits, from descents without limits; (0, n) if none.

    The first search ends early where no configuration exists at all.
    """
    revolute = problem.robot.revolute
    away = problem.robot.reach + float(np.linalg.norm(problem.T[:3, 3] - problem.robot.T_world_base[:3, 3]))
    low = np.where(revolute, -TURN, problem.lower - away)
    high = np.where(revolute, TURN, problem.upper + away)
    wide = replace(problem, low=low, high=high, code=code, respect=False)
    found = solve_numerically(wide, _WIDE_BUDGET)
    if found.error > _EXACT:
        return np.empty((0, problem.robot.n))
    starts = np.concatenate([found.q[None], starting_points(wide, count=STARTS)])
    q, errors = descend_each(wide, code, starts, 1.0)
    return np.concatenate([found.q[None], q[errors <= TOLERANCES.closure_position]])


def polish(problem: IKProblem, q: Array, stats: Array) -> Flags:
    """Refine the rows ``(k, n)`` that are near misses by descents, in place; which of them are now good ``(k,)``.

    Where two branches merge, a rounding error of 1e-16 in the target is 1e-8 in an angle: enough to move another
    joint past its limit, or the roll past the closure tolerance. Arms with few joints meet the point of a rounded
    target exactly, and so its orientation too badly.
    """
    position, rotation = problem.requirement.position, problem.requirement.rotation
    near_miss = max(TOLERANCES.near_miss, _NEAR * (position / problem.unit + rotation))
    good = np.zeros(len(q), dtype=bool)
    miss = stats[:, POSITION_ERROR] / problem.unit + stats[:, ROTATION_ERROR]
    if problem.respect:
        miss = miss + stats[:, OVERRUN]
    for i in np.flatnonzero(miss < near_miss).tolist():
        near, _ = descend(problem, problem.code, q[i : i + 1], 1.0)
        row, row_stats = measure(problem, near[None])
        met = row_stats[0, POSITION_ERROR] <= position and row_stats[0, ROTATION_ERROR] <= rotation
        if met and (row_stats[0, OVERRUN] == 0.0 or not problem.respect):
            q[i], stats[i], good[i] = row[0], row_stats[0], True
    return good


def closest(problem: IKProblem, candidates: Array | None) -> IKSolution | None:
    """The configuration inside the limits with the smallest E, at 0.1 m per radian.

    None if no descent ends on a requested branch.
    """
    starts = starting_points(problem, candidates, _MOST_STARTS)
    meetings = _MEETINGS if problem.branches is None else len(starts) + 1
    ends, errors = _descend(problem, problem.code, starts, ORIENTATION_WEIGHT, 0.0, meetings)
    allowed = np.array([problem.branches is None or problem.allows(problem.branch_of(end)) for end in ends])
    if not allowed.any():
        return None
    ends, errors = ends[allowed], errors[allowed]
    q = ends[_best(errors)]
    if not _is_decided(problem):
        search = _search(problem, problem.code, ORIENTATION_WEIGHT)
        followed = _followed(problem, search, ends, errors * problem.unit)
        if followed is not None and (problem.branches is None or problem.allows(problem.branch_of(followed))):
            q = followed
    found, stats = measure(problem, q[None])
    return solution(problem, found[0], stats[0], compromise="closest")


def mismatch(problem: IKProblem, found: IKSolution) -> float:
    """The distance E in metres that `closest` minimises."""
    return math.hypot(found.position_error, ORIENTATION_WEIGHT * problem.unit * found.rotation_error)


def is_exact(problem: IKProblem, found: IKSolution) -> bool:
    """Whether the closest configuration meets the task exactly."""
    return (
        found.position_error <= problem.requirement.position
        and found.rotation_error <= problem.requirement.rotation
        and (found.in_limits or not problem.respect)
    )


def nearest_to_point(problem: IKProblem, known: IKSolution | None) -> tuple[IKSolution, float]:
    """The configuration nearest to the target's point alone, and its distance from it in metres.

    For a mask, only the coordinates of the point that it keeps count.
    """
    if known is not None and (known.position_error <= problem.closure or problem.code == MASK):
        return known, known.position_error if problem.code == MASK else 0.0
    starts = starting_points(problem, None if known is None else known.q[None], _MOST_STARTS)
    q, distance = descend(problem, POSITION, starts, 1.0, enough=1e-11)
    found, stats = measure(problem, q[None])
    closest_point = solution(problem, found[0], stats[0], compromise="closest")
    return closest_point, 0.0 if distance <= TOLERANCES.point_met else distance * problem.unit


def _different_minima(errors: Array, same: float) -> list[int]:
    """Indices of the errors ``(k,)``, sorted by error; of a run of equal errors only the first two.

    Descents with equal errors have mostly ended in the same minimum, so it is enough to continue one or two.
    """
    order = np.argsort(errors, kind="stable").tolist()
    return [i for k, i in enumerate(order) if k < 2 or errors[i] > errors[order[k - 2]] + same]


def nearest_orientation(problem: IKProblem, candidates: Array | None) -> IKSolution | None:
    """The configuration with the exact point and the smallest rotation error, None if the point is out of reach.

    A penalty method: from stage to stage a radian weighs less against a metre, down to a tenth of a millimetre,
    and the best minima of each stage are the starts of the next. The closed form for the orientation found there
    then makes the point exact.
    """
    q = starting_points(problem, candidates)
    met, errors = descend_each(problem, POSITION, q, 1.0)
    least = errors.min()
    if least > TOLERANCES.point_met and np.sum(errors <= least + TOLERANCES.same_minimum) >= _MEETINGS:
        return None  # the point is out of reach, as `nearest_to_point` would find
    met = met[errors <= TOLERANCES.point_met]
    for weight, keep in _STAGES:
        if weight == _POINT_KEPT:
            q = np.concatenate([q, met])
        q, errors = descend_each(problem, problem.code, q, weight)
        q = q[_different_minima(errors, TOLERANCES.same_minimum_angle * weight)[:keep]]
    q, errors = descend_each(problem, POSITION, q, 1.0)
    q = np.concatenate([q[errors <= TOLERANCES.point_met], met])
    if not len(q):
        return None
    q = q[int(np.argmin(measure(problem, q)[1][:, ROTATION_ERROR].round(9)))]
    T = fk(problem.robot, q)
    T[:3, 3] = problem.T[:3, 3]
    known = solve_branches(problem, T, APPROACH if problem.robot.n < 6 else POSE, q)
    if known is not None:
        miss = np.abs(known.q - q).max(axis=1)
        miss[~(known.stats[:, POSITION_ERROR] <= problem.closure)] = math.inf
        if problem.respect:
            miss[known.stats[:, OVERRUN] > 0.0] = math.inf
        best = int(np.argmin(miss))
        if miss[best] < TOLERANCES.same_branch:
            return solution(problem, known.q[best], known.stats[best], best, compromise="rotation")
    # At a limit of the wrist the exact orientation may be just outside the limits: refine the point alone.
    q, error = descend(problem, POSITION, q[None], 1.0)
    if error > TOLERANCES.closure_position:
        return None
    found, stats = measure(problem, q[None])
    return solution(problem, found[0], stats[0], compromise="rotation")
