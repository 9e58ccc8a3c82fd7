"""The closed form of a planar arm with four joints: matching, branches, singularities."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN, wrap
from kin.axes import frame_of, inverse, is_along, is_zero, lines_of, perpendicular_to
from kin.fk import jacobian
from kin.robot import Robot
from kin.solvers.canonical import at_every_turn, merged, turn_around
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
from kin.solvers.names import Names, left_or_right, names_of, stance_of
from kin.solvers.planar import BASE, LINKS, TOOL
from kin.solvers.planar4.branches import OFFSET, SIGN, branches_many, branches_one, solve
from kin.solvers.planar4.point import ARCS, solve_point
from kin.solvers.singular import Singularity, by_jacobian, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "planar4"
TITLE = "closed form, four parallel axes"
_PHI = RedundancyParameter("phi", "direction φ of the third link", circular=True)
_THETA4 = RedundancyParameter("theta4", "θ4", joint=3)


def match(robot: Robot) -> Planar4 | None:
    """The closed form if all four axes are parallel and revolute."""
    if robot.n != 4 or not robot.revolute.all():
        return None
    lines = lines_of(robot)
    z, points = lines.z, lines.points
    if not is_zero(*np.cross(z[0], z).ravel()):
        return None
    base = frame_of(perpendicular_to(z[0]), z[0], points[0])
    x, y, _ = base[:3, :3].T @ (points - base[:3, 3]).T
    links = np.diff(x + 1j * y)
    if np.abs(links).min() < TOLERANCES.geometry:
        return None
    first, second, third = np.angle(links).tolist()
    offset = [first, second - first, third - second, -third]
    last = frame_of(base[:3, 0], z[0], base[:3, :3] @ (x[3], y[3], 0.0) + base[:3, 3])
    tool = inverse(last) @ lines.T_base_tool
    pose = [*inverse(base)[:3].ravel(), *tool[:3].ravel()]
    params = np.array([*pose, *np.abs(links), *lines.sign, *offset])
    return Planar4(params, is_along(tool), robot)


class Planar4(ClosedForm):
    """The closed form of a planar arm with four joints."""

    name, title, reason = NAME, TITLE, "all four axes are parallel"
    tasks = (POSE, APPROACH, POSITION)

    def __init__(self, params: Array, upright: bool, robot: Robot) -> None:
        self.robot, self.params, self.upright = robot, params, upright
        self.lengths = tuple(params[LINKS:SIGN].tolist())
        self.kernels = BatchKernels(params, branches_one, branches_many)
        self.branches, self.meanings = self.names(robot, np.ones(robot.n))

    def names(self, robot: Robot, sense: Array) -> Names:
        """The rows are the signs of s2: positive with the elbow on the right, where z is up."""
        p = self.params
        stance = stance_of(robot, p[BASE:TOOL].reshape(3, 4), float(p[OFFSET]), float(p[SIGN] * sense[0]))
        part = left_or_right(stance, "elbow", "the elbow", "the third axis").times(-1.0)
        return names_of((part,), [(1.0,), (-1.0,)])

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """The direction of the third link; θ4 as well where the tool may turn about the axes."""
        return (_THETA4, _PHI) if self._turns(task) else (_PHI,)

    def _turns(self, task: int) -> bool:
        """Whether a task leaves ψ free: a point, and a direction along the axes."""
        return task == POSITION or (task == APPROACH and self.upright)

    def solve(self, problem: SolverInput) -> Candidates:
        """Both branches that bring the tool to the target's point, at the requested φ or the best one."""
        p = problem
        if self._turns(p.task):
            return self._solve_point(p)
        out, arcs = np.empty((2, 5)), np.empty((64, 3))
        gap, count = solve(self.params, p.T, p.task, p.values[0], p.seed, p.lower, p.upper, arcs, out)
        obstacle = Obstacle("last axis beyond the links' reach") if np.isnan(out[:, 0]).all() else None
        return Candidates(out[:, :4], out[:, 4:], (arcs[:count],), max(gap, 0.0) if obstacle else 0.0, obstacle)

    def _solve_point(self, problem: SolverInput) -> Candidates:
        """Both branches with θ4 and φ as requested, or near the seed's."""
        p, sign, offset = problem, float(self.params[SIGN + 3]), float(self.params[OFFSET + 3])
        out, arcs = np.empty((2, 6)), np.empty((2, ARCS, 3))
        asked = np.array([sign * p.values[0] + offset, p.values[1]])
        gap, first, second = solve_point(self.params, p.T, asked, p.seed, p.lower, p.upper, arcs, out)
        q = out[:, :4]
        if not math.isnan(p.values[0]):
            q[~np.isnan(q[:, 0]), 3] = p.values[0]
        turned = arcs[0, :first].copy()
        turned[:, 1:] = np.sort(sign * (turned[:, 1:] - offset), axis=1)
        low, high = float(p.lower[3]), float(p.upper[3])
        ranges = at_every_turn(_inside(turned, *turn_around(low, high, float(p.seed[3]))), low, high)
        obstacle = None
        if np.isnan(q[:, 0]).all():
            obstacle = Obstacle("point" if gap > 0.0 else "given joint values")
        values = np.column_stack([q[:, 3], out[:, 4]])
        return Candidates(q, values, (ranges, arcs[1, :second]), max(gap, 0.0) if obstacle else 0.0, obstacle)

    def value_at(self, T: Array, q: Array) -> float:
        """The direction of the third link."""
        return wrap(float(self.params[SIGN : SIGN + 3] @ q[:3] + self.params[OFFSET : OFFSET + 3].sum()))

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: the sign of s2."""
        return int(math.sin(self.params[SIGN + 1] * q[1] + self.params[OFFSET + 1]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The third singular value of the Jacobian: it vanishes where all three links are in line."""
        return those_within(within, by_jacobian(jacobian(self.robot, q), rank=3))


def _inside(arcs: Array, low: float, high: float) -> Array:
    """Intervals ``(k, 3)`` of an angle at the whole turns where they are inside [low, high], at most a turn wide.

    Those that touch become one.
    """
    found: list[tuple[float, float, float]] = []
    slack = TOLERANCES.limit
    for branch, x, y in arcs.tolist():
        for turn in range(math.ceil((low - slack - y) / TURN), math.floor((high + slack - x) / TURN) + 1):
            start, end = (min(max(value + TURN * turn, low), high) for value in (x, y))
            found.append((branch, start, end))
    return np.array(merged(found, slack)).reshape(-1, 3)
