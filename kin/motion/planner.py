"""From a program to a motion, segment by segment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from kin.fk import fk
from kin.ik import solve_ik
from kin.ik.details import JointKind, LimitViolation
from kin.ik.options import Task
from kin.motion.details import (
    BlendLeftOut,
    Cause,
    Help,
    Note,
    NotReached,
    RefusalDetails,
    StartOutside,
    TargetOutside,
)
from kin.motion.limits import MotionLimits
from kin.motion.pieces import Hold, JointMotion, Piece
from kin.motion.program import Dwell, JointTarget, Program, Ptp, Segment, kind_of
from kin.motion.results import Motion, Refusal, SegmentTimes
from kin.robot import Robot
from kin.solvers import closed_form_of
from kin.tolerances import TOLERANCES
from kin.transforms import Array


def task_of(program: Program, robot: Robot) -> Task:
    """What the tool keeps of a pose: by default as much as the joints of the arm can keep."""
    if program.task is not None:
        return program.task
    if robot.n < 5:
        form = closed_form_of(robot)
        return "pose" if form is not None and form.name == "scara4" else "position"
    return "approach" if robot.n == 5 else "pose"


class RefusedError(Exception):
    """Ends the planning of a segment that cannot be driven."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.reason)
        self.refusal = refusal


@dataclass(slots=True, eq=False)
class Plan:
    """A motion being planned: what is known so far, and where the arm is at its end."""

    robot: Robot
    program: Program
    limits: MotionLimits
    q: Array
    stop: Callable[[], None]
    pieces: list[Piece] = field(default_factory=list)
    segments: list[SegmentTimes] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    time: float = 0.0

    def add(self, index: int, piece: Piece) -> None:
        """A piece that is one segment."""
        segment = self.program.segments[index]
        end = self.time + piece.duration
        self.segments.append(SegmentTimes(index, kind_of(segment), segment.name, self.time, end))
        if piece.duration > 0.0:
            self.pieces.append(piece)
        self.time = end


def planned(
    robot: Robot, program: Program, limits: MotionLimits, q_start: Array, stop: Callable[[], None]
) -> Motion:
    """The motion of a program from a configuration ``(n,)``."""
    plan = Plan(robot, program, limits, q_start.copy(), stop)
    try:
        outside = violations(robot, q_start)
        if outside:
            raise _refused(plan, 0, "start", StartOutside(outside), (Help("start"),))
        for index, segment in enumerate(program.segments):
            stop()
            _drive(plan, index, segment)
    except RefusedError as error:
        return Motion(robot, program, limits, q_start, error.refusal, ())
    return Motion(
        robot, program, limits, q_start, None, tuple(plan.segments), tuple(plan.notes), tuple(plan.pieces)
    )


def _drive(plan: Plan, index: int, segment: Segment) -> None:
    """Add a segment to the plan."""
    if isinstance(segment, Dwell):
        plan.add(index, Hold(plan.q, segment.seconds))
        return
    assert isinstance(segment, Ptp)
    end = _configuration(plan, index, segment)
    limits = np.stack([plan.limits.velocity, plan.limits.acceleration, plan.limits.jerk], axis=1)
    limits *= (segment.speed, segment.acceleration, segment.acceleration)
    plan.add(index, JointMotion.between(plan.q, end, limits))
    plan.q = end
    if segment.blend > 0.0:
        plan.notes.append(BlendLeftOut(index, "last" if index + 1 == len(plan.program.segments) else "kinds"))


def _configuration(plan: Plan, index: int, segment: Ptp) -> Array:
    """Where a PTP ends ``(n,)``."""
    robot, target = plan.robot, segment.target
    if isinstance(target, JointTarget):
        q = robot.check_q(target.q, f"segments[{index}].q")
        outside = violations(robot, q)
        if outside:
            raise _refused(plan, index, "target", TargetOutside(outside), ())
        return robot.clip(q)
    result = solve_ik(robot, target.pose(fk(robot, plan.q)), q_seed=plan.q, task=task_of(plan.program, robot))
    if not result.solutions:
        facts = NotReached(result.details, result.cause, result.task, result.singularities)
        helps = (Help("closer"),) if result.cause in ("too far", "too near") else ()
        raise _refused(plan, index, "unreachable", facts, helps)
    return robot.clip(result.solutions[0].q)


def _refused(
    plan: Plan, index: int, cause: Cause, details: RefusalDetails, helps: tuple[Help, ...]
) -> RefusedError:
    segment = plan.program.segments[index]
    return RefusedError(Refusal(index, kind_of(segment), segment.name, None, None, cause, details, helps))


def violations(robot: Robot, q: Array) -> tuple[LimitViolation, ...]:
    """The joint values of a configuration ``(n,)`` that are outside the limits."""
    found = []
    for i, joint in enumerate(robot.joints):
        if not robot.lower[i] - TOLERANCES.limit <= q[i] <= robot.upper[i] + TOLERANCES.limit:
            limit = robot.lower[i] if q[i] < robot.lower[i] else robot.upper[i]
            kind: JointKind = "prismatic" if joint.kind == "prismatic" else "revolute"
            found.append(LimitViolation(i, joint.name, float(q[i]), float(limit), kind, False))
    return tuple(found)
