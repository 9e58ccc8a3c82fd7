"""Which kind of answer a problem has.

1. A closed form covers the task: its branches inside the limits are the solutions (`_solved`).
2. Without it, or for a task it does not cover: numeric descents (`_numeric`).
3. No solution: :mod:`kin.ik.failures` finds out why, and what comes closest.
"""

from __future__ import annotations

import numpy as np

from kin.axes import size
from kin.fk import fk
from kin.ik import avoidance, failures, nearest, preferences
from kin.ik.assembly import Found, by_key, curves_of, leaves_motion, make_result, with_images
from kin.ik.branches import Branches, Flags, is_closed, measure, solution, solve_branches
from kin.ik.candidates import DISTANCE, OVERRUN
from kin.ik.details import NotOnBranch, Solved
from kin.ik.problem import IKProblem
from kin.ik.results import IKResult, Status
from kin.solvers.contract import APPROACH, POSE, POSITION, Candidates
from kin.transforms import Array

_OTHERS = 8  # further starts of descents where the nearest of many configurations is wanted
_SUSPICIOUS = 1e3  # times the rounding: where the formulas of a rounded table may miss postures


def answer(problem: IKProblem, found: Candidates | None = None) -> IKResult:
    """The answer to a checked problem; found: what its closed form finds for it, if it has been asked.

    Where there is no exact solution, a target that looks rounded is met as closely as its digits say.
    """
    exact = _as_given(problem, found)
    rounded = None if exact.status is Status.SOLVED else problem.as_rounded()
    if rounded is None:
        return exact
    close = _as_given(rounded)
    return close if close.status is Status.SOLVED else exact


def _as_given(problem: IKProblem, found: Candidates | None = None) -> IKResult:
    """The answer within the tolerances of the problem."""
    if not problem.options.avoids:
        return _answer(problem, found)
    most = problem.options.max_solutions
    return avoidance.checked(problem, _answer(avoidance.with_all_solutions(problem)), most)


def answer_at_once(problem: IKProblem) -> IKResult | None:
    """The same where it takes some ten microseconds: solutions of a closed form that is quick. Else None."""
    options, form = problem.options, problem.closed_form
    if form is None or problem.code not in form.quick or problem.branches is not None or options.avoids:
        return None
    if not options.prefer == options.images == "nearest":
        return None
    branches = solve_branches(problem, problem.T, problem.code)
    return _solved(problem, branches, branches.good) if branches is not None and branches.order else None


def _answer(problem: IKProblem, found: Candidates | None = None) -> IKResult:
    branches = solve_branches(problem, problem.T, problem.code, found=found)
    if branches is None:
        return _numeric(problem)
    if branches.order and problem.branches is None:
        return _solved(problem, branches, branches.good)
    closed, good = branches.closed, branches.good
    if not branches.order and not problem.requested:  # a descent would change a requested value
        good = nearest.polish(problem, branches.q, branches.stats)
        closed |= good
    allowed = np.array([problem.allows(i) for i in range(len(closed))])
    if (good & allowed).any():
        return _solved(problem, branches, good & allowed)
    missed = _missed(problem, branches, closed)
    if missed is not None:
        return missed
    refused = _refused(problem, branches, closed, good, allowed)
    if refused.status is not Status.SOLVED:
        refused.completeness = branches.completeness
    return refused


def _refused(problem: IKProblem, branches: Branches, closed: Flags, good: Flags, allowed: Flags) -> IKResult:
    """The answer where no row ``(k,)`` that is allowed is a solution."""
    if (closed & allowed).any():
        return failures.outside_limits(problem, branches, closed & allowed, good)
    if closed.any():
        return failures.not_on_branch(problem, branches, closed, good)
    if problem.robot.n < 6 and problem.code == POSE:
        return failures.compromise(problem, branches, allowed)
    return failures.out_of_reach(problem, branches)


def _solved(problem: IKProblem, branches: Branches, good: Flags) -> IKResult:
    """The rows in `good` ``(k,)`` are the solutions."""
    touching = 0
    if problem.options.avoids:
        if preferences.searches(problem, branches):
            preferences.improve(problem, branches, good)
        searched = avoidance.searchable(problem, branches, good)
        free = avoidance.free_rows(problem, branches, good)
        if not free.any():
            refused = avoidance.all_touch(problem, branches.q[good], np.flatnonzero(good), searched)
            refused.completeness = "unknown" if searched else branches.completeness
            return refused
        touching, good = int((good & ~free).sum()), free
    result = _ordered(problem, branches, good)
    return result if touching == 0 else avoidance.with_count(result, touching)


def _ordered(problem: IKProblem, branches: Branches, good: Flags) -> IKResult:
    """The rows in `good` ``(k,)`` as solutions, in the preferred order."""
    searches = preferences.searches(problem, branches)
    if searches and not problem.options.avoids:
        preferences.improve(problem, branches, good)
    if problem.options.prefer != "nearest":
        order = by_key(branches.q, good, preferences.ranks(problem, branches.q, branches.stats[:, DISTANCE]))
    elif good is branches.good and not searches:
        order = branches.order
    else:
        order = by_key(branches.q, good, branches.stats[:, DISTANCE])
    found = Found(problem, branches, order, good)
    if problem.options.images == "nearest":
        return found.result()
    solutions = with_images(problem, found.all_solutions())
    redundancy = found.redundancy
    if redundancy and solutions[0].redundancy:
        redundancy = tuple(
            r._replace(value=own.value) for r, own in zip(redundancy, solutions[0].redundancy, strict=True)
        )
    details = found.details._replace(configurations=len(solutions))
    known = found.completeness
    return make_result(
        problem, Status.SOLVED, "", details, solutions=solutions, redundancy=redundancy, completeness=known
    )


