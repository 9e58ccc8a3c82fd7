"""Results without an exact solution: the cause, and the closest configuration.

One function per cause. Each first searches the closest configuration by descents: where branches merge, a descent
may meet a target that every row of the closed form misses by rounding error, and then the problem is solved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeGuard

import numpy as np

from kin.fk import fk, link_frames
from kin.ik import nearest
from kin.ik.assembly import Found, by_key, leaves_motion, make_result
from kin.ik.branches import (
    Branches,
    Flags,
    is_closed,
    measure,
    redundancy_of,
    solution,
    solve_branches,
    violations_of,
    with_further,
)
from kin.ik.candidates import DISTANCE, OVERRUN, ROLL
from kin.ik.details import (
    Details,
    MaskNotMet,
    NotOnBranch,
    OrientationNotMet,
    OutOfReach,
    OutsideLimits,
    Restriction,
    RollError,
    RotationError,
    Solved,
)
from kin.ik.options import JointConstraints
from kin.ik.problem import IKProblem
from kin.ik.results import BlockedBranch, Cause, IKResult, IKSolution, Status
from kin.robot import Robot
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION
from kin.tolerances import TOLERANCES
from kin.transforms import Array


def not_found(problem: IKProblem) -> IKResult:
    """No descent met the task. An arm without a closed form gets the same statuses as one with a closed form."""
    if problem.closed_form is None and problem.respect:
        found = outside_by_descent(problem)
        if found is not None:
            return found
    if problem.closed_form is None and problem.robot.n < 6 and problem.code == POSE:
        return _compromise_by_descent(problem)
    return out_of_reach(problem, None)


def _beyond_limits(problem: IKProblem, code: int) -> tuple[BlockedBranch, ...]:
    """Configurations outside the limits that meet a task, the closest to the limits first."""
    found = nearest.beyond_limits(problem, code)
    if not len(found):
        return ()
    q, stats = measure(problem, found, code=code)
    branch = [problem.branch_of(row) for row in q]
    allowed = np.array([problem.allows(i) for i in branch])
    rows = is_closed(problem, stats) & (stats[:, OVERRUN] > 0.0) & allowed
    return _blocked(problem, q, _by_overrun(q, rows, stats), branch)


def _by_overrun(q: Array, rows: Flags, stats: Array) -> list[int]:
    """The flagged rows of q ``(k, n)``, the least outside the limits first, and the first of those equally far.

    Rounding must not decide between them. Generated code does the same, see `kin.codegen.entries`.
    """
    return by_key(q, rows, stats[:, OVERRUN].round(12))


def outside_by_descent(problem: IKProblem) -> IKResult | None:
    """The task is met outside the limits only, as far as descents can tell; None if they do not meet it there."""
    blocked = _beyond_limits(problem, problem.code)
    if not blocked:
        return None
    closest = nearest.closest(problem, None)
    if _is_solution(closest, problem):
        return _found_by_descent(problem, closest)
    first = blocked[0]
    return make_result(
        problem,
        Status.LIMITS,
        "joint limits",
        OutsideLimits(first.branch, first.violations, len(blocked), (), 0),
        closest=closest,
        blocked=blocked,
        distance=nearest.nearest_to_point(problem, closest)[1],
    )


def _compromise_by_descent(problem: IKProblem) -> IKResult:
    """As `compromise`, for an arm without a closed form."""
    starts = nearest.starting_points(problem, count=4 * nearest.STARTS)
    q, stats = measure(problem, nearest.descend_each(problem, APPROACH, starts, 1.0)[0])
    rows = is_closed(problem, measure(problem, q, code=APPROACH)[1])
    if problem.respect:
        rows &= stats[:, OVERRUN] == 0.0
    order = by_key(q, rows, np.abs(stats[:, ROLL]))
    solutions = tuple(solution(problem, q[i], stats[i], compromise="roll") for i in order)
    oriented = nearest.nearest_orientation(problem, q[rows] if rows.any() else None)
    if oriented is not None:
        solutions += (oriented,)
    if not solutions:
        return out_of_reach(problem, None)
    blocked = () if rows.any() or not problem.respect else _beyond_limits(problem, APPROACH)
    return _compromised(problem, solutions, blocked, None)


def outside_limits(problem: IKProblem, branches: Branches, rows: Flags, good: Flags) -> IKResult:
    """The postures in `rows` exist, but all of them are outside the limits; `good` are solutions elsewhere."""
    closest = nearest.closest(problem, branches.q)
    if _is_solution(closest, problem):
        return _found_by_descent(problem, closest)
    order = _by_overrun(branches.q, rows, branches.stats)
    blocked = _blocked(problem, branches.q, order, range(len(branches.q)))
    redundancy = with_further(branches, redundancy_of(problem, branches, order[:1], rows)[1])
    names = [parameter.name for parameter in problem.requested]
    details = OutsideLimits(
        branch=blocked[0].branch,
        violations=blocked[0].violations,
        branches=len(blocked),
        requested=tuple(r for r in redundancy if r.name in names),
        elsewhere=len(by_key(branches.q, good, branches.stats[:, DISTANCE])),
    )
    return make_result(
        problem,
        Status.LIMITS,
        "joint limits",
        details,
        closest=closest,
        blocked=blocked,
        distance=nearest.nearest_to_point(problem, closest)[1],
        redundancy=redundancy,
    )


def not_on_branch(problem: IKProblem, branches: Branches, closed: Flags, good: Flags) -> IKResult:
    """The requested branch does not exist at this target; others do."""
    closest = nearest.closest(problem, branches.q)
    if _is_solution(closest, problem):
        return _found_by_descent(problem, closest)
    fits, exist = (len(by_key(branches.q, rows, branches.stats[:, DISTANCE])) for rows in (good, closed))
    locked = tuple(np.flatnonzero(problem.locked).tolist())
    details = NotOnBranch(fits, exist - fits, locked)
    return make_result(problem, Status.UNREACHABLE, "branch", details, closest=closest)


def compromise(problem: IKProblem, branches: Branches, allowed: Flags) -> IKResult:
    """An arm with fewer than six joints cannot reach every pose: what it can meet of this one.

    First the solutions that meet point and approach direction, with a rotation about it left (the smallest first);
    then the one that meets the point with the smallest rotation error.
    """
    stats = branches.stats
    approach_q, approach_stats = measure(problem, branches.q, code=APPROACH)
    possible = allowed & is_closed(problem, approach_stats)
    rows = possible & (stats[:, OVERRUN] == 0.0) if problem.respect else possible
    order = by_key(branches.q, rows, np.abs(stats[:, ROLL]))
    solutions = Found(problem, branches, order, rows).all_solutions("roll")
    oriented = nearest.nearest_orientation(problem, branches.q if rows.any() else None)
    if oriented is not None and (problem.branches is None or problem.allows(problem.branch_of(oriented.q))):
        solutions += (oriented,)
    if not solutions:
        return out_of_reach(problem, branches)
    blocked: tuple[BlockedBranch, ...] = ()
    if not rows.any() and possible.any():
        order = _by_overrun(approach_q, possible, approach_stats)
        blocked = _blocked(problem, approach_q, order, range(len(approach_q)))
    return _compromised(problem, solutions, blocked, branches.q)


def _compromised(
    problem: IKProblem, solutions: tuple[IKSolution, ...], blocked: tuple[BlockedBranch, ...], known: Array | None
) -> IKResult:
    """The result with these compromises, the best first; `known` ``(k, n)`` are further starts of descents."""
    closest = nearest.closest(problem, known)
    if _is_solution(closest, problem):
        return _found_by_descent(problem, closest)
    first, joints = solutions[0], problem.robot.n
    details: Details = RollError(joints, first.rotation_error)
    if first.compromise != "roll":
        details = RotationError(joints, first.rotation_error, blocked[0].violations[0] if blocked else None)
    return make_result(
        problem,
        Status.APPROXIMATE,
        "roll" if first.compromise == "roll" else "rotation",
        details,
        solutions=solutions,
        closest=min((*solutions, *filter(None, (closest,))), key=lambda near: nearest.mismatch(problem, near)),
        blocked=blocked,
    )


def out_of_reach(problem: IKProblem, branches: Branches | None) -> IKResult:
    """No configuration: either the point is out of reach, or the orientation is not possible there."""
    candidates = None if branches is None else branches.q
    closest = nearest.closest(problem, candidates)
    if _is_solution(closest, problem):
        return _found_by_descent(problem, closest)
    at_point, distance = nearest.nearest_to_point(problem, closest)
    position, rotation = (None, None) if closest is None else (closest.position_error, closest.rotation_error)
    if problem.code == MASK:
        details: Details = MaskNotMet(position, rotation, _restriction(problem))
        return make_result(problem, Status.UNREACHABLE, "outside", details, closest=closest, distance=distance)
    if problem.code == POSITION and problem.branches is None:
        closest = at_point
    if distance > 0.0 or problem.code == POSITION:
        restriction, cause = _point_restriction(problem, distance) or (None, side_of(problem, at_point.q))
        details = OutOfReach(distance, restriction)
        return make_result(problem, Status.UNREACHABLE, cause, details, closest=closest, distance=distance)
    oriented = nearest.nearest_orientation(problem, candidates)
    fits = branches is None or branches.obstacle is None or not branches.gap > 0.0
    details = OrientationNotMet(
        obstacle=None if fits or branches is None else branches.obstacle,
        gap=None if fits or branches is None else branches.gap,
        nearest_rotation=None if oriented is None else oriented.rotation_error,
        position_error=position,
        rotation_error=rotation,
        restriction=_restriction(problem),
    )
    return make_result(
        problem, Status.ORIENTATION, "orientation", details, closest=closest, nearest_orientation=oriented
    )


def _unrestricted(problem: IKProblem) -> tuple[IKProblem, Restriction] | None:
    """The same problem without locks and narrowed limits, and these; None if it has none."""
    robot = problem.robot
    narrowed = (problem.lower > robot.lower) | (problem.upper < robot.upper)
    if not problem.respect or not narrowed.any():
        return None
    locked = tuple(i for i, flag in enumerate(problem.locked) if flag)
    others = tuple(i for i in np.flatnonzero(narrowed).tolist() if i not in locked)
    options = replace(problem.options, constraints=JointConstraints(), branch=None, redundancy=None)
    free = IKProblem.of(robot, problem.T, options, problem.seed)
    return replace(free, target_error=problem.target_error), Restriction(locked, others)


def _point_restriction(problem: IKProblem, distance: float) -> tuple[Restriction, Cause] | None:
    """What keeps the arm from coming nearer to a point that is `distance` out of reach, and the cause then."""
    found = _unrestricted(problem)
    if found is None:
        return None
    free, restriction = found
    nearer, left = nearest.nearest_to_point(free, None)
    if left == 0.0:
        return restriction, "outside"
    if left > distance - TOLERANCES.same_distance * problem.unit:
        return None
    return restriction._replace(distance=left), side_of(free, nearer.q)


def _restriction(problem: IKProblem) -> Restriction | None:
    """The locks and narrowed limits of a problem that has no answer, if it has one without them."""
    found = _unrestricted(problem)
    if found is None:
        return None
    free, restriction = found
    branches = solve_branches(free, free.T, free.code)
    if branches is not None and branches.order:
        return restriction
    closest = nearest.closest(free, None if branches is None else branches.q)
    return restriction if _is_solution(closest, free) else None


def side_of(problem: IKProblem, q: Array) -> Cause:
    """On which side of the workspace the target's point is; q ``(n,)`` is the configuration nearest to it.

    Distances are measured from the shoulder. For a target in a hole, the direction to the nearest point tells
    which hole it is: straight away from the axis, or away from the shoulder.
    """
    robot, same, none = problem.robot, TOLERANCES.same_distance * problem.unit, TOLERANCES.geometry * problem.unit
    axis, shoulder = shoulder_of(robot, q)
    reached = fk(robot, q)[:3, 3] - shoulder
    target = problem.T[:3, 3] - shoulder
    far, near = float(np.linalg.norm(target)), float(np.linalg.norm(reached))
    if far > near + same:
        return "too far"
    out = reached - target
    radial = out - axis * float(axis @ out)
    away = float(out @ target) / far if far > none else math.inf
    off_axis = [float(np.linalg.norm(v - axis * float(axis @ v))) for v in (target, reached)]
    if robot.turns_as_one and off_axis[1] > off_axis[0] + same and np.linalg.norm(radial) > away - none:
        return "around the axis"
    return "too near" if far < near - same else "outside"


def shoulder_of(robot: Robot, q: Array) -> tuple[Array, Array]:
    """The direction of the first joint axis, and its point at the height of the second joint, each ``(3,)``."""
    first = link_frames(robot, q)[0]
    axis = robot.T_world_base[:3, 2] if robot.convention == "standard" else first[:3, 2]
    foot = robot.T_world_base[:3, 3]
    return axis, foot + axis * float(axis @ (first[:3, 3] - foot))


def _blocked(problem: IKProblem, q: Array, order: list[int], branch: Sequence[int]) -> tuple[BlockedBranch, ...]:
    """Rows of q ``(k, n)`` that exist outside the limits; `branch` has the branch of each row."""
    name = problem.branch_name
    return tuple(BlockedBranch(name(branch[i]), q[i].copy(), violations_of(problem, q[i])) for i in order)


def _is_solution(closest: IKSolution | None, problem: IKProblem) -> TypeGuard[IKSolution]:
    """Whether a descent met the task. Not if redundancy values were requested: a descent changes them."""
    return closest is not None and not problem.requested and nearest.is_exact(problem, closest)


def _found_by_descent(problem: IKProblem, found: IKSolution) -> IKResult:
    """A descent met the task where every branch of the closed form misses by rounding error."""
    found = replace(found, compromise=None)
    return make_result(
        problem,
        Status.SOLVED,
        "",
        Solved(1, False, problem.chosen_branches, complete=False, infinite=leaves_motion(problem)),
        solutions=(found,),
        solver="numeric",
    )
