"""Answers about motions: what a program becomes, when each segment is driven, which limits are met, or why not."""

from __future__ import annotations

import math
from typing import Any, Literal, NotRequired, cast

import numpy as np
from typing_extensions import TypedDict

from app.shared.answers.details import (
    ContactAnswer,
    IkDetails,
    SingularityAnswer,
    Violation,
    contact_answer,
    details_answer,
    singularity_answer,
    violation_answer,
)
from app.shared.answers.document import documented
from app.shared.answers.fk import Matrix
from kin import Contact, Motion
from kin.ik.details import LimitViolation
from kin.ik.results import Cause as IkCause
from kin.motion import MotionLimits, MotionSample, Peak, Refusal, messages
from kin.motion.details import Cause, HelpCode, Note, NotReached, RefusalDetails
from kin.motion.program import Kind
from kin.motion.results import Quantity
from kin.path.details import JointMove
from kin.robot import Robot
from kin.solvers.singular import Singularity
from kin.transforms import Array, wxyz_from_rotation
from kin.units import DEFAULT_UNITS


@documented
class SegmentTimesAnswer(TypedDict):
    """When a segment is driven; blends are shared half and half."""

    index: int
    """Which segment of the program, from 0."""
    kind: Kind
    """Kind of the segment."""
    name: str
    """Its name in the program."""
    start: float
    """Seconds from the start of the motion."""
    end: float
    """Seconds from the start of the motion."""


@documented
class PeakAnswer(TypedDict):
    """The largest value of a quantity, read off the motion by fine sampling."""

    joint: int | None
    """Index into q, from 0; null for the tool."""
    name: str
    """Name of the joint, or "tool"."""
    quantity: Quantity
    """Of a joint velocity, acceleration or jerk; of the tool its speed (tool_speed) or its angular velocity."""
    peak: float
    """The largest size, in rad or m and seconds."""
    time: float
    """When it is met, in seconds."""
    limit: float | None
    """Its limit; null if there is none."""
    ratio: float | None
    """Peak / limit; null if there is no limit."""
    assumed: bool
    """Whether the limit is assumed, because no robot file states it."""


@documented
class JointMoveAnswer(TypedDict):
    """How far a joint moves."""

    joint: int
    """Index into q, from 0."""
    motion: float
    """In radians (metres)."""


@documented
class RefusalDetailsAnswer(TypedDict, total=False):
    """The numbers behind a refusal; which fields there are depends on its cause. Metres and radians."""

    violations: list[Violation]
    """Causes "start" and "target": the joint values outside the limits."""
    details: IkDetails
    """Cause "unreachable": the numbers of inverse kinematics, as in the answers of `ik`."""
    cause: IkCause
    """Cause "unreachable": its cause, as in the answers of `ik`."""
    task: str
    """Cause "unreachable": what the tool would have had to meet."""
    singularities: list[SingularityAnswer]
    """Cause "unreachable": the singularities that the closest configuration is at."""
    violation: Violation
    """Cause "limits": the joint that would pass its limit."""
    singularity: SingularityAnswer | None
    """Cause "singularity": which one; null if no condition is known."""
    move: JointMoveAnswer | None
    """Cause "singularity": the joint that would have to jump farthest."""
    start: str | None
    """Cause "branch": the posture at the start; null if the arm's postures have no names."""
    coincident: list[str] | None
    """Cause "circle": the two points that are the same; null: via is in line, but not between the others."""
    joints: int
    """Cause "task": number of joints of the arm."""
    position: float
    """Cause "task": by how much the path is missed."""
    rotation: float
    """Cause "task": by how much the orientations on the path are missed."""
    time: float
    """Cause "collision": seconds from the start to the first contact."""
    contact: ContactAnswer
    """Cause "collision": what touches."""


@documented
class HelpAnswer(TypedDict):
    """What would help."""

    code: HelpCode
    """"ptp": a PTP to the same target. "posture": another posture at the start. "via": a via point. "start": a
    start inside the limits. "closer": a target closer to the arm. "task": keeping less than the whole pose."""
    posture: str | None
    """Name of the posture for "ptp" and "posture"."""


@documented
class RefusalAnswer(TypedDict):
    """Why a program cannot be driven."""

    segment: int
    """Which segment, from 0."""
    kind: Kind
    """Kind of the segment."""
    name: str
    """Its name in the program."""
    fraction: float | None
    """How much of it is covered at the place in question, 0 to 1; null if it is not a matter of a place."""
    distance: float | None
    """The same in metres of the tool's path; null likewise."""
    cause: Cause
    """What is in the way, as a code."""
    details: RefusalDetailsAnswer
    """The numbers behind `cause`."""
    helps: list[HelpAnswer]
    """What would help."""
    reason: str
    """All of it in sentences for people."""


@documented
class NoteAnswer(TypedDict):
    """Something worth knowing about a motion."""

    code: Literal["blend shortened", "blend left out", "slowed", "jerk cost"]
    """What it is about."""
    reason: str
    """The same in a sentence for people."""


@documented
class JointLimitsAnswer(TypedDict):
    """How fast a joint may move, in rad or m and seconds."""

    velocity: float
    """Largest speed."""
    acceleration: float
    """Largest acceleration."""
    jerk: float
    """Largest jerk."""
    effort: float | None
    """Largest torque or force (N·m or N), null where none is stated. Not checked: masses are unknown."""
    assumed: list[str]
    """Which of these are assumed, because no robot file states them."""