def _missed(problem: IKProblem, branches: Branches, closed: Flags) -> IKResult | None:
    """What descents find of a rounded table where its family has nothing; None if nothing, or if it is exact.

    Joints that are free in the family may move the tool by little more than the rounding, and must then move far.
    Only where the closest configuration misses the target by little may there be one that meets it.
    """
    form = problem.closed_form
    if form is None or form.off == 0.0 or problem.requested:  # a descent would change a requested value
        return None
    near = nearest.closest(problem, branches.q)
    if near is not None and nearest.mismatch(problem, near) < _SUSPICIOUS * form.off * size(problem.robot):
        found = _by_descents(problem)
        if found is not None and (found.status is Status.SOLVED or not closed.any()):
            return found
    return failures.outside_by_descent(problem) if problem.respect and not closed.any() else None


def _numeric(problem: IKProblem) -> IKResult:
    """A task or an arm without a closed form."""
    found = _by_descents(problem)
    return failures.not_found(problem) if found is None else found


def _by_descents(problem: IKProblem) -> IKResult | None:
    """Descents from many starts; None if none meets the task.

    Where the arm has a closed form for whole poses, it adds the other branches of the poses found.
    """
    prefer = problem.options.prefer
    avoids, moves = problem.options.avoids, leaves_motion(problem)
    if problem.branches is None and prefer == "nearest" and not avoids:
        pool = nearest.solve_numerically(problem).q[None]
        if moves:
            others = nearest.descend_each(
                problem, problem.code, nearest.starting_points(problem, count=_OTHERS), 1.0
            )
            pool = np.concatenate([pool, others[0]])
    else:
        starts = nearest.starting_points(problem, count=4 * nearest.STARTS)
        pool = nearest.descend_each(problem, problem.code, starts, 1.0)[0]
    q, stats = _usable(problem, *measure(problem, pool))
    if not len(q):
        return None
    related = [_same_pose(problem, row) for row in (q[:1] if moves and prefer == "nearest" else q)]
    q = np.concatenate([q, *related])
    if prefer == "nearest":
        if moves:  # some leave their branch
            q = np.concatenate([q, nearest.moved_nearer(problem, q)])
        q, stats = measure(problem, q)
        key = stats[:, DISTANCE].copy()
    else:
        q, stats = preferences.centred(problem, q)
        key = preferences.ranks(problem, q, stats[:, DISTANCE])
    clear = avoidance.is_free(problem, q) if avoids else np.ones(len(q), bool)
    touching: list[int] = []
    # The best one of each branch: several descents may end on the same branch.
    best: dict[int, int] = {}
    for i in np.argsort(key, kind="stable").tolist():
        branch = problem.branch_of(q[i])
        if problem.allows(branch) and len(_usable(problem, q[i : i + 1], stats[i : i + 1])[0]):
            if clear[i]:
                best.setdefault(branch, i)
            else:
                touching.append(i)
    if touching and not best:
        return avoidance.all_touch(problem, q[touching], None)
    if not best:
        details = NotOnBranch(len({problem.branch_of(row) for row in q}), 0)
        closest = nearest.closest(problem, None)
        return make_result(problem, Status.UNREACHABLE, "branch", details, closest=closest)
    form = problem.closed_form if len(related[0]) else None
    return _descended(problem, q, stats, best, moves, "numeric" if form is None else form.name)


def _descended(
    problem: IKProblem, q: Array, stats: Array, best: dict[int, int], moves: bool, solver: str
) -> IKResult:
    """The answer with the best rows of q ``(k, n)`` that descents found, by branch; moves: as `leaves_motion`."""
    rows = list(best.values())
    curves, kept = ((), rows) if moves else curves_of(problem, q, rows)
    solutions = tuple(solution(problem, q[i], stats[i], branch) for branch, i in best.items() if i in kept)
    if problem.options.images == "all":
        solutions = with_images(problem, solutions)
    details = Solved(
        len(solutions),
        False,
        problem.chosen_branches,
        complete=False,
        infinite=bool(curves) or moves,
        postures=len(best),
        curves=curves,
    )
    return make_result(problem, Status.SOLVED, "", details, solutions=solutions, solver=solver)


def _usable(problem: IKProblem, q: Array, stats: Array) -> tuple[Array, Array]:
    """The rows that meet the task inside the limits."""
    rows = is_closed(problem, stats)
    if problem.respect:
        rows = rows & (stats[:, OVERRUN] == 0.0)
    return q[rows], stats[rows]


def _same_pose(problem: IKProblem, q: Array) -> Array:
    """The branches ``(k, n)`` of the closed form at the pose of q ``(n,)``."""
    T = fk(problem.robot, q)
    if problem.code == POSITION:
        T[:3, 3] = problem.T[:3, 3]
    form = problem.closed_form
    rolls = problem.robot.n < 6 and form is not None and form.handles(APPROACH)
    code = APPROACH if rolls else POSE
    free = code == POSE and form is not None and not all(p.rare for p in form.redundancies(POSE))
    nearest = problem.options.prefer == "nearest"
    found = solve_branches(problem, T, code, problem.seed if free and nearest else q)
    if found is not None and free and not nearest and not np.isnan(found.q).all():
        # The other branches at the same values of the redundancy parameters: they are as far from singularities.
        own = int(np.nanargmin(np.abs(found.q - q).max(axis=1)))
        found = solve_branches(problem, T, code, q, tuple(found.values[own].tolist()))
    return np.empty((0, problem.robot.n)) if found is None else found.q[~np.isnan(found.q[:, 0])]
