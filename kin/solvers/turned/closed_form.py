"""The closed form of an arm whose last joint turns the tool about its point."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kin.fk import jacobian
from kin.robot import Robot
from kin.solvers import pair2
from kin.solvers.canonical import free_last
from kin.solvers.contract import (
    APPROACH,
    POSE,
    POSITION,
    BatchKernels,
    Candidates,
    ClosedForm,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.singular import Singularity, by_jacobian, those_within
from kin.solvers.turned.last import LastJoint, last_joint
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "turned3"
TITLE = "closed form, two joints and one that turns the tool about its point"


def match(robot: Robot) -> Turned | None:
    """The closed form if the last of three joints turns the tool about its point."""
    last = last_joint(robot) if robot.n == 3 else None
    if last is None:
        return None
    J = jacobian(robot, np.random.default_rng(3).uniform(-1.0, 1.0, (3, 3)))
    J[:, :3] /= robot.reach or 1.0
    if np.linalg.matrix_rank(J, tol=TOLERANCES.geometry).max() < 3:
        return None
    inner = pair2.match(last.others)
    return Turned(robot, last, inner) if inner is not None and inner.handles(APPROACH) else None


def with_point(
    robot: Robot, form: ClosedForm | None, form_of: Callable[[Robot], ClosedForm | None]
) -> ClosedForm | None:
    """The solver of an arm with four or five joints, for a point too if the last joint turns the tool about it.

    `form_of` gives the solver of the arm without that joint.
    """
    if form is None or form.named or robot.n not in (4, 5) or form.handles(POSITION):
        return form
    last = last_joint(robot)
    inner = None if last is None else form_of(last.others)
    return (
        form if last is None or inner is None or not inner.handles(POSITION) else Turned(robot, last, inner, form)
    )


class Turned(ClosedForm):
    """The closed form of an arm whose last joint turns the tool about its point.

    Attributes:
        last: the last joint.
        inner: the closed form of the joints before it.
        whole: the solver of poses, None if the other joints and the last one follow one after the other.
    """

    def __init__(self, robot: Robot, last: LastJoint, inner: ClosedForm, whole: ClosedForm | None = None) -> None:
        self.robot, self.last, self.inner, self.whole = robot, last, inner, whole
        self.lengths = ()
        named = inner if whole is None else whole
        self.named, self.branches, self.meanings = named.named, named.branches, named.meanings
        self.off = max(inner.off, named.off)
        if whole is None:
            self.name, self.title = NAME, TITLE
            self.reason = "axis 3 passes through the tool's point"
            self.kernels = self._kernels(pair2.kernels_of(last.others, APPROACH))
        else:
            self.name, self.title, self.reason, self.kernels = whole.name, whole.title, whole.reason, whole.kernels
            self.steady = whole.steady

    def _inner_task(self, task: int) -> int:
        """The task of the joints before the last one, −1 if the whole arm has a solver for it."""
        if self.whole is not None and self.whole.handles(task):
            return -1
        return APPROACH if task == POSE or (task == APPROACH and self.last.rolls) else POSITION

    def handles(self, task: int) -> bool:
        """Poses; a point or a direction if the joints before the last one have a closed form for what it keeps."""
        if task not in (POSE, APPROACH, POSITION):
            return False
        inner = self._inner_task(task)
        if inner < 0 or task == POSITION:
            return inner < 0 or self.inner.handles(POSITION)
        # Nothing else may be free where the last joint follows from a direction.
        settled = all(r.rare for r in self.inner.redundancies(inner)) if self.inner.handles(inner) else False
        return settled or (self._is_free(task) and self.inner.handles(inner))

    def _is_free(self, task: int) -> bool:
        """Whether a task leaves the last joint free."""
        return task == POSITION or (task == APPROACH and self.last.rolls)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """What the joints before the last one leave free, and the last one itself."""
        inner = self._inner_task(task)
        if inner < 0:
            assert self.whole is not None
            return self.whole.redundancies(task)
        n = self.robot.n
        own = (RedundancyParameter(f"theta{n}", f"θ{n}", joint=n - 1),)
        return self.inner.redundancies(inner) + own * self._is_free(task)

    def solve(self, problem: SolverInput) -> Candidates:
        """All configurations: those of the joints before the last one, then its value."""
        p, inner = problem, self._inner_task(problem.task)
        if inner < 0:
            assert self.whole is not None
            return self.whole.solve(p)
        free = self._is_free(p.task)
        found = self.inner.solve(
            replace(
                p,
                T=self.last.target(p.T),
                task=inner,
                values=p.values[:-1] if free else p.values,
                seed=p.seed[:-1].copy(),
                lower=p.lower[:-1].copy(),
                upper=p.upper[:-1].copy(),
            )
        )
        q = self._with_last(found.q, p.T, p.task)
        values, arcs = np.full((len(q), found.values.shape[1]), math.nan), found.arcs
        values[: len(found.values)] = found.values
        if free:
            arcs = (*arcs, free_last(p, q))
            values = np.column_stack([values, q[:, -1]])
        return replace(found, q=q, values=values, arcs=arcs)

    def _with_last(self, others: Array, T: Array, task: int) -> Array:
        """Configurations ``(rows, n)`` from those of the other joints."""
        q = np.full((len(self.branches), self.robot.n), math.nan)
        rows = np.flatnonzero(~np.isnan(others[:, 0]))
        if len(rows):
            there = np.ascontiguousarray(others[rows])
            turn = self.last.to_orientation if task == POSE else self.last.to_direction
            q[rows, :-1], q[rows, -1] = there, turn(T, there)
        return q

    def _kernels(self, inner: BatchKernels) -> BatchKernels:
        """The batch kernels of the arm from those of the other joints."""

        def many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
            rows = np.empty((*out.shape[:2], 2))
            inner.many(params, self.last.target(T), values, near[:2].copy(), rows)
            for k in range(len(T)):
                out[k] = self._with_last(rows[k], T[k], POSE)

        return BatchKernels.of_many(inner.params, many)

    def branch_of(self, q: Array) -> int:
        """The branch of a configuration, which the other joints decide."""
        return self.inner.branch_of(np.asarray(q)[:-1]) if self.whole is None else self.whole.branch_of(q)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The smallest singular value of the Jacobian."""
        if self.whole is not None:
            return self.whole.singularities(q, within)
        return those_within(within, by_jacobian(jacobian(self.robot, q), rank=3))
