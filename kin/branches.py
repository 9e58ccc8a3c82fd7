"""Branches of one question: asked of the closed form, brought to their best whole turns, measured by FK."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kin.finish import DISTANCE, OVERRUN, POSITION_ERROR, ROTATION_ERROR, finish
from kin.fk import fk
from kin.question import Question
from kin.results import IKSolution, LimitViolation, Redundancy
from kin.solvers.common import APPROACH, TURN, Freedom, Problem, wrap
from kin.tolerances import TOLERANCES
from kin.transforms import Array

Flags = NDArray[np.bool_]
_NO_LIMIT = 1e6
_EVERYWHERE = ((-math.pi, math.pi),)


@dataclass(slots=True, eq=False)
class Branches:
    """One row per branch; where two have merged, both rows hold the same joints.

    Attributes:
        q: ``(k, n)``, NaN where the branch does not exist.
        stats: ``(k, 5)``, columns as in :mod:`kin.finish`.
        freedoms: what `values` and `arcs` are about.
        values, arcs, gap, obstacle: as in `kin.solvers.common.Candidates`.
    """

    q: Array
    stats: Array
    freedoms: tuple[Freedom, ...]
    values: Array
    arcs: list[Array]
    gap: float
    obstacle: str


def is_closed(stats: Array) -> Flags:
    """Which rows of statistics ``(k, 5)`` meet the task, whatever the limits say ``(k,)``."""
    return np.asarray(
        (stats[:, POSITION_ERROR] <= TOLERANCES.closure_position)
        & (stats[:, ROTATION_ERROR] <= TOLERANCES.closure_rotation)
    )


def solve_branches(
    question: Question, T: Array, code: int, seed: Array | None = None, values: tuple[float, ...] | None = None
) -> Branches | None:
    """The branches of the arm's closed form for target `T` ``(4, 4)``, None if it has none for this task.

    Args:
        question: limits, seed, and the task the rows are measured against.
        T: target of the closed form; the errors are told against the question's own.
        code: task of the closed form.
        seed: another seed than the question's.
        values: other values of the freedoms than the question's, NaN where free.
    """
    match = question.match
    if match is None or not match.solver.handles(match.geometry, code):
        return None
    freedoms = question.freedoms if code == question.code else match.solver.freedoms(match.geometry, code)
    if values is None:
        values = question.values if code == question.code else (math.nan,) * len(freedoms)
    seed = question.seed if seed is None else seed
    roll = 0.0
    if code == APPROACH:
        x = fk(question.robot, seed)[:3, 0]
        roll = math.atan2(float(T[:3, 1] @ x), float(T[:3, 0] @ x))
    lower, upper = question.lower, question.upper
    if not question.respect:
        # Limits to be ignored must not even pull what is free away from the seed.
        lower, upper = np.full_like(lower, -_NO_LIMIT), np.full_like(upper, _NO_LIMIT)
    problem = Problem(T, code, values, question.respect, seed, lower, upper, roll)
    candidates = match.solver.solve(match.geometry, problem)
    q, stats = measure(question, candidates.q, seed)
    found = candidates
    return Branches(q, stats, freedoms, found.values, list(found.arcs), found.gap, found.obstacle)


def measure(
    question: Question, q: Array, near: Array | None = None, code: int | None = None
) -> tuple[Array, Array]:
    """Configurations ``(k, n)`` at their best images, with their statistics ``(k, 5)`` by FK."""
    q = np.array(q, order="C")
    stats = np.empty((q.shape[0], 5))
    finish(
        question.robot.model, question.T, question.code if code is None else code, question.mask,
        question.seed if near is None else near, question.seed, question.lower, question.upper, question.turns,
        question.respect, q, stats,
    )  # fmt: skip
    return q, stats


def solution(
    question: Question,
    q: Array,
    stats: Array,
    branch: int | None = None,
    redundancy: tuple[Redundancy, ...] = (),
    compromise: str | None = None,
) -> IKSolution:
    """A row as a result; its branch is worked out where it is not known."""
    q = q.copy()
    q.flags.writeable = False
    return IKSolution(
        q=q,
        branch=question.branch_name(question.branch_of(q) if branch is None else branch),
        position_error=float(stats[POSITION_ERROR]),
        rotation_error=float(stats[ROTATION_ERROR]),
        in_limits=bool(stats[OVERRUN] == 0.0),
        distance=float(stats[DISTANCE]),
        redundancy=redundancy,
        compromise=compromise,
    )


def redundancy_of(
    question: Question, branches: Branches, rows: list[int], together: list[int] | None = None
) -> list[tuple[Redundancy, ...]]:
    """What is free on each branch of `rows`: the value used, and its ranges (or those of all branches in
    `together`).

    A joint's own value follows its whole-turn image. Without limits an angle may be anything.
    """
    found: list[tuple[Redundancy, ...]] = [()] * len(rows)
    for k, freedom in enumerate(branches.freedoms):
        values = branches.values[rows, k] if freedom.joint < 0 else branches.q[rows, freedom.joint]
        there = ~np.isnan(branches.values[rows, k])
        pieces: dict[int, list[tuple[float, float]]] = {}
        for row, low, high in branches.arcs[k].tolist():
            pieces.setdefault(int(row), []).append((low, high))
        for i, (row, value) in enumerate(zip(rows, values.tolist(), strict=True)):
            if there[i]:
                mine = [piece for r in together or (row,) for piece in pieces.get(r, ())]
                intervals: tuple[tuple[float, float], ...] = _EVERYWHERE
                if question.respect and all(map(math.isfinite, itertools.chain(*mine))):
                    intervals = union(mine, freedom.circular)
                found[i] += (Redundancy(freedom.name, freedom.label, value, intervals),)
    return found


def violations_of(question: Question, q: Array) -> tuple[LimitViolation, ...]:
    """The stops that configuration q ``(n,)`` breaks."""
    found = []
    for i, joint in enumerate(question.robot.joints):
        if not question.lower[i] <= q[i] <= question.upper[i]:
            limit = question.lower[i] if q[i] < question.lower[i] else question.upper[i]
            found.append(LimitViolation(i, joint.name, float(q[i]), float(limit)))
    return tuple(found)


def union(arcs: Iterable[tuple[float, float]], circular: bool) -> tuple[tuple[float, float], ...]:
    """Overlapping intervals joined and sorted; on a circle within (−π, π], split at the seam."""
    pieces: list[tuple[float, float]] = []
    for low, high in arcs:
        if not circular:
            pieces.append((low, high))
        elif high - low >= TURN - 1e-12:
            return _EVERYWHERE
        else:
            start = wrap(low)
            end = start + (high - low)
            if end > math.pi:
                pieces += [(start, math.pi), (-math.pi, end - TURN)]
            else:
                pieces.append((start, end))
    joined: list[tuple[float, float]] = []
    for low, high in sorted(pieces):
        if joined and low <= joined[-1][1] + 1e-12:
            joined[-1] = (joined[-1][0], max(high, joined[-1][1]))
        else:
            joined.append((low, high))
    return tuple(joined)
