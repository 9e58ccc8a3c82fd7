"""The branches of one problem: rows of the closed form at their best whole turns, measured by FK."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kin.angles import TURN
from kin.fk import fk
from kin.ik.candidates import DISTANCE, ROLL, Rows, accept, measure_and_sort, measure_rows, ranges, select
from kin.ik.candidates import Flags as Flags
from kin.ik.details import JointKind, LimitViolation, Redundancy
from kin.ik.problem import IKProblem
from kin.ik.results import IKSolution
from kin.solvers.canonical import merged
from kin.solvers.contract import (
    APPROACH,
    Candidates,
    ClosedForm,
    Completeness,
    Obstacle,
    RedundancyParameter,
    SolverInput,
)
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_NO_LIMIT = 1e6
_BOOL, _WHOLE = np.dtype(bool), np.dtype(np.int64)
_empty = np.empty
_WHOLE_CIRCLE = ((-math.pi, math.pi),)


@dataclass(slots=True, eq=False)
class Branches:
    """One row per branch; where two have merged, both rows hold the same joint values.

    Attributes:
        q: ``(k, n)``, NaN where the branch does not exist.
        stats: ``(k, 5)``, columns as in :mod:`kin.ik.candidates`.
        closed, good: ``(k,)``, which rows meet the task, and which of them the limits allow (if they count).
        order: the good rows, nearest to the seed first, each configuration once.
        redundancies: the redundancy parameters of `values` and `arcs`.
        values, arcs, gap, obstacle, completeness, further: as in `kin.solvers.contract.Candidates`.
    """

    q: Array
    stats: Array
    closed: Flags
    good: Flags
    order: list[int]
    redundancies: tuple[RedundancyParameter, ...]
    values: Array
    arcs: list[Array]
    gap: float
    obstacle: Obstacle | None
    completeness: Completeness
    further: Callable[[], Array] | None


def is_closed(problem: IKProblem, stats: Array) -> Flags:
    """Which rows of statistics ``(k, 5)`` meet the task, whether or not inside the limits ``(k,)``."""
    closed, good = np.empty((2, len(stats)), dtype=bool)
    accept(problem.requirement, stats, False, closed, good)
    return closed


def solve_branches(
    problem: IKProblem, T: Array, code: int, seed: Array | None = None, values: tuple[float, ...] | None = None,
    found: Candidates | None = None,
) -> Branches | None:  # fmt: skip
    """The branches of the arm's closed form for target `T` ``(4, 4)``, None if it has none for this task.

    Args:
        problem: limits, seed, and the target and task that the rows are measured against.
        T, code, seed, values: as for `candidates_of`; the errors are measured against the problem's own target.
        found: what `candidates_of` gives for them, if it has been asked.
    """
    closed_form = problem.closed_form
    if found is None:
        found = candidates_of(problem, T, code, seed, values)
    if found is None or closed_form is None:
        return None
    redundancies = problem.redundancies if code == problem.code else closed_form.redundancies(code)
    q = found.q.copy()
    k = len(q)
    rows = Rows(q, _empty((k, 5)), _empty(k, _BOOL), _empty(k, _BOOL), _empty(k, _WHOLE))
    seed = problem.seed if seed is None else seed
    count = measure_and_sort(problem.requirement, problem.T, seed, problem.seed, rows)
    on_seed, count = count < 0, max(count, -1 - count)
    branches = Branches(
        q, rows.stats, rows.closed, rows.good, rows.order[:count].tolist(), redundancies, found.values,
        list(found.arcs), found.gap, found.obstacle, found.completeness, found.further,
    )  # fmt: skip
    if on_seed and values is None and not problem.requested:
        _put_seed(problem, closed_form, branches)
    return branches


def _put_seed(problem: IKProblem, form: ClosedForm, branches: Branches) -> None:
    """Make the seed, which meets the target, the row of the branch that it is on, and the first solution.

    Where branches merge, the formulas miss it by the root of the rounding error, or find it outside the limits.
    """
    q, stats = measure(problem, problem.seed[None])
    apart = np.where(branches.good, np.abs(branches.q - q).max(axis=1), math.inf)
    row = int(np.argmin(apart))
    if not apart[row] < TOLERANCES.same_branch:
        row = form.branch_of(problem.seed) if form.named else int(np.argmin(branches.good))
        if not (form.named and branches.closed[row]):
            branches.completeness = "unknown"  # a posture was missed
    branches.q[row], branches.stats[row] = q[0], stats[0]
    branches.closed[row] = branches.good[row] = True
    branches.values = branches.values.copy()
    for k, parameter in enumerate(branches.redundancies):
        value = _value_at(problem, form, parameter, q[0], float(stats[0, ROLL]))
        if not (math.isnan(value) or (parameter.rare and math.isnan(branches.values[row, k]))):
            branches.values[row, k] = value
            arcs = branches.arcs[k]
            _, low, high = arcs[arcs[:, 0] == row].T
            past = (value - low) % TURN if parameter.circular else value - low
            if problem.respect and not ((past >= 0.0) & (past <= high - low)).any():
                branches.arcs[k] = np.concatenate([arcs, [[row, value, value]]])
    kept, count = select(branches.q, np.where(branches.good, branches.stats[:, DISTANCE], math.inf))
    branches.order = kept[:count].tolist()


def _value_at(
    problem: IKProblem, form: ClosedForm, parameter: RedundancyParameter, q: Array, roll: float
) -> float:
    """The value of a redundancy parameter at a configuration ``(n,)`` that meets the target; NaN if unknown."""
    if parameter.joint >= 0:
        return float(q[parameter.joint])
    return roll if parameter.name == "roll" else form.value_at(problem.T, q)


def candidates_of(
    problem: IKProblem, T: Array, code: int, seed: Array | None = None, values: tuple[float, ...] | None = None
) -> Candidates | None:
    """What the arm's closed form finds for target `T` ``(4, 4)``, None if it has none for this task.

    Args:
        problem: the limits, and whatever is not given.
        T: target of the closed form.
        code: task of the closed form.
        seed: another seed than the problem's.
        values: other values of the redundancy parameters than the problem's, NaN to let them be chosen.
    """
    closed_form = problem.closed_form
    if closed_form is None or not closed_form.handles(code):
        return None
    redundancies = problem.redundancies if code == problem.code else closed_form.redundancies(code)
    if values is None:
        values = problem.values if code == problem.code else (math.nan,) * len(redundancies)
    seed = problem.seed if seed is None else seed
    roll = 0.0
    if code == APPROACH and "roll" in [parameter.name for parameter in redundancies]:
        x = fk(problem.robot, seed)[:3, 0]
        roll = math.atan2(float(T[:3, 1] @ x), float(T[:3, 0] @ x))
    lower, upper = limits_of(problem)
    return closed_form.solve(SolverInput(T, code, values, problem.respect, seed, lower, upper, roll))


def limits_of(problem: IKProblem) -> tuple[Array, Array]:
    """The limits ``(n,)`` that a closed form keeps.

    Limits that are ignored must not pull redundancy parameters away from the seed either.
    """
    lower, upper = problem.lower, problem.upper
    if problem.respect:
        return lower, upper
    return np.full_like(lower, -_NO_LIMIT), np.full_like(upper, _NO_LIMIT)


def measure(
    problem: IKProblem, q: Array, near: Array | None = None, code: int | None = None
) -> tuple[Array, Array]:
    """Configurations ``(k, n)`` at their best images, with their statistics ``(k, 5)`` by FK."""
    q = np.array(q, order="C")
    stats = np.empty((q.shape[0], 5))
    requirement = problem.requirement
    if code is not None:
        requirement = requirement._replace(task=code)
    near = problem.seed if near is None else near
    measure_rows(requirement, problem.T, near, problem.seed, q, stats)
    return q, stats


def solution(
    problem: IKProblem, q: Array, stats: Array, branch: int | None = None, compromise: str | None = None
) -> IKSolution:
    """A row as a solution; its branch is computed if it is not given."""
    q = q.copy()
    q.flags.writeable = False
    branch = problem.branch_of(q) if branch is None else branch
    position, rotation, distance, overrun, _ = stats.tolist()
    name = problem.branch_name(branch)
    return IKSolution(q, name, position, rotation, overrun == 0.0, distance, (), compromise)


def redundancy_of(
    problem: IKProblem, branches: Branches, rows: list[int], every: Flags
) -> tuple[list[tuple[Redundancy, ...]], tuple[Redundancy, ...]]:
    """The redundancy parameters of each branch in `rows`: values and ranges; and those of the first row with the
    ranges of all branches in `every` ``(k,)``, but for further ones (`with_further`).

    A parameter that is a joint's value follows its whole-turn image. Without limits an angle may have any value.
    """
    found: list[tuple[Redundancy, ...]] = [()] * len(rows)
    together: tuple[Redundancy, ...] = ()
    for k, parameter in enumerate(branches.redundancies):
        there = branches.values[:, k].tolist()
        if not rows or all(map(math.isnan, there)):
            continue
        values = there if parameter.joint < 0 else branches.q[:, parameter.joint].tolist()
        intervals = _intervals(problem, branches.arcs[k], rows, every, parameter.circular)
        name, label = parameter.name, parameter.label
        for i, row in enumerate(rows):
            if not math.isnan(there[row]):
                found[i] += (Redundancy(name, label, values[row], intervals[i]),)
        if not math.isnan(there[rows[0]]):
            together += (Redundancy(name, label, values[rows[0]], intervals[-1]),)
    return found, together


def with_further(branches: Branches, together: tuple[Redundancy, ...]) -> tuple[Redundancy, ...]:
    """The redundancy parameters with the values at which there are configurations on no row of `branches`."""
    if branches.further is None or not together:
        return together
    first = together[0]
    every = merged(((0, *ends) for ends in (*first.intervals, *branches.further().tolist())), TOLERANCES.merge)
    return (first._replace(intervals=tuple((low, high) for _, low, high in every)), *together[1:])


def _intervals(
    problem: IKProblem, arcs: Array, rows: list[int], every: Flags, circular: bool
) -> list[tuple[tuple[float, float], ...]]:
    """Ranges on each branch in `rows`, and those of all branches in `every`."""
    out = np.empty((4 * len(arcs) + 2, 3))
    count = ranges(arcs, np.array(rows), every, circular, out) if problem.respect else -1
    if count < 0:
        return [_WHOLE_CIRCLE] * (len(rows) + 1)
    found: list[tuple[tuple[float, float], ...]] = [()] * (len(rows) + 1)
    for row, low, high in out[:count].tolist():
        found[int(row)] += ((low, high),)
    return found


def violations_of(problem: IKProblem, q: Array) -> tuple[LimitViolation, ...]:
    """The joint values of configuration q ``(n,)`` that are outside the limits."""
    found = []
    for i, joint in enumerate(problem.robot.joints):
        if not problem.lower[i] <= q[i] <= problem.upper[i]:
            limit = problem.lower[i] if q[i] < problem.lower[i] else problem.upper[i]
            kind: JointKind = "prismatic" if joint.kind == "prismatic" else "revolute"
            found.append(LimitViolation(i, joint.name, float(q[i]), float(limit), kind, problem.locked[i]))
    return tuple(found)
