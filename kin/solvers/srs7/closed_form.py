"""The S-R-S family as a closed form: recognition by joint axes, the solver contract, singularities."""

from __future__ import annotations

import math

import numpy as np

from kin.axes import inverse, is_along, is_zero, links_by_rows, screw_z
from kin.robot import Robot
from kin.solvers.canonical import Geometry7, free_last
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
from kin.solvers.names import Names, bent, eight, flipped, front_or_back, names_of, stance_of
from kin.solvers.singular import JointValue, Singularity, elbow_at, off_line, off_perpendicular, those_within
from kin.solvers.srs7.batch import branches_many, branches_one
from kin.solvers.srs7.branches import solve, solve_many
from kin.solvers.srs7.geometry import TOO_FAR, TOO_NEAR, arm_angle
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "srs7"
TITLE = "closed form, S-R-S arm"
_PSI = RedundancyParameter("psi", "arm angle ψ", circular=True)
_THETA7 = RedundancyParameter("theta7", "θ7", joint=6)


def match(robot: Robot) -> Srs7 | None:
    """The closed form if axes 1, 2, 3 meet, axes 5, 6, 7 meet, and neighbouring axes are perpendicular."""
    links = links_by_rows(robot, (-1, 1, -1, 1, -1, 1)) if robot.n == 7 else None
    if links is None or not is_zero(*links.a, links.d[1], links.d[3], links.d[5]):
        return None
    d3, d5 = float(links.d[2]), float(links.d[4])
    if min(d3, d5) < TOLERANCES.geometry:
        return None
    tool = screw_z(0.0, float(links.d[6])) @ links.tool
    on_axis = is_zero(tool[0, 3], tool[1, 3]) and is_along(tool) and tool[2, 2] > 0.0
    base = links.base @ screw_z(0.0, float(links.d[0]))
    return Srs7(Geometry7(inverse(base), inverse(tool), links.theta, d3, d5, bool(on_axis)), robot)


class Srs7(ClosedForm):
    """The closed form of an S-R-S arm."""

    name, title, quick = NAME, TITLE, (POSE,)
    reason = (
        "axes 1, 2, 3 meet in one point and axes 5, 6, 7 in another, "
        "with the elbow's axis perpendicular to both links"
    )

    def __init__(self, geometry: Geometry7, robot: Robot) -> None:
        g = self.geometry = geometry
        self.tasks = (POSE, APPROACH) if g.tool_on_axis else (POSE,)
        self.lengths = (g.d3, g.d5)
        self.kernels = BatchKernels(g.params, branches_one, branches_many, seeded=solve_many)
        self.branches, self.meanings = self.names(robot, np.ones(7))

    def names(self, robot: Robot, sense: Array) -> Names:
        """The rows are the signs of s2, s4 and s6. The height of the elbow depends on the arm angle instead."""
        g = self.geometry
        stance = stance_of(robot, g.inverse_base, float(g.offset[0]), float(sense[0]))
        elbow, wrist = (
            bent(3, sense[3], g.offset[3]),
            flipped(5, sense[5], g.offset[5], "axes 5 and 7 are in line"),
        )
        return names_of((front_or_back(stance, "the elbow"), elbow, wrist), eight())

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """The arm angle; for an approach direction joint 7 as well."""
        return (_PSI, _THETA7) if task == APPROACH else (_PSI,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches, each at the arm angle at which it is nearest to the seed (or at the requested one)."""
        g, p, free_roll = self.geometry, problem, problem.task == APPROACH
        out, arcs = np.empty((8, 8)), np.empty((256, 3))
        options = p.values[0], p.respect_limits, free_roll, False
        code, gap, count = solve(self.kernels.params, p.T, options, p.seed, p.lower, p.upper, arcs, out)
        values, all_arcs = out[:, 7:], [arcs[:count]]
        if free_roll:
            # Joint 7 turns the tool about its own axis and nothing else: it stays, or takes the requested value.
            all_arcs.append(free_last(p, out[:, :7]))
            values = out[:, [7, 6]]
        obstacle = None
        if code == TOO_FAR:
            obstacle = Obstacle("wrist centre too far from the shoulder", g.d3 + g.d5)
        elif code == TOO_NEAR:
            obstacle = Obstacle("wrist centre too near to the shoulder", abs(g.d3 - g.d5))
        return Candidates(out[:, :7], values, tuple(all_arcs), gap, obstacle)

    def value_at(self, T: Array, q: Array) -> float:
        """The arm angle of a configuration."""
        return float(arm_angle(self.kernels.params, np.array(T), q))

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: the signs of s2, s4 and s6."""
        s = np.sin(q + self.geometry.offset)
        return 4 * int(s[1] < 0.0) + 2 * int(s[3] < 0.0) + int(s[5] < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The zeros of √det(J Jᵀ) = d3 d5 |s4| |m|, where m spans the motions that keep the tool still.

        With s4 ≠ 0 it vanishes for s2 = c3 = 0, for s6 = c5 = 0 and for s2 = s6 = 0 only: s2 = 0 or s6 = 0 alone
        is no singularity of this arm.
        """
        g = self.geometry
        t = (q + g.offset).tolist()
        off = (
            0.0,
            off_line(t[1]),
            off_perpendicular(t[2]),
            off_line(t[3]),
            off_perpendicular(t[4]),
            off_line(t[5]),
        )
        side, along = g.d5 * math.sin(t[3]), g.d3 + g.d5 * math.cos(t[3])
        x = math.cos(t[1]) * math.cos(t[2]) * side + math.sin(t[1]) * along
        above, before = math.hypot(off[1], off[2]), math.hypot(off[5], off[4])
        both, off_axis = math.hypot(off[1], off[5]), math.hypot(x, math.sin(t[2]) * side)
        if min(abs(off[3]), above, before, both, off_axis) > within:
            return ()  # as almost everywhere

        def met_at(*joints: int) -> tuple[JointValue, ...]:
            return tuple(JointValue(i, float(q[i]) - off[i]) for i in joints)

        return those_within(
            within,
            Singularity("elbow", elbow_at(t[3]), "hand along the arm", abs(off[3]), "rad", met_at(3)),
            Singularity("shoulder", "upper arm on axis 1", "hand along the forearm", above, "rad", met_at(1, 2)),
            Singularity(
                "wrist",
                "hand along the forearm, axes 4 and 6 perpendicular",
                "hand along the upper arm",
                before,
                "rad",
                met_at(5, 4),
            ),
            Singularity(
                "wrist",
                "upper arm on axis 1, hand along the forearm",
                "joints 1 and 3, 5 and 7 coincide",
                both,
                "rad",
                met_at(1, 5),
            ),
            Singularity("algorithmic", "wrist centre on axis 1", "reference of the arm angle", off_axis, "m"),
        )
