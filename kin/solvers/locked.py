"""Arms with seven joints of which one is locked: all postures, and no redundancy parameter.

A locked joint is a rigid link. What it makes of the arm depends on the closed form of the whole arm:

- its redundancy parameter is the value of that joint: its only feasible value is the one the joint is locked at;
- its ranges are exact: on each branch, those of a joint that may have one value only are single values of the
  redundancy parameter, one for each posture (`SingleValues`);
- else the six joints that are left are an arm of their own (`LockedJoints`).

Postures keep the names of the whole arm's branches. Several may be on one branch, with different arm angles for
example.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from kin.angles import wrap
from kin.fk import jacobian
from kin.robot import Robot
from kin.solvers import closed_form_of
from kin.solvers.common import UNBOUNDED
from kin.solvers.contract import (
    APPROACH,
    POSE,
    Candidates,
    ClosedForm,
    RedundancyParameter,
    SolverInput,
    WrappedForm,
    weakest,
)
from kin.solvers.reduced import fixed
from kin.solvers.reversed import kernels_by_solving
from kin.solvers.singular import JointValue, Singularity
from kin.tolerances import TOLERANCES
from kin.transforms import Array

Locks = tuple[float | None, ...]
_PER_BRANCH = 16  # rows for each branch of the whole arm: as many as six joints have postures
_SINGLE = 1e-6  # rad; the most that rounding makes of a single value


@lru_cache(maxsize=256)
def form_with_locked(robot: Robot, locked: Locks | None, task: int = POSE) -> ClosedForm | None:
    """The solver of an arm with locked joints: that of the whole arm unless they leave no redundancy parameter."""
    form = named_form_of(robot)
    values = {i: value for i, value in enumerate(locked or ()) if value is not None}
    if not values or robot.n - len(values) != 6 or not _determined(robot, values, task):
        return form
    if form is not None and robot.n == 7:
        ((joint, value),) = values.items()
        first = form.redundancies(POSE)[0]
        if first.joint == joint:
            return form
        if form.exact_ranges:
            return SingleValues(form, joint, value)
    inner = closed_form_of(fixed(robot, values))
    return form if inner is None else LockedJoints(robot, form, inner, values)


@lru_cache(maxsize=256)
def named_form_of(robot: Robot) -> ClosedForm | None:
    """The solver of an arm; postures of a calibrated one are called as they would be in its nominal table."""
    form, nominal = closed_form_of(robot), robot.nominal_arm
    if form is None or form.named or nominal is None:
        return form
    names = closed_form_of(nominal)
    return form if names is None or not names.named else LockedJoints(robot, names, form, {})


def _determined(robot: Robot, values: dict[int, float], task: int) -> bool:
    """Whether the six joints that are left can meet any pose; if the tool may roll, it needs its last joint."""
    if task == APPROACH and robot.n - 1 in values:
        return False
    others = [i for i in range(robot.n) if i not in values]
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (4, robot.n))
    q[:, list(values)] = list(values.values())
    return bool(np.linalg.matrix_rank(jacobian(robot, q)[..., others], rtol=1e-9).max() == 6)


def _several(names: tuple[str, ...]) -> tuple[str, ...]:
    """The names of rows, several for each branch."""
    return tuple(name for name in names for _ in range(_PER_BRANCH))


def _place(q: Array, branch: int) -> int | None:
    """A free row of q ``(k, n)`` that belongs to this branch of the whole arm; None if there is none left."""
    first = _PER_BRANCH * branch
    return next((row for row in range(first, first + _PER_BRANCH) if math.isnan(q[row, 0])), None)


def _single_values(arcs: Array) -> list[tuple[int, float]]:
    """The (branch, value) of intervals ``(k, 3)`` of width 0; of values that are whole turns apart only one."""
    found: list[tuple[int, float]] = []
    for branch, low, high in arcs.tolist():
        for value in (low,) if high - low < _SINGLE else (low, high):
            if all(b != branch or abs(wrap(value - x)) > TOLERANCES.limit for b, x in found):
                found.append((int(branch), value))
    return found


class SingleValues(WrappedForm):
    """A closed form with exact ranges, in which one joint may have one value only."""

    def __init__(self, form: ClosedForm, joint: int, value: float) -> None:
        self.form, self.joint, self.value = form, joint, value
        self.name, self.title, self.reason, self.lengths = form.name, form.title, form.reason, form.lengths
        self.off = form.off
        self.branches, self.meanings, self.named = _several(form.branches), form.meanings, form.named
        self.kernels = kernels_by_solving(self, form.kernels.params)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """Those of the closed form but for the first."""
        return self.form.redundancies(task)[1:]

    def solve(self, problem: SolverInput) -> Candidates:
        """All postures, each in a row of its branch."""
        p, form = problem, self.form
        lower, upper = np.full(len(p.seed), -UNBOUNDED), np.full(len(p.seed), UNBOUNDED)
        lower[self.joint] = upper[self.joint] = self.value
        parameters = form.redundancies(p.task)
        free = (math.nan,) * len(parameters)
        if parameters[0].joint >= 0:  # one turn of it is enough
            lower[parameters[0].joint], upper[parameters[0].joint] = -math.pi, math.pi
        first = form.solve(replace(p, values=free, respect_limits=True, lower=lower, upper=upper))
        rest = len(free) - 1
        q, values = np.full((len(self.branches), len(p.seed)), math.nan), np.empty((len(self.branches), rest))
        values[:] = math.nan
        completeness = first.completeness
        arcs: list[list[tuple[float, float, float]]] = [[] for _ in range(rest)]
        for branch, value in _single_values(first.arcs[0]):
            found = form.solve(replace(p, values=(value, *p.values)))
            completeness = weakest(completeness, found.completeness)
            row = _place(q, branch)
            if math.isnan(found.q[branch, 0]) or row is None:
                continue
            q[row], values[row] = found.q[branch], found.values[branch, 1:]
            for k in range(rest):
                arcs[k] += [(row, x, y) for i, x, y in found.arcs[k + 1].tolist() if i == branch]
        kept = tuple(np.array(each, dtype=np.float64).reshape(-1, 3) for each in arcs)
        return Candidates(q, values, kept, first.gap, first.obstacle, completeness)

    def branch_of(self, q: Array) -> int:
        """The first row of the branch that a configuration ``(n,)`` is on."""
        return _PER_BRANCH * self.form.branch_of(q)


class LockedJoints(ClosedForm):
    """The solver of the six joints that are left, in the joint values of the whole arm.

    Attributes:
        form: the closed form of the whole arm, which names the branches; None if it has none.
        inner: the solver of the six joints.
    """

    def __init__(self, robot: Robot, form: ClosedForm | None, inner: ClosedForm, values: dict[int, float]) -> None:
        self.form, self.inner, self.values = form, inner, values
        self.others = [i for i in range(robot.n) if i not in values]
        self.name, self.title, self.lengths, self.off = inner.name, inner.title, inner.lengths, inner.off
        self.kernels = kernels_by_solving(self, inner.kernels.params)
        numbers = ", ".join(str(i + 1) for i in values)
        locked = f"joint{'s' * (len(values) > 1)} {numbers} locked: " if values else ""
        self.reason = locked + inner.reason
        self.steady, self.exact_ranges = inner.steady, inner.exact_ranges
        self.named = inner.named
        self.branches, self.meanings = inner.branches, inner.meanings
        self._names = form if form is not None and form.named else None
        if self._names is not None:
            self.named, self.meanings = True, self._names.meanings
            self.branches = _several(self._names.branches)

    def handles(self, task: int) -> bool:
        """The tasks of the six joints."""
        return self.inner.handles(task)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """Those of the six joints; a joint's value is named after the joint of the whole arm."""
        return tuple(map(self._parameter, self.inner.redundancies(task)))

    def _parameter(self, parameter: RedundancyParameter) -> RedundancyParameter:
        if parameter.joint < 0:
            return parameter
        joint = self.others[parameter.joint]
        return parameter._replace(name=f"theta{joint + 1}", label=f"θ{joint + 1}", joint=joint)

    def solve(self, problem: SolverInput) -> Candidates:
        """All postures, each in a row that belongs to its branch."""
        p, others = problem, self.others
        seed, lower, upper = p.seed[others], p.lower[others], p.upper[others]
        found = self.inner.solve(replace(p, seed=seed, lower=lower, upper=upper))
        q = np.full((len(found.q), len(p.seed)), math.nan)
        q[:, others] = found.q
        for joint, value in self.values.items():
            q[:, joint] = np.where(np.isnan(found.q[:, 0]), math.nan, value)
        return replace(found, q=q) if self._names is None else self._in_rows(replace(found, q=q), self._names)

    def _in_rows(self, found: Candidates, names: ClosedForm) -> Candidates:
        """The same with each posture in a row of its branch."""
        count = len(self.branches)
        q, values = np.full((count, found.q.shape[1]), math.nan), np.full((count, found.values.shape[1]), math.nan)
        place = np.full(len(found.q), -1)
        for i in np.flatnonzero(~np.isnan(found.q[:, 0])).tolist():
            row = _place(q, names.branch_of(found.q[i]))
            if row is not None:
                place[i] = row
                q[row], values[row] = found.q[i], found.values[i]
        arcs = []
        for intervals in found.arcs:
            kept = intervals[place[intervals[:, 0].astype(int)] >= 0].copy()
            kept[:, 0] = place[kept[:, 0].astype(int)]
            arcs.append(kept)
        return replace(found, q=q, values=values, arcs=tuple(arcs))

    def branch_of(self, q: Array) -> int:
        """The first row of the branch that a configuration ``(n,)`` is on."""
        if self._names is None:
            return self.inner.branch_of(np.asarray(q)[self.others])
        return _PER_BRANCH * self._names.branch_of(q)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """Those of the six joints."""
        return tuple(
            replace(found, met_at=tuple(JointValue(self.others[i], value) for i, value in found.met_at))
            for found in self.inner.singularities(np.asarray(q)[self.others], within)
        )
