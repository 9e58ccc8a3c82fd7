"""From measured rows to results: order, solutions with their redundancy parameters, singularities, whole turns."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np

from kin.errors import InputError
from kin.fk import jacobian
from kin.ik import preferences
from kin.ik.branches import Branches, Flags, measure, redundancy_of, solution, with_further
from kin.ik.candidates import select
from kin.ik.details import Details, Redundancy, SolutionCurve, Solved
from kin.ik.problem import IKProblem
from kin.ik.results import BlockedBranch, Cause, IKResult, IKSolution, Status
from kin.singularity import Singularity, singularities_at
from kin.solvers.contract import APPROACH, MASK, POSITION, ClosedForm, Completeness, is_complete, weakest
from kin.solvers.curves import curves_among
from kin.solvers.numeric import spread
from kin.tolerances import TOLERANCES
from kin.transforms import Array

MOST_IMAGES = 4096  # of one solution
_STEP = 1e-4  # rad or m along a curve
Parameters = tuple[list[tuple[Redundancy, ...]], tuple[Redundancy, ...]]


def by_key(q: Array, rows: Flags, key: Array) -> list[int]:
    """The flagged rows of q ``(k, n)`` by rising key, each configuration once."""
    kept, count = select(q, np.where(rows, key, math.inf))
    order: list[int] = kept[:count].tolist()
    return order


class Found:
    """Exact solutions as the kernels left them: what their `IKResult` contains is made when it is first read.

    Args:
        order: the rows that are solutions, the best first.
        every: ``(k,)`` the rows whose intervals together are those of the best solution's redundancy.
    """

    __slots__ = ("_branches", "_curves", "_every", "_given", "_problem", "_redundancies", "_together")

    def __init__(self, problem: IKProblem, branches: Branches, order: list[int], every: Flags) -> None:
        self._problem, self._branches, self._given, self._every = problem, branches, order, every
        self._redundancies: Parameters | None = None
        self._together: tuple[Redundancy, ...] | None = None
        self._curves: tuple[tuple[SolutionCurve, ...], list[int]] | None = None

    def result(self) -> IKResult:
        """The answer; its solutions, details, redundancy and singularities are those below."""
        problem, form, requirement = self._problem, form_of(self._problem), self._problem.requirement
        result = IKResult.__new__(IKResult)
        result.read_from(self)
        result.status, result.cause, result.distance, result.target_error = (
            Status.SOLVED, "", 0.0, problem.target_error,
        )  # fmt: skip
        result.closest = result.nearest_orientation = None
        result.blocked, result.task = (), problem.task
        result.solver, result.solver_reason = form.name, form.reason
        result.tolerances, result.joints = (requirement.position, requirement.rotation), problem.robot.n
        return result

    @property
    def curves(self) -> tuple[SolutionCurve, ...]:
        """The curves on which solutions are; one solution is kept of each."""
        if self._curves is None:
            # A redundancy parameter tells the same, unless it is free at singular targets only.
            moves = any(not parameter.rare for parameter in self._branches.redundancies)
            self._curves = ((), self._given) if moves else curves_of(self._problem, self._branches.q, self._given)
        return self._curves[0]

    @property
    def _order(self) -> list[int]:
        """The rows that are solutions, the best first."""
        return self._given if not self.curves else self._curves[1]  # type: ignore[index]  # set by `curves`

    @property
    def completeness(self) -> Completeness:
        """How it is known that no solution is missing; where there is a curve, no proof covers it."""
        return weakest(self._branches.completeness, "agreed") if self.curves else self._branches.completeness

    @property
    def solutions(self) -> tuple[IKSolution, ...]:
        """As many solutions as are wanted."""
        return self.all_solutions(most=self._problem.options.max_solutions)

    def all_solutions(self, compromise: str | None = None, most: int | None = None) -> tuple[IKSolution, ...]:
        """Every solution, or the first ones."""
        q, stats = self._branches.q.copy(), self._branches.stats
        q.flags.writeable = False
        names, plain = form_of(self._problem).branches, not self._branches.redundancies
        solutions = []
        for place, row in enumerate(self._order[:most]):
            made = IKSolution.__new__(IKSolution)
            made.q, made.branch, made.compromise = q[row], names[row], compromise
            made.position_error, made.rotation_error, made.distance, overrun, _ = stats[row].tolist()
            made.in_limits = overrun == 0.0
            if plain:
                made.redundancy = ()
            else:
                made.read_from(_Place(self, place))
            solutions.append(made)
        return tuple(solutions)

    def redundancies(self) -> Parameters:
        """Of each solution, and of the best one with the intervals of all branches that have a solution."""
        if self._redundancies is None:
            self._redundancies = redundancy_of(self._problem, self._branches, self._order, self._every)
        return self._redundancies

    @property
    def redundancy(self) -> tuple[Redundancy, ...]:
        """The parameters of the best solution, with the intervals of all branches."""
        if self._together is None:
            self._together = with_further(self._branches, self.redundancies()[1])
        return self._together

    @property
    def details(self) -> Solved:
        """How many solutions there are, and what the task leaves free."""
        problem, names = self._problem, form_of(self._problem).branches
        redundancy, complete = self.redundancies()[1], is_complete(self.completeness)
        postures, multiple = len({names[row] for row in self._order}), self._multiple()
        if not redundancy and problem.options.redundancy is None:
            return Solved(
                len(self._order),
                False,
                problem.chosen_branches,
                complete,
                infinite=bool(self.curves),
                postures=postures,
                curves=self.curves,
                multiple=multiple,
            )
        fixed = tuple([parameter.label for parameter in problem.requested])
        free = tuple([r.label for r in redundancy if r.label not in fixed and _has_width(r)])
        if redundancy and not free and not fixed and self._branches.further is not None:
            free = tuple([r.label for r in self.redundancy if _has_width(r)])
        movable = redundancy and {
            p.name for p in problem.redundancies if p.joint < 0 or not problem.locked[p.joint]
        }
        return Solved(
            configurations=len(self._order),
            redundant=any(r.name in movable for r in redundancy),
            chosen_branches=problem.chosen_branches,
            infinite=bool(free or self.curves),
            curves=self.curves,
            postures=postures,
            free=free,
            fixed=fixed,
            complete=complete,
            multiple=multiple,
        )

    def _multiple(self) -> int:
        """How many solutions are isolated and on several rows."""
        if self.curves or len(self._every) == 1:
            return 0
        branches, rows = self._branches, np.array(self._order)
        apart = np.abs(branches.q[rows][:, None] - branches.q[self._every]).max(axis=2)
        several = rows[np.count_nonzero(apart <= TOLERANCES.merge, axis=1) > 1]
        if not several.size:
            return 0
        rare = [k for k, p in enumerate(branches.redundancies) if p.rare]
        return int(np.count_nonzero(np.isnan(branches.values[several][:, rare]).all(axis=1)))

    @property
    def singularities(self) -> tuple[Singularity, ...]:
        """Those of the best solution."""
        best = self._branches.q[self._order[0]]
        return singularities_at(self._problem.robot, best, TOLERANCES.at_singularity)


class _Place:
    """Of one solution, the redundancy parameters, made when they are first read."""

    __slots__ = ("_found", "_place")

    def __init__(self, found: Found, place: int) -> None:
        self._found, self._place = found, place

    @property
    def redundancy(self) -> tuple[Redundancy, ...]:
        """The parameters on its branch."""
        return self._found.redundancies()[0][self._place]


def curves_of(problem: IKProblem, q: Array, rows: list[int]) -> tuple[tuple[SolutionCurve, ...], list[int]]:
    """The curves through solutions q[rows] that the limits leave, and the rows with one row for each of them."""
    found, kept = curves_among(problem.robot, problem.T, problem.code, problem.free, q, rows)
    return tuple(
        SolutionCurve(tuple(q[curve.row].tolist()), tuple(curve.direction.tolist()))
        for curve in found
        if not problem.respect or _is_inside(problem, q[curve.row], curve.direction)
    ), kept


def _is_inside(problem: IKProblem, q: Array, direction: Array) -> bool:
    """Whether the limits leave a motion along a direction or against it."""
    steps = q + np.outer((_STEP, -_STEP), direction)
    return bool(((steps >= problem.lower) & (steps <= problem.upper) | (direction == 0.0)).all(axis=1).any())


def form_of(problem: IKProblem) -> ClosedForm:
    """The closed form that the branches of a problem are from."""
    assert problem.closed_form is not None
    return problem.closed_form


def _has_width(redundancy: Redundancy) -> bool:
    """Whether a redundancy parameter may have more than one value."""
    return any(high - low > TOLERANCES.merge for low, high in redundancy.intervals)


def leaves_motion(problem: IKProblem) -> bool:
    """Whether the task leaves the joints that may move a motion, at almost all targets."""
    of_world = problem.code == MASK and bool(problem.mask[6])
    J = jacobian(problem.robot, spread(problem.low, problem.high, 16), "world" if of_world else "tool")
    rows = {APPROACH: np.arange(5), POSITION: np.arange(3), MASK: np.flatnonzero(problem.mask[:6])}
    J = J[:, rows.get(problem.code, np.arange(6))][..., problem.low < problem.high]
    rank = int(np.linalg.matrix_rank(J, rtol=1e-9).max())
    return bool(rank < J.shape[-1])


def make_result(
    problem: IKProblem,
    status: Status,
    cause: Cause,
    details: Details,
    *,
    solutions: tuple[IKSolution, ...] = (),
    closest: IKSolution | None = None,
    solver: str | None = None,
    blocked: tuple[BlockedBranch, ...] = (),
    distance: float = 0.0,
    nearest_orientation: IKSolution | None = None,
    redundancy: tuple[Redundancy, ...] = (),
    completeness: Completeness = "unknown",
) -> IKResult:
    """A result, with the singularities of the configuration it shows."""
    best = solutions[0] if solutions else closest
    singular: tuple[Singularity, ...] = ()
    if best is not None:
        singular = singularities_at(problem.robot, best.q, TOLERANCES.at_singularity)
    if solver is None:
        solver = "numeric" if problem.closed_form is None else problem.closed_form.name
    return IKResult(
        status=status,
        cause=cause,
        details=details,
        solutions=solutions[: problem.options.max_solutions],
        closest=closest,
        solver=solver,
        solver_reason=_solver_reason(problem, solver),
        task=problem.task,
        blocked=blocked,
        distance=distance,
        nearest_orientation=nearest_orientation,
        redundancy=redundancy,
        singularities=singular,
        tolerances=(problem.requirement.position, problem.requirement.rotation),
        target_error=problem.target_error,
        completeness=completeness,
        joints=problem.robot.n,
    )


def _solver_reason(problem: IKProblem, used: str) -> str:
    """Why the answer comes from this solver."""
    closed_form = problem.closed_form
    if closed_form is None:
        why = (
            "none of Kinboard's closed forms fits this arm's axes"
            if problem.options.solver == "auto"
            else "requested"
        )
        return f"{why}: numeric descent from many starts"
    if used != closed_form.name:
        return f"the closed form ({closed_form.name}) does not cover this task or target: numeric descent"
    return closed_form.reason


def with_images(problem: IKProblem, solutions: tuple[IKSolution, ...]) -> tuple[IKSolution, ...]:
    """The solutions and all their whole-turn images inside the limits, in the preferred order.

    Raises:
        InputError: more than 4096 images of one solution.
    """
    found: list[IKSolution] = []
    for first in solutions:
        choices = [
            _images_of(x, *span)
            for x, *span in zip(first.q.tolist(), problem.lower, problem.upper, problem.turns, strict=True)
        ]
        total = math.prod(len(choice) for choice in choices)
        if total > MOST_IMAGES:
            raise InputError("images", "all", f"limits that leave at most {MOST_IMAGES} images, not {total}")
        q, stats = measure(problem.without_turns(), np.array([*itertools.product(*choices)]))
        for row, figures in zip(q, stats, strict=True):
            image = solution(problem, row, figures, -1)
            redundancy = tuple(
                r._replace(value=float(row[p.joint])) if p.joint >= 0 else r
                for r in first.redundancy
                for p in problem.redundancies
                if p.name == r.name
            )
            found.append(replace(image, branch=first.branch, redundancy=redundancy, compromise=first.compromise))
    if problem.options.prefer == "nearest":
        return tuple(sorted(found, key=lambda s: s.distance))
    order = preferences.ranks(problem, np.array([s.q for s in found]), np.array([s.distance for s in found]))
    return tuple(found[i] for i in np.argsort(order).tolist())


def _images_of(x: float, low: float, high: float, turn: float) -> list[float]:
    """x + k·turn inside [low, high], x first; only x where a joint has no images or no limits."""
    if turn == 0.0 or not math.isfinite(high - low):
        return [x]
    first = math.ceil((low - TOLERANCES.limit - x) / turn)
    last = math.floor((high + TOLERANCES.limit - x) / turn)
    if last - first > MOST_IMAGES:
        raise InputError("images", "all", f"limits that leave at most {MOST_IMAGES} images")
    return [x, *(x + k * turn for k in range(first, last + 1) if k != 0)]
