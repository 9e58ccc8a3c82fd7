"""Answers about motions: what a program becomes, when each segment is driven, which limits are met, or why not."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from msgspec import UNSET, UnsetType

from app.shared.answers.answer import Answer, From
from app.shared.answers.details import ContactAnswer, IkDetails, SingularityAnswer, Violation
from app.shared.answers.fk import Matrix
from kin.ik.details import Details
from kin.ik.results import Cause as IkCause
from kin.motion import Motion, MotionLimits, Refusal, messages
from kin.motion.details import (
    ArrivesOtherwise,
    BlendLeftOut,
    BlendShortened,
    Braked,
    Cause,
    HelpCode,
    JerkCost,
    Note,
    NotReached,
    Slowed,
)
from kin.motion.program import Kind
from kin.motion.results import Quantity
from kin.transforms import wxyz_from_rotation
from kin.units import DEFAULT_UNITS

NoteCode = Literal["arrives otherwise", "blend shortened", "blend left out", "slowed", "jerk cost", "braked"]
_NOTES: dict[type[Note], NoteCode] = {
    ArrivesOtherwise: "arrives otherwise",
    BlendShortened: "blend shortened",
    BlendLeftOut: "blend left out",
    Slowed: "slowed",
    JerkCost: "jerk cost",
    Braked: "braked",
}


class ArrivalAnswer(Answer):
    """In which configuration a segment meets its target; with a blend, in which it would."""

    q: list[float]
    """Joint values, in radians (metres)."""
    posture: str | None
    """Name of the branch; null if the arm's branches have no names."""
    recorded_posture: str | None
    """Name of the branch of the target's joint values; null likewise, or where the target is a pose."""
    difference: list[float] | None
    """Joint values of the arrival minus those of the target, which have the same pose; null where it is a pose."""
    as_recorded: bool
    """False if a joint differs by more than 0.001 rad or m; a note says so in words."""


class SegmentTimesAnswer(Answer):
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
    arrival: ArrivalAnswer | None
    """In which configuration it meets its target; null where the arm stands still."""
    opening: float | None
    """How far the gripper is open at its end, 0 (closed) to 1 (open); null if it does not move the gripper."""


class PeakAnswer(Answer):
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


class JointMoveAnswer(Answer):
    """How far a joint moves."""

    joint: int
    """Index into q, from 0."""
    motion: float
    """In radians (metres)."""


class RefusalDetailsAnswer(Answer):
    """The numbers behind a refusal; which fields there are depends on its cause. Metres and radians."""

    violations: list[Violation] | UnsetType = UNSET
    """Causes "start" and "target": the joint values outside the limits."""
    details: IkDetails | UnsetType = UNSET
    """Cause "unreachable": the numbers of inverse kinematics, as in the answers of `ik`."""
    cause: IkCause | UnsetType = UNSET
    """Cause "unreachable": its cause, as in the answers of `ik`."""
    task: str | UnsetType = UNSET
    """Cause "unreachable": what the tool would have had to meet."""
    singularities: list[SingularityAnswer] | UnsetType = UNSET
    """Cause "unreachable": the singularities that the closest configuration is at."""
    violation: Violation | UnsetType = UNSET
    """Causes "limits" and "stop": the joint that would pass its limit."""
    singularity: SingularityAnswer | UnsetType | None = UNSET
    """Cause "singularity": which one; null if no condition is known."""
    move: JointMoveAnswer | UnsetType | None = UNSET
    """Cause "singularity": the joint that would have to jump farthest."""
    start: str | UnsetType | None = UNSET
    """Cause "branch": the posture at the start; null if the arm's postures have no names."""
    coincident: list[str] | UnsetType | None = UNSET
    """Cause "circle": the two points that are the same; null: via is in line, but not between the others."""
    joints: int | UnsetType = UNSET
    """Cause "task": number of joints of the arm."""
    position: float | UnsetType = UNSET
    """Cause "task": by how much the path is missed."""
    rotation: float | UnsetType = UNSET
    """Cause "task": by how much the orientations on the path are missed."""
    time: float | UnsetType = UNSET
    """Cause "collision": seconds from the start to the first contact. Cause "stop": to the joint's limit."""
    speed: float | UnsetType = UNSET
    """Cause "stop": how fast the joint moves at the start."""
    contact: ContactAnswer | UnsetType = UNSET
    """Cause "collision": what touches."""


