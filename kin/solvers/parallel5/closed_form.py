"""The closed form of an arm with three parallel axes and at most a roll: branches, redundancy, singularities."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.axes import is_zero
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
from kin.solvers.names import Names, bent, front_or_back, names_of, stance_of
from kin.solvers.parallel5.branches import ROWS, branches_many, branches_one, solve, solve_many
from kin.solvers.parallel5.geometry import BASE, TOOL_Z, TURNED, Geometry, geometry_of
from kin.solvers.singular import Condition, Singularity, by_angle, elbow_at, off_line, those_within
from kin.transforms import Array

NAME = "parallel5"
_PSI = RedundancyParameter("psi", "pitch ψ", circular=True)
_THETA5 = RedundancyParameter("theta5", "θ5", joint=4)


def match(robot: Robot) -> Parallel5 | None:
    """The closed form if the robot has three parallel axes behind the first one, and at most a roll after them."""
    geometry = geometry_of(robot)
    return None if geometry is None else Parallel5(geometry, robot)


class Parallel5(ClosedForm):
    """The closed form of an arm with three parallel axes and at most a roll."""

    name, quick = NAME, (POSE,)

    def __init__(self, geometry: Geometry, robot: Robot) -> None:
        g = self.geometry = geometry
        self.rolls = robot.n == 5
        self.title = "closed form, three parallel axes" + " and a roll" * self.rolls
        self.reason = (
            "axes 2, 3 and 4 are parallel and perpendicular to axis 1" + ", and axis 5 to them" * self.rolls
        )
        self.lengths = (g.a1, g.a2, g.a3, g.p, g.q, g.beside)
        self.kernels = BatchKernels(g.params, branches_one, branches_many, seeded=solve_many)
        self.branches, self.meanings = self.names(robot, np.ones(robot.n))

    def names(self, robot: Robot, sense: Array) -> Names:
        """The rows are the signs of x and of s3."""
        g = self.geometry
        sense = sense * g.sign
        stance = stance_of(robot, g.params[BASE:TURNED].reshape(3, 4), float(g.offset[0]), float(sense[0]))
        what = "the tool's point" if g.tool_on_axis else "the roll axis beside the tool"
        parts = (front_or_back(stance, what), bent(2, sense[2], float(g.offset[2])))
        return names_of(parts, [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])

    def handles(self, task: int) -> bool:
        """Poses; a point or a direction if the roll, where there is one, keeps both."""
        if task == APPROACH and not self.rolls and not self._upright:
            return True
        return task == POSE or (task in (APPROACH, POSITION) and self.geometry.tool_on_axis)

    @property
    def _upright(self) -> bool:
        """Whether the tool's z axis is parallel to axes 2, 3 and 4."""
        return is_zero(*self.geometry.params[TOOL_Z : TOOL_Z + 2])

    def _frees_psi(self, task: int) -> bool:
        """Whether a task leaves ψ free: a point, and a direction across the arm's plane, which θ1 alone turns."""
        return task == POSITION or (task == APPROACH and not self.rolls and self._upright)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """ψ for a point alone, and the roll for whatever it keeps."""
        return (_PSI,) * self._frees_psi(task) + (_THETA5,) * (self.rolls and task != POSE)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches, at the requested ψ and θ5 or those nearest to the seed's."""
        p, n = problem, len(problem.seed)
        out, arcs = np.empty((ROWS, n + 1)), np.empty((256, 3))
        free = self._frees_psi(p.task)
        psi, task = (p.values[0], POSITION) if free else (math.nan, p.task)
        gap, count = solve(self.geometry.params, p.T, (task, psi), p.seed, p.lower, p.upper, arcs, out)
        q = out[:, :n]
        columns, ranges = [], []
        if free:
            columns.append(out[:, n])
            ranges.append(arcs[:count])
        if self.rolls and p.task != POSE:
            ranges.append(free_last(p, q))
            columns.append(q[:, 4])
        values = np.column_stack(columns) if columns else np.empty((ROWS, 0))
        missing = bool(np.isnan(q[:, 0]).all())
        obstacle = Obstacle("last axis beyond the links' reach") if missing else None
        return Candidates(q, values, tuple(ranges), max(gap, 0.0) if missing else 0.0, obstacle)

    def _x(self, t: Array) -> float:
        """How far C is before axis 1 in the arm's own plane, metres."""
        g, psi = self.geometry, float(t[1] + t[2] + t[3])
        links = g.a2 * math.cos(t[1]) + g.a3 * math.cos(t[1] + t[2])
        return float(g.a1 + links + g.p * math.cos(psi) - g.q * math.sin(psi))

    def value_at(self, T: Array, q: Array) -> float:
        """The pitch."""
        t = self.geometry.sign * q + self.geometry.offset
        return wrap(float(t[1] + t[2] + t[3]))

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: the signs of x and of s3."""
        t = self.geometry.sign * q + self.geometry.offset
        return 2 * int(self._x(t) < 0.0) + int(math.sin(t[2]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The elbow, and the shoulder, where the tool cannot move sideways."""
        g = self.geometry
        t = g.sign * q + g.offset
        elbow, x = off_line(float(t[2])), self._x(t)
        where: Condition = "tool on axis 1" if g.beside == 0.0 else "tool nearest to axis 1"
        return those_within(
            within,
            by_angle("elbow", elbow_at(float(t[2])), "last axis along the arm", elbow, q, 2, g.sign[2]),
            Singularity("shoulder", where, "tool sideways", abs(x), "m"),
        )
