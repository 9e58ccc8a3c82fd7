"""The first part of a motion that begins while the arm moves.

A PTP that stops at its end goes on from the motion at the start. Before any other segment the arm brakes: a line
or an arc begins at rest, where the arm stands then.
"""

from __future__ import annotations

import numpy as np

from kin.ik.details import LimitViolation
from kin.motion.details import Braked, CannotStop
from kin.motion.moving import braked, extremes, together
from kin.motion.pieces import JointMotion
from kin.motion.planning.plan import Plan, RefusedError
from kin.motion.planning.runs import configuration_of
from kin.motion.program import Move, Ptp
from kin.motion.refusals import violations
from kin.robot import Robot
from kin.transforms import Array

_LOOKS, _HALVINGS = 1000, 60  # of the time until a joint reaches its limit


def set_off(plan: Plan) -> int:
    """Add what the arm does at first, from the motion `plan.start`; the index of the segment that follows.

    Raises `RefusedError` if a joint cannot stop before its limit.
    """
    start, segment = plan.start, plan.program.segments[0]
    assert start is not None
    plan.start = None
    stops = isinstance(segment, Ptp) and (segment.blend == 0.0 or len(plan.program.segments) == 1)
    if isinstance(segment, Ptp) and stops and segment.tool_speed is None and segment.tool_turn is None:
        goal = configuration_of(plan, 0, segment.target, plan.q)
        piece = _inside(
            plan, [together(plan.q, goal, start.qd, start.qdd, limits) for limits in _limits(plan, segment)]
        )
        plan.q = goal
        plan.add(0, piece, [piece.duration], goal[None])
        return 1
    move = segment if isinstance(segment, Move) else None
    piece = _inside(plan, [braked(plan.q, start.qd, start.qdd, limits) for limits in _limits(plan, move)])
    plan.q = plan.robot.clip(piece.at(np.array([piece.duration]))[0, 0])
    plan.pieces.append(piece)
    plan.time += piece.duration
    plan.notes.append(Braked(piece.duration))
    return 0


def _limits(plan: Plan, segment: Move | None) -> list[Array]:
    """Those that the first segment asks for ``(n, 3)``, and those of the arm, to stop in time."""
    whole = np.stack([plan.limits.velocity, plan.limits.acceleration, plan.limits.jerk], axis=1)
    if segment is None:
        return [whole]
    own = whole * (segment.speed, segment.acceleration, segment.acceleration)
    return [own, whole * (segment.speed, 1.0, 1.0)]


def _inside(plan: Plan, pieces: list[JointMotion]) -> JointMotion:
    """The first piece inside the limits of the joints, or the refusal of the last one."""
    for piece in pieces:
        if not _beyond(plan.robot, piece):
            return piece
    raise _refused(plan, pieces[-1])


def _beyond(robot: Robot, piece: JointMotion) -> tuple[LimitViolation, ...]:
    low, high = extremes(piece)
    return (*violations(robot, low), *violations(robot, high))


def _refused(plan: Plan, piece: JointMotion) -> RefusedError:
    """The refusal of the joint that is the first to reach its limit."""
    found = [(_time_of(piece, each), each) for each in _beyond(plan.robot, piece)]
    time, violation = min(found, key=lambda each: each[0])
    speed = float(piece.at(np.zeros(1))[1, 0, violation.joint])
    return plan.refused(0, "stop", CannotStop(violation, time, speed))


def _time_of(piece: JointMotion, violation: LimitViolation) -> float:
    """When a joint first reaches the limit that it would go beyond, which it has not at the start."""
    sign = 1.0 if violation.value > violation.limit else -1.0

    def beyond(times: Array) -> Array:
        return np.asarray(sign * (piece.at(times)[0, :, violation.joint] - violation.limit))

    times = np.linspace(0.0, piece.duration, _LOOKS)
    far = beyond(times)
    k = max(int(np.argmax(far > 0.0)) if (far > 0.0).any() else int(np.argmax(far)), 1)
    low, high = float(times[k - 1]), float(times[k])
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if beyond(np.array([middle]))[0] > 0.0 else (middle, high)
    return high
