"""Path inverse kinematics: a sequence of poses solved to one continuous joint path.

Each pose has many configurations: branches, values of redundancy parameters, whole turns. Choosing the nearest one
pose by pose runs into dead ends: a joint turns up to its limit although it could have started a turn lower. Here
the whole path is chosen at once, as the shortest path through layers:

1. :mod:`kin.path.layers` gives each waypoint a layer of configurations, at most 4000, which is 0.2 MB per waypoint
   for seven joints. They are computed and measured in :mod:`kin.path.configurations`.
   At singular waypoints :mod:`kin.path.crossings` adds those that their neighbours lead to.
2. :mod:`kin.path.viterbi` finds the path through the layers with the fewest jumps and, of these, the smallest sum
   of squared joint motion. A step is a *jump* if some joint moves more than `max_step`
   (:mod:`kin.path.waypoints`).
3. :mod:`kin.path.search` repairs what samples miss, and :mod:`kin.path.smoothing` straightens their staircase.
4. :mod:`kin.path.gaps` fills in the waypoints that cannot be met.
5. :mod:`kin.path.causes` finds out why each jump is forced, :mod:`kin.path.report` assembles the result, and
   :mod:`kin.path.messages` words it. :mod:`kin.path.postures` shows all postures along the path beside it.

Where layers are numeric continuations instead of samples of a closed form, the number of jumps is the smallest
*found*.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError, finite_number
from kin.ik.options import IKOptions, PathKeywords, options_of_call
from kin.ik.problem import IKProblem, listed, never_cancel, read_poses
from kin.named import robot_of
from kin.path.details import JumpCause
from kin.path.gaps import fill_gaps
from kin.path.layers import layered
from kin.path.postures import PathPostures, postures_along
from kin.path.report import report
from kin.path.results import PathGap, PathJump, PathResult
from kin.path.search import DeadEnd, best_path
from kin.path.waypoints import LayerSequence, PathSettings, Waypoint
from kin.robot import Robot
from kin.transforms import Array

__all__ = [
    "JumpCause",
    "PathGap",
    "PathJump",
    "PathPostures",
    "PathResult",
    "path_postures",
    "solve_path",
]

MAX_STEP = 0.5


def solve_path(
    robot: Robot | str,
    targets: Sequence[ArrayLike] | Array,
    *,
    options: IKOptions | None = None,
    q_start: ArrayLike | None = None,
    max_step: float = MAX_STEP,
    cancel: Callable[[], None] = never_cancel,
    **keywords: Unpack[PathKeywords],
) -> PathResult:
    """One joint path through all `targets`: as few jumps as possible, then as little joint motion as possible.

    Args:
        robot: the arm, or the id of a built-in one.
        targets: poses ``(k, 4, 4)`` of the tool in the world frame, metres, k ≥ 1; for ``task="position"`` also
            points ``(k, 3)``.
        options: the keywords as one value. Those that choose among the solutions of one target (`images`,
            `prefer`, `max_solutions`) have no effect: the path chooses.
        q_start: ``(n,)`` where the arm is, radians (metres). The way from there to the first waypoint counts as
            motion, but never as a jump: the path begins at its first waypoint. Without it the path may start
            anywhere; of equally good paths, the one that starts nearest to the home pose is taken.
        max_step: the most a joint may move between neighbouring waypoints: radians, a slide as a share of the
            arm's reach.
        cancel: called now and then; cancels the computation by raising.
        keywords: those of `kin.solve_ik` that do not choose among the solutions of one target, for every waypoint;
            the branch ``"seed"`` is that of `q_start`.

    Returns:
        The joint values at each waypoint, and where the path jumps or has a gap, with the cause.

    Raises:
        InputError: a malformed target (named ``targets[i]``) or option. An unreachable target is not an error.

    Examples:
        >>> import kin, numpy as np
        >>> arm = kin.get_robot("ur5")
        >>> line = kin.fk(arm, arm.q_home + np.linspace(0.0, 0.2, 5)[:, None])
        >>> path = kin.solve_path(arm, line, q_start=arm.q_home)
        >>> path.continuous, path.q.shape
        (True, (5, 6))
    """
    wanted = options_of_call(PathKeywords, options, keywords)
    return solve(robot, targets, wanted, q_start, max_step, cancel)


def solve(
    robot: Robot | str,
    targets: Sequence[ArrayLike] | Array,
    options: IKOptions,
    q_start: ArrayLike | None = None,
    max_step: float = MAX_STEP,
    cancel: Callable[[], None] = never_cancel,
    roundings: Sequence[float] | None = None,
) -> PathResult:
    """`solve_path` for callers that have an `IKOptions`, or rounded frames.

    `roundings` are one per target, each as in `kin.ik.solve`.
    """
    settings, waypoints = _layers(robot_of(robot), targets, options, q_start, max_step, cancel, roundings)
    return _chosen(settings, waypoints)


def path_postures(
    robot: Robot | str,
    targets: Sequence[ArrayLike] | Array,
    *,
    options: IKOptions | None = None,
    q_start: ArrayLike | None = None,
    max_step: float = MAX_STEP,
    cancel: Callable[[], None] = never_cancel,
    roundings: Sequence[float] | None = None,
) -> PathPostures:
    """At each target and in each posture of the arm what is in the way, and how far it gets without a jump.

    Args:
        robot, targets, q_start, max_step, cancel: as in `solve_path`.
        options: as in `solve_path`. With `avoid_self_collision` or `obstacles`, configurations that touch
            something are in the way.
        roundings: one per target: how rounded the numbers are from which it was computed, such as the pose of a
            workpiece (metres; for directions without unit). By default not at all.

    Returns:
        The table of targets and postures, and the path of `solve_path` in it.

    Raises:
        InputError: as `solve_path`.

    Examples:
        >>> import kin
        >>> arm = kin.get_robot("planar2r")
        >>> reach = float(arm.reach)
        >>> line = [[share * reach, 0.0, 0.0] for share in (0.5, 0.52, 0.54)]
        >>> found = kin.path.path_postures(arm, line, options=kin.IKOptions(task="position"))
        >>> len(found.postures), found.through
        (2, (0, 1))
    """
    wanted = IKOptions.of(options)
    settings, waypoints = _layers(robot_of(robot), targets, wanted, q_start, max_step, cancel, roundings)
    return postures_along(settings, waypoints, _chosen(settings, waypoints))


def _layers(
    robot: Robot,
    targets: Sequence[ArrayLike] | Array,
    options: IKOptions,
    q_start: ArrayLike | None,
    max_step: float,
    cancel: Callable[[], None],
    roundings: Sequence[float] | None,
) -> tuple[PathSettings, list[Waypoint]]:
    """The waypoints with their layers, and what is constant along the path."""
    if q_start is not None and robot.check_q(q_start, "q_start").ndim != 1:
        raise InputError("q_start", q_start, f"one configuration of {robot.n} values")
    problem = replace(IKProblem.of(robot, np.eye(4), options, q_start), cancel=cancel)
    step = _checked_step(max_step)
    if not len(targets := listed(targets)):
        raise InputError("targets", targets, "at least one pose")
    poses, errors = read_poses(targets, problem.code, always=robot.n < 6)
    settings = PathSettings.of(problem, step, q_start is not None, len(poses))
    more = np.zeros(len(poses)) if roundings is None else np.asarray(roundings)
    problems = [
        replace(problem, T=T, target_error=error) for T, error in zip(poses, (errors + more).tolist(), strict=True)
    ]
    return settings, layered(problems, settings.grid)


def _chosen(settings: PathSettings, waypoints: list[Waypoint]) -> PathResult:
    """The best path through the layers."""
    sequence = LayerSequence.of(settings, waypoints)
    q = np.full((len(waypoints), settings.problem.robot.n), math.nan)
    ends: list[DeadEnd] = []
    if sequence.waypoints:
        q[sequence.at], ends = best_path(sequence)
    fill_gaps(settings, waypoints, q)
    return report(sequence, waypoints, q, ends)


def _checked_step(value: float) -> float:
    expected = "a finite number above 0: radians, or a share of the arm's reach for a slide"
    number = finite_number("max_step", value, expected)
    if number <= 0.0:
        raise InputError("max_step", value, expected)
    return number
