"""The closed form of an arm with one or two joints: tasks, branches, singularities."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.axes import is_zero
from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.solvers.canonical import free_last
from kin.solvers.contract import (
    APPROACH,
    POSE,
    POSITION,
    BatchKernels,
    Candidates,
    ClosedForm,
    Obstacle,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.names import Names, bent, names_of
from kin.solvers.pair2.configurations import OFF, OPEN, branches_many, branches_one, solve, solve_many
from kin.solvers.pair2.geometry import Geometry, geometry_of, straight
from kin.solvers.singular import Singularity, by_jacobian, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "pair2"
_TASKS = (POSE, APPROACH, POSITION)
_THETA1 = RedundancyParameter("theta1", "θ1", joint=0, rare=True)


def match(robot: Robot) -> Pair2 | None:
    """The closed form of an arm with one or two joints, unless both do the same."""
    if robot.n not in (1, 2):
        return None
    form = Pair2(robot, geometry_of(robot))
    return form if form.handles(POSE) else None


def kernels_of(robot: Robot, task: int) -> BatchKernels:
    """The batch kernels of one or two joints for a task."""
    return BatchKernels(geometry_of(robot).params(task), branches_one, branches_many, seeded=solve_many)


class Pair2(ClosedForm):
    """The closed form of an arm with one or two joints."""

    name = NAME

    def __init__(self, robot: Robot, geometry: Geometry) -> None:
        self.robot, self.geometry = robot, geometry
        count = "one joint" if robot.n == 1 else "two joints"
        self.title, self.reason = f"closed form, {count}", f"the arm has {count}"
        self.lengths = ()
        self.kernels = kernels_of(robot, POSE)
        self._rank = {task: self._ranks(task) for task in _TASKS}
        # Every task, unless it leaves another joint free than the last.
        self.tasks = tuple(task for task, (rank, free) in self._rank.items() if rank == robot.n - free)
        # Parallel axes: an elbow, which has two sides. Otherwise the values of joint 2 have no names.
        self.named = geometry.rows == 1 or (all(geometry.turns) and is_zero(*geometry.wave[:, 0, 2]))
        self.branches, self.meanings = self.names(robot, np.ones(robot.n))
        self.quick = () if self.redundancies(POSE) else (POSE,)

    def names(self, robot: Robot, sense: Array) -> Names:
        """The sign of joint 2 where the axes are parallel."""
        g = self.geometry
        if g.rows == 1:
            return Names(("solution 1",), (("solution 1", "the only configuration"),))
        if not self.named:
            return Names(("solution 1", "solution 2"), ())
        return names_of((bent(1, sense[1], -straight(g)),), [(1.0,), (-1.0,)])

    def _ranks(self, task: int) -> tuple[int, bool]:
        """How many coordinates of a task the joints move, and whether the last joint moves none."""
        q = np.random.default_rng(2).uniform(-1.0, 1.0, (3, self.robot.n))
        J, R = jacobian(self.robot, q), fk(self.robot, q)[:, :3, :3]
        J[:, :3] /= self.geometry.scale
        if task == APPROACH:
            J = np.concatenate([J[:, :3], np.swapaxes(R[:, :, :2], 1, 2) @ J[:, 3:]], axis=1)
        elif task == POSITION:
            J = J[:, :3]
        free = bool(np.linalg.norm(J[:, :, -1], axis=1).max() < TOLERANCES.geometry)
        return int(np.linalg.matrix_rank(J, tol=TOLERANCES.geometry).max()), free

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """The last joint, if it moves neither point nor direction; θ1 where what a task keeps is on axis 1."""
        n = self.robot.n
        turns = self.geometry.turns
        if self._rank[task][1]:
            name, label = (f"theta{n}", f"θ{n}") if turns[-1] else (f"d{n}", f"d{n}")
            return (RedundancyParameter(name, label, joint=n - 1),)
        return (_THETA1,) if n == 2 and turns[0] and task != POSE else ()

    def solve(self, problem: SolverInput) -> Candidates:
        """All configurations that meet what the arm can meet of the target."""
        p, g = problem, self.geometry
        q, notes = np.empty((g.rows, self.robot.n)), np.empty((g.rows, 2))
        solve(self.kernels.params, p.T, p.task, p.seed, q, notes)
        missing = bool(np.isnan(q).all())
        gap, obstacle = (float(notes[:, OFF].min()), Obstacle("point")) if missing else (0.0, None)
        if not self.redundancies(p.task):
            return Candidates(q, np.empty((len(q), 0)), (), gap, obstacle)
        if not self._rank[p.task][1]:
            values, arcs = _any_first(p, q, notes[:, OPEN] > 0.0)
            return Candidates(q, values, (arcs,), gap, obstacle)
        q[1:] = math.nan
        arcs = free_last(p, q)
        return Candidates(q, q[:, -1:].copy(), (arcs,), gap, obstacle)

    def branch_of(self, q: Array) -> int:
        """The side of the elbow, or the row of q ``(n,)`` among all configurations of its pose."""
        if self.geometry.rows == 1:
            return 0
        if self.named:
            return int(math.sin(q[1] - straight(self.geometry)) < 0.0)
        return super().branch_of(q)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The smallest singular value of the point's Jacobian that is not zero everywhere."""
        J = jacobian(self.robot, q)[:3]
        return those_within(within, by_jacobian(J, rank=self._rank[POSITION][0]))


def _any_first(problem: SolverInput, q: Array, free: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Values of θ1 ``(rows, 1)`` and its intervals ``(k, 3)`` where it may have any value, in place.

    It is the seed's, moved inside the limits.
    """
    low, high = problem.lower[0], problem.upper[0]
    rows = np.flatnonzero(free & ~np.isnan(q[:, 0]))
    values = np.full((len(q), 1), math.nan)
    q[rows, 0] = values[rows, 0] = min(max(problem.seed[0], low), high)
    return values, np.array([(i, low, high) for i in rows], dtype=np.float64).reshape(-1, 3)
