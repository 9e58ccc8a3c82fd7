"""The general solver of six revolute joints: matching, the choice of cuts, solutions, singularities."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from kin.angles import apart, wrapped
from kin.axes import is_along, is_zero, links_of, screw_x, screw_z
from kin.differential.metric import extent
from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.solvers.canonical import free_last, without_last
from kin.solvers.contract import (
    APPROACH,
    POSE,
    BatchKernels,
    Candidates,
    ClosedForm,
    Completeness,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.curves import curves_among
from kin.solvers.general6.batch import (
    AGREED,
    PROVED,
    SOLUTIONS,
    branches_many,
    branches_one,
    misfit_of_degree,
    solve_all,
)
from kin.solvers.general6.cuts import cuts_of
from kin.solvers.general6.opposite import loop_with_opposite_slides, opposite_kernels, solve_opposite
from kin.solvers.general6.orders import Reading, readings
from kin.solvers.numeric import descend_freely
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "general6"
TITLE = "elimination, any six joints of which at least four turn"
BRANCHES = tuple(f"solution {i + 1}" for i in range(SOLUTIONS))
_THETA6 = RedundancyParameter("theta6", "θ6", joint=5)
_MOST_SLIDES = 2  # `slides3` has three; more cannot turn the tool in every direction
_REGULAR = TOLERANCES.regular
_VALID = 1e-9  # largest misfit of degree of a valid cut
_EXACT = 1e-14  # a misfit that is rounding error
_SIMILAR = 30.0  # misfits within this factor are as good
_POSES = 24  # random poses that decide among valid cuts
_PROBES = 9  # of these poses, those on which the degree is checked
_CUTS = 3  # the most that are kept
# Targets close by, in radians and shares of the reach; the error of a solution, how far apart two are, and the
# smallest singular value of a double one.
STEPS = tuple(
    screw_z(1e-3 * a, 1e-3 * b) @ screw_x(1e-3 * c, 1e-3 * d)
    for a, b, c, d in ((1.0, 0.6, -0.8, 0.9), (-0.7, 0.8, 1.1, -0.5), (0.3, -1.2, 0.9, 0.4))
)
MET, SAME = 1e-10, 1e-6
_JOINTS = np.arange(6)
COPIES = 1e-3  # rad, m: farther apart are no copies of one solution, whatever its multiplicity
SolveAll = Callable[[Array, Array, Array], int]
# Beside curves: random starts of each of two searches, rows that are compared.
_STARTS, _MOST_ROWS = 40, 60
# Smallest singular values: near a fold, so near that targets close by are asked, so near that nothing is agreed.
_FOLD, _NEAR_FOLD, _AT_FOLD = 1e-2, 1e-4, 1e-5
_ALONG = np.array([1e-3, -1e-3, 3e-3, -3e-3, 1e-2, -1e-2, 3e-2, -3e-2, 0.1, -0.1, 0.3, -0.3])
_RARE = 1  # of these poses, those with an odd number of solutions on an arm without special axes


def match(robot: Robot) -> General6 | None:
    """The general solver, if at least four of six joints turn and the arm's loop can be cut somewhere.

    Where it misses solutions of some poses, the arm in another order may have better cuts.
    """
    slides = int((~robot.revolute).sum())
    if robot.n != 6 or slides > _MOST_SLIDES or (slides and not moves_freely(robot)):
        return None
    tool = links_of(robot, (1,) * 5).tool
    on_axis = bool(robot.revolute[5]) and is_zero(tool[0, 3], tool[1, 3]) and is_along(tool)
    best: tuple[int, General6] | None = None
    for reading in readings(robot):
        cuts = _best_cuts(reading.robot)
        kernels, solve = BatchKernels(cuts, branches_one, branches_many), solve_all
        opposite = None if len(cuts) else loop_with_opposite_slides(reading.robot)
        if opposite is not None:
            kernels, solve = opposite_kernels(opposite), solve_opposite
        missed, proved = _tried(reading.robot, kernels.params, solve)
        if len(kernels.params) and (best is None or missed < best[0]):
            best = missed, General6(robot, kernels, on_axis, reading, solve, proved)
        if missed <= _RARE:
            break
    return best[1] if best is not None and best[0] < _POSES // 2 else None


def _poses(robot: Robot) -> tuple[Array, Array]:
    """Random configurations, and their poses."""
    q = np.random.default_rng(6).uniform(-math.pi, math.pi, (_POSES, 6))
    q[:, ~robot.revolute] *= extent(robot) / math.pi
    return q, fk(robot, q)


def moves_freely(robot: Robot) -> bool:
    """Whether an arm with six joints can move its tool in every direction."""
    J = jacobian(robot, np.random.default_rng(5).uniform(-1.0, 1.0, (4, 6)))
    J[:, :3, robot.revolute] /= extent(robot)
    return int(np.linalg.matrix_rank(J, rtol=_REGULAR).max()) == 6


def _tried(robot: Robot, params: Array, solve: SolveAll) -> tuple[int, int]:
    """How many of the random poses have an odd number of solutions, or none, and how many have certainly all."""
    if not len(params):
        return _POSES, 0
    out, T = np.empty((_POSES, SOLUTIONS, 6)), _poses(robot)[1]
    proved = [solve(params, pose, rows) for pose, rows in zip(T, out, strict=True)].count(PROVED)
    count = (~np.isnan(out[:, :, 0])).sum(axis=1)
    return int(((count % 2 == 1) | (count == 0)).sum()), proved


def _best_cuts(robot: Robot) -> Array:
    """The parameters of the best valid cuts, concatenated: those that miss least, of these those that prove most.

    A cut counts as valid if it is for most of a few poses; one that misses a quarter of the poses is not used. A
    cut that would be degenerate but for the rounding of the table is valid with a large misfit.
    """
    q, T = _poses(robot)
    ranked: list[tuple[int, int, int, int, Array]] = []
    out = np.empty((_POSES, SOLUTIONS, 6))
    for cut in cuts_of(robot):
        misfit = max(float(np.median([misfit_of_degree(cut, pose) for pose in T[:_PROBES]])), _EXACT)
        if not misfit <= _VALID:
            continue
        proved = [solve_all(cut, pose, rows) for pose, rows in zip(T, out, strict=True)].count(PROVED)
        there = ~np.isnan(out[:, :, 0])
        away = apart(out, q[:, None], robot.revolute)
        away[~there] = math.inf
        missed = int((away.min(axis=1) > 1e-6).sum())
        if missed < _POSES // 4:
            off = int(math.log(misfit / _EXACT) / math.log(_SIMILAR))
            ranked.append((missed, -proved, off, len(ranked), cut))
    ranked.sort(key=lambda entry: entry[:4])
    return np.concatenate([entry[4] for entry in ranked[:_CUTS]] or [np.empty(0)])


class General6(ClosedForm):
    """All solutions of an arm with six joints, of which at most two slide, that has no closed form of its own.

    Rows are numbered, not named: there may be up to sixteen, the arm may pass from one to another without meeting
    a singularity, and their number changes from pose to pose.

    Attributes:
        reading: the order in which the kernels read the arm's joints.
        solver: finds the rows of a target in that order.
        proved: of how many of a few random poses the solutions are proved to be all.
    """

    name, title, branches = NAME, TITLE, BRANCHES
    lengths = ()
    named = False

    def __init__(
        self,
        robot: Robot,
        kernels: BatchKernels,
        tool_on_axis: bool,
        reading: Reading,
        solve: SolveAll,
        proved: int,
    ) -> None:
        self.robot = robot
        self.tasks = (POSE, APPROACH) if tool_on_axis else (POSE,)
        self.kernels = reading.kernels(kernels)
        self.reading, self.solver, self.proved = reading, solve, proved
        slides = int((~robot.revolute).sum())
        kind = ("revolute joints", "joints, one of which slides,", "joints, two of which slide,")[slides]
        self.reason = f"six {kind} whose axes fit no closed form: all real solutions by elimination"

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """None for a pose, joint 6 for an approach direction."""
        return (_THETA6,) * (task == APPROACH)

    def solve(self, problem: SolverInput) -> Candidates:
        """All solutions; with an approach direction only, joint 6 stays or takes the value requested."""
        out, free_roll = np.empty((SOLUTIONS, 6)), problem.task == APPROACH
        T = without_last(problem)[0] if free_roll else problem.T
        completeness = self.add_missing(T, problem.seed, out)
        values, ranges = np.full((SOLUTIONS, int(free_roll)), math.nan), []
        if free_roll:
            ranges.append(free_last(problem, out))
            values[:, -1] = out[:, 5]
        return Candidates(out, values, tuple(ranges), completeness=completeness)

    def add_missing(self, T: Array, near: Array, q: Array) -> Completeness:
        """q ``(16, 6)`` ← all solutions, copies of a multiple one alike; how it is known that these are all."""
        known = self._all(T, near, q)
        if known != "proved":
            self._merge_copies(T, q)
        return known

    def _merge_copies(self, T: Array, q: Array) -> None:
        """Make the copies into which rounding splits a multiple solution of q ``(16, 6)`` one, in place.

        What is between two copies meets the target as well as they do; between two solutions nothing does.
        """
        turns, rows = self.robot.revolute, np.flatnonzero(~np.isnan(q[:, 0])).tolist()
        for k, i in enumerate(rows):
            close = [j for j in rows[:k] if apart(q[j], q[i], turns) < COPIES]
            off = np.where(turns, wrapped(q[close] - q[i]), q[close] - q[i])
            miss = np.abs(fk(self.robot, q[i] + 0.5 * off) - T).max(axis=(1, 2), initial=0.0)
            if (miss < TOLERANCES.closure_position).any():
                q[i] = q[close[int(miss.argmin())]]

    def _all(self, T: Array, near: Array, q: Array) -> Completeness:
        """`add_missing`, with the copies of multiple solutions."""
        known = self._solve_all(T, q)
        rows = q[~np.isnan(q[:, 0])]
        if curves_among(self.robot, T, POSE, _JOINTS, rows, list(range(len(rows))))[0]:
            return self._beside_curves(T, near, q)
        if known == PROVED:
            return "proved"
        # Beside a singular wrist all cuts may miss the same two postures: a target close by has them apart.
        if known == AGREED and not self._doubtful(q) and len(self._near_target(T, STEPS[0])) == len(rows):
            return "agreed"
        return "agreed" if self._add_nearby(T, q) else "unknown"

    def _solve_all(self, T: Array, q: Array) -> int:
        """q ``(16, 6)`` ← the solutions that the kernels find, and what `solve_all` knows of them."""
        known = int(self.solver(self.kernels.params, self.reading.target(T), q))
        q[:, list(self.reading.order)] = q.copy()
        return known

    def _beside_curves(self, T: Array, near: Array, q: Array) -> Completeness:
        """Find the isolated solutions of a pose that a curve meets too; q ``(16, 6)`` has one row for each.

        The elimination has no isolated roots there. Targets close by and random starts lead to the others.
        """
        # Of a curve the point nearest to the seed comes first.
        rows = self._thinned(T, np.concatenate([self._descended(T, near[None]), q[~np.isnan(q[:, 0])]]))
        close = [self._near_target(T, step) for step in STEPS]
        starts = np.random.default_rng(8).uniform(-math.pi, math.pi, (2, _STARTS, 6))
        starts[..., ~self.robot.revolute] *= extent(self.robot) / math.pi
        for each in (np.concatenate(close), *starts):
            before = len(rows)
            rows = self._thinned(T, np.concatenate([rows, self._descended(T, each)]))
        q[:] = math.nan
        q[: min(len(rows), SOLUTIONS)] = rows[:SOLUTIONS]
        return "agreed" if len(rows) == before <= SOLUTIONS else "unknown"

    def _thinned(self, T: Array, rows: Array) -> Array:
        """The configurations ``(k, 6)``, each once, and of those on one curve the first."""
        kept: list[int] = []
        for i, row in enumerate(rows):
            if all(apart(rows[kept], row, self.robot.revolute) > SAME) and len(kept) < _MOST_ROWS:
                kept.append(i)
        rows = np.ascontiguousarray(rows[kept])
        return rows[curves_among(self.robot, T, POSE, _JOINTS, rows, list(range(len(rows))))[1]]

    def _doubtful(self, q: Array) -> bool:
        """Whether a solution of q ``(16, 6)`` is so near a fold that its twin may be missing."""
        there = q[~np.isnan(q[:, 0])]
        return len(there) % 2 == 1 or bool(self._folds(there).min(initial=math.inf) < _NEAR_FOLD)

    def _folds(self, q: Array) -> Array:
        """The smallest singular value ``(k,)`` at each configuration, lengths in shares of the reach."""
        J = jacobian(self.robot, q)
        J[:, :3, self.robot.revolute] /= extent(self.robot)
        return np.asarray(np.linalg.svd(J, compute_uv=False)[:, -1])

    def _add_nearby(self, T: Array, q: Array) -> bool:
        """Add to doubtful solutions ``(16, 6)`` what targets close by lead to; whether they lead to nothing else.

        Where several share the angle that the elimination solves for, it may miss one. Close by they differ. The
        twin of a solution near a fold is looked for along the direction in which the arm barely moves.
        """
        count = found = int((~np.isnan(q[:, 0])).sum())
        for step in STEPS:
            count = self._add(T, self._near_target(T, step), q, count)
        done = 0
        while done < count:
            near = q[done:count][self._folds(q[done:count]) < _FOLD]
            done = count
            if len(near):
                J = jacobian(self.robot, near)
                weak = np.linalg.svd(J)[2][:, -1]
                starts = near[:, None] + _ALONG[None, :, None] * weak[:, None]
                count = self._add(T, starts.reshape(-1, 6), q, count)
        even = count > 0 and count % 2 == 0
        return even and count == found and bool(self._folds(q[:count]).min() > _AT_FOLD)

    def _add(self, T: Array, starts: Array, q: Array, count: int) -> int:
        """Add to the first `count` rows of q ``(16, 6)`` where descents from `starts` end; their number."""
        for row in self._descended(T, starts):
            if count < SOLUTIONS and all(apart(q[:count], row, self.robot.revolute) > SAME):
                q[count] = row
                count += 1
        return count

    def _near_target(self, T: Array, step: Array) -> Array:
        """The solutions ``(k, 6)`` of a target close by."""
        moved, rows = T @ step, np.empty((SOLUTIONS, 6))
        moved[:3, 3] = T[:3, 3] + extent(self.robot) * step[:3, 3]
        self._solve_all(moved, rows)
        return rows[~np.isnan(rows[:, 0])]

    def _descended(self, T: Array, starts: Array) -> Array:
        """Where descents from `starts` ``(k, 6)`` meet the target."""
        rows, errors = descend_freely(self.robot.model, T, POSE, starts)
        met = rows[errors < MET]
        return np.asarray(np.where(self.robot.revolute, wrapped(met), met))
