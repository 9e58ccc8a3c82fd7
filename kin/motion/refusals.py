"""Why a path cannot be driven, and what would help."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kin.differential.task import Task
from kin.ik import branch_names, branch_of, solve_ik
from kin.ik.branches import Flags
from kin.ik.details import JointKind, LimitViolation, OrientationNotMet, OutOfReach
from kin.ik.results import IKResult, Status
from kin.motion.details import (
    BranchNeeded,
    Cause,
    Help,
    NotKept,
    NotReached,
    RefusalDetails,
    SingularityMet,
    Slowed,
)
from kin.motion.detours import least_shift, least_tilt, path_of
from kin.motion.paths import Layout
from kin.motion.timing.timed import JointPath
from kin.path.details import JointMove
from kin.robot import Robot
from kin.singularity import singularities_at
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NEAR = 0.1  # radians or metres from a singularity that counts as the reason
_SAME = 1e-6  # radians or metres between two configurations that count as one
# A path is slow where the joints allow less than this part of its usual speed; how near a singularity is named.
_SLOW, _WIDE = 0.4, 0.5
_HALVINGS = 40  # of the interval in which a joint reaches its limit


def violations(robot: Robot, q: Array) -> tuple[LimitViolation, ...]:
    """The joint values of a configuration ``(n,)`` that are outside the limits."""
    found = []
    for i, joint in enumerate(robot.joints):
        if not robot.lower[i] - TOLERANCES.limit <= q[i] <= robot.upper[i] + TOLERANCES.limit:
            limit = robot.lower[i] if q[i] < robot.lower[i] else robot.upper[i]
            kind: JointKind = "prismatic" if joint.kind == "prismatic" else "revolute"
            found.append(LimitViolation(i, joint.name, float(q[i]), float(limit), kind, False))
    return tuple(found)


def outside(robot: Robot, q: Array) -> Flags:
    """Which configurations of a path ``(k, n)`` are outside the limits ``(k,)``."""
    slack = TOLERANCES.limit
    return np.asarray(((q < robot.lower - slack) | (q > robot.upper + slack)).any(axis=1))


def limit_met(
    robot: Robot, s: Array, q: Array, at: Callable[[float, Array], Array]
) -> tuple[float, LimitViolation] | None:
    """Where a path first reaches the limit of a joint, and how far that joint would go beyond it.

    Args:
        s, q: places ``(k,)`` and the configurations ``(k, n)`` there.
        at: the configuration ``(n,)`` at any place, given one that is close to it.
    """
    beyond = outside(robot, q)
    if not beyond.any():
        return None
    row = int(np.argmax(beyond))
    high, there = float(s[row]), q[row]
    low, here = (float(s[row - 1]), q[row - 1]) if row else (high, there)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        between = at(middle, 0.5 * (here + there))
        if outside(robot, between[None])[0]:
            high, there = middle, between
        else:
            low, here = middle, between
    first = violations(robot, there)[0]
    rest = q[row:, first.joint]
    value = float(rest.max() if first.limit == robot.upper[first.joint] else rest.min())
    return high, replace(first, value=value)


def lost(robot: Robot, poses: Array, before: Array, task: Task) -> tuple[Cause, RefusalDetails]:
    """Why the joints cannot follow the tool from a configuration to the first of the poses ``(k, 4, 4)``.

    The others lead from there to the end of the segment.
    """
    result = solve_ik(robot, poses[0], q_seed=before, task=task)
    if result.status is Status.APPROXIMATE:
        best = solve_ik(robot, poses[-1], q_seed=before, task=task).best or result.best
        assert best is not None
        return "task", NotKept(robot.n, best.position_error, best.rotation_error)
    near = singularities_at(robot, before, NEAR)
    if near or not result.solutions:
        others = [solve_ik(robot, T, q_seed=before, task=task) for T in poses[1:]]
        # A path that leaves the workspace passes a singularity first: there, too, it is the reach that ends.
        if not result.solutions or not any(each.solutions for each in others):
            worst = max([result, *others], key=_shortfall)
            return "unreachable", NotReached(worst.details, worst.cause, worst.task, worst.singularities)
    jump = result.solutions[0].q - before
    joint = int(np.argmax(np.abs(jump)))
    row = robot.joints[joint]
    kind: JointKind = "prismatic" if row.kind == "prismatic" else "revolute"
    move = JointMove(joint, row.name, kind, abs(float(jump[joint])))
    if near or abs(move.motion) < 0.5:
        return "singularity", SingularityMet(near[0] if near else None, move if abs(move.motion) > 1e-3 else None)
    return "branch", BranchNeeded(branch_of(robot, before) if branch_names(robot) else None)


def _shortfall(result: IKResult) -> tuple[float, float]:
    """By how much a pose is missed: first its point (metres), then its orientation (radians)."""
    match result.details:
        case OutOfReach(distance):
            return distance, 0.0
        case OrientationNotMet(nearest_rotation=rotation, rotation_error=error):
            return 0.0, rotation or error or 0.0
    return 0.0, 0.0


def helps_for(
    robot: Robot, poses: Array, q: Array, task: Task, cause: Cause, can_follow: Callable[[Array], bool],
    velocity: Array,
) -> tuple[Help, ...]:  # fmt: skip
    """What would help on a path of poses ``(k, 4, 4)`` that cannot be driven from q ``(n,)``.

    `can_follow` says whether the path can be driven from a configuration, `velocity` ``(n,)`` are the limits.
    """
    end = solve_ik(robot, poses[-1], q_seed=q, task=task)
    if end.status is not Status.SOLVED:
        return helps_at(robot, poses[-1], q, end)
    found = [Help("ptp")]
    others = solve_ik(robot, poses[0], q_seed=q, task=task).solutions
    other = next((each for each in others if np.abs(each.q - q).max() > _SAME and can_follow(each.q)), None)
    if other is not None:
        found.append(Help("posture", branch_of(robot, other.q) if branch_names(robot) else None))
    elif cause in ("singularity", "branch"):
        found.append(Help("via"))
    path = path_of(robot, task, q, poses, velocity) if cause == "singularity" else None
    beside = () if path is None else (least_shift(path), least_tilt(path))
    return (*found, *(each for each in beside if each is not None))


def helps_at(robot: Robot, T: Array, q: Array, result: IKResult) -> tuple[Help, ...]:
    """What would help where a pose cannot be met: another place, or keeping less of it."""
    if result.cause in ("too far", "too near"):
        return (Help("closer"),)
    point = None if result.task == "position" else solve_ik(robot, T, q_seed=q, task="position")
    return (Help("task"),) if point is not None and point.status is Status.SOLVED else ()


def slow_places(robot: Robot, layout: Layout, path: JointPath) -> list[Slowed]:
    """Where a path is slow because a joint has to turn fast: its slowest place, corners and ends left out."""
    slopes = np.abs(path.joints[:, :, 1])
    with np.errstate(divide="ignore"):
        speeds = (path.limits[:, :, 0] / slopes).min(axis=1)
    part = np.clip(np.searchsorted(layout.starts, path.knots[:-1], side="right") - 1, 0, len(layout.owners) - 1)
    straight = np.array([len(owners) == 1 for owners in layout.owners])[part]
    speeds = np.where(straight, speeds, np.inf)
    usual = float(np.median(speeds[straight])) if straight.any() else np.inf
    k = int(np.argmin(speeds))
    if not np.isfinite(usual) or speeds[k] > _SLOW * usual:
        return []
    q = path.joints[k, :, 0].copy()
    near = [s for s in singularities_at(robot, q, _WIDE) if s.kind != "algorithmic"]
    joint = int(np.argmax(slopes[k] / path.limits[k, :, 0]))
    segment = int(
        np.clip(np.searchsorted(layout.bounds, path.knots[k], side="right") - 1, 0, len(layout.bounds) - 2)
    )
    low, high = layout.bounds[segment], layout.bounds[segment + 1]
    where = layout.owners[0][0] + segment, float((path.knots[k] - low) / (high - low))
    ratio = float(speeds[k]) / usual
    return [Slowed(*where, joint, robot.joints[joint].name, "velocity", ratio, near[0] if near else None)]
