"""The family as a closed form: recognition by joint axes, the solver contract, singularities."""

from __future__ import annotations

import math

import numpy as np

from kin.axes import inverse, is_along, is_zero, links_by_rows, screw_x, screw_z
from kin.robot import Robot
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
from kin.solvers.names import Names, bent, eight, flipped, front_or_back, names_of, stance_of, up_or_down
from kin.solvers.singular import Singularity, by_angle, elbow_at, off_line, those_within
from kin.solvers.wrist5 import point
from kin.solvers.wrist5.batch import branches_many, branches_one, solve_many, solve_one
from kin.solvers.wrist5.geometry import OFFSET, REACH, Geometry
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "wrist5"
TITLE = "closed form, elbow arm with a two-axis wrist"
_THETA1 = RedundancyParameter("theta1", "θ1", joint=0, circular=True, rare=True)


def match(robot: Robot) -> Wrist5 | None:
    """The closed form if axes 2 and 3 are parallel, perpendicular to axis 1, and 3-4, 4-5 meet at right angles."""
    links = links_by_rows(robot, (-1, 0, -1, 1)) if robot.n == 5 else None
    if links is None or not is_zero(*links.a[2:], links.d[1] + links.d[2]):
        return None
    theta, d = links.theta, links.d
    a1, a2, d4 = float(links.a[0]), float(links.a[1]), float(d[3])
    if min(abs(a2), d4) < TOLERANCES.geometry:
        return None
    tool = screw_x(0.0, math.pi / 2) @ screw_z(0.0, float(d[4])) @ links.tool
    if tool[2, 2] < 0.0:
        theta[4] += math.pi
        tool = screw_x(0.0, math.pi / 2) @ screw_z(math.pi, float(d[4])) @ links.tool
    if not (is_zero(tool[0, 3], tool[1, 3]) and is_along(tool)):
        return None
    # In the formulas θ3 = 0 is the straight elbow, a quarter turn from where the common normals align.
    theta[2] += math.pi / 2
    base = links.base @ screw_z(0.0, float(d[0]))
    if a2 < 0:
        # A negative length is two half turns: Tx(−a) = Rz(π) Tx(a) Rz(−π).
        theta[1] += math.pi
        theta[2] -= math.pi
        a2 = -a2
    return Wrist5(Geometry(inverse(base), theta, a1, a2, d4, float(tool[2, 3])), robot)


class Wrist5(ClosedForm):
    """The closed form of a five-joint elbow arm with a two-axis wrist."""

    name, title, quick = NAME, TITLE, (POSE, APPROACH)
    tasks = (POSE, APPROACH, POSITION)  # `kin.ik` judges the roll that a pose gets
    reason = (
        "axes 2 and 3 are parallel and perpendicular to axis 1, "
        "axes 3 and 4 meet at a right angle, and so do axes 4 and 5"
    )

    def __init__(self, geometry: Geometry, robot: Robot) -> None:
        g = self.geometry = geometry
        self.lengths = (g.a1, g.a2, g.d4, g.d6)
        self.kernels = BatchKernels(g.parameters(), branches_one, branches_many, seeded=solve_many)
        self.branches, self.meanings = self.names(robot, np.ones(5))

    def names(self, robot: Robot, sense: Array) -> Names:
        """The rows are the signs of the wrist centre's x, of s3 and of s5.

        Which elbow is the higher one depends on the side of axis 2 that the wrist centre is on: it is the side of
        axis 1 only if both axes meet.
        """
        g = self.geometry
        stance = stance_of(robot, g.inverse_base, float(g.offset[0]), float(sense[0]))
        parts = front_or_back(stance), bent(2, sense[2], g.offset[2])
        rows = eight()
        if is_zero(g.a1) and stance.vertical:
            parts, rows = (parts[0], up_or_down(stance)), [(x, x * elbow, wrist) for x, elbow, wrist in rows]
        wrist = flipped(4, sense[4], g.offset[4], "the tool is in line with the forearm")
        return names_of((*parts, wrist), rows)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """θ4 and θ5 for a point alone; otherwise θ1 when the wrist centre is on axis 1, else nothing."""
        return point.REDUNDANCIES if task == POSITION else (_THETA1,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches that bring the tool point and the approach direction to the target's.

        Of a point alone θ4 and θ5 are free: that is :mod:`kin.solvers.wrist5.point`.
        """
        if problem.task == POSITION:
            return point.solve(self.geometry, problem)
        out, arcs, arm = np.empty((8, 6)), np.empty((128, 3)), self.kernels.params
        gap, count = solve_one(
            arm, problem.T, problem.values[0], problem.seed, problem.lower, problem.upper, arcs, out
        )
        arcs = arcs[: max(count, 0)]
        if count > 0:
            arcs[:, 1:] -= arm[OFFSET]
        obstacle = None if gap <= REACH else Obstacle("approach direction")
        return Candidates(out[:, :5], out[:, 5:], (arcs,), max(gap, 0.0), obstacle)

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: the signs of the wrist centre's x, of s3 and of s5."""
        g = self.geometry
        t = q + g.offset
        reach = g.a1 + g.a2 * math.cos(t[1]) + g.d4 * math.cos(t[1] + t[2])
        return 4 * int(reach < 0.0) + 2 * int(math.sin(t[2]) < 0.0) + int(math.sin(t[4]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """Those of the task point and approach direction.

        The three are the factors of the determinant, −a2 d4 s3 (a1 + a2 c2 + d4 c23) s5: there are no others.
        """
        g = self.geometry
        t = (q + g.offset).tolist()
        elbow, wrist = off_line(t[2]), off_line(t[4])
        reach = g.a1 + g.a2 * math.cos(t[1]) + g.d4 * math.cos(t[1] + t[2])
        if min(abs(elbow), abs(reach), abs(wrist)) > within:
            return ()  # as almost everywhere
        return those_within(
            within,
            by_angle("elbow", elbow_at(t[2]), "wrist centre along the arm", elbow, q, 2),
            Singularity("shoulder", "wrist centre on axis 1", "wrist centre sideways", abs(reach), "m"),
            by_angle("wrist", "tool along the forearm", "tilt sideways", wrist, q, 4),
        )
