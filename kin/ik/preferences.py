"""Which answer is preferred, where the task leaves something free.

The solvers themselves choose the free value nearest to the seed. The other preferences look for the best value on
each branch: samples over its exact feasible ranges, then a closing zoom round the best of them. Outside those
ranges nothing is ever tried, so the choice is always feasible. Of two free values each is sought with the other
one held.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.ik.branches import Branches, Flags, is_closed, measure, solve_branches
from kin.ik.candidates import OVERRUN
from kin.ik.problem import Question
from kin.kernels import jacobian as jacobian_kernels
from kin.solvers.common import wrap
from kin.solvers.contract import POSE, POSITION
from kin.transforms import Array

_SAMPLES = 24
_ZOOMS = 4


def scores(question: Question, q: Array) -> Array:
    """How well configurations ``(k, n)`` do what is preferred ``(k,)``, more is better; −∞ for NaN rows.

    ``limits``: the least margin to a stop, as a share of half the joint's range. ``manipulability``: Yoshikawa's
    figure, of the linear rows when only the point matters.
    """
    out = np.full(len(q), -math.inf)
    rows = ~np.isnan(q[:, 0])
    if question.prefer == "limits":
        half = 0.5 * (question.upper - question.lower)
        counts = np.isfinite(half) & (half > 0.0)
        margin = np.minimum(q[rows] - question.lower, question.upper - q[rows])[:, counts] / half[counts]
        out[rows] = margin.min(axis=1, initial=1.0)
    else:
        J = jacobian_kernels.jacobian_many(question.robot.model, np.ascontiguousarray(q[rows]))
        out[rows] = jacobian_kernels.manipulability_many(J, 0, 3 if question.code == POSITION else 6)
    return out


def ranks(question: Question, q: Array, distance: Array) -> Array:
    """Place of each configuration ``(k, n)`` in the preferred order ``(k,)``; of equals the nearer comes first."""
    worth = scores(question, q)
    finite = worth[np.isfinite(worth)]
    scale = float(np.abs(finite).max(initial=0.0)) or 1.0
    order = np.lexsort((distance, -np.round(worth / scale, 7)))
    out = np.empty(len(q))
    out[order] = np.arange(len(q))
    return out


def centred(question: Question, q: Array) -> tuple[Array, Array]:
    """Rows ``(k, n)`` at the images the preference wants, with their statistics ``(k, 5)``."""
    near = None
    if question.prefer == "limits":
        middle = 0.5 * (question.lower + question.upper)
        near = np.where(np.isfinite(middle), middle, question.seed)
    return measure(question, q, near)


def improve(question: Question, branches: Branches, good: Flags) -> None:
    """Bring every good row of `branches`, in place, to its best free values."""
    branches.q, branches.stats = centred(question, branches.q)
    score = scores(question, branches.q)
    rows = np.flatnonzero(good)
    for k in range(len(branches.freedoms)):
        if not math.isnan(question.values[k]):
            continue
        there = rows[~np.isnan(branches.values[rows, k])]
        if len(branches.freedoms) == 1 and question.code == POSE:
            _improve_together(question, branches, score, there)
        else:
            for row in there.tolist():
                _improve_row(question, branches, score, row, k)


def _improve_together(question: Question, branches: Branches, score: Array, rows: NDArray[np.intp]) -> None:
    """The best value of the one freedom on each of `rows`, all samples of all branches in one thin call."""
    arcs = branches.arcs[0]
    arcs = arcs[np.isin(arcs[:, 0], rows)]
    if not len(arcs):
        return
    owner, low, high = arcs[:, 0].astype(np.intp), arcs[:, 1], arcs[:, 2]
    total = np.bincount(owner, high - low)[owner]
    count = np.where(high > low, 3 + (_SAMPLES * (high - low) / np.where(total > 0.0, total, 1.0)).astype(int), 1)
    step = (high - low) / np.maximum(count - 1, 1)
    grid = np.arange(count.max())
    values = np.where(grid < count[:, None], low[:, None] + step[:, None] * grid, math.nan)
    for _ in range(_ZOOMS + 1):
        reached = _try_all(question, branches, score, owner, np.minimum(values, high[:, None]))
        best = values[np.arange(len(values)), reached.argmax(axis=1)]
        values = np.clip(best[:, None] + step[:, None] * np.linspace(-0.8, 0.8, 7), low[:, None], high[:, None])
        step = 0.27 * step


def _try_all(
    question: Question, branches: Branches, score: Array, owner: NDArray[np.intp], values: Array
) -> Array:
    """Scores of the values ``(k, m)`` of branches `owner` ``(k,)``; a row is taken over if one is better."""
    assert question.match is not None  # whose branches these are
    kernels = question.match.kernels
    flat = np.ascontiguousarray(values.reshape(-1))
    whose = np.repeat(owner, values.shape[1])
    out = np.empty((len(flat), len(branches.q), question.robot.n))
    targets = np.ascontiguousarray(np.broadcast_to(question.T, (len(flat), 4, 4)))
    kernels.many(kernels.params, targets, flat, question.seed, out)
    q, stats = centred(question, out[np.arange(len(flat)), whose])
    fits = is_closed(stats) & ~np.isnan(flat)
    if question.respect:
        fits &= stats[:, OVERRUN] == 0.0
    reached = np.where(fits, scores(question, q), -math.inf)
    for i in np.argsort(-reached, kind="stable").tolist():
        row = whose[i]
        if reached[i] > score[row]:
            score[row] = reached[i]
            branches.q[row], branches.stats[row] = q[i], stats[i]
            branches.values[row, 0] = wrap(flat[i]) if branches.freedoms[0].circular else flat[i]
    return reached.reshape(values.shape)


def _improve_row(question: Question, branches: Branches, score: Array, row: int, k: int) -> None:
    """The best value of freedom `k` on one branch, the other freedoms held."""
    held = [
        float(branches.q[row, freedom.joint] if freedom.joint >= 0 else branches.values[row, i])
        for i, freedom in enumerate(branches.freedoms)
    ]
    arcs = branches.arcs[k]
    if len(branches.freedoms) > 1:
        # The ranges at hand may belong to other values of the other freedoms.
        arcs = _solve(question, branches, row, [v if i != k else math.nan for i, v in enumerate(held)]).arcs[k]
    arcs = arcs[arcs[:, 0] == row][:, 1:]
    total = float((arcs[:, 1] - arcs[:, 0]).sum())
    for low, high in arcs.tolist():
        count = 3 + int(_SAMPLES * (high - low) / total) if high > low else 1
        step = (high - low) / max(count - 1, 1)
        values = np.linspace(low, high, count)
        for _ in range(_ZOOMS if high > low else 1):
            reached = [_try(question, branches, score, row, k, held, value) for value in values.tolist()]
            best = float(values[int(np.argmax(reached))])
            values = np.clip(best + step * np.linspace(-0.8, 0.8, 7), low, high)
            step *= 0.27


def _try(
    question: Question, branches: Branches, score: Array, row: int, k: int, held: list[float], value: float
) -> float:
    """The score of one value; the row is taken over if it is better than what it had."""
    tried = _solve(question, branches, row, [value if i == k else h for i, h in enumerate(held)])
    q, stats = centred(question, tried.q[row : row + 1])
    if not is_closed(stats)[0] or (question.respect and stats[0, OVERRUN] > 0.0):
        return -math.inf
    reached = float(scores(question, q)[0])
    if reached > score[row]:
        score[row] = reached
        branches.q[row], branches.stats[row], branches.values[row] = q[0], stats[0], tried.values[row]
        for j, (old, new) in enumerate(zip(branches.arcs, tried.arcs, strict=True)):
            if j != k:
                branches.arcs[j] = np.concatenate([old[old[:, 0] != row], new[new[:, 0] == row]])
    return reached


def _solve(question: Question, branches: Branches, row: int, values: list[float]) -> Branches:
    """The branches at these values, near what the row is now."""
    found = solve_branches(question, question.T, question.code, branches.q[row].copy(), tuple(values))
    assert found is not None  # the same closed form has just answered
    return found
