"""Path inverse kinematics: a sequence of poses solved to one continuous joint path.

Each pose has many configurations: branches, values of what is free, whole turns. Choosing the nearest one pose by
pose walks into dead ends: a joint winds up to its stop although it could have started a turn lower. Here the whole
path is chosen at once, as the shortest way through layers:

1. :mod:`kin.path.layers` gives each waypoint a layer of configurations, at most 4000, so 0.2 MB a waypoint for
   seven joints. They are made and measured in :mod:`kin.path.waypoint`.
2. :mod:`kin.path.trellis` finds the way through the layers with the fewest jumps and, of these, the least sum of
   squared joint motion. A step is a *jump* if some joint moves more than `max_step`
   (:mod:`kin.path.course`).
3. :mod:`kin.path.route` repairs what samples miss, and :mod:`kin.path.smooth` draws their staircase straight.
4. :mod:`kin.path.gaps` fills in the waypoints that cannot be met.
5. :mod:`kin.path.causes` finds out why each jump is forced; :mod:`kin.path.report` tells it.

Where layers are numeric continuations instead of samples of a closed form, the fewest jumps *found* are told.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError
from kin.ik.problem import Frame, Limits, Locks, ask, finite_number, go_on, pose_of
from kin.ik.results import Task
from kin.path.course import Course, Way
from kin.path.gaps import fill_gaps
from kin.path.layers import stops_at
from kin.path.report import report
from kin.path.results import JumpCause, PathGap, PathJump, PathResult
from kin.path.route import DeadEnd, route
from kin.robot import Robot
from kin.transforms import Array

__all__ = ["JumpCause", "PathGap", "PathJump", "PathResult", "solve_path"]


def solve_path(
    robot: Robot,
    targets: Sequence[ArrayLike] | Array,
    *,
    task: Task = "pose",
    mask: Sequence[bool] | None = None,
    mask_frame: Frame = "tool",
    q_start: ArrayLike | None = None,
    limits: Limits | None = None,
    locked: Locks | None = None,
    branch: str | Sequence[str] | None = None,
    max_step: float = 0.5,
    stop: Callable[[], None] = go_on,
) -> PathResult:
    """One joint path through all `targets`: as few jumps as possible, then as little joint motion as possible.

    Args:
        robot: the arm.
        targets: T_base_tool ``(k, 4, 4)``, k ≥ 1; for ``task="position"`` also points ``(k, 3)`` in metres.
        task, mask, mask_frame, limits, locked, branch: as in `kin.solve_ik`, for every waypoint; the branch
            ``"seed"`` is the one `q_start` is on.
        q_start: ``(n,)`` where the arm is. The way from there to the first waypoint counts as motion, but never as
            a jump: the path begins at its first waypoint. Without it the path may start anywhere, and of equally
            good paths the one that starts nearest to the home pose is taken.
        max_step: the most a joint may move between neighbouring waypoints: radians, or 4 per metre.
        stop: called now and then; it ends the work by raising what then comes out of here.

    Raises:
        InputError: a malformed target (named ``targets[i]``) or option. An unreachable target is not an error.
    """
    if q_start is not None and robot.check_q(q_start, "q_start").ndim != 1:
        raise InputError("q_start", q_start, f"one configuration of {robot.n} values")
    question = ask(
        robot,
        np.eye(4),
        task=task,
        mask=mask,
        mask_frame=mask_frame,
        q_seed=q_start,
        limits=limits,
        locked=locked,
        branch=branch,
    )
    question = replace(question, stop=stop)
    step = _checked_step(max_step)
    poses = _checked_targets(targets, question.code)
    way = Way.of(question, step, q_start is not None, len(poses))
    stops = stops_at([replace(question, T=T) for T in poses], way.grid)
    course = Course.through(way, stops)
    q = np.full((len(stops), robot.n), math.nan)
    ends: list[DeadEnd] = []
    if course.stops:
        q[course.at], ends = route(course)
    fill_gaps(way, stops, q)
    return report(course, stops, q, ends)


def _checked_step(value: float) -> float:
    expected = "a finite number above 0: radians, or 4 per metre"
    number = finite_number("max_step", value, expected)
    if number <= 0.0:
        raise InputError("max_step", value, expected)
    return number


def _checked_targets(targets: object, code: int) -> list[Array]:
    """Every target as a pose ``(4, 4)``."""
    if isinstance(targets, np.ndarray):
        targets = list(targets) if targets.ndim else None
    if not isinstance(targets, Sequence) or isinstance(targets, str | bytes):
        raise InputError("targets", targets, "a sequence of poses (k, 4, 4)")
    if not targets:
        raise InputError("targets", targets, "at least one pose")
    return [pose_of(target, code, f"targets[{i}]") for i, target in enumerate(targets)]
