"""From a program to a motion: segments that are blended into each other are driven as one path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kin.fk import fk
from kin.motion.details import CannotStop, Help, Slowed, StartOutside
from kin.motion.detours import detours, lengths, path_of
from kin.motion.limits import MotionLimits
from kin.motion.planning.parts import driven, part_before
from kin.motion.planning.plan import Plan, RefusedError, task_of
from kin.motion.program import JointTarget, Program, Spline
from kin.motion.refusals import violations
from kin.motion.results import InMotion, Motion
from kin.robot import Robot
from kin.transforms import Array

_PLACES = 129  # of a segment that slows down beside a singularity


def planned(
    robot: Robot,
    program: Program,
    limits: MotionLimits,
    q_start: Array,
    start: InMotion | None,
    cancel: Callable[[], None],
) -> Motion:
    """The motion of a program from a configuration ``(n,)``, at rest or in motion."""
    _check_targets(robot, program)
    plan = Plan(robot, program, limits, q_start.copy(), cancel, start=start)
    outside = violations(robot, q_start)
    if outside:
        refused = plan.refused(0, "start", StartOutside(outside), (Help("start"),))
        return Motion(robot, program, limits, q_start, refused.refusal, (), start=start)
    try:
        driven(plan, 0)
    except RefusedError as error:
        part = None
        if not isinstance(error.refusal.details, CannotStop):
            part = part_before(plan, q_start, error.refusal, start)
            part = None if part is None else _with_helps(part, cancel)
        return Motion(robot, program, limits, q_start, error.refusal, (), part=part, start=start)
    return _with_helps(plan.motion(q_start, start), cancel)


def _with_helps(motion: Motion, cancel: Callable[[], None]) -> Motion:
    """The motion; its notes on places that are slow beside a singularity say what would help."""
    if not any(isinstance(each, Slowed) for each in motion.notes):
        return motion
    notes = tuple(
        each._replace(helps=_helps(motion, each, cancel))
        if isinstance(each, Slowed) and each.singularity
        else each
        for each in motion.notes
    )
    return replace(motion, notes=notes)


def _helps(motion: Motion, note: Slowed, cancel: Callable[[], None]) -> tuple[Help, ...]:
    """A PTP, and what else leads past the singularity beside which a segment is slow."""
    cancel()
    robot, task = motion.robot, task_of(motion.program, motion.robot)
    times = next(each for each in motion.segments if each.index == note.segment)
    t = np.linspace(times.start, times.end, 4 * _PLACES)  # many are where it is slow
    s = lengths(robot, task, fk(robot, motion.derivatives(t)[0]))
    q = motion.derivatives(np.interp(np.linspace(0.0, s[-1], _PLACES), s, t))[0]
    path = path_of(robot, task, q[0], fk(robot, q), motion.limits.velocity)
    return (Help("ptp"), *(() if path is None else detours(path)))


def _check_targets(robot: Robot, program: Program) -> None:
    """Raise `InputError` for a configuration with another number of joints."""
    for i, segment in enumerate(program.segments):
        points = segment.points if isinstance(segment, Spline) else (getattr(segment, "target", None),)
        for k, point in enumerate(points):
            where = f"segments[{i}].points[{k}].q" if isinstance(segment, Spline) else f"segments[{i}].q"
            if isinstance(point, JointTarget):
                robot.check_q(point.q, where)
