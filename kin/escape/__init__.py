"""The way out of a singularity: the shortest motion of the joints to a margin, with the tool kept where it can be.

How far an arm is from a singularity is measured by σ, the smallest singular value of the Jacobian of its natural
task (the pose; the point and approach direction of five joints; the point of fewer), with lengths of the tool as
shares of the arm's size and slides as shares of its reach. It does not depend on units or on the size of the arm.

1. :mod:`kin.escape.search` finds ends beyond the margin with the least deviation of the tool.
2. An arm with joints to spare may reach one while its tool stays (:mod:`kin.escape.keeping`). One without cannot,
   because along a motion that keeps the tool it stays singular.
3. Ways that are proven free of contacts (:mod:`kin.collision.sweep`) remain, one for each posture at their ends.

Every answer that is found is inside the limits, beyond the margin and free; that none deviates less is not proven:
the search starts from many configurations around the arm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from kin.collision import Obstacle
from kin.collision.contacts import surroundings
from kin.differential.error import task_error
from kin.errors import InputError, finite_number
from kin.escape.keeping import explored, kept_along
from kin.escape.results import Code, Exit, ExitCause, Exits
from kin.escape.search import TIES, Measure, improved, measure_of, starts, usual_margin
from kin.fk import fk
from kin.ik import IKOptions, branch_names, branch_of
from kin.ik.problem import never_cancel
from kin.named import robot_of
from kin.robot import Robot
from kin.singularity import singularities_at
from kin.tolerances import TOLERANCES
from kin.transforms import Array
from kin.way.free import Space
from kin.way.results import path_length

__all__ = ["Exit", "ExitCause", "Exits", "leave_singularity"]

_ALIKE = 0.005  # deviations that differ by less of them are equal
_OTHER = 2.0  # another posture is offered at up to so many times the deviation of the best
_MOST = 4  # postures
_SHARES = np.linspace(0.0, 1.0, 33)  # of a motion, at which the tool is looked at
_NEARLY = 1e-3  # deviation of an end beside which one may be found that keeps the tool


def leave_singularity(
    robot: Robot | str,
    q: ArrayLike,
    *,
    margin: float | None = None,
    obstacles: Sequence[Obstacle] = (),
    avoid_self_collision: bool = False,
    cancel: Callable[[], None] = never_cancel,
) -> Exits:
    """The shortest motions of the joints out of a singularity, those first that keep the tool where it is.

    Otherwise the tool deviates as little as it can; the largest deviation on the way is part of the answer.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(n,)`` where the arm is, radians (metres for a slide).
        margin: σ at the end, at least, a number without a unit, see `kin.escape`; by default 0.03, or half of the
            arm's usual σ if that is less.
        obstacles, avoid_self_collision: what must not be touched on the way.
        cancel: called now and then; cancels the search by raising.

    Returns:
        The ways out, one for each posture; or why there are none, for example because the arm is far from any
        singularity.

    Raises:
        InputError: malformed arguments.

    Examples:
        >>> import kin
        >>> found = kin.leave_singularity("ur5e", [0.0, -1.2, 1.4, -0.7, 0.0, 0.0])  # joint 5 at zero
        >>> found.found, bool(found.sigma < 1e-9), found.exits[0].sigma >= found.margin
        (True, True, True)
    """
    robot = robot_of(robot)
    start = robot.check_q(q).copy()
    if start.ndim != 1:
        raise InputError("q", f"shape {start.shape}", f"one configuration of {robot.n} values")
    least = usual_margin(robot) if margin is None else finite_number("margin", margin, "a number above 0")
    if least <= 0.0:
        raise InputError("margin", margin, "a number above 0")
    avoided = IKOptions(avoid_self_collision=avoid_self_collision, obstacles=tuple(obstacles))
    space = Space.of(robot, surroundings(robot, avoided.obstacles, avoided.avoid_self_collision), cancel)
    near = [s for s in singularities_at(robot, start, math.inf) if s.kind != "algorithmic"]
    at = tuple(s for s in near if s.distance <= TOLERANCES.at_singularity) or tuple(near[:1])
    sigma = float(measure_of(robot).sigma(start))
    return Exits(robot, start, sigma, least, at, *_searched(space, start, sigma, least))


def _searched(
    space: Space, start: Array, sigma: float, margin: float
) -> tuple[tuple[Exit, ...], ExitCause | None]:
    """The ways out of a configuration ``(n,)`` with this σ, or why there are none."""
    measure = measure_of(space.robot)
    if sigma >= margin:
        return (), ExitCause("clear")
    refused = space.refusal(start, "start")
    if refused is not None:
        code: Code = "start outside" if refused.violations else "start touches"
        return (), ExitCause(code, refused.violations, refused.contact)
    T, inside = fk(space.robot, start), np.clip(start, space.lower, space.upper)
    first = starts(measure, inside, margin, space.lower, space.upper)
    limits = space.lower, space.upper
    better = [improved(measure, inside, T, first, margin, *limits, ties, space.cancel) for ties in TIES]
    ends = np.concatenate([*better, first])
    reached = measure.sigma(ends)
    if not (reached >= margin).any():
        return (), ExitCause("margin", largest=float(reached.max()))
    ends = ends[reached >= margin]
    ends = ends[np.sort(np.unique(np.round(ends * measure.joints, 3), axis=0, return_index=True)[1])]
    return _free(measure, space, inside, T, ends, margin)


def _free(
    measure: Measure, space: Space, start: Array, T: Array, ends: Array, margin: float
) -> tuple[tuple[Exit, ...], ExitCause | None]:
    """The best motions to the ends ``(k, n)`` that touch nothing, one for each posture; or why there is none."""
    exits = [_exit(measure, start, T, end, margin, space) for end in ends]
    if measure.spare and not any(each.keeps_tool for each in exits):
        waves = explored(measure, space, start, T, margin)
        exits += [_described(measure, T, q, True) for q in waves]
    found: list[Exit] = []
    contact = None
    for each in _ordered(exits):
        if len(found) == _MOST or (found and _is_worse(each, found[0])):
            break
        if any(_is_alike(measure, each, other) for other in found):
            continue
        if all(space.is_free(a, b) for a, b in pairwise(each.q)):
            found.append(each)
        elif contact is None:
            contact = next(filter(None, map(space.near.touching, each.q[::-1])), None)
    return tuple(found), None if found else ExitCause("blocked", contact=contact)


def _exit(measure: Measure, start: Array, T: Array, end: Array, margin: float, space: Space) -> Exit:
    """The motion to an end ``(n,)``, in which the tool stays if the arm has joints to spare and can do it."""
    kept = None
    if measure.spare and np.linalg.norm(measure.error(end, T)) < _NEARLY:
        kept = kept_along(measure, space, T, np.array([start, end]), margin)
    return _described(measure, T, np.array([start, end]) if kept is None else kept, kept is not None)


def _described(measure: Measure, T: Array, q: Array, keeps_tool: bool) -> Exit:
    """The motion along waypoints q ``(k, n)``; of one that keeps the tool, only these are looked at."""
    robot = measure.robot
    on = q if keeps_tool else q[0] + _SHARES[:, None] * (q[-1] - q[0])
    missing = task_error(robot, on, T, measure.task)
    q.flags.writeable = False
    return Exit(
        q=q,
        sigma=float(measure.sigma(q[-1])),
        keeps_tool=keeps_tool,
        translation=float(np.linalg.norm(missing[:, :3], axis=1).max()),
        rotation=float(np.linalg.norm(missing[:, 3:], axis=1).max()),
        deviation=float(np.linalg.norm(missing * measure.rows, axis=1).max()),
        posture=branch_of(robot, q[-1]) if branch_names(robot) else None,
        length=path_length(robot, q),
    )


def _ordered(found: list[Exit]) -> list[Exit]:
    """Those that keep the tool first; then by deviation of the tool, and the shorter one of two that are alike."""

    def shortest_first(some: list[Exit]) -> list[Exit]:
        # Rounding must not decide between a motion and its mirror image.
        return sorted(some, key=lambda each: (round(each.length, 6), *np.round(each.q[-1], 6).tolist()))

    order = shortest_first([each for each in found if each.keeps_tool])
    others = sorted((each for each in found if not each.keeps_tool), key=lambda each: each.deviation)
    while others:
        alike = [each for each in others if each.deviation <= others[0].deviation * (1.0 + _ALIKE)]
        order += shortest_first(alike)
        others = others[len(alike) :]
    return order


def _is_worse(each: Exit, best: Exit) -> bool:
    """Whether it is not worth a word beside the best one."""
    return not each.keeps_tool if best.keeps_tool else each.deviation > _OTHER * best.deviation


def _is_alike(measure: Measure, each: Exit, other: Exit) -> bool:
    """Whether two motions lead to the same posture; where postures have no names, into like directions."""
    if each.posture is not None:
        return each.posture == other.posture
    a, b = ((one.q[-1] - one.q[0]) * measure.joints for one in (each, other))
    return bool(a @ b > 0.0)