@documented
class MotionSamples(TypedDict):
    """The motion at equal steps of time; one item of each list for each time. The last one is the end."""

    t: list[float]
    """Seconds from the start."""
    q: Matrix
    """Joint values, in radians (metres)."""
    qd: Matrix
    """Joint velocities."""
    qdd: Matrix
    """Joint accelerations."""
    position: Matrix
    """Tool points in the world frame, in metres."""
    wxyz: Matrix
    """Orientations of the tool as quaternions w, x, y, z."""
    tool_speed: list[float]
    """Speed of the tool point, in m/s."""


@documented
class MotionAnswer(TypedDict):
    """The motion of a program, or why it cannot be driven."""

    planned: bool
    """Whether the program can be driven."""
    reason: str
    """The whole in sentences for people, in degrees and millimetres."""
    duration: float
    """Seconds; 0 after a refusal."""
    q_start: list[float]
    """Where the motion begins, in radians (metres)."""
    refusal: RefusalAnswer | None
    """Why it cannot be driven; null if it can."""
    segments: list[SegmentTimesAnswer]
    """When each segment is driven; empty after a refusal."""
    peaks: list[PeakAnswer]
    """The largest velocity, acceleration and jerk of each joint, and those of the tool; empty after a refusal."""
    notes: list[NoteAnswer]
    """What is worth knowing: blends that are smaller than requested, where a path is slow and why."""
    limits: list[JointLimitsAnswer]
    """The limits that were kept, joint by joint."""
    samples: NotRequired[MotionSamples]
    """The motion itself, unless it was not requested; empty lists after a refusal."""


_NOTES: dict[str, Literal["blend shortened", "blend left out", "slowed", "jerk cost"]] = {
    "BlendShortened": "blend shortened",
    "BlendLeftOut": "blend left out",
    "Slowed": "slowed",
    "JerkCost": "jerk cost",
}


def motion_answer(motion: Motion, times: Array | None = None) -> MotionAnswer:
    """A motion, with samples at these times ``(k,)``; None: without."""
    answer: MotionAnswer = {
        "planned": motion.planned,
        "reason": motion.reason,
        "duration": motion.duration,
        "q_start": motion.q_start.tolist(),
        "refusal": None if motion.refusal is None else _refusal(motion.refusal),
        "segments": [
            {"index": each.index, "kind": each.kind, "name": each.name, "start": each.start, "end": each.end}
            for each in motion.segments
        ],
        "peaks": [_peak(each) for each in motion.peaks] if motion.planned else [],
        "notes": [_note(each) for each in motion.notes],
        "limits": _limits(motion.robot, motion.limits),
    }
    if times is not None:
        answer["samples"] = samples_answer(motion.sample(times))
    return answer


def samples_answer(sample: MotionSample) -> MotionSamples:
    """A motion at times ``(k,)``."""
    return {
        "t": sample.t.tolist(),
        "q": sample.q.tolist(),
        "qd": sample.qd.tolist(),
        "qdd": sample.qdd.tolist(),
        "position": sample.T[:, :3, 3].tolist(),
        "wxyz": wxyz_from_rotation(sample.T[:, :3, :3]).tolist(),
        "tool_speed": sample.tool_speed.tolist(),
    }


def sample_times(motion: Motion, rate: float) -> Array:
    """Times ``(k,)`` at `rate` per second, from the start to the end, which is one of them."""
    if not motion.planned:
        return np.zeros(0)
    steps = np.arange(int(motion.duration * rate * (1.0 + 1e-12)) + 1) / rate
    return steps if motion.duration - steps[-1] < 1e-9 else np.append(steps, motion.duration)


def _peak(peak: Peak) -> PeakAnswer:
    return {
        "joint": peak.joint,
        "name": peak.name,
        "quantity": peak.quantity,
        "peak": peak.peak,
        "time": peak.time,
        "limit": peak.limit,
        "ratio": peak.ratio,
        "assumed": peak.assumed,
    }


def _note(fact: Note) -> NoteAnswer:
    return {"code": _NOTES[type(fact).__name__], "reason": messages.note(fact, DEFAULT_UNITS)}


def _limits(robot: Robot, limits: MotionLimits) -> list[JointLimitsAnswer]:
    columns = zip(limits.velocity, limits.acceleration, limits.jerk, limits.effort, limits.assumed, strict=True)
    return [
        {
            "velocity": float(velocity),
            "acceleration": float(acceleration),
            "jerk": float(jerk),
            "effort": None if math.isnan(effort) else float(effort),
            "assumed": list(assumed),
        }
        for velocity, acceleration, jerk, effort, assumed in columns
    ]


def _refusal(refusal: Refusal) -> RefusalAnswer:
    return {
        "segment": refusal.segment,
        "kind": refusal.kind,
        "name": refusal.name,
        "fraction": refusal.fraction,
        "distance": refusal.distance,
        "cause": refusal.cause,
        "details": _details(refusal.details),
        "helps": [{"code": each.code, "posture": each.posture} for each in refusal.helps],
        "reason": refusal.reason,
    }


def _details(details: RefusalDetails) -> RefusalDetailsAnswer:
    """The fields of the details, those that are not numbers as answers of their own."""
    fields: dict[str, Any] = {name: _field(value) for name, value in details._asdict().items()}
    if isinstance(details, NotReached):
        fields["details"] = details_answer(details.details)
    return cast(RefusalDetailsAnswer, fields)


def _field(value: object) -> object:
    match value:
        case LimitViolation():
            return violation_answer(value)
        case Contact():
            return contact_answer(value)
        case Singularity():
            return singularity_answer(value)
        case JointMove():
            return {"joint": value.joint, "motion": value.motion}
        case tuple():
            return [_field(item) for item in value]
    return value
