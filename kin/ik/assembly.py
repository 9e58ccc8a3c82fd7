"""From measured rows to results: order, solutions with their redundancy parameters, singularities."""

from __future__ import annotations

import math

import numpy as np

from kin.fk import jacobian
from kin.ik.branches import Branches, Flags, redundancy_of
from kin.ik.candidates import select
from kin.ik.details import Details, Redundancy, Solved
from kin.ik.options import Frame
from kin.ik.problem import IKProblem
from kin.ik.results import BlockedBranch, Cause, IKResult, IKSolution, Status
from kin.singularity import Singularity, singularities_at
from kin.solvers.contract import APPROACH, MASK, POSITION
from kin.solvers.numeric import spread
from kin.tolerances import TOLERANCES
from kin.transforms import Array


def by_key(q: Array, rows: Flags, key: Array) -> list[int]:
    """The flagged rows of q ``(k, n)`` by rising key, each configuration once."""
    kept, count = select(q, np.where(rows, key, math.inf))
    order: list[int] = kept[:count].tolist()
    return order


def solutions_of(
    problem: IKProblem, branches: Branches, order: list[int], every: Flags, compromise: str | None = None
) -> tuple[tuple[IKSolution, ...], tuple[Redundancy, ...]]:
    """Rows as solutions in this order, and the redundancy of the rows in `every` together."""
    q, stats = branches.q.copy(), branches.stats.tolist()
    q.flags.writeable = False
    each, together = redundancy_of(problem, branches, order, every)
    assert problem.closed_form is not None  # whose branches these are
    names = problem.closed_form.branches
    solutions = []
    for i, own in zip(order, each, strict=True):
        position, rotation, distance, overrun, _ = stats[i]
        solutions.append(IKSolution(q[i], names[i], position, rotation, overrun == 0.0, distance, own, compromise))
    return tuple(solutions), together


def leaves_motion(problem: IKProblem) -> bool:
    """Whether the task leaves the joints that may move a motion, at almost all targets."""
    frame: Frame = "base" if problem.code == MASK and problem.mask[6] else "tool"
    J = jacobian(problem.robot, spread(problem.low, problem.high, 16), frame)
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
) -> IKResult:
    """A result, with the singularities of the configuration it shows."""
    best = solutions[0] if solutions else closest
    singular: tuple[Singularity, ...] = ()
    if best is not None:
        singular = singularities_at(problem.robot, best.q, TOLERANCES.at_singularity)
    if solver is None:
        solver = "numeric" if problem.closed_form is None else problem.closed_form.name
    known = problem.closed_form is not None and problem.closed_form.handles(problem.code)
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
        complete=known and (details.complete if isinstance(details, Solved) else True),
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
