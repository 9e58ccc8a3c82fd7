"""Solutions in which the arm touches neither itself nor obstacles.

Rows that touch are left out. Where the task leaves redundancy parameters, each branch that touches is searched for
values at which it does not: samples of its ranges, then finer ones on both sides of the best sample. A range of
free values that is narrower than the samples may be missed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kin.angles import TURN
from kin.collision.contacts import Surroundings, surroundings
from kin.ik import preferences
from kin.ik.assembly import make_result
from kin.ik.branches import Branches, Flags, measure, solution, solve_branches
from kin.ik.candidates import DISTANCE
from kin.ik.details import RollError, RotationError, Solved, Touching
from kin.ik.problem import IKProblem
from kin.ik.results import Cause, IKResult, Status
from kin.singularity import singularities_at
from kin.solvers.contract import weakest
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_STEP = math.radians(7.5)  # between samples of a redundancy parameter; of two, four times as much
_ZOOMS = 3
_SHARES = (-0.8, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 0.8)


def around(problem: IKProblem) -> Surroundings:
    """What the solutions of a problem must not touch."""
    options = problem.options
    return surroundings(problem.robot, tuple(options.obstacles), options.avoid_self_collision)


def is_free(problem: IKProblem, q: Array) -> Flags:
    """Which configurations ``(k, n)`` touch nothing; NaN rows do."""
    return np.asarray(around(problem).distances(q)[0] >= 0.0)


def with_all_solutions(problem: IKProblem) -> IKProblem:
    """The same problem without a largest number of solutions."""
    if problem.options.max_solutions is None:
        return problem
    return replace(problem, options=replace(problem.options, max_solutions=None))


def with_count(result: IKResult, touching: int) -> IKResult:
    """The result, saying how many configurations were left out."""
    assert isinstance(result.details, Solved)
    result.details = result.details._replace(touching=touching)
    return result


def checked(problem: IKProblem, result: IKResult, most: int | None) -> IKResult:
    """The result without solutions that touch, and with at most so many."""
    found = result.solutions
    if not found:
        return result
    free = is_free(problem, np.array([each.q for each in found]))
    if free.all():
        if most is not None:
            result.solutions = found[:most]
        return result
    kept = tuple(each for each, clear in zip(found, free.tolist(), strict=True) if clear)
    if not kept:
        return all_touch(problem, np.array([each.q for each in found]), None)
    details = result.details
    if isinstance(details, Solved):
        details = details._replace(configurations=len(kept), touching=details.touching + len(found) - len(kept))
    elif isinstance(details, RollError | RotationError):
        details = details._replace(rotation_error=kept[0].rotation_error)
    singular = singularities_at(problem.robot, kept[0].q, TOLERANCES.at_singularity)
    return replace(result, solutions=kept[:most], details=details, singularities=singular)


def all_touch(
    problem: IKProblem, q: Array, rows: NDArray[np.intp] | None, searched: tuple[str, ...] = ()
) -> IKResult:
    """The answer if all configurations ``(k, n)`` that meet the target touch something.

    The one with the fewest contacts is shown; of several, the one whose deepest contact is the least deep. The
    depth alone does not tell: where the axes of two capsules meet, it is the sum of their radii, however far they
    overlap.

    Args:
        rows: their branches, None if these are not known.
        searched: labels of the redundancy parameters that were searched.
    """
    near = around(problem)
    touching = [near.touches(each) for each in q]
    best = min(range(len(q)), key=lambda i: (len(touching[i]), -touching[i][0].distance))
    contact = touching[best][0]
    q, stats = measure(problem, q)
    branches = [problem.branch_of(row) for row in q] if rows is None else rows.tolist()
    names = [problem.branch_name(branch) for branch in branches]
    details = Touching(names[best], contact, len(set(names)), searched, len(touching[best]))
    cause: Cause = "self-collision" if contact.obstacle is None else "obstacle"
    closest = solution(problem, q[best], stats[best], branches[best])
    return make_result(problem, Status.COLLISION, cause, details, closest=closest)


def searchable(problem: IKProblem, branches: Branches, good: Flags) -> tuple[str, ...]:
    """Labels of the redundancy parameters that may have another value on one of the good rows ``(k,)``.

    Not one whose value was requested or whose joint is locked, nor one that only singular targets leave free where
    the target is not singular.
    """
    found = []
    for k, parameter in enumerate(branches.redundancies):
        if not math.isnan(problem.values[k]) or np.isnan(branches.values[good, k]).all():
            continue
        row, low, high = branches.arcs[k].T
        if not problem.respect or (good[row.astype(np.intp)] & (high - low > TOLERANCES.merge)).any():
            found.append(parameter.label)
    return tuple(found)


def free_rows(problem: IKProblem, branches: Branches, good: Flags) -> Flags:
    """Which good rows touch nothing, after redundancy parameters of the others were searched, in place."""
    free = np.zeros(len(good), bool)
    free[good] = is_free(problem, branches.q[good])
    wanted = good & ~free
    open_ones = [k for k, value in enumerate(problem.values[: len(branches.redundancies)]) if math.isnan(value)]
    if not open_ones or not wanted.any():
        return free
    search = _Search(problem, branches, around(problem))
    if not search.steady:
        if not free.any():
            search.everywhere(good, open_ones[0])
            free = good & is_free(problem, branches.q)
        return free
    step = _STEP if len(open_ones) == 1 else 4.0 * _STEP
    grid = search.grid(wanted, open_ones, step)
    return np.asarray(free | search.improved(wanted, grid, open_ones[-1], step))


@dataclass(frozen=True, eq=False)
class _Search:
    """The search for values of redundancy parameters."""

    problem: IKProblem
    branches: Branches
    near: Surroundings

    @property
    def steady(self) -> bool:
        """Whether a row is the same branch at every value."""
        form = self.problem.closed_form
        return form is not None and form.steady

    def at(self, values: tuple[float, ...]) -> tuple[Branches, Array]:
        """The branches at given values, and their keys ``(k,)``: smaller is better, infinite is none."""
        problem = self.problem
        problem.cancel()
        found = solve_branches(problem, problem.T, problem.code, None, values)
        assert found is not None
        key = np.full(len(found.q), math.inf)
        rows = np.flatnonzero(found.good)
        if len(rows):
            rows = rows[self.near.distances(found.q[rows])[0] >= 0.0]
            key[rows] = found.stats[rows, DISTANCE]
            if problem.options.prefer != "nearest":
                key[rows] = -preferences.scores(problem, found.q[rows])
        return found, key

    def grid(self, wanted: Flags, open_ones: list[int], step: float) -> list[tuple[float, ...]]:
        """Values of all parameters: samples of the open ones, in every combination."""
        samples: list[tuple[float, ...]] = [self.problem.values]
        for k in open_ones:
            more: list[tuple[float, ...]] = []
            for values in samples:
                arcs = self.branches.arcs[k] if len(samples) == 1 else self.at(values)[0].arcs[k]
                more += [(*values[:k], v, *values[k + 1 :]) for v in self._marks(arcs, wanted, step, k)]
            samples = more
        return samples

    def _marks(self, arcs: Array, wanted: Flags, step: float, k: int) -> list[float]:
        """Samples of the ranges of the wanted branches; of a range without limits, of one turn."""
        found: list[float] = []
        for branch, low, high in arcs.tolist():
            if not wanted[int(branch)]:
                continue
            if not math.isfinite(high - low) or high - low > TURN:
                middle = float(np.nan_to_num(self.branches.values[int(branch), k]))
                low, high = middle - 0.5 * TURN, middle + 0.5 * TURN
            found += np.linspace(low, high, max(2, math.ceil((high - low) / step) + 1)).tolist()
        return sorted({round(value, 9) for value in found})

    def improved(self, wanted: Flags, grid: list[tuple[float, ...]], last: int, step: float) -> Flags:
        """Put the best free values into the wanted rows; returns the rows for which there are any."""
        count = len(wanted)
        best = np.full(count, math.inf)
        chosen: dict[int, tuple[float, ...]] = {}

        def attempt(values: tuple[float, ...]) -> None:
            found, key = self.at(values)
            for row in np.flatnonzero(wanted & (key < best)).tolist():
                best[row], chosen[row] = key[row], values
                self.branches.q[row], self.branches.stats[row] = found.q[row], found.stats[row]
                self.branches.values[row] = found.values[row]

        for values in grid:
            attempt(values)
        for _ in range(_ZOOMS):
            for values in {*chosen.values()}:
                for share in _SHARES:
                    attempt((*values[:last], values[last] + share * step, *values[last + 1 :]))
            step *= 0.2
        return np.asarray(np.isfinite(best))

    def everywhere(self, good: Flags, k: int) -> None:
        """All rows at the value of parameter k at which one is best, in place, where rows are not branches."""
        problem = self.problem
        joint = problem.redundancies[k].joint
        low, high = -math.pi, math.pi  # of a roll
        if joint >= 0:
            low, high = float(problem.lower[joint]), float(problem.upper[joint])
            if not math.isfinite(high - low) or not problem.respect:
                low, high = float(problem.seed[joint]) - math.pi, float(problem.seed[joint]) + math.pi
        step = _STEP
        values = np.linspace(low, high, max(2, math.ceil((high - low) / step) + 1)).tolist()
        least = math.inf
        best: Branches | None = None
        for _ in range(_ZOOMS + 1):
            middle = None
            for value in values:
                found, key = self.at((*problem.values[:k], value, *problem.values[k + 1 :]))
                if key.min() < least:
                    least, best, middle = float(key.min()), found, value
            if middle is None:
                break
            values = [min(max(middle + share * step, low), high) for share in _SHARES]
            step *= 0.2
        if best is not None:
            branches = self.branches
            branches.q[:], branches.stats[:], branches.values[:] = best.q, best.stats, best.values
            branches.arcs, branches.closed = best.arcs, best.closed
            branches.completeness = weakest(best.completeness, "searched")  # at the best value of many
            good[:] = best.good
