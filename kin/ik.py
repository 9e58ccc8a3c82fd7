"""Inverse kinematics: choose a solver → its branches → one finishing pass → an answer with a reason.

`solve_ik` always answers. Its `status` tells what kind of answer it is, `reason` says it in a sentence, and
every configuration in it has been put through forward kinematics: the errors shown are measured, not assumed.

A closed form gives all branches; where the arm leaves a parameter free (arm angle, θ1, roll), the solver picks
for each branch the feasible value nearest to the seed, from exact feasible arcs, so that a pose that can be
reached inside the limits is found. A numeric descent (:mod:`kin.solvers.numeric`) answers what has no closed
form: the closest configuration to a target that cannot be met, and point-only tasks.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from kin import explain
from kin.errors import InputError
from kin.finish import DISTANCE, OVERRUN, POSITION_ERROR, ROLL, ROTATION_ERROR, finish, select
from kin.fk import fk
from kin.results import IKResult, IKSolution, LimitViolation, Redundancy, Status, Task
from kin.robot import Robot
from kin.solvers import Match, solver_for
from kin.solvers.common import APPROACH, POSE, POSITION, TASK_CODES, TURN, Candidates, Problem, wrap
from kin.solvers.numeric import best_of, spread
from kin.tolerances import TOLERANCES
from kin.transforms import Array, as_transform, finite_array

ORIENTATION_WEIGHT = 0.1
_STARTS = 24
_HAIR = 1e-6


def solve_ik(
    robot: Robot,
    target: ArrayLike,
    *,
    task: Task = "pose",
    q_seed: ArrayLike | None = None,
    respect_limits: bool = True,
    max_solutions: int | None = None,
    redundancy: float | None = None,
) -> IKResult:
    """All configurations that bring the tool to `target`, or why there are none.

    Args:
        robot: the arm.
        target: T_base_tool ``(4, 4)``; for ``task="position"`` also just a point ``(3,)`` in metres.
        task: ``"pose"`` (all six), ``"approach"`` (point and direction of the tool's z axis) or ``"position"``.
        q_seed: ``(n,)`` configuration to stay near; the home pose by default.
        respect_limits: leave out configurations outside the joint limits (each joint at its best whole turn).
        max_solutions: at most this many, the nearest first.
        redundancy: value of the arm's free parameter (arm angle ψ or θ1, radians) instead of the solver's choice.

    Raises:
        InputError: a malformed target, seed or option. An unreachable target is not an error.
    """
    return _Query(robot, target, task, q_seed, respect_limits, max_solutions, redundancy).answer()


def ik_branches(robot: Robot, target: Array, redundancy: float = math.nan) -> Array:
    """All closed-form branches ``(branches, n)`` for one pose, unverified, NaN where a branch does not exist.

    The thin call: no limits, no images, no order. Raises `InputError` for an arm without a closed form.
    """
    match = solver_for(robot)
    if match is None:
        raise InputError("robot", robot.id, "an arm with a closed form")
    T = np.ascontiguousarray(target, dtype=np.float64)
    seed = robot.q_home.copy()
    problem = Problem(T, POSE, redundancy, False, seed, robot.lower.copy(), robot.upper.copy())
    return match.solver.solve(match.geometry, problem).q


class _Query:
    """One call of `solve_ik`: the checked question and the steps towards its answer."""

    def __init__(
        self,
        robot: Robot,
        target: ArrayLike,
        task: str,
        q_seed: ArrayLike | None,
        respect_limits: bool,
        max_solutions: int | None,
        redundancy: float | None,
    ) -> None:
        if task not in TASK_CODES:
            raise InputError("task", task, "one of " + ", ".join(TASK_CODES))
        if max_solutions is not None and (isinstance(max_solutions, bool) or max_solutions < 1):
            raise InputError("max_solutions", max_solutions, "a whole number from 1, or none")
        if redundancy is not None and not math.isfinite(redundancy):
            raise InputError("redundancy", redundancy, "a finite angle in radians, or none")
        self.robot = robot
        self.task_name = task
        self.task = TASK_CODES[task]
        self.T = self._target(target)
        q = robot.q_home if q_seed is None else robot.check_q(q_seed, "q_seed")
        if q.ndim != 1:
            raise InputError("q_seed", f"shape {q.shape}", f"one configuration of {robot.n} values")
        self.seed = np.array(q)
        self.respect = respect_limits
        self.max_solutions = max_solutions
        self.value = math.nan if redundancy is None else float(redundancy)
        self.lower, self.upper = robot.lower.copy(), robot.upper.copy()
        self.turns = np.where(robot.revolute, TURN, 0.0)
        # Where a descent may go: inside the limits or, if these are to be ignored, one turn either way.
        free = robot.revolute & (not respect_limits)
        self.low = np.where(free, -TURN, self.lower)
        self.high = np.where(free, TURN, self.upper)
        self.match = solver_for(robot)
        if redundancy is not None and (self.match is None or robot.n < 7):
            raise InputError("redundancy", redundancy, f"none: {robot.id} has no free parameter to set")

    def _target(self, target: ArrayLike) -> Array:
        if self.task == POSITION and np.shape(target) == (3,):
            T = np.eye(4)
            T[:3, 3] = finite_array("target", target, (3,))
        else:
            T = as_transform(target)
        far = float(np.abs(T[:3, 3]).max())
        if far > 1e6:
            raise InputError("target position", T[:3, 3].tolist(), "coordinates below 1e6 m")
        return T

    # -- steps ---------------------------------------------------------------------------------------------

    def closed_form(self, T: Array, task: int, seed: Array | None = None) -> tuple[Match, Candidates] | None:
        """The branches for pose `T` from the arm's closed form, None if it has none for this task."""
        if self.match is None or not self.match.solver.handles(self.match.geometry, task):
            return None
        seed = self.seed if seed is None else seed
        roll = 0.0
        if task == APPROACH:
            x = fk(self.robot, seed)[:3, 0]
            roll = math.atan2(float(T[:3, 1] @ x), float(T[:3, 0] @ x))
        problem = Problem(T, task, self.value, self.respect, seed, self.lower, self.upper, roll)
        return self.match, self.match.solver.solve(self.match.geometry, problem)

    def measure(self, q: Array, task: int) -> tuple[Array, Array]:
        """Candidates ``(k, n)`` at their best images, with their statistics ``(k, 5)`` by FK."""
        q = np.ascontiguousarray(q)
        stats = np.empty((q.shape[0], 5))
        finish(
            self.robot.model, self.T, task, self.seed, self.lower, self.upper, self.turns, self.respect, q, stats
        )
        return q, stats

    def solution(
        self, q: Array, stats: Array, branch: str, parameter: float = math.nan, compromise: str | None = None
    ) -> IKSolution:
        q = q.copy()
        q.flags.writeable = False
        return IKSolution(
            q=q,
            branch=branch,
            position_error=float(stats[POSITION_ERROR]),
            rotation_error=float(stats[ROTATION_ERROR]),
            in_limits=bool(stats[OVERRUN] == 0.0),
            distance=float(stats[DISTANCE]),
            redundancy=None if math.isnan(parameter) else parameter,
            compromise=compromise,
        )

    def descend(self, task: int, starts: Array, weight: float, enough: float = 0.0) -> tuple[Array, float]:
        """Best configuration by numeric descent, and its error E in metres."""
        out = np.empty(self.robot.n)
        error = best_of(
            self.robot.model, self.T, task, weight, self.low, self.high, np.ascontiguousarray(starts), enough, out
        )
        return out, float(error)

    def starts(self, candidates: Array | None = None, count: int = _STARTS) -> Array:
        """Where a descent begins: the seed, the known branches, then points spread over the limits."""
        rows = [self.seed[None]]
        if candidates is not None:
            rows.append(candidates[~np.isnan(candidates[:, 0])])
        rows.append(spread(self.low, self.high, count))
        return np.concatenate(rows)

    # -- answers -------------------------------------------------------------------------------------------

    def answer(self) -> IKResult:
        if self.task == POSITION:
            return self.answer_position()
        known = self.closed_form(self.T, self.task)
        if known is None:
            return self.answer_numeric()
        match, candidates = known
        q, stats = self.measure(candidates.q, self.task)
        exists = stats[:, POSITION_ERROR] <= TOLERANCES.closure_position
        exact = exists & (stats[:, ROTATION_ERROR] <= TOLERANCES.closure_rotation)
        good = exact & (stats[:, OVERRUN] == 0.0) if self.respect else exact
        if not good.any():
            good = self.polish(q, stats)
            exact |= good
        if good.any():
            return self.solved(match, candidates, q, stats, good)
        if exact.any():
            return self.blocked(match, candidates, q, stats, exact)
        if self.robot.n < 6 and self.task == POSE:
            return self.compromise(match, candidates, q, stats, exists)
        return self.out_of_reach(candidates.obstacle, candidates.gap, candidates.q)

    def polish(self, q: Array, stats: Array) -> np.ndarray:
        """Descend from the rows that miss by a hair, in place; which of them then are good.

        Where two branches merge, a rounding error of 1e-16 in the target is 1e-8 in an angle: enough to push
        another joint past its stop or the roll past the closure tolerance.
        """
        good = np.zeros(len(q), dtype=bool)
        miss = stats[:, POSITION_ERROR] + stats[:, ROTATION_ERROR] + (stats[:, OVERRUN] if self.respect else 0.0)
        for i in np.flatnonzero(miss < _HAIR).tolist():
            near, _ = self.descend(self.task, q[i : i + 1], 1.0)
            row, row_stats = self.measure(near[None], self.task)
            error = max(row_stats[0, POSITION_ERROR], row_stats[0, ROTATION_ERROR])
            if error <= TOLERANCES.closure_position and (row_stats[0, OVERRUN] == 0.0 or not self.respect):
                q[i], stats[i], good[i] = row[0], row_stats[0], True
        return good

    def solved(self, match: Match, candidates: Candidates, q: Array, stats: Array, good: np.ndarray) -> IKResult:
        solutions = self.wrap_up(match, candidates, q, stats, good, stats[:, DISTANCE])
        redundancy = self.redundancy(match, candidates, solutions[0])
        return IKResult(
            status=Status.SOLVED,
            reason=explain.solved(len(solutions), self.task_name, redundancy is not None),
            solutions=solutions[: self.max_solutions],
            closest=None,
            solver=match.solver.NAME,
            task=self.task_name,
            redundancy=redundancy,
        )

    def wrap_up(
        self, match: Match, candidates: Candidates, q: Array, stats: Array, rows: np.ndarray, key: Array,
        compromise: str | None = None,
    ) -> tuple[IKSolution, ...]:  # fmt: skip
        """The chosen rows as named solutions, by rising key, each posture once."""
        kept, count = select(q, np.where(rows, key, math.inf))
        return tuple(
            self.solution(
                q[i],
                stats[i],
                match.solver.branch_name(i, q[i]),
                self.parameter(match, candidates, q, i),
                compromise,
            )
            for i in kept[:count].tolist()
        )

    def parameter(self, match: Match, candidates: Candidates, q: Array, row: int) -> float:
        """The redundancy value of a row; a joint's own value follows its whole-turn image."""
        value = float(candidates.parameter[row])
        return float(q[row, 0]) if match.solver.PARAMETER[0] == "theta1" and not math.isnan(value) else value

    def redundancy(self, match: Match, candidates: Candidates, best: IKSolution) -> Redundancy | None:
        if best.redundancy is None:
            return None
        name, label = match.solver.PARAMETER
        circular = name == "psi"
        return Redundancy(name, label, best.redundancy, union(candidates.arcs[:, 1:], circular))

    def blocked(self, match: Match, candidates: Candidates, q: Array, stats: Array, exact: np.ndarray) -> IKResult:
        """Branches exist, but each breaks a limit: name the joints of the least offending one."""
        order = np.where(exact, stats[:, OVERRUN], math.inf)
        least = int(np.argmin(order))
        violations = self.violations(q[least])
        closest = self.closest(candidates.q)
        return IKResult(
            status=Status.LIMITS,
            reason=explain.limits(self.robot, violations, self.given_redundancy(match)),
            solutions=(),
            closest=closest,
            solver=match.solver.NAME,
            task=self.task_name,
            violations=violations,
            distance=self.nearest_to_point(closest)[1],
        )

    def given_redundancy(self, match: Match) -> str:
        return "" if math.isnan(self.value) else match.solver.PARAMETER[1]

    def violations(self, q: Array) -> tuple[LimitViolation, ...]:
        found = []
        for i, joint in enumerate(self.robot.joints):
            limit = self.lower[i] if q[i] < self.lower[i] else self.upper[i]
            if not self.lower[i] <= q[i] <= self.upper[i]:
                found.append(LimitViolation(i, joint.name, float(q[i]), float(limit)))
        return tuple(found)

    def compromise(
        self, match: Match, candidates: Candidates, q: Array, stats: Array, exists: np.ndarray
    ) -> IKResult:
        """An arm with fewer than six joints cannot take every pose: give up as little as possible, and say so.

        First the answers that keep point and approach direction and are off by a roll about it (least roll
        first), then the one that keeps the point and has the least whole rotation error.
        """
        approach_q, approach_stats = self.measure(candidates.q, APPROACH)
        rows = exists & (approach_stats[:, ROTATION_ERROR] <= TOLERANCES.closure_rotation)
        possible = rows
        if self.respect:
            rows = rows & (stats[:, OVERRUN] == 0.0)
        solutions = self.wrap_up(match, candidates, q, stats, rows, np.abs(stats[:, ROLL]), "roll")
        nearest = self.least_rotation(candidates.q if rows.any() else None)
        if nearest is not None:
            solutions += (nearest,)
        if not solutions:
            return self.out_of_reach(candidates.obstacle, candidates.gap, candidates.q)
        violations: tuple[LimitViolation, ...] = ()
        if not rows.any() and possible.any():
            least = int(np.argmin(np.where(possible, approach_stats[:, OVERRUN], math.inf)))
            violations = self.violations(approach_q[least])
        return IKResult(
            status=Status.APPROXIMATE,
            reason=explain.approximate(self.robot, solutions[0], violations),
            solutions=solutions[: self.max_solutions],
            closest=min(solutions, key=lambda s: s.rotation_error),
            solver=match.solver.NAME,
            task=self.task_name,
            violations=violations,
        )

    def least_rotation(self, candidates: Array | None) -> IKSolution | None:
        """The configuration with the exact point and the least rotation error, None if the point is out of reach.

        A descent in which a radian weighs a tenth of a millimetre settles the orientation; its approach
        direction then goes through the closed form, which makes the point exact.
        """
        start, error = self.descend(POSITION, self.starts(candidates), 1.0, enough=1e-9)
        q = start
        if error <= 1e-7:
            for weight in (0.1, 1e-2, 1e-4):
                tries = np.stack([q, start]) if candidates is None else self.starts(candidates, 4)
                tries = np.concatenate([q[None], tries])
                q, _ = self.descend(POSE, tries, weight)
        if error > 1e-7:
            return None
        T = fk(self.robot, q)
        T[:3, 3] = self.T[:3, 3]
        known = self.closed_form(T, APPROACH, q)
        if known is not None:
            match, polished = known
            found, stats = self.measure(polished.q, POSE)
            miss = np.abs(found - q).max(axis=1)
            miss[~(stats[:, POSITION_ERROR] <= TOLERANCES.closure_position)] = math.inf
            if self.respect:
                miss[stats[:, OVERRUN] > 0.0] = math.inf
            best = int(np.argmin(miss))
            if miss[best] < 0.05:
                name = match.solver.branch_name(best, found[best])
                return self.solution(found[best], stats[best], name, compromise="rotation")
        # At a stop of the wrist the polished direction may leave the limits by a hair: polish the point alone.
        q, error = self.descend(POSITION, q[None], 1.0)
        if error > TOLERANCES.closure_position:
            return None
        found, stats = self.measure(q[None], POSE)
        return self.solution(found[0], stats[0], "numeric", compromise="rotation")

    def answer_position(self) -> IKResult:
        """Point only: settle the directions by descent from the seed, then list the branches that share them."""
        q, error = self.descend(POSITION, self.starts(count=4 * _STARTS), 1.0, enough=1e-11)
        if error > TOLERANCES.closure_position:
            return self.out_of_reach("", 0.0, None)
        T = fk(self.robot, q)
        T[:3, 3] = self.T[:3, 3]
        found, stats = self.measure(q[None], POSITION)
        names = ["numeric"]
        known = self.closed_form(T, POSE if self.robot.n >= 6 else APPROACH, q)
        solver = "numeric"
        if known is not None:
            match, candidates = known
            solver = match.solver.NAME
            rows, row_stats = self.measure(candidates.q, POSITION)
            keep = row_stats[:, POSITION_ERROR] <= TOLERANCES.closure_position
            if self.respect:
                keep &= row_stats[:, OVERRUN] == 0.0
            order = sorted(np.flatnonzero(keep).tolist(), key=lambda i: float(row_stats[i, DISTANCE]))
            if order:
                found, stats = rows[order], row_stats[order]
                names = [match.solver.branch_name(i, rows[i]) for i in order]
        solutions = tuple(self.solution(a, b, name) for a, b, name in zip(found, stats, names, strict=True))
        return IKResult(
            status=Status.SOLVED,
            reason=explain.solved(len(solutions), self.task_name, False),
            solutions=solutions[: self.max_solutions],
            closest=None,
            solver=solver,
            task=self.task_name,
        )

    def answer_numeric(self) -> IKResult:
        """A task with no closed form: the descent's best, from many starts."""
        q, _ = self.descend(self.task, self.starts(count=4 * _STARTS), 1.0, enough=1e-11)
        found, stats = self.measure(q[None], self.task)
        if (
            stats[0, POSITION_ERROR] > TOLERANCES.closure_position
            or stats[0, ROTATION_ERROR] > TOLERANCES.closure_rotation
        ):
            return self.out_of_reach("", 0.0, None)
        return IKResult(
            status=Status.SOLVED,
            reason=explain.solved(1, self.task_name, False),
            solutions=(self.solution(found[0], stats[0], "numeric"),),
            closest=None,
            solver="numeric",
            task=self.task_name,
        )

    def out_of_reach(self, obstacle: str, gap: float, candidates: Array | None) -> IKResult:
        """No configuration: tell a point out of reach from an orientation that cannot be had there."""
        closest = self.closest(candidates)
        nearest, distance = self.nearest_to_point(closest)
        if self.task == POSITION:
            closest = nearest
        return IKResult(
            status=Status.UNREACHABLE,
            reason=explain.unreachable(self.robot, self.T, nearest.q, distance, closest, obstacle, gap),
            solutions=(),
            closest=closest,
            solver=self.match.solver.NAME if self.match else "numeric",
            task=self.task_name,
            distance=distance,
        )

    def closest(self, candidates: Array | None) -> IKSolution:
        """The configuration inside the limits with the least E, ℓ = 0.1 m per radian."""
        q, _ = self.descend(self.task, self.starts(candidates), ORIENTATION_WEIGHT)
        found, stats = self.measure(q[None], self.task)
        return self.solution(found[0], stats[0], "numeric", compromise="closest")

    def nearest_to_point(self, closest: IKSolution) -> tuple[IKSolution, float]:
        """The configuration nearest to the target's point alone, and the metres that are missing there."""
        if closest.position_error <= TOLERANCES.closure_position:
            return closest, 0.0
        q, distance = self.descend(POSITION, self.starts(closest.q[None]), 1.0, enough=1e-11)
        found, stats = self.measure(q[None], self.task)
        nearest = self.solution(found[0], stats[0], "numeric", compromise="closest")
        return nearest, 0.0 if distance <= 1e-7 else distance


def union(arcs: Array, circular: bool) -> tuple[tuple[float, float], ...]:
    """Overlapping intervals ``(k, 2)`` joined and sorted; on a circle within (−π, π], split at the seam."""
    pieces: list[tuple[float, float]] = []
    for low, high in arcs.tolist():
        if not circular:
            pieces.append((low, high))
        elif high - low >= TURN - 1e-12:
            return ((-math.pi, math.pi),)
        else:
            start = wrap(low)
            end = start + (high - low)
            if end > math.pi:
                pieces += [(start, math.pi), (-math.pi, end - TURN)]
            else:
                pieces.append((start, end))
    joined: list[tuple[float, float]] = []
    for low, high in sorted(pieces):
        if joined and low <= joined[-1][1] + 1e-12:
            joined[-1] = (joined[-1][0], max(high, joined[-1][1]))
        else:
            joined.append((low, high))
    return tuple(joined)
