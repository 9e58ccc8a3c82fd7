"""The general solver of six revolute joints: matching, the choice of cuts, solutions, singularities."""

from __future__ import annotations

import math

import numpy as np

from kin.axes import is_along, is_zero, links_of, screw_x, screw_z
from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.solvers.canonical import free_last, without_last
from kin.solvers.common import TURN, UNBOUNDED
from kin.solvers.contract import (
    APPROACH,
    POSE,
    BatchKernels,
    Candidates,
    ClosedForm,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.general6.backwards import backwards, turned_round
from kin.solvers.general6.batch import SOLUTIONS, branches_many, branches_one, misfit_of_degree
from kin.solvers.general6.cuts import SHIFT, SIZE, cut_at
from kin.solvers.numeric import each_of
from kin.solvers.singular import Singularity, by_jacobian, those_within
from kin.transforms import Array

NAME = "general6"
TITLE = "elimination, any six revolute joints"
BRANCHES = tuple(f"solution {i + 1}" for i in range(SOLUTIONS))
_THETA6 = RedundancyParameter("theta6", "θ6", joint=5)
_VALID = 1e-9  # largest misfit of degree of a valid cut
_POSES = 24  # random poses that decide among valid cuts
_PROBES = 5  # of these poses, those on which the degree is checked
_CUTS = 3  # the most that are kept
# Targets close by, in radians and shares of the reach; the error of a solution, how far apart two are, and the
# smallest singular value of a double one.
_STEPS = tuple(
    screw_z(1e-3 * a, 1e-3 * b) @ screw_x(1e-3 * c, 1e-3 * d)
    for a, b, c, d in ((1.0, 0.6, -0.8, 0.9), (-0.7, 0.8, 1.1, -0.5), (0.3, -1.2, 0.9, 0.4))
)
_MASK = np.array([1.0] * 6 + [0.0])
_MET, _SAME, _SHARED, _DOUBLE = 1e-10, 1e-6, 1e-5, 1e-5
_RARE = 1  # of these poses, those with an odd number of solutions on an arm without special axes


def match(robot: Robot) -> General6 | None:
    """The general solver, if the robot has six revolute joints and its loop can be cut somewhere.

    Where some poses of the arm have solutions that it misses, the arm from tool to base may have better cuts.
    """
    if robot.n != 6 or not robot.revolute.all():
        return None
    links = links_of(robot, (1,) * 5)
    on_axis = is_zero(links.tool[0, 3], links.tool[1, 3]) and is_along(links.tool)
    params = _best_cuts(robot, [cut_at(links, shift) for shift in range(6)])
    missed = _missed(robot, params)
    kernels = BatchKernels(params, branches_one, branches_many)
    if missed > _RARE:
        back = backwards(robot)
        links = links_of(back, (1,) * 5)
        other = _best_cuts(back, [cut_at(links, shift) for shift in range(6)])
        if _missed(back, other) < missed:
            return General6(robot, turned_round(BatchKernels(other, branches_one, branches_many)), on_axis, True)
    return General6(robot, kernels, on_axis) if len(params) else None


def _poses(robot: Robot) -> tuple[Array, Array]:
    """Random configurations, and their poses."""
    q = np.random.default_rng(6).uniform(-math.pi, math.pi, (_POSES, 6))
    return q, fk(robot, q)


def _missed(robot: Robot, params: Array) -> int:
    """How many of the random poses have an odd number of solutions, or none, with these cuts."""
    if not len(params):
        return _POSES
    q, T = _poses(robot)
    out = np.empty((_POSES, SOLUTIONS, 6))
    branches_many(params, T, np.array([math.nan]), q[0], out)
    count = (~np.isnan(out[:, :, 0])).sum(axis=1)
    return int(((count % 2 == 1) | (count == 0)).sum())


def _best_cuts(robot: Robot, cuts: list[Array]) -> Array:
    """The parameters of the best valid cuts, concatenated: those that find most configurations of random poses.

    A cut counts as valid if it is for most of a few poses; one that misses a quarter of the poses is not used.
    """
    q, T = _poses(robot)
    ranked: list[tuple[int, int, int, Array]] = []
    out = np.empty((_POSES, SOLUTIONS, 6))
    for cut in cuts:
        if np.median([misfit_of_degree(cut, pose) for pose in T[:_PROBES]]) > _VALID:
            continue
        branches_many(cut, T, np.array([math.nan]), q[0], out)
        there = ~np.isnan(out[:, :, 0])
        apart = np.abs((out - q[:, None] + math.pi) % TURN - math.pi).max(axis=2)
        apart[~there] = math.inf
        missed = int((apart.min(axis=1) > 1e-6).sum())
        if missed < _POSES // 4:
            ranked.append((missed, -int(there.sum()), len(ranked), cut))
    ranked.sort(key=lambda entry: entry[:3])
    return np.concatenate([entry[3] for entry in ranked[:_CUTS]] or [np.empty(0)])


class General6(ClosedForm):
    """All solutions of an arm with six revolute joints that has no closed form of its own.

    Rows are numbered, not named: there may be up to sixteen, the arm may pass from one to another without meeting
    a singularity, and their number changes from pose to pose.
    """

    name, title, branches = NAME, TITLE, BRANCHES
    reason = "six revolute joints whose axes fit no closed form: all real solutions by elimination"
    lengths = ()
    named = False

    def __init__(self, robot: Robot, kernels: BatchKernels, tool_on_axis: bool, turned: bool = False) -> None:
        self.robot = robot
        self.tool_on_axis = tool_on_axis
        self.kernels = kernels
        solved = {int(2 + shift) % 6 for shift in kernels.params[SHIFT::SIZE]}
        self._solved_for = [5 - joint if turned else joint for joint in sorted(solved)]

    def handles(self, task: int) -> bool:
        """Poses, and an approach direction when it is the last joint's own axis (then that joint is free)."""
        return task == POSE or (task == APPROACH and self.tool_on_axis)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """None for a pose, joint 6 for an approach direction."""
        return (_THETA6,) * (task == APPROACH)

    def solve(self, problem: SolverInput) -> Candidates:
        """All solutions; with an approach direction only, joint 6 stays or takes the value requested."""
        out, free_roll = np.empty((SOLUTIONS, 6)), problem.task == APPROACH
        T = without_last(problem)[0] if free_roll else problem.T
        self.kernels.one(self.kernels.params, T, math.nan, problem.seed, out)
        complete = self.add_missing(T, problem.seed, out)
        values, ranges = np.full((SOLUTIONS, int(free_roll)), math.nan), []
        if free_roll:
            ranges.append(free_last(problem, out))
            values[:, -1] = out[:, 5]
        return Candidates(out, values, tuple(ranges), complete=complete)

    def add_missing(self, T: Array, near: Array, q: Array) -> bool:
        """Add to solutions ``(16, 6)`` those that share an angle with another and may be missing."""
        return self._is_plain(q) or self._add_nearby(T, near, q)

    def _is_plain(self, q: Array) -> bool:
        """Whether solutions ``(16, 6)`` come in pairs, and none share an angle that the elimination solves for."""
        there = q[~np.isnan(q[:, 0])]
        return len(there) % 2 == 0 and all(
            np.diff(np.sort(there[:, joint])).min(initial=1.0) > _SHARED for joint in self._solved_for
        )

    def _add_nearby(self, T: Array, near: Array, q: Array) -> bool:
        """Add to doubtful solutions ``(16, 6)`` what targets close by lead to; whether none is missing.

        Where several share the angle that the elimination solves for, it may miss one. Close by they differ.
        """
        rows, count = np.empty((SOLUTIONS, 6)), int((~np.isnan(q[:, 0])).sum())
        wide, errors = np.full(6, UNBOUNDED), np.empty(SOLUTIONS)
        for step in _STEPS:
            moved = T @ step
            moved[:3, 3] = T[:3, 3] + self.robot.reach * step[:3, 3]
            self.kernels.one(self.kernels.params, moved, math.nan, near, rows)
            there = rows[~np.isnan(rows[:, 0])].copy()
            goal = (np.ascontiguousarray(T), POSE, _MASK, 1.0)
            each_of(self.robot.model, goal, (-wide, wide, np.zeros(6)), -1.0, len(there) + 1, there, errors)
            for row, error in zip(there, errors, strict=False):
                apart = np.abs((q[:count] - row + math.pi) % TURN - math.pi).max(axis=1, initial=0.0)
                if error < _MET and count < SOLUTIONS and (count == 0 or apart.min() > _SAME):
                    q[count] = math.pi - (math.pi - row) % TURN
                    count += 1
        if count and count % 2 == 0:
            return True
        # A double solution counts once.
        sigma = np.linalg.svd(jacobian(self.robot, q[:count]), compute_uv=False)[:, -1]
        return bool(sigma.min(initial=math.inf) < _DOUBLE)

    def branch_of(self, q: Array) -> int:
        """The row of q ``(6,)`` among all solutions of its pose."""
        out = np.empty((SOLUTIONS, 6))
        self.kernels.one(self.kernels.params, fk(self.robot, q), math.nan, q, out)
        apart = np.abs((out - q + math.pi) % TURN - math.pi).max(axis=1)
        return 0 if np.isnan(apart).all() else int(np.nanargmin(apart))

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The smallest singular value of the Jacobian: where it vanishes has no simple form."""
        return those_within(within, by_jacobian(jacobian(self.robot, q), rank=6))
