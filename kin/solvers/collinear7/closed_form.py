"""The family as a closed form: recognition by joint axes, the solver contract, singularities."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace

import numpy as np

from kin.axes import inverse, is_zero, links_by_rows, screw_z
from kin.robot import Robot
from kin.solvers.canonical import Geometry7
from kin.solvers.collinear7.batch import branches_many, branches_one
from kin.solvers.collinear7.branches import REACH, SLACK, solve, solve_many
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
from kin.solvers.names import Names, bent, eight, flipped, left_or_right, names_of, stance_of
from kin.solvers.singular import Singularity, by_angle, elbow_at, off_line, off_perpendicular, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "collinear7"
TITLE = "closed form, joints 1 and 2 on one line"
_THETA1 = RedundancyParameter("theta1", "θ1", joint=0)
_ROLL = RedundancyParameter("roll", "roll about the approach axis", circular=True)


def match(robot: Robot) -> Collinear7 | None:
    """The closed form if axes 1 and 2 are one line, 3 is perpendicular to it and 5-6-7 meet in a point."""
    links = links_by_rows(robot, (0, -1, -1, 1, -1, 1)) if robot.n == 7 else None
    if links is None or not is_zero(*links.a, links.d[3], links.d[5]):
        return None
    d3, d5 = float(links.d[2]), float(links.d[4])
    if min(d3, d5) < TOLERANCES.geometry:
        return None
    tool = screw_z(0.0, float(links.d[6])) @ links.tool
    base = links.base @ screw_z(0.0, float(links.d[0] + links.d[1]))
    inverse_tool = inverse(tool)
    # The wrist centre in the tool frame: it must stay when the tool rolls about its approach axis.
    on_axis = is_zero(*inverse_tool[:2, 3])
    return Collinear7(Geometry7(inverse(base), inverse_tool, links.theta, d3, d5, on_axis), robot)


class Collinear7(ClosedForm):
    """The closed form of the arm whose joints 1 and 2 turn about one line."""

    name, title, quick = NAME, TITLE, (POSE,)
    reason = "axes 1 and 2 are one line, axis 3 is perpendicular to it, and axes 5, 6, 7 meet in one point"

    def __init__(self, geometry: Geometry7, robot: Robot) -> None:
        g = self.geometry = geometry
        self.tasks = (POSE, APPROACH) if g.tool_on_axis else (POSE,)
        self.lengths = (g.d3, g.d5)
        self.kernels = BatchKernels(np.append(g.params, REACH), branches_one, branches_many, seeded=solve_many)
        self.branches, self.meanings = self.names(robot, np.ones(7))

    def names(self, robot: Robot, sense: Array) -> Names:
        """The rows are the side of the wrist centre that the upper arm is on, and the signs of s4 and s6."""
        g = self.geometry
        stance = stance_of(robot, g.inverse_base, float(g.offset[0] + g.offset[1]), float(sense[0]))
        side = left_or_right(stance, "shoulder", "the upper arm")
        elbow, wrist = (
            bent(3, sense[3], g.offset[3]),
            flipped(5, sense[5], g.offset[5], "axes 5 and 7 are in line"),
        )
        return names_of((side, elbow, wrist), eight())

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """θ1, which joint 2 undoes; for an approach direction the roll about it as well."""
        return (_THETA1, _ROLL) if task == APPROACH else (_THETA1,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches, with θ1 and θ2 (and the roll of an approach task) as near the seed as the limits allow."""
        free_roll = problem.task == APPROACH
        out, arcs, rolls = np.empty((8, 9)), np.empty((64, 3)), np.empty((256, 3))
        roll = problem.values[1] if free_roll else math.nan
        options = problem.values[0], roll, problem.seed_roll, problem.respect_limits, free_roll
        gap, count, roll_count = solve(
            self.kernels.params, problem.T, options, problem.seed, problem.lower, problem.upper, arcs, rolls, out
        )
        obstacle = Obstacle("wrist centre off the upper arm and forearm") if gap > 0.0 else None
        if free_roll:
            return Candidates(out[:, :7], out[:, 7:], (arcs[:count], rolls[:roll_count]), gap, obstacle)
        return Candidates(out[:, :7], out[:, 7:8], (arcs[:count],), gap, obstacle)

    def relaxed(self, by: float) -> Collinear7:
        """The same with a forearm that may miss the wrist centre by some more metres."""
        other, params = copy(self), self.kernels.params.copy()
        params[SLACK] += by
        other.kernels = replace(self.kernels, params=params)
        return other

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: the side of w on which u lies, and the signs of s4 and s6."""
        t = q + self.geometry.offset
        s4 = math.sin(t[3])
        return 4 * int(math.cos(t[2]) * s4 < 0.0) + 2 * int(s4 < 0.0) + int(math.sin(t[5]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The three factors of the determinant without joint 2, d3 d5² s4² c3 s6: there are no others.

        s4 counts twice, so an elbow nearly straight costs more than a wrist nearly aligned.
        """
        g = self.geometry
        t = (q + g.offset).tolist()
        elbow, shoulder, wrist = off_line(t[3]), off_perpendicular(t[2]), off_line(t[5])
        across, along = g.d5 * math.sin(t[3]) * math.cos(t[2]), g.d3 + g.d5 * math.cos(t[3])
        off_axis = math.hypot(across, along)
        if min(abs(elbow), abs(shoulder), abs(wrist), off_axis) > within:
            return ()  # as almost everywhere
        found = [
            by_angle("elbow", elbow_at(t[3]), "hand along the arm", elbow, q, 3),
            by_angle("shoulder", "forearm in one plane with axis 1", "hand along the forearm", shoulder, q, 2),
            by_angle("wrist", "hand along the forearm", "joints 5 and 7 coincide", wrist, q, 5),
        ]
        if g.d5 >= g.d3 - TOLERANCES.geometry:
            # Only a forearm at least as long as the upper arm gets back to axis 1; then θ3 is ±90°, too.
            found.append(
                Singularity("algorithmic", "wrist centre on axis 1", "azimuth of the forearm", off_axis, "m")
            )
        return those_within(within, *found)
