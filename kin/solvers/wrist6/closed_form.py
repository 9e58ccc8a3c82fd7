"""The closed form of an elbow arm with a spherical wrist: matching, redundancy, branches, singularities."""

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
from kin.solvers.names import (
    Names,
    Part,
    Stance,
    bent,
    eight,
    flipped,
    front_or_back,
    names_of,
    stance_of,
    up_or_down,
)
from kin.solvers.singular import Singularity, by_angle, elbow_at, off_line, those_within
from kin.solvers.wrist6.batch import branches_many, branches_one, solve_many, solve_one
from kin.solvers.wrist6.geometry import BASE, TOOL, Geometry, geometry_of
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "wrist6"
TITLE = "closed form, elbow arm with a spherical wrist"
_THETA1 = RedundancyParameter("theta1", "θ1", joint=0, circular=True, rare=True)
_THETA6 = RedundancyParameter("theta6", "θ6", joint=5)
_REACH = TOLERANCES.reach


def match(robot: Robot) -> Wrist6 | None:
    """The closed form if the robot is an elbow arm with a spherical wrist."""
    geometry = geometry_of(robot)
    return None if geometry is None else Wrist6(geometry, robot)


class Wrist6(ClosedForm):
    """The closed form of an elbow arm with a spherical wrist."""

    name, title, quick = NAME, TITLE, (POSE,)
    reason = "axes 4, 5 and 6 meet in one point, and axes 2 and 3 are parallel and perpendicular to axis 1"
    _solve = staticmethod(solve_one)

    def __init__(self, geometry: Geometry, robot: Robot) -> None:
        g = self.geometry = geometry
        self.tasks = (POSE, APPROACH) if g.tool_on_axis else (POSE,)
        self.lengths = (g.a1, g.a2, g.f, g.beside)
        self.kernels = BatchKernels(g.params, branches_one, branches_many, seeded=solve_many)
        self.branches, self.meanings = self.names(robot, np.ones(6))

    def names(self, robot: Robot, sense: Array) -> Names:
        """The rows are the signs of X, of X s3 and of s5.

        Which elbow is the higher one depends on the side of axis 2 that W is on: it is the side of axis 1 only if
        both axes meet.
        """
        sense = sense * self.geometry.sign
        stance = self._stance(robot, sense)
        elbow, rows = up_or_down(stance), eight()
        if not (is_zero(self.geometry.a1) and stance.vertical):
            elbow = bent(2, sense[2], self.geometry.offset[2])
            rows = [(x, x * side, wrist) for x, side, wrist in rows]
        return names_of((front_or_back(stance), elbow, self._wrist(sense)), rows)

    def _stance(self, robot: Robot, sense: Array) -> Stance:
        g = self.geometry
        return stance_of(robot, g.params[BASE:TOOL].reshape(3, 4), float(g.offset[0]), float(sense[0]))

    def _wrist(self, sense: Array) -> Part:
        return flipped(4, sense[4], self.geometry.offset[4], "axes 4 and 6 are in line")

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """θ1 where the wrist centre can be on axis 1; for an approach direction joint 6 as well."""
        return (_THETA1,) * self._reaches_axis_1 + (_THETA6,) * (task == APPROACH)

    @property
    def _reaches_axis_1(self) -> bool:
        """Whether W can be on axis 1."""
        return self.geometry.beside == 0.0

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches; with an approach direction only, joint 6 stays or takes the value requested."""
        g, free_roll = self.geometry, problem.task == APPROACH
        out, arcs = np.empty((8, 6)), np.empty((128, 3))
        T, lower, upper = without_last(problem) if free_roll else (problem.T, problem.lower, problem.upper)
        reaches_axis_1 = self._reaches_axis_1
        value = problem.values[0] if reaches_axis_1 else math.nan
        gap, count = self._solve(g.params, T, value, problem.seed, lower, upper, arcs, out)
        values, ranges = np.empty((8, reaches_axis_1 + free_roll)), []
        values.fill(math.nan)
        if reaches_axis_1:
            rows = arcs[: max(count, 0)]
            rows[:, 1:] -= g.offset[0]
            if g.sign[0] < 0.0:
                rows[:, 1:] = -rows[:, :0:-1]
            if count >= 0:
                values[:, 0] = out[:, 0]
            ranges.append(rows)
        if free_roll:
            ranges.append(free_last(problem, out))
            values[:, -1] = out[:, 5]
        obstacle = None if gap <= _REACH else self._obstacle()
        return Candidates(out, values, tuple(ranges), max(gap, 0.0), obstacle)

    def _obstacle(self) -> Obstacle:
        return Obstacle("wrist centre beyond the elbow's reach")

    def _x_of_wrist(self, t: Sequence[float] | Array) -> float:
        """X of the wrist centre: how far it is before axis 1 in the arm's own plane, metres."""
        g = self.geometry
        return float(g.a1 + g.a2 * math.cos(t[1]) + g.f * math.cos(t[1] + t[2]))

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: the signs of X, of X s3 and of s5."""
        t = self.geometry.sign * q + self.geometry.offset
        side = -1.0 if self._x_of_wrist(t) < 0.0 else 1.0
        return 4 * int(side < 0.0) + 2 * int(side * math.sin(t[2]) < 0.0) + int(math.sin(t[4]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The three factors of the determinant, −a2 f s3 (a1 + a2 c2 + f c23) s5: there are no others."""
        g = self.geometry
        t = (g.sign * q + g.offset).tolist()
        elbow, x, wrist = off_line(t[2]), self._x_of_wrist(t), off_line(t[4])
        if min(abs(elbow), abs(x), abs(wrist)) > within:
            return ()  # as almost everywhere
        return those_within(
            within,
            by_angle("elbow", elbow_at(t[2]), "wrist centre along the arm", elbow, q, 2, g.sign[2]),
            Singularity(
                "shoulder",
                "wrist centre on axis 1" if self._reaches_axis_1 else "wrist centre nearest to axis 1",
                "wrist centre sideways",
                abs(x),
                "m",
            ),
            by_angle("wrist", "axes 4 and 6 in line", "tilt about the third axis", wrist, q, 4, g.sign[4]),
        )