class HelpAnswer(Answer):
    """What would help."""

    code: HelpCode
    """"ptp": a PTP to the same target. "posture": another posture at the start. "via": a via point. "start": a
    start inside the limits. "closer": a target closer to the arm. "task": keeping less than the whole pose.
    "shift": the same path beside this one. "tilt": the same path with the tool turned."""
    posture: str | None
    """Name of the posture for "ptp" and "posture"."""
    vector: Annotated[list[float] | UnsetType, From("vector", unless_empty=True)] = UNSET
    """For "shift" in metres along the axes of the world, for "tilt" a rotation vector in radians about the tool's
    own axes; absent for others."""


def _ik_details(refusal: Refusal) -> Details | UnsetType:
    return refusal.details.details if isinstance(refusal.details, NotReached) else UNSET


class RefusalAnswer(Answer):
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
    ik: Annotated[IkDetails | UnsetType, From(_ik_details)] = UNSET
    """Cause "unreachable": the numbers of inverse kinematics, as in the answers of `ik`. They are in
    `details.details` too, for older clients."""


class NoteAnswer(Answer):
    """Something worth knowing about a motion."""

    code: Annotated[NoteCode, From(lambda note: _NOTES[type(note)])]
    """What it is about."""
    reason: Annotated[str, From(lambda note: messages.note(note, DEFAULT_UNITS))]
    """The same in a sentence for people."""
    segment: int | UnsetType = UNSET
    """Which segment, from 0; absent where it is about several or none."""
    fraction: float | UnsetType = UNSET
    """For "slowed": how much of it is covered at that place, 0 to 1."""
    joint: int | UnsetType = UNSET
    """For "slowed": which joint limits the speed there, from 0."""
    helps: list[HelpAnswer] | UnsetType = UNSET
    """For "slowed": what leads past a singularity that is near; empty if none is."""


class JointLimitsAnswer(Answer):
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


class MotionSamples(Answer):
    """The motion at equal steps of time; one item of each list for each time. The last one is the end."""

    t: list[float]
    """Seconds from the start."""
    q: Matrix
    """Joint values, in radians (metres)."""
    qd: Matrix
    """Joint velocities."""
    qdd: Matrix
    """Joint accelerations."""
    position: Annotated[Matrix, From(lambda sample: sample.T[:, :3, 3])]
    """Tool points in the world frame, in metres."""
    wxyz: Annotated[Matrix, From(lambda sample: wxyz_from_rotation(sample.T[:, :3, :3]))]
    """Orientations of the tool as quaternions w, x, y, z."""
    tool_speed: list[float]
    """Speed of the tool point, in m/s."""


class PartAnswer(Answer):
    """What can be driven of a program that is refused: its beginning, up to just before the place in question."""

    duration: float
    """Seconds; the arm is at rest at the end."""
    segments: list[SegmentTimesAnswer]
    """When each segment is driven; of a line or an arc that is refused on its way, its beginning is the last."""
    peaks: list[PeakAnswer]
    """As for a whole motion."""
    notes: list[NoteAnswer]
    """As for a whole motion."""
    samples: MotionSamples | UnsetType = UNSET
    """The motion of this part, unless it was not requested."""


class MotionAnswer(Answer):
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
    part: PartAnswer | None
    """After a refusal what can be driven nevertheless; null if that is nothing, or nothing was refused."""
    samples: MotionSamples | UnsetType = UNSET
    """The motion itself, unless it was not requested; empty lists after a refusal."""


def motion_answer(motion: Motion, rate: float | None = None) -> MotionAnswer:
    """A motion, with this many samples per second; None: without."""
    part = motion.part
    return MotionAnswer.of(
        motion,
        peaks=[PeakAnswer.of(each) for each in motion.peaks] if motion.planned else [],
        limits=_limits(motion.limits),
        part=None if part is None else PartAnswer.of(part, samples=_samples(part, rate)),
        samples=_samples(motion, rate),
    )


def _samples(motion: Motion, rate: float | None) -> MotionSamples | UnsetType:
    return UNSET if rate is None else MotionSamples.of(motion.sample(motion.step_times(rate)))


def _limits(limits: MotionLimits) -> list[JointLimitsAnswer]:
    columns = zip(limits.velocity, limits.acceleration, limits.jerk, limits.effort, limits.assumed, strict=True)
    return [
        JointLimitsAnswer(
            float(velocity),
            float(acceleration),
            float(jerk),
            None if math.isnan(effort) else float(effort),
            list(assumed),
        )
        for velocity, acceleration, jerk, effort, assumed in columns
    ]
