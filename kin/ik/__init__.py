"""Inverse kinematics: choose a solver → its branches → one finishing pass → an answer with a reason.

`solve_ik` always answers. Its `status` tells what kind of answer it is, `reason` says it in a sentence, and
every configuration in it has been put through forward kinematics: the errors shown are measured, not assumed.

A closed form gives all branches; where the arm leaves a parameter free (arm angle, θ1, roll), the solver picks
for each branch the feasible value nearest to the seed, from exact feasible arcs, so that a pose that can be
reached inside the limits is found. A numeric descent (:mod:`kin.solvers.numeric`) answers what has no closed
form: the closest configuration to a target that cannot be met, and tasks or arms without one.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError
from kin.fk import fk
from kin.ik import messages, preferences
from kin.ik import nearest as search
from kin.ik.branches import (
    Branches,
    Flags,
    is_closed,
    measure,
    redundancy_of,
    solution,
    solve_branches,
    violations_of,
)
from kin.ik.candidates import DISTANCE, OVERRUN, ROLL, select
from kin.ik.problem import Frame, Images, Limits, Locks, Preference, Question, Solver, ask
from kin.ik.results import BlockedBranch, Cause, IKResult, IKSolution, Redundancy, Status, Task
from kin.robot import Robot
from kin.singularity import Singularity, singularities_at
from kin.solvers import closed_form_of
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_MOST_IMAGES = 4096


def solve_ik(
    robot: Robot,
    target: ArrayLike,
    *,
    task: Task = "pose",
    mask: Sequence[bool] | None = None,
    mask_frame: Frame = "tool",
    q_seed: ArrayLike | None = None,
    respect_limits: bool = True,
    limits: Limits | None = None,
    locked: Locks | None = None,
    branch: str | Sequence[str] | None = None,
    images: Images = "nearest",
    prefer: Preference = "nearest",
    redundancy: float | Mapping[str, float] | None = None,
    max_solutions: int | None = None,
    solver: Solver = "auto",
) -> IKResult:
    """All configurations that bring the tool to `target`, or why there are none.

    Args:
        robot: the arm.
        target: T_base_tool ``(4, 4)``; for ``task="position"`` also just a point ``(3,)`` in metres.
        task: ``"pose"`` (all six), ``"approach"`` (point and direction of the tool's z axis) or ``"position"``.
        mask: instead of a task, which of the six coordinates x, y, z, rx, ry, rz of the error must vanish; the
            last three are the rotation vector from the target to the tool.
        mask_frame: whether they are told in the target's own frame (``"tool"``) or in the ``"base"`` frame.
        q_seed: ``(n,)`` configuration to stay near; the home pose by default.
        respect_limits: leave out configurations outside the joint limits (each joint at its best whole turn).
        limits: n pairs (lower, upper) inside the robot's own limits, None for a joint that keeps its own.
        locked: n joint values to be kept, None for a joint that may move.
        branch: only these branches: a name of `branch_names`, parts of one (``"elbow up"``), ``"seed"`` for the
            branch the seed is on, or several of these.
        images: ``"all"`` adds every whole-turn image inside the limits to the nearest one of each branch.
        prefer: of what is free, the value nearest to the seed, farthest from the ``"limits"`` or with the most
            ``"manipulability"``; answers are sorted by the same.
        redundancy: values for free parameters by name (``{"psi": 0.3}``), radians, instead of a choice; a bare
            number is for the first one.
        max_solutions: at most this many, the best first.
        solver: ``"numeric"`` to do without the arm's closed form.

    Raises:
        InputError: a malformed target, seed or option. An unreachable target is not an error.
    """
    return answer(
        ask(
            robot,
            target,
            task=task,
            mask=mask,
            mask_frame=mask_frame,
            q_seed=q_seed,
            respect_limits=respect_limits,
            limits=limits,
            locked=locked,
            branch=branch,
            images=images,
            prefer=prefer,
            redundancy=redundancy,
            max_solutions=max_solutions,
            solver=solver,
        )
    )


def branch_names(robot: Robot) -> tuple[str, ...]:
    """The names of the arm's branches; none for an arm without a closed form."""
    match = closed_form_of(robot)
    return () if match is None else match.branches


def branch_of(robot: Robot, q: ArrayLike) -> str:
    """Name of the branch a configuration ``(n,)`` is on; on the border of two the one whose sine is not negative.

    Raises `InputError` for an arm whose branches have no names.
    """
    match = closed_form_of(robot)
    if match is None:
        raise InputError("robot", robot.id, "an arm with a closed form")
    values = robot.check_q(q)
    if values.ndim != 1:
        raise InputError("q", f"shape {values.shape}", f"one configuration of {robot.n} values")
    return match.branches[match.branch_of(values)]


def answer(question: Question) -> IKResult:
    """The answer to a checked question."""
    branches = solve_branches(question, question.T, question.code)
    if branches is None:
        return _numeric(question)
    if branches.order and question.branches is None:
        return _solved(question, branches, branches.good)
    closed, good = branches.closed, branches.good
    if not branches.order and not question.given:  # a value that was asked for is not for a descent to change
        good = search.polish(question, branches.q, branches.stats)
        closed |= good
    asked = _asked(question, len(closed))
    if (good & asked).any():
        return _solved(question, branches, good & asked)
    if (closed & asked).any():
        return _blocked(question, branches, closed & asked, good)
    if closed.any():
        return _other_branch(question, branches, closed, good)
    if question.robot.n < 6 and question.code == POSE:
        return _compromise(question, branches, asked)
    return _out_of_reach(question, branches)


def _by(q: Array, rows: Flags, key: Array) -> list[int]:
    """The flagged rows of q ``(k, n)`` by rising key, each posture once."""
    kept, count = select(q, np.where(rows, key, math.inf))
    order: list[int] = kept[:count].tolist()
    return order


def _asked(question: Question, count: int) -> Flags:
    if question.branches is None:
        return np.ones(count, dtype=bool)
    return np.array([question.allows(i) for i in range(count)])


def _result(
    question: Question,
    status: Status,
    cause: Cause,
    reason: str,
    *,
    solutions: tuple[IKSolution, ...] = (),
    closest: IKSolution | None = None,
    solver: str | None = None,
    blocked: tuple[BlockedBranch, ...] = (),
    distance: float = 0.0,
    nearest_orientation: IKSolution | None = None,
    redundancy: tuple[Redundancy, ...] = (),
) -> IKResult:
    """A result, with what is singular about the configuration it shows."""
    best = solutions[0] if solutions else closest
    singular: tuple[Singularity, ...] = ()
    if best is not None:
        singular = singularities_at(question.robot, best.q, TOLERANCES.at_singularity)
    if solver is None:
        solver = "numeric" if question.match is None else question.match.name
    return IKResult(
        status=status,
        cause=cause,
        reason=reason + messages.singular(singular, shown=bool(solutions)),
        solutions=solutions[: question.max_solutions],
        closest=closest,
        solver=solver,
        solver_reason=messages.solver(question, solver),
        task=question.task,
        blocked=blocked,
        distance=distance,
        nearest_orientation=nearest_orientation,
        redundancy=redundancy,
        singularities=singular,
    )


# Closed form


def _solved(question: Question, branches: Branches, good: Flags) -> IKResult:
    if question.prefer != "nearest":
        preferences.improve(question, branches, good)
        order = _by(branches.q, good, preferences.ranks(question, branches.q, branches.stats[:, DISTANCE]))
    elif good is branches.good:
        order = branches.order
    else:
        order = _by(branches.q, good, branches.stats[:, DISTANCE])
    solutions, redundancy = _wrap_up(question, branches, order, good)
    if question.all_images:
        solutions = _with_images(question, solutions)
        if redundancy and solutions[0].redundancy:
            redundancy = tuple(
                r._replace(value=own.value) for r, own in zip(redundancy, solutions[0].redundancy, strict=True)
            )
    return _result(
        question,
        Status.SOLVED,
        "",
        messages.solved(len(solutions), question.task, bool(redundancy)),
        solutions=solutions,
        redundancy=redundancy,
    )


def _wrap_up(
    question: Question, branches: Branches, order: list[int], every: Flags, compromise: str | None = None
) -> tuple[tuple[IKSolution, ...], tuple[Redundancy, ...]]:
    """Rows as named solutions in this order, and what is free for all together on the rows in `every`."""
    q, stats = branches.q.copy(), branches.stats.tolist()
    q.flags.writeable = False
    free, together = redundancy_of(question, branches, order, every)
    assert question.match is not None  # whose branches these are
    names = question.match.branches
    solutions = []
    for i, own in zip(order, free, strict=True):
        position, rotation, distance, overrun, _ = stats[i]
        solutions.append(IKSolution(q[i], names[i], position, rotation, overrun == 0.0, distance, own, compromise))
    return tuple(solutions), together


def _with_images(question: Question, solutions: tuple[IKSolution, ...]) -> tuple[IKSolution, ...]:
    """The solutions and all their whole-turn images inside the limits, in the order that is preferred."""
    found = []
    for known in solutions:
        choices = [
            _images_of(x, *span)
            for x, *span in zip(known.q.tolist(), question.lower, question.upper, question.turns, strict=True)
        ]
        total = math.prod(len(choice) for choice in choices)
        if total > _MOST_IMAGES:
            raise InputError("images", "all", f"limits that leave at most {_MOST_IMAGES} images, not {total}")
        as_they_are = replace(question, turns=np.zeros(len(choices)))
        q, stats = measure(as_they_are, np.array([*itertools.product(*choices)]))
        for row, figures in zip(q, stats, strict=True):
            image = solution(question, row, figures, -1)
            free = tuple(
                r._replace(value=float(row[f.joint])) if f.joint >= 0 else r
                for r in known.redundancy
                for f in question.freedoms
                if f.name == r.name
            )
            found.append(replace(image, branch=known.branch, redundancy=free, compromise=known.compromise))
    if question.prefer == "nearest":
        return tuple(sorted(found, key=lambda s: s.distance))
    order = preferences.ranks(question, np.array([s.q for s in found]), np.array([s.distance for s in found]))
    return tuple(found[i] for i in np.argsort(order).tolist())


def _images_of(x: float, low: float, high: float, turn: float) -> list[float]:
    """x + k·turn inside [low, high], x first; only x where a joint has no images or no stops."""
    if turn == 0.0 or not math.isfinite(high - low):
        return [x]
    first = math.ceil((low - TOLERANCES.limit - x) / turn)
    last = math.floor((high + TOLERANCES.limit - x) / turn)
    if last - first > _MOST_IMAGES:
        raise InputError("images", "all", f"limits that leave at most {_MOST_IMAGES} images")
    return [x, *(x + k * turn for k in range(first, last + 1) if k != 0)]


def _blocked(question: Question, branches: Branches, rows: Flags, good: Flags) -> IKResult:
    """Branches exist, but each breaks a limit: name the joints in the way, the least offending branch first."""
    closest = search.closest(question, branches.q)
    if closest is not None and not question.given and search.is_exact(question, closest):
        return _found_by_descent(question, closest)
    order = _by(branches.q, rows, branches.stats[:, OVERRUN])
    blocked = tuple(
        BlockedBranch(question.branch_name(i), branches.q[i].copy(), violations_of(question, branches.q[i]))
        for i in order
    )
    redundancy = redundancy_of(question, branches, order[:1], rows)[1]
    others = len(_by(branches.q, good, branches.stats[:, DISTANCE]))
    return _result(
        question,
        Status.LIMITS,
        "joint limits",
        messages.limits(question, blocked, redundancy, others),
        closest=closest,
        blocked=blocked,
        distance=search.nearest_to_point(question, closest)[1],
        redundancy=redundancy,
    )


def _other_branch(question: Question, branches: Branches, closed: Flags, good: Flags) -> IKResult:
    """The branch that was asked for does not exist at this target; others do."""
    closest = search.closest(question, branches.q)
    if closest is not None and not question.given and search.is_exact(question, closest):
        return _found_by_descent(question, closest)
    fits, exist = (len(_by(branches.q, rows, branches.stats[:, DISTANCE])) for rows in (good, closed))
    reason = messages.other_branch(fits, exist)
    return _result(question, Status.UNREACHABLE, "branch", reason, closest=closest)


def _compromise(question: Question, branches: Branches, asked: Flags) -> IKResult:
    """An arm with fewer than six joints cannot take every pose: give up as little as possible, and say so.

    First the answers that keep point and approach direction and are off by a roll about it (least roll first),
    then the one that keeps the point and has the least whole rotation error.
    """
    stats = branches.stats
    approach_q, approach_stats = measure(question, branches.q, code=APPROACH)
    possible = asked & is_closed(approach_stats)
    rows = possible & (stats[:, OVERRUN] == 0.0) if question.respect else possible
    solutions, _ = _wrap_up(question, branches, _by(branches.q, rows, np.abs(stats[:, ROLL])), rows, "roll")
    nearest = search.nearest_orientation(question, branches.q if rows.any() else None)
    if nearest is not None and (question.branches is None or question.allows(question.branch_of(nearest.q))):
        solutions += (nearest,)
    if not solutions:
        return _out_of_reach(question, branches)
    blocked: tuple[BlockedBranch, ...] = ()
    if not rows.any() and possible.any():
        blocked = tuple(
            BlockedBranch(question.branch_name(i), approach_q[i].copy(), violations_of(question, approach_q[i]))
            for i in _by(approach_q, possible, approach_stats[:, OVERRUN])
        )
    closest = search.closest(question, branches.q)
    return _result(
        question,
        Status.APPROXIMATE,
        "roll" if solutions[0].compromise == "roll" else "rotation",
        messages.approximate(question, solutions[0], blocked),
        solutions=solutions,
        closest=min((*solutions, *filter(None, (closest,))), key=search.mismatch),
        blocked=blocked,
    )


# Numeric


def _numeric(question: Question) -> IKResult:
    """A task or an arm without closed form: descend from many starts; where branches are known, add their like."""
    if question.branches is None and question.prefer == "nearest":
        pool = search.solve_numerically(question).q[None]
    else:
        starts = search.starting_points(question, count=4 * search.STARTS)
        pool = search.descend_each(question, question.code, starts, 1.0)[0]
    q, stats = measure(question, pool)
    q, stats = _usable(question, q, stats)
    if not len(q):
        return _out_of_reach(question, None)
    related = [_relatives(question, row) for row in q]
    q = np.concatenate([q, *related])
    if question.prefer == "nearest":
        q, stats = measure(question, q)
        key = stats[:, DISTANCE].copy()
    else:
        q, stats = preferences.centred(question, q)
        key = preferences.ranks(question, q, stats[:, DISTANCE])
    # One per branch, the best: a pool of descents is no list of branches.
    best: dict[int, int] = {}
    for i in np.argsort(key, kind="stable").tolist():
        branch = question.branch_of(q[i])
        if question.allows(branch) and len(_usable(question, q[i : i + 1], stats[i : i + 1])[0]):
            best.setdefault(branch, i)
    if not best:
        exist = len({question.branch_of(row) for row in q})
        closest = search.closest(question, None)
        return _result(
            question, Status.UNREACHABLE, "branch", messages.other_branch(exist, exist), closest=closest
        )
    solutions = tuple(solution(question, q[i], stats[i], branch) for branch, i in best.items())
    if question.all_images:
        solutions = _with_images(question, solutions)
    closed_form = question.match if len(related[0]) else None
    return _result(
        question,
        Status.SOLVED,
        "",
        messages.solved(len(solutions), question.task, False),
        solutions=solutions,
        solver="numeric" if closed_form is None else closed_form.name,
    )


def _usable(question: Question, q: Array, stats: Array) -> tuple[Array, Array]:
    """The rows that meet the task, inside the limits."""
    rows = is_closed(stats)
    if question.respect:
        rows = rows & (stats[:, OVERRUN] == 0.0)
    return q[rows], stats[rows]


def _relatives(question: Question, q: Array) -> Array:
    """The other branches ``(k, n)`` that take the pose of q ``(n,)``."""
    T = fk(question.robot, q)
    if question.code == POSITION:
        T[:3, 3] = question.T[:3, 3]
    known = solve_branches(question, T, POSE if question.robot.n >= 6 else APPROACH, q)
    return np.empty((0, question.robot.n)) if known is None else known.q[~np.isnan(known.q[:, 0])]


def _found_by_descent(question: Question, found: IKSolution) -> IKResult:
    """A descent met the task where every branch of the closed form misses by rounding error."""
    found = replace(found, compromise=None)
    return _result(
        question, Status.SOLVED, "", messages.solved(1, question.task, False), solutions=(found,), solver="numeric"
    )


def _out_of_reach(question: Question, branches: Branches | None) -> IKResult:
    """No configuration: tell a point out of reach from an orientation that cannot be had there."""
    candidates = None if branches is None else branches.q
    closest = search.closest(question, candidates)
    if closest is not None and not question.given and search.is_exact(question, closest):
        return _found_by_descent(question, closest)
    nearest, distance = search.nearest_to_point(question, closest)
    if question.code == MASK:
        assert closest is not None or question.branches is not None
        reason = messages.mask(closest)
        return _result(question, Status.UNREACHABLE, "outside", reason, closest=closest, distance=distance)
    if question.code == POSITION and question.branches is None:
        closest = nearest
    if distance > 0.0 or question.code == POSITION:
        cause, reason = messages.unreachable(question, nearest.q, distance)
        return _result(question, Status.UNREACHABLE, cause, reason, closest=closest, distance=distance)
    oriented = search.nearest_orientation(question, candidates)
    gap, obstacle = (branches.gap, branches.obstacle) if branches is not None else (0.0, None)
    return _result(
        question,
        Status.ORIENTATION,
        "orientation",
        messages.orientation(closest, oriented, obstacle, gap),
        closest=closest,
        nearest_orientation=oriented,
    )
