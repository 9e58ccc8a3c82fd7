"""Motions: a program of segments, timed so that the joints keep their limits.

1. :mod:`kin.motion.program` holds the program, :mod:`kin.motion.reading` reads it from plain data.
2. :mod:`kin.motion.limits` knows how fast each joint may move, :mod:`kin.motion.tasks` what the tool can
   keep of a pose.
3. :mod:`kin.motion.planner` turns the program into pieces (:mod:`kin.motion.pieces`), with the steps of
   :mod:`kin.motion.planning`: a PTP is timed joint by joint (:mod:`kin.motion.scurve`). Curves of the tool and
   corners are built in :mod:`kin.motion.paths` from :mod:`kin.motion.geometry`, which also finds the joint path;
   :mod:`kin.motion.timing` times it.
4. :mod:`kin.motion.results` holds the answer, :mod:`kin.motion.arrivals` in which configuration a segment meets
   its target, :mod:`kin.motion.details` the facts behind a refusal or a note, and
   :mod:`kin.motion.messages` words them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from kin.collision.contacts import surroundings
from kin.errors import InputError
from kin.ik.options import IKOptions, MotionKeywords, options_of_call
from kin.ik.problem import never_cancel
from kin.motion import limits as assumed
from kin.motion.limits import MotionLimits, motion_limits
from kin.motion.planner import planned
from kin.motion.planning.collisions import checked
from kin.motion.planning.starts import start_as_recorded
from kin.motion.program import (
    Circ,
    Dwell,
    Gripper,
    JointTarget,
    Lin,
    Move,
    Pause,
    PoseTarget,
    Program,
    Ptp,
    Segment,
    Spline,
)
from kin.motion.reading import parse_program, program_from_dict, program_to_dict
from kin.motion.results import InMotion, Motion, MotionSample, Peak, Refusal, SegmentTimes
from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import finite_array

_ROUNDING = 1e-9  # part of a speed

__all__ = [
    "Circ",
    "Dwell",
    "Gripper",
    "JointTarget",
    "Lin",
    "Motion",
    "MotionLimits",
    "MotionSample",
    "Peak",
    "PoseTarget",
    "Program",
    "Ptp",
    "Refusal",
    "SegmentTimes",
    "Spline",
    "motion_limits",
    "parse_program",
    "plan_motion",
    "program_from_dict",
    "program_to_dict",
    "start_as_recorded",
]


def plan_motion(
    robot: Robot | str,
    program: Program | Mapping[str, Any] | Sequence[Move | Pause],
    q_start: ArrayLike | None = None,
    *,
    qd_start: ArrayLike | None = None,
    qdd_start: ArrayLike | None = None,
    motion_limits: MotionLimits | None = None,
    options: IKOptions | None = None,
    cancel: Callable[[], None] = never_cancel,
    **keywords: Unpack[MotionKeywords],
) -> Motion:
    """The motion of a program, with every limit kept, or why it cannot be driven.

    Args:
        robot: the arm, or the id of a built-in one.
        program: a `Program`, its segments, or plain data as in `program_from_dict`.
        q_start: ``(n,)`` where the arm is, radians (metres); the home pose by default.
        qd_start, qdd_start: ``(n,)`` how the joints move at the start, radians (metres) per second and per s²,
            within their limits; at rest by default. A PTP without a blend goes on from this motion; before any
            other segment the arm brakes, and the segment begins where it then stands.
        motion_limits: other limits than those of `kin.motion.motion_limits`, in radians (metres) and seconds.
        options: the keywords as one value. All others have to be the default: the program states the task, and
            its start the posture.
        cancel: called now and then; cancels the computation by raising.
        keywords: `avoid_self_collision` and `obstacles`: the motion is checked, and refused at the first place
            where the arm touches itself or an obstacle. It is not led around them.

    Returns:
        The motion to sample, or the refusal with its place and joint; its cause is ``"stop"`` where a joint that
        moves at the start cannot stop before its limit.

    Raises:
        InputError: a malformed program or start, or one that moves faster than the limits allow. A program that
            cannot be driven is not an error.

    Examples:
        >>> import kin
        >>> arm = kin.get_robot("ur5")
        >>> motion = kin.plan_motion(arm, [kin.motion.Ptp(kin.motion.JointTarget(arm.q_home + 0.3))])
        >>> motion.refusal is None, motion.sample(motion.duration).q.shape
        (True, (6,))
    """
    robot = robot_of(robot)
    program = _program_of(program, robot)
    q = robot.q_home if q_start is None else robot.check_q(q_start, "q_start")
    if q.ndim != 1:
        raise InputError("q_start", f"shape {q.shape}", f"one configuration of {robot.n} values")
    limits = assumed.motion_limits(robot) if motion_limits is None else motion_limits
    if not isinstance(limits, MotionLimits) or len(limits.velocity) != robot.n:
        raise InputError("motion_limits", limits, f"MotionLimits of {robot.n} joints")
    start = _in_motion(robot, limits, qd_start, qdd_start)
    wanted = options_of_call(MotionKeywords, options, keywords)
    wanted.check_only("avoid_self_collision", "obstacles")
    found = planned(robot, program, limits, q.copy(), start, cancel)
    if wanted.avoids:
        return checked(found, surroundings(robot, wanted.obstacles, wanted.avoid_self_collision), cancel)
    return found


def _program_of(program: Program | Mapping[str, Any] | Sequence[Move | Pause], robot: Robot) -> Program:
    if isinstance(program, Program):
        return program
    if isinstance(program, Mapping):
        return program_from_dict(program, robot)
    if not isinstance(program, Sequence) or isinstance(program, str | bytes):
        raise InputError("program", program, "a Program, its segments, or a dict")
    return Program(cast(tuple[Segment, ...], tuple(program)))  # checked there


def _in_motion(
    robot: Robot, limits: MotionLimits, qd_start: ArrayLike | None, qdd_start: ArrayLike | None
) -> InMotion | None:
    """How the arm moves at the start, checked against the limits of its joints; None at rest."""
    if qd_start is None and qdd_start is None:
        return None
    found = []
    for field, given, most, per in (
        ("qd_start", qd_start, limits.velocity, "s"),
        ("qdd_start", qdd_start, limits.acceleration, "s²"),
    ):
        values = np.zeros(robot.n) if given is None else finite_array(field, given, (robot.n,)).copy()
        if values.ndim != 1:
            raise InputError(field, f"shape {values.shape}", f"{robot.n} numbers, one for each joint")
        for i in np.flatnonzero(np.abs(values) > most).tolist():
            raise InputError(f"{field}[{i}]", float(values[i]), _at_most(robot, i, float(most[i]), per))
        found.append(values)
    qd, qdd = found
    # What the acceleration at the start adds to the speed until it is gone.
    later = np.abs(qd + 0.5 * qdd * np.abs(qdd) / limits.jerk)
    for i in np.flatnonzero(later > limits.velocity * (1.0 + _ROUNDING)).tolist():
        least = float(limits.velocity[i] - np.sign(qdd[i]) * qd[i])
        most = (2.0 * float(limits.jerk[i]) * max(least, 0.0)) ** 0.5
        why = ", or the joint would become faster than it may before the acceleration is gone"
        raise InputError(f"qdd_start[{i}]", float(qdd[i]), _at_most(robot, i, most, "s²") + why)
    return InMotion(qd, qdd) if qd.any() or qdd.any() else None


def _at_most(robot: Robot, index: int, most: float, per: str) -> str:
    joint = robot.joints[index]
    return f"at most {most:.6g} {'rad' if robot.revolute[index] else 'm'}/{per} either way, as {joint.name} may"
