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
from typing import Any, cast

from numpy.typing import ArrayLike

from kin.collision import Obstacle
from kin.collision.contacts import surroundings
from kin.errors import InputError
from kin.ik.options import IKOptions
from kin.ik.problem import never_cancel
from kin.motion.arrivals import Arrival
from kin.motion.limits import MotionLimits, motion_limits
from kin.motion.planner import planned
from kin.motion.planning.collisions import checked
from kin.motion.planning.plan import task_of
from kin.motion.planning.starts import segment_poses, start_as_recorded
from kin.motion.program import Circ, Dwell, JointTarget, Lin, Move, PoseTarget, Program, Ptp, Segment, Spline
from kin.motion.reading import parse_program, program_from_dict, program_to_dict
from kin.motion.results import Motion, MotionSample, Peak, Refusal, SegmentTimes
from kin.named import robot_of
from kin.robot import Robot

__all__ = [
    "Arrival",
    "Circ",
    "Dwell",
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
    "segment_poses",
    "start_as_recorded",
    "task_of",
]


def plan_motion(
    robot: Robot | str,
    program: Program | Mapping[str, Any] | Sequence[Move | Dwell],
    q_start: ArrayLike | None = None,
    *,
    limits: MotionLimits | None = None,
    options: IKOptions | None = None,
    avoid_self_collision: bool = False,
    obstacles: Sequence[Obstacle] = (),
    stop: Callable[[], None] = never_cancel,
) -> Motion:
    """The motion of a program, with every limit kept, or why it cannot be driven.

    Args:
        robot: the arm, or the id of a built-in one.
        program: a `Program`, its segments, or plain data as in `program_from_dict`.
        q_start: ``(n,)`` where the arm is, radians (metres); the home pose by default.
        limits: other limits than those of `motion_limits`, in radians (metres) and seconds.
        options: the next two as one value. All others have to be the default: the program states the task, and
            its start the posture.
        avoid_self_collision, obstacles: the motion is checked, and refused at the first place where the arm
            touches itself or an obstacle. It is not led around them.
        stop: called now and then; cancels the computation by raising.

    Returns:
        The motion to sample, or the refusal with its place and joint.

    Raises:
        InputError: a malformed program or start. A program that cannot be driven is not an error.

    Examples:
        >>> import kin
        >>> arm = kin.get_robot("ur5")
        >>> motion = kin.plan_motion(arm, [kin.Ptp(kin.JointTarget(arm.q_home + 0.3))])
        >>> motion.refusal is None, motion.sample(motion.duration).q.shape
        (True, (6,))
    """
    robot = robot_of(robot)
    if isinstance(program, Mapping):
        program = program_from_dict(program, robot)
    elif not isinstance(program, Program):
        if not isinstance(program, Sequence) or isinstance(program, str | bytes):
            raise InputError("program", program, "a Program, its segments, or a dict")
        program = Program(cast(tuple[Segment, ...], tuple(program)))  # checked there
    q = robot.q_home if q_start is None else robot.check_q(q_start, "q_start")
    if q.ndim != 1:
        raise InputError("q_start", f"shape {q.shape}", f"one configuration of {robot.n} values")
    if limits is None:
        limits = motion_limits(robot)
    elif not isinstance(limits, MotionLimits) or len(limits.velocity) != robot.n:
        raise InputError("limits", limits, f"MotionLimits of {robot.n} joints")
    wanted = IKOptions.of(options, avoid_self_collision=avoid_self_collision, obstacles=obstacles)
    wanted.check_only("avoid_self_collision", "obstacles")
    found = planned(robot, program, limits, q.copy(), stop)
    if wanted.avoids:
        return checked(found, surroundings(robot, wanted.obstacles, wanted.avoid_self_collision), stop)
    return found
