"""The closed form of an arm with three parallel axes: matching, redundancy, branches, singularities."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from kin.axes import is_zero
from kin.robot import Robot
from kin.solvers.canonical import free_last, without_last
from kin.solvers.contract import (
    APPROACH,
    POSE,
    BatchKernels,
    Candidates,
    ClosedForm,
    Obstacle,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.names import Names, bent, eight, flipped, front_or_back, left_or_right, names_of, stance_of
from kin.solvers.parallel6.batch import branches_many, branches_one, solve_many, solve_one
from kin.solvers.parallel6.geometry import BASE, COS_TWIST, TOOL, Geometry, geometry_of
from kin.solvers.singular import Singularity, by_angle, elbow_at, off_line, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "parallel6"
TITLE = "closed form, three parallel axes and a wrist"
_SPIN6 = RedundancyParameter("theta6", "θ6", joint=5, circular=True, rare=True)
_THETA6 = RedundancyParameter("theta6", "θ6", joint=5)
_REACH = TOLERANCES.reach


def match(robot: Robot) -> Parallel6 | None:
    """The closed form if the robot has three parallel axes and a wrist."""
    geometry = geometry_of(robot)
    return None if geometry is None else Parallel6(geometry, robot)


class Parallel6(ClosedForm):
    """The closed form of an arm with three parallel axes and a wrist."""

    name, title, quick = NAME, TITLE, (POSE,)
    reason = (
        "axes 2, 3 and 4 are parallel, and axis 5 is perpendicular to axis 4 and meets axis 6 at a right angle"
    )

    def __init__(self, geometry: Geometry, robot: Robot) -> None:
        g = self.geometry = geometry
        self.tasks = (POSE, APPROACH) if g.tool_on_axis else (POSE,)
        self.lengths = (g.a1, g.a2, g.a3, g.a4, g.d5, g.beside)
        self.kernels = BatchKernels(g.params, branches_one, branches_many, seeded=solve_many)
        self.branches, self.meanings = self.names(robot, np.ones(6))

    def names(self, robot: Robot, sense: Array) -> Names:
        """The rows are the side of axis 1 that the arm's plane is on, and the signs of x s3 and of s5.

        Only a vertical plane beside axis 1 is on one side of it. How high the elbow is depends on where axis 4
        is, which need not be on the same side of axis 1 as W.
        """
        g, sense = self.geometry, sense * self.geometry.sign
        stance = stance_of(robot, g.params[BASE:TOOL].reshape(3, 4), float(g.offset[0]), float(sense[0]))
        x_of_left = -1.0 if g.beside < 0.0 else 1.0
        if is_zero(g.beside) or not is_zero(g.params[COS_TWIST]):
            side = front_or_back(stance).times(x_of_left)
        else:
            side = left_or_right(stance, "shoulder", "the plane of the arm")
        wrist = flipped(4, sense[4], g.offset[4], "axis 6 is parallel to axes 2, 3 and 4")
        rows = [(left, x_of_left * left * up, wrist) for left, up, wrist in eight()]
        return names_of((side, bent(2, sense[2], g.offset[2]), wrist), rows)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """θ6: for a pose when axis 6 is parallel to axes 2, 3 and 4; for an approach direction always."""
        return (_THETA6,) if task == APPROACH else (_SPIN6,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches; with an approach direction only, joint 6 stays or takes the value requested."""
        g, free_roll = self.geometry, problem.task == APPROACH
        out, arcs = np.empty((8, 7)), np.empty((128, 3))
        T, lower, upper = without_last(problem) if free_roll else (problem.T, problem.lower, problem.upper)
        value = math.nan if free_roll else problem.values[0]
        gap, count = solve_one(g.params, T, value, problem.seed, lower, upper, arcs, out)
        q = out[:, :6]
        if free_roll:
            ranges = free_last(problem, q)
            values = q[:, 5:].copy()
        else:
            ranges = arcs[: max(count, 0)]
            values = np.empty((8, 1))
            values.fill(math.nan)
            if 1.0 in out[:, 6].tolist():
                values = np.where(out[:, 6:] == 1.0, q[:, 5:], math.nan)
        obstacle = None if gap <= _REACH else Obstacle("wrist centre beyond the elbow's reach")
        return Candidates(q, values, (ranges,), max(gap, 0.0), obstacle)

    def _x_of_wrist(self, t: Sequence[float] | Array) -> float:
        """x of W in the frame that turns with axis 1, metres."""
        g = self.geometry
        A = t[1] + t[2] + t[3]
        return float(
            g.a1 + g.a2 * math.cos(t[1]) + g.a3 * math.cos(t[1] + t[2]) + g.a4 * math.cos(A) - g.d5 * math.sin(A)
        )

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: the arm's side of axis 1, and the signs of x s3 and of s5."""
        t = self.geometry.sign * q + self.geometry.offset
        side = -1.0 if self._x_of_wrist(t) < 0.0 else 1.0
        right = (side < 0.0) == (self.geometry.beside >= 0.0)
        return 4 * int(right) + 2 * int(side * math.sin(t[2]) < 0.0) + int(math.sin(t[4]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The three factors of the determinant, ±a2 a3 s3 · x sin α1 · s5: there are no others."""
        g = self.geometry
        t = (g.sign * q + g.offset).tolist()
        elbow, x, wrist = off_line(t[2]), self._x_of_wrist(t), off_line(t[4])
        if min(abs(elbow), abs(x), abs(wrist)) > within:
            return ()  # as almost everywhere
        return those_within(
            within,
            by_angle("elbow", elbow_at(t[2]), "axis 4 along the arm", elbow, q, 2, g.sign[2]),
            Singularity("shoulder", "wrist centre nearest to axis 1", "wrist centre along axis 2", abs(x), "m"),
            by_angle(
                "wrist", "axis 6 parallel to axes 2, 3 and 4", "tilt about the third axis", wrist, q, 4, g.sign[4]
            ),
        )
