"""The facts behind a refused motion, and what is worth knowing of a planned one, as codes and numbers.

`kin.motion.messages` makes the sentences from them. Lengths are in metres, angles in radians.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from kin.collision import Contact
from kin.ik.details import Details, JointKind, LimitViolation
from kin.motion.arrivals import Arrival
from kin.path.details import JointMove
from kin.solvers.singular import Singularity

Cause = Literal[
    "start", "target", "unreachable", "limits", "singularity", "branch", "circle", "task", "collision", "stop"
]
HelpCode = Literal["ptp", "posture", "via", "start", "closer", "task", "shift", "tilt"]


class StartOutside(NamedTuple):
    """Cause ``start``: the arm is outside its limits before it moves."""

    violations: tuple[LimitViolation, ...]


class CannotStop(NamedTuple):
    """Cause ``stop``: the arm moves at the start, and a joint cannot stop before its limit.

    Attributes:
        violation: which joint and limit, and the value that it would need, braking as fast as it may.
        time: seconds from the start until it reaches the limit.
        speed: of the joint at the start.
    """

    violation: LimitViolation
    time: float
    speed: float


class TargetOutside(NamedTuple):
    """Cause ``target``: the configuration asked for is outside the limits."""

    violations: tuple[LimitViolation, ...]


class NotReached(NamedTuple):
    """Cause ``unreachable``: no configuration meets a pose, as in the `kin.IKResult` of it.

    Of a segment that can be driven for a part, the pose of the rest that is missed most.
    """

    details: Details
    cause: str
    task: str
    singularities: tuple[Singularity, ...]


class LimitMet(NamedTuple):
    """Cause ``limits``: the posture being followed would take a joint past its limit."""

    violation: LimitViolation


class SingularityMet(NamedTuple):
    """Cause ``singularity``: the path leads through a singularity, where a joint would have to jump.

    Attributes:
        singularity: which one; None if no condition is known.
        move: the joint that moves most there, and how far.
    """

    singularity: Singularity | None
    move: JointMove | None


class BranchNeeded(NamedTuple):
    """Cause ``branch``: the posture at the start does not lead to the end.

    Attributes:
        start: the posture being followed; None if the arm's postures have no names.
    """

    start: str | None


class NoCircle(NamedTuple):
    """Cause ``circle``: start, via point and target do not define an arc.

    Attributes:
        coincident: which two points are the same; None: via lies on the line but not between the others.
    """

    coincident: tuple[str, str] | None


class NotKept(NamedTuple):
    """Cause ``task``: the arm's joints cannot keep the path.

    Attributes:
        joints: how many the arm has.
        position, rotation: by how much the path is missed.
    """

    joints: int
    position: float
    rotation: float


class Collides(NamedTuple):
    """Cause ``collision``: the arm would touch itself or an obstacle that is to be avoided.

    Attributes:
        time: seconds from the start of the motion to the first contact.
        contact: what touches.
    """

    time: float
    contact: Contact


RefusalDetails = (
    StartOutside
    | CannotStop
    | TargetOutside
    | NotReached
    | LimitMet
    | SingularityMet
    | BranchNeeded
    | NoCircle
    | NotKept
    | Collides
)


class Help(NamedTuple):
    """What would help.

    Attributes:
        code: ``"ptp"``: a PTP to the same target; ``"posture"``: another posture at the start; ``"via"``: a detour
            by another point; ``"start"``: a start inside the limits; ``"closer"``: a target closer to the arm;
            ``"task"``: keeping less than the whole pose; ``"shift"``: the same path beside this one; ``"tilt"``:
            the same path with the tool turned.
        posture: name of the posture, for ``"posture"`` and ``"ptp"``; None if it has none.
        vector: for ``"shift"`` in metres along the axes of the world; for ``"tilt"`` a rotation vector in radians
            about the tool's own axes, the same all along the path.
    """

    code: HelpCode
    posture: str | None = None
    vector: tuple[float, float, float] | None = None


class BlendShortened(NamedTuple):
    """The zone at the end of a segment is smaller than asked for: half of the shorter segment is the most."""

    segment: int
    asked: float
    used: float


class BlendLeftOut(NamedTuple):
    """The arm stops at the end of a segment although a zone was asked for.

    Attributes:
        segment: which.
        why: ``"last"``: nothing follows; ``"short"``: it or the next one has no length; ``"small"``: the zone is
            too small for it or the next one; ``"dwell"``: a pause follows; ``"slower"``: with the blend the motion
            would take longer.
        passing, stopping: for ``"slower"``: seconds from the middle of the segment to the middle of the next one,
            with the blend and with the stop; else None.
    """

    segment: int
    why: Literal["last", "short", "small", "dwell", "slower"]
    passing: float | None = None
    stopping: float | None = None


class Slowed(NamedTuple):
    """A path that is slow at one place, because a joint is at its limit of velocity or acceleration there.

    Attributes:
        segment, fraction: where: the segment, and the part of it that is covered, 0 to 1.
        joint, name: which joint limits the speed.
        quantity: which of its limits.
        ratio: the speed that the limits of velocity allow there, as a part of the median on this path.
        singularity: the one that is nearest there; None if none is near.
        helps: what leads past it.
    """

    segment: int
    fraction: float
    joint: int
    name: str
    quantity: Literal["velocity", "acceleration", "jerk"]
    ratio: float
    singularity: Singularity | None
    helps: tuple[Help, ...] = ()


class Braked(NamedTuple):
    """The arm moves at the start, and brakes for so many seconds; the first segment begins after that."""

    seconds: float


class JerkCost(NamedTuple):
    """What the limits of jerk cost on a path: its seconds with them and without."""

    first: int
    last: int
    duration: float
    without: float


class ArrivesOtherwise(NamedTuple):
    """A segment meets the pose of its target, but not in the joint values it was recorded with.

    Attributes:
        segment: which.
        posture, recorded: names of the postures; None if they have none.
        move: the joint that differs most, and by how much.
    """

    segment: int
    posture: str | None
    recorded: str | None
    move: JointMove

    @classmethod
    def of(cls, segment: int, arrival: Arrival) -> ArrivesOtherwise:
        """The note on an arrival that differs from what was recorded."""
        assert arrival.difference is not None
        sizes = np.abs(arrival.difference)
        joint = int(np.argmax(np.round(sizes, 6)))  # the first one of several that differ by the same
        row = arrival.robot.joints[joint]
        kind: JointKind = "prismatic" if row.kind == "prismatic" else "revolute"
        move = JointMove(joint, row.name, kind, float(sizes[joint]))
        return cls(segment, arrival.posture, arrival.recorded_posture, move)


Note = ArrivesOtherwise | BlendShortened | BlendLeftOut | Slowed | JerkCost | Braked
