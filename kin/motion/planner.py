"""From a program to a motion: segments that are blended into each other are driven as one path."""

from __future__ import annotations

from collections.abc import Callable

from kin.motion.details import CannotStop, Help, StartOutside
from kin.motion.limits import MotionLimits
from kin.motion.planning.parts import driven, part_before
from kin.motion.planning.plan import Plan, RefusedError
from kin.motion.program import JointTarget, Program, Spline
from kin.motion.refusals import violations
from kin.motion.results import InMotion, Motion
from kin.robot import Robot
from kin.transforms import Array


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
        return Motion(robot, program, limits, q_start, error.refusal, (), part=part, start=start)
    return plan.motion(q_start, start)


def _check_targets(robot: Robot, program: Program) -> None:
    """Raise `InputError` for a configuration with another number of joints."""
    for i, segment in enumerate(program.segments):
        points = segment.points if isinstance(segment, Spline) else (getattr(segment, "target", None),)
        for k, point in enumerate(points):
            where = f"segments[{i}].points[{k}].q" if isinstance(segment, Spline) else f"segments[{i}].q"
            if isinstance(point, JointTarget):
                robot.check_q(point.q, where)
