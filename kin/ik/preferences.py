"""Preferences: which values redundancy parameters get.

The solvers of seven joints choose the value at which the configuration is nearest to the seed, the others the
value nearest to the seed's own, which is not the same: a parameter that is free at a singular target moves other
joints too. There, and for the other preferences, each branch is searched for the best value: samples over its
feasible ranges, then ever finer grids around the best sample. Values outside those ranges are never tried, so the
choice is always feasible. Several redundancy parameters are searched one after another.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.angles import wrap
from kin.ik.branches import Branches, Flags, candidates_of, is_closed, measure, solve_branches
from kin.ik.candidates import OVERRUN
from kin.ik.problem import IKProblem
from kin.kernels import jacobian as jacobian_kernels
from kin.solvers.contract import POSE, POSITION, weakest
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_SAMPLES = 24
_ZOOMS = 4
# Of a parameter whose rows are not the same branches at all values: samples of its range, and how many of the best
# ones are refined.
_ALL_SAMPLES = 108
_REFINED = 10


def scores(problem: IKProblem, q: Array) -> Array:
    """Score of configurations ``(k, n)`` by the preference ``(k,)``, larger is better; −∞ for NaN rows.

    ``limits``: the smallest distance to a joint limit, as a share of half the joint's range. ``manipulability``:
    Yoshikawa's measure, of the linear rows if the task is a position. ``nearest``: minus the distance to the seed.
    """
    out = np.full(len(q), -math.inf)
    rows = ~np.isnan(q[:, 0])
    if problem.options.prefer == "nearest":
        off = problem.requirement.weights * (q[rows] - problem.seed)
        out[rows] = -np.sqrt((off * off).sum(axis=1))
        return out
    if problem.options.prefer == "limits":
        half = 0.5 * (problem.upper - problem.lower)
        counts = np.isfinite(half) & (half > 0.0)
        margin = np.minimum(q[rows] - problem.lower, problem.upper - q[rows])[:, counts] / half[counts]
        out[rows] = margin.min(axis=1, initial=1.0)
    else:
        J = jacobian_kernels.jacobian_many(problem.robot.model, np.ascontiguousarray(q[rows]))
        out[rows] = jacobian_kernels.manipulability_many(J, 0, 3 if problem.code == POSITION else 6)
    return out


def searches(problem: IKProblem, branches: Branches) -> bool:
    """Whether there may be better values than those that the solver has chosen."""
    if problem.options.prefer != "nearest":
        return True
    return any(len(branches.arcs[k]) for k in problem.searched)


def ranks(problem: IKProblem, q: Array, distance: Array) -> Array:
    """Rank of each configuration ``(k, n)`` by the preference ``(k,)``; of equal scores the nearer one is
    first."""
    worth = scores(problem, q)
    finite = worth[np.isfinite(worth)]
    scale = float(np.abs(finite).max(initial=0.0)) or 1.0
    order = np.lexsort((distance, -np.round(worth / scale, 7)))
    out = np.empty(len(q))
    out[order] = np.arange(len(q))
    return out


def centred(problem: IKProblem, q: Array) -> tuple[Array, Array]:
    """Rows ``(k, n)`` at the images that score best, with their statistics ``(k, 5)``."""
    near = None
    if problem.options.prefer == "limits":
        bounded = np.isfinite(problem.upper - problem.lower)
        near = problem.seed.copy()
        near[bounded] = 0.5 * (problem.lower[bounded] + problem.upper[bounded])
    return measure(problem, q, near)


def improve(problem: IKProblem, branches: Branches, good: Flags) -> None:
    """Set the redundancy parameters of every good row of `branches`, in place, to their best values.

    Where rows are not the same branches at all values, all of them get the value at which one of them is best.
    """
    assert problem.closed_form is not None  # whose branches these are
    form = problem.closed_form
    changing = bool(form.redundancies(POSE)) and not form.steady
    if changing and problem.code == POSE and not problem.requested:
        _improve_all(problem, branches, good)
        return
    branches.q, branches.stats = centred(problem, branches.q)
    score = scores(problem, branches.q)
    rows = np.flatnonzero(good)
    for k in problem.searched:
        there = rows[~np.isnan(branches.values[rows, k])]
        if len(branches.redundancies) == 1:
            _improve_together(problem, branches, score, there)
        else:
            for row in there.tolist():
                _improve_row(problem, branches, score, row, k)
    if changing and problem.searched:
        branches.completeness = weakest(branches.completeness, "searched")  # rows at values of their own


def _improve_all(problem: IKProblem, branches: Branches, good: Flags) -> None:
    """All solutions at the value at which one of them is best, of all values inside the limits, in place."""
    assert problem.closed_form is not None
    joint = problem.redundancies[0].joint
    low, high = float(problem.lower[joint]), float(problem.upper[joint])
    if not math.isfinite(high - low) or not problem.respect:
        low, high = float(problem.seed[joint]) - math.pi, float(problem.seed[joint]) + math.pi
    values = np.unique(np.append(np.linspace(low, high, _ALL_SAMPLES), branches.values[good, 0]))
    reached = _best_at(problem, values)
    step = (high - low) / (_ALL_SAMPLES - 1)
    peaks = [i for i in range(len(values)) if reached[i] == reached[max(i - 1, 0) : i + 2].max()]
    best = float(values[int(reached.argmax())])
    most = float(reached.max())
    for i in sorted(peaks, key=lambda i: -reached[i])[:_REFINED]:
        middle, width = float(values[i]), step
        for _ in range(_ZOOMS):
            tried = np.clip(middle + width * np.linspace(-0.8, 0.8, 7), low, high)
            there = _best_at(problem, tried)
            middle, width = float(tried[int(there.argmax())]), 0.27 * width
            if there.max() > most:
                best, most = middle, float(there.max())
    found = solve_branches(problem, problem.T, problem.code, None, (best,))
    if found is None or not found.good.any():
        return
    branches.q, branches.stats = centred(problem, found.q)
    branches.values, branches.arcs, branches.closed = found.values, found.arcs, found.closed
    branches.completeness = weakest(found.completeness, "searched")  # at the best value of many
    good[:] = found.good


def _best_at(problem: IKProblem, values: Array) -> Array:
    """The best score of all solutions at each value ``(k,)`` of the only redundancy parameter; −∞ for none."""
    assert problem.closed_form is not None
    kernels, rows = problem.closed_form.kernels, len(problem.closed_form.branches)
    out = np.empty((len(values), rows, problem.robot.n))
    targets = np.ascontiguousarray(np.broadcast_to(problem.T, (len(values), 4, 4)))
    kernels.many(kernels.params, targets, np.ascontiguousarray(values), problem.seed, out)
    q, stats = centred(problem, out.reshape(-1, problem.robot.n))
    fits = is_closed(problem, stats)
    if problem.respect:
        fits &= stats[:, OVERRUN] == 0.0
    return np.asarray(np.where(fits, scores(problem, q), -math.inf).reshape(len(values), rows).max(axis=1))


def _improve_together(problem: IKProblem, branches: Branches, score: Array, rows: NDArray[np.intp]) -> None:
    """The best value of the only parameter on each of `rows`: all samples of all branches in one batch call."""
    arcs = branches.arcs[0]
    arcs = arcs[np.isin(arcs[:, 0], rows)]
    if not len(arcs):
        return
    owner, (low, high) = arcs[:, 0].astype(np.intp), _inside(arcs[:, 1], arcs[:, 2])
    total = np.bincount(owner, high - low)[owner]
    count = np.where(high > low, 3 + (_SAMPLES * (high - low) / np.where(total > 0.0, total, 1.0)).astype(int), 1)
    step = (high - low) / np.maximum(count - 1, 1)
    grid = np.arange(count.max())
    values = np.where(grid < count[:, None], low[:, None] + step[:, None] * grid, math.nan)
    for _ in range(_ZOOMS + 1):
        reached = _try_all(problem, branches, score, owner, np.minimum(values, high[:, None]))
        best = values[np.arange(len(values)), reached.argmax(axis=1)]
        middle = values
        values = np.clip(best[:, None] + step[:, None] * np.linspace(-0.8, 0.8, 7), low[:, None], high[:, None])
        step = 0.27 * step
    if problem.options.prefer == "nearest":  # an arm that follows is not to tremble: the top of a parabola
        _try_all(problem, branches, score, owner, _tops(middle, reached)[:, None])


def _tops(x: Array, y: Array) -> Array:
    """The top ``(k,)`` of a parabola through the best of equidistant samples ``(k, m)`` and its neighbours."""
    rows, place = np.arange(len(x)), np.clip(y.argmax(axis=1), 1, x.shape[1] - 2)
    before, best, after = (y[rows, place + i] for i in (-1, 0, 1))
    middle, width = x[rows, place], x[rows, place + 1] - x[rows, place]
    with np.errstate(invalid="ignore", divide="ignore"):
        off = 0.5 * width * (before - after) / (before - 2.0 * best + after)
    return np.asarray(np.where(np.abs(off) <= width, middle + off, middle))


def _inside(low: Array, high: Array) -> tuple[Array, Array]:
    """Slightly inside the ends of intervals ``(k,)``: at the very end two branches may meet, and would be one."""
    inset = np.minimum(TOLERANCES.interval_inset, 0.5 * (high - low))
    return low + inset, high - inset


def _try_all(
    problem: IKProblem, branches: Branches, score: Array, owner: NDArray[np.intp], values: Array
) -> Array:
    """Scores of the values ``(k, m)`` on branches `owner` ``(k,)``; a better one replaces the branch's row.

    That of NaN is −∞.
    """
    tried = ~np.isnan(values)
    flat, whose = values[tried], np.broadcast_to(owner[:, None], values.shape)[tried]
    q, stats = centred(problem, _rows_at(problem, flat, whose))
    fits = is_closed(problem, stats)
    if problem.respect:
        fits &= stats[:, OVERRUN] == 0.0
    found = np.where(fits, scores(problem, q), -math.inf)
    for i in np.argsort(-found, kind="stable").tolist():
        row = whose[i]
        if found[i] > score[row]:
            score[row] = found[i]
            branches.q[row], branches.stats[row] = q[i], stats[i]
            branches.values[row, 0] = wrap(flat[i]) if branches.redundancies[0].circular else flat[i]
    reached = np.full(values.shape, -math.inf)
    reached[tried] = found
    return reached


def _rows_at(problem: IKProblem, values: Array, rows: NDArray[np.intp]) -> Array:
    """One row ``(k, n)`` of the branches at each value ``(k,)`` of the only redundancy parameter."""
    assert problem.closed_form is not None  # whose branches these are
    if problem.code == POSE:
        targets = np.repeat(problem.T[None], len(values), axis=0)
        return problem.closed_form.rows_at(targets, values, problem.seed, rows)
    asked = values.tolist()
    found = {
        value: candidates_of(problem, problem.T, problem.code, None, (value,)) for value in dict.fromkeys(asked)
    }
    there = {value: each.q for value, each in found.items() if each is not None}
    return np.array([there[value][row] for value, row in zip(asked, rows.tolist(), strict=True)])


def _improve_row(problem: IKProblem, branches: Branches, score: Array, row: int, k: int) -> None:
    """The best value of parameter `k` on one branch, with the other parameters fixed."""
    fixed = [
        float(branches.q[row, parameter.joint] if parameter.joint >= 0 else branches.values[row, i])
        for i, parameter in enumerate(branches.redundancies)
    ]
    arcs = branches.arcs[k]
    if len(branches.redundancies) > 1:
        # The present ranges may belong to other values of the other parameters.
        arcs = _solve(problem, branches, row, [v if i != k else math.nan for i, v in enumerate(fixed)]).arcs[k]
    arcs = arcs[arcs[:, 0] == row][:, 1:]
    total = float((arcs[:, 1] - arcs[:, 0]).sum())
    for low, high in np.stack(_inside(arcs[:, 0], arcs[:, 1]), axis=1).tolist():
        count = 3 + int(_SAMPLES * (high - low) / total) if high > low else 1
        step = (high - low) / max(count - 1, 1)
        values = np.linspace(low, high, count)
        for _ in range(_ZOOMS if high > low else 1):
            reached = [_try(problem, branches, score, row, k, fixed, value) for value in values.tolist()]
            best = float(values[int(np.argmax(reached))])
            values = np.clip(best + step * np.linspace(-0.8, 0.8, 7), low, high)
            step *= 0.27


def _try(
    problem: IKProblem, branches: Branches, score: Array, row: int, k: int, fixed: list[float], value: float
) -> float:
    """The score of one value; a better one replaces the row."""
    tried = _solve(problem, branches, row, [value if i == k else v for i, v in enumerate(fixed)])
    q, stats = centred(problem, tried.q[row : row + 1])
    if not is_closed(problem, stats)[0] or (problem.respect and stats[0, OVERRUN] > 0.0):
        return -math.inf
    reached = float(scores(problem, q)[0])
    if reached > score[row]:
        score[row] = reached
        branches.q[row], branches.stats[row], branches.values[row] = q[0], stats[0], tried.values[row]
        for j, (old, new) in enumerate(zip(branches.arcs, tried.arcs, strict=True)):
            if j != k:
                branches.arcs[j] = np.concatenate([old[old[:, 0] != row], new[new[:, 0] == row]])
    return reached


def _solve(problem: IKProblem, branches: Branches, row: int, values: list[float]) -> Branches:
    """The branches at these values, near the present row."""
    found = solve_branches(problem, problem.T, problem.code, branches.q[row].copy(), tuple(values))
    assert found is not None  # the same closed form gave the row
    return found
