"""Branches of one question: asked of the closed form, brought to their best whole turns, measured by FK."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kin.fk import fk
from kin.ik.candidates import Flags as Flags
from kin.ik.candidates import finish, judge, ranges, settle
from kin.ik.problem import Question
from kin.ik.results import IKSolution, LimitViolation, Redundancy
from kin.solvers.contract import APPROACH, Obstacle, RedundancyParameter, SolverInput
from kin.transforms import Array

_NO_LIMIT = 1e6
_EVERYWHERE = ((-math.pi, math.pi),)


@dataclass(slots=True, eq=False)
class Branches:
    """One row per branch; where two have merged, both rows hold the same joints.

    Attributes:
        q: ``(k, n)``, NaN where the branch does not exist.
        stats: ``(k, 5)``, columns as in :mod:`kin.ik.candidates`.
        closed, good: ``(k,)``, which rows meet the task, and which are inside the limits too if those count.
        order: the good rows, nearest to the seed first, each posture once.
        freedoms: what `values` and `arcs` are about.
        values, arcs, gap, obstacle: as in `kin.solvers.contract.Candidates`.
    """

    q: Array
    stats: Array
    closed: Flags
    good: Flags
    order: list[int]
    freedoms: tuple[RedundancyParameter, ...]
    values: Array
    arcs: list[Array]
    gap: float
    obstacle: Obstacle | None


def is_closed(stats: Array) -> Flags:
    """Which rows of statistics ``(k, 5)`` meet the task, whatever the limits say ``(k,)``."""
    closed, good = np.empty((2, len(stats)), dtype=bool)
    judge(stats, False, closed, good)
    return closed


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
    if match is None or not match.handles(code):
        return None
    freedoms = question.freedoms if code == question.code else match.redundancies(code)
    if values is None:
        values = question.values if code == question.code else (math.nan,) * len(freedoms)
    seed = question.seed if seed is None else seed
    roll = 0.0
    if code == APPROACH and "roll" in [freedom.name for freedom in freedoms]:
        x = fk(question.robot, seed)[:3, 0]
        roll = math.atan2(float(T[:3, 1] @ x), float(T[:3, 0] @ x))
    lower, upper = question.lower, question.upper
    if not question.respect:
        # Limits to be ignored must not even pull what is free away from the seed.
        lower, upper = np.full_like(lower, -_NO_LIMIT), np.full_like(upper, _NO_LIMIT)
    found = match.solve(SolverInput(T, code, values, question.respect, seed, lower, upper, roll))
    q = np.array(found.q, order="C")
    count = len(q)
    stats, closed, good, order = (
        np.empty((count, 5)),
        np.empty(count, bool),
        np.empty(count, bool),
        np.empty(count, int),
    )
    count = settle(
        question.robot.model, question.T, question.code, question.mask, seed, question.seed, question.lower,
        question.upper, question.turns, question.respect, q, stats, closed, good, order,
    )  # fmt: skip
    return Branches(
        q, stats, closed, good, order[:count].tolist(), freedoms, found.values, list(found.arcs), found.gap,
        found.obstacle,
    )  # fmt: skip


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
    question: Question, q: Array, stats: Array, branch: int | None = None, compromise: str | None = None
) -> IKSolution:
    """A row as a result; its branch is worked out where it is not known."""
    q = q.copy()
    q.flags.writeable = False
    branch = question.branch_of(q) if branch is None else branch
    position, rotation, distance, overrun, _ = stats.tolist()
    name = question.branch_name(branch)
    return IKSolution(q, name, position, rotation, overrun == 0.0, distance, (), compromise)


def redundancy_of(
    question: Question, branches: Branches, rows: list[int], every: Flags
) -> tuple[list[tuple[Redundancy, ...]], tuple[Redundancy, ...]]:
    """What is free on each branch of `rows`: the value used, and its ranges; and for the first of them with the
    ranges of all branches in `every` ``(k,)``.

    A joint's own value follows its whole-turn image. Without limits an angle may be anything.
    """
    found: list[tuple[Redundancy, ...]] = [()] * len(rows)
    together: tuple[Redundancy, ...] = ()
    for k, freedom in enumerate(branches.freedoms):
        there = branches.values[:, k].tolist()
        if not rows or all(map(math.isnan, there)):
            continue
        values = there if freedom.joint < 0 else branches.q[:, freedom.joint].tolist()
        intervals = _intervals(question, branches.arcs[k], rows, every, freedom.circular)
        name, label = freedom.name, freedom.label
        for i, row in enumerate(rows):
            if not math.isnan(there[row]):
                found[i] += (Redundancy(name, label, values[row], intervals[i]),)
        if not math.isnan(there[rows[0]]):
            together += (Redundancy(name, label, values[rows[0]], intervals[-1]),)
    return found, together


def _intervals(
    question: Question, arcs: Array, rows: list[int], every: Flags, circular: bool
) -> list[tuple[tuple[float, float], ...]]:
    """Ranges of each row's branch, and those of all branches in `every`."""
    out = np.empty((4 * len(arcs) + 2, 3))
    count = ranges(arcs, np.array(rows), every, circular, out) if question.respect else -1
    if count < 0:
        return [_EVERYWHERE] * (len(rows) + 1)
    found: list[tuple[tuple[float, float], ...]] = [()] * (len(rows) + 1)
    for row, low, high in out[:count].tolist():
        found[int(row)] += ((low, high),)
    return found


def violations_of(question: Question, q: Array) -> tuple[LimitViolation, ...]:
    """The stops that configuration q ``(n,)`` breaks."""
    found = []
    for i, joint in enumerate(question.robot.joints):
        if not question.lower[i] <= q[i] <= question.upper[i]:
            limit = question.lower[i] if q[i] < question.lower[i] else question.upper[i]
            found.append(LimitViolation(i, joint.name, float(q[i]), float(limit)))
    return tuple(found)
