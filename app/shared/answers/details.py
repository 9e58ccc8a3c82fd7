"""The numbers behind an answer, one set of fields for each cause."""

from __future__ import annotations

from typing import Any, Literal, cast

from typing_extensions import TypedDict

from app.shared.answers.document import documented
from kin import Contact, LimitViolation, Redundancy, Singularity
from kin.ik.details import (
    Details,
    MaskNotMet,
    NotOnBranch,
    OrientationNotMet,
    OutOfReach,
    OutsideLimits,
    Restriction,
    RotationError,
    Solved,
    Touching,
)
from kin.ik.messages import singularity
from kin.path import PathJump
from kin.path.details import BranchEnds, LimitInTheWay, NearSingularity, TooFarApart
from kin.solvers.contract import ObstacleCode
from kin.solvers.singular import Condition, Lost


@documented
class RedundancyAnswer(TypedDict):
    """A redundancy parameter of the task."""

    name: str
    """Short name, such as "psi" or "theta1"; the one to use in a request's `redundancy`."""
    label: str
    """Name for people."""
    value: float
    """The value used, in radians."""
    intervals: list[list[float]]
    """Every [lower, upper] range of values, in radians, for which the target can be reached inside the limits.
    With several parameters, the ranges of each hold for the present values of the others. Exact, not sampled."""


@documented
class Violation(TypedDict):
    """A joint value outside the joint's limits."""

    joint: int
    """Index into q, from 0."""
    name: str
    """Name of the joint."""
    value: float
    """The value that is outside, in radians (metres)."""
    limit: float
    """The limit it exceeds, in radians (metres)."""
    unit: Literal["rad", "m"]
    """Unit of both."""
    locked: bool
    """Whether the limit is the value at which the request locks the joint."""


@documented
class JointValueAnswer(TypedDict):
    """A value of one joint."""

    joint: int
    """Index into q, from 0."""
    value: float
    """In radians (metres)."""


@documented
class SingularityAnswer(TypedDict):
    """A way in which a configuration is singular."""

    kind: Literal["elbow", "shoulder", "wrist", "algorithmic", "jacobian"]
    """Which part of the arm loses a motion; "algorithmic": only the closed form loses a parameter, the arm
    loses nothing; "jacobian": judged by the smallest singular value, for arms without a closed form."""
    condition: Condition
    """What aligns there."""
    lost: Lost
    """What the arm (for "algorithmic": the closed form) loses there."""
    joints: list[JointValueAnswer]
    """The joints that decide, with the values at which the condition is met; empty where no single joint
    decides."""
    meaning: str
    """Condition, joint values and loss as one clause."""
    distance: float
    """How far away it is, in `unit`."""
    unit: str
    """"rad", "m", or "SI" for a singular value."""


@documented
class ObstacleAnswer(TypedDict):
    """Why the geometry of the arm does not close at a target."""

    code: ObstacleCode
    """What does not fit."""
    bound: float | None
    """The length that decides, in metres; null if no single length does."""


@documented
class RestrictionAnswer(TypedDict):
    """Locks and narrowed limits that are what prevents an answer."""

    locked: list[int]
    """The locked joints, as indices into q."""
    narrowed: list[int]
    """The joints whose limits are narrowed, as indices into q."""
    distance: float
    """Metres by which the point is out of reach without them; 0 if it can be reached."""


@documented
class ContactAnswer(TypedDict):
    """Two bodies that touch, or the two that are nearest to each other."""

    distance: float
    """Metres between them; negative where they overlap. How far a link is inside a box or cylinder counts up to
    the axis of its capsule."""
    link: int
    """The link that joint `link` moves, from 1."""
    other_link: int | None
    """The other link, 0 for the base; null for an obstacle."""
    obstacle: int | None
    """Index into `obstacles`; null for a link."""
    text: str
    """Both in words."""


@documented
class CurveAnswer(TypedDict):
    """A curve of configurations that meet the target."""

    q: list[float]
    """The solution that stands for it, in radians (metres)."""
    direction: list[float]
    """Unit vector of joint motion along the curve there."""


@documented
class IkDetails(TypedDict, total=False):
    """The numbers behind `cause`; which fields there are depends on it. Metres and radians."""

    configurations: int
    """Cause "" (solved): how many configurations were found; `max_solutions` may return fewer."""
    redundant: bool
    """Cause "" (solved): whether the task leaves a redundancy parameter."""
    chosen_branches: int | None
    """Cause "" (solved): how many postures, branches of one name, were requested; null for all."""
    complete: bool
    """Cause "" (solved): whether these are all configurations, as in the answer's own `complete`."""
    infinite: bool
    """Cause "" (solved): whether there are infinitely many configurations, since the task leaves the joints a
    motion or the target is met on a curve."""
    curves: list[CurveAnswer]
    """Cause "" (solved): the curves of configurations at a singular target, such as joints 4 and 6 in line, one of
    the solutions for each; absent if there are none."""
    postures: int
    """Cause "" (solved): on how many branches the configurations are."""
    free: list[str]
    """Cause "" (solved): labels of the redundancy parameters that may have other values."""
    fixed: list[str]
    """Cause "" (solved): labels of the redundancy parameters whose values were requested."""
    restriction: RestrictionAnswer | None
    """Causes "too far", "too near", "around the axis", "outside" and "orientation": the locks and narrowed limits
    without which the arm could do better; null if there are none."""
    joints: int
    """Causes "roll" and "rotation": number of joints of the arm."""
    position_error: float | None
    """Cause "orientation", and "outside" for a mask: position error of `closest`; null if there is none."""
    rotation_error: float | None
    """Causes "roll" and "rotation": rotation that is left. Cause "orientation", and "outside" for a mask: that of
    `closest`; null if there is none."""
    violation: Violation | None
    """Cause "rotation": the limit that keeps the arm from the approach direction; null if no limit does."""
    branch: str
    """Cause "joint limits": the posture that is closest to the limits. Causes "self-collision" and "obstacle": the
    one with the fewest contacts."""
    violations: list[Violation]
    """Cause "joint limits": its joint values outside the limits."""
    branches: int
    """Cause "joint limits": how many postures are outside the limits."""
    requested: list[RedundancyAnswer]
    """Cause "joint limits": the requested redundancy parameters, with the values that satisfy the limits."""
    elsewhere: int
    """Causes "joint limits" and "branch": how many solutions there are on branches that were not requested."""
    contact: ContactAnswer
    """Causes "self-collision" and "obstacle": the deepest contact in the posture `branch`."""
    contacts: int
    """Causes "self-collision" and "obstacle": how many pairs of links, and of links and obstacles, touch there."""
    searched: list[str]
    """Causes "self-collision" and "obstacle": labels of the redundancy parameters that were searched."""
    touching: int
    """Cause "" (solved): how many configurations were left out because something touches; absent if none were."""
    outside_limits: int
    """Cause "branch": how many other branches exist, but outside the limits."""
    locked: list[int]
    """Cause "branch": indices of the locked joints; absent if there are none."""
    distance: float
    """Causes "too far", "too near", "around the axis" and "outside": metres by which the point is out of reach."""
    obstacle: ObstacleAnswer | None
    """Cause "orientation": what does not fit geometrically; null if nothing is known."""
    gap: float | None
    """Cause "orientation": metres by which it does not fit."""
    nearest_rotation: float | None
    """Cause "orientation": rotation from the target to the nearest orientation found at this point."""


@documented
class JumpDetailsAnswer(TypedDict, total=False):
    """The numbers behind a jump; which fields there are depends on its cause. Metres and radians."""

    between: list[int]
    """The two neighbouring waypoints between which the continuous motion ends."""
    backwards: bool
    """Whether the motion was followed from the end of the path to its start."""
    joint: int
    """The joint that jumps farthest, as an index into q."""
    motion: float
    """How far it moves, in radians (metres)."""
    violation: Violation
    """Cause "limits": the joint limit in the way."""
    met: bool
    """Cause "singularity": whether the motion meets it; otherwise it passes close to it."""
    singularity: SingularityAnswer | None
    """Causes "singularity" and "branch": the nearest singularity; null if none is near."""
    branch: str | None
    """Cause "branch": the branch that ends; null if the arm's branches have no names."""
    max_step: float
    """Cause "spacing": the largest step allowed, as a motion of `step_joint` in radians (metres)."""
    step_joint: int
    """Cause "spacing": the joint that would move most, as an index into q."""
    distance: float
    """Cause "spacing": distance between the tool points of the two waypoints."""
    rotation: float
    """Cause "spacing": rotation between their orientations; 0 if the task does not count it."""


def details_answer(details: Details) -> IkDetails:
    """The details of a `kin.IKResult`: fields of numbers as they are, the others as answers of their own."""
    fields: dict[str, Any] = details._asdict()
    match details:
        case OutsideLimits():
            fields["violations"] = [violation_answer(v) for v in details.violations]
            fields["requested"] = [redundancy_answer(r) for r in details.requested]
        case RotationError():
            fields["violation"] = None if details.violation is None else violation_answer(details.violation)
        case Solved():
            fields["free"], fields["fixed"] = list(details.free), list(details.fixed)
            if not details.touching:
                del fields["touching"]
            fields["curves"] = [curve._asdict() for curve in details.curves]
            if not details.curves:
                del fields["curves"]
        case NotOnBranch():
            fields["locked"] = list(details.locked)
            if not details.locked:
                del fields["locked"]
        case Touching():
            fields["contact"], fields["searched"] = contact_answer(details.contact), list(details.searched)
        case OrientationNotMet():
            found = details.obstacle
            if found is not None:
                bound = found.bound if found.bound == found.bound else None  # NaN: no single length decides
                fields["obstacle"] = {"code": found.code, "bound": bound}
    if isinstance(details, OutOfReach | MaskNotMet | OrientationNotMet):
        fields["restriction"] = None if details.restriction is None else _restriction_answer(details.restriction)
    return cast(IkDetails, fields)


def _restriction_answer(found: Restriction) -> RestrictionAnswer:
    """Locks and narrowed limits that are what prevents an answer."""
    return {"locked": list(found.locked), "narrowed": list(found.narrowed), "distance": found.distance}


def jump_details_answer(jump: PathJump) -> JumpDetailsAnswer:
    """The details of a jump."""
    answer: JumpDetailsAnswer = {
        "between": [jump.place.before, jump.place.after],
        "backwards": jump.place.backwards,
        "joint": jump.widest.joint,
        "motion": jump.widest.motion,
    }
    match jump.details:
        case LimitInTheWay(violation):
            answer["violation"] = violation_answer(violation)
        case NearSingularity(met, singular):
            answer["met"] = met
            answer["singularity"] = None if singular is None else singularity_answer(singular)
        case BranchEnds(branch, singular):
            answer["branch"] = branch
            answer["singularity"] = None if singular is None else singularity_answer(singular)
        case TooFarApart(max_step, distance, rotation):
            answer["max_step"], answer["step_joint"] = max_step.motion, max_step.joint
            answer["distance"], answer["rotation"] = distance, rotation
    return answer


def contact_answer(contact: Contact) -> ContactAnswer:
    """What touches."""
    return {
        "distance": contact.distance,
        "link": contact.link,
        "other_link": contact.other,
        "obstacle": contact.obstacle,
        "text": contact.text,
    }


def violation_answer(violation: LimitViolation) -> Violation:
    """A joint value outside the limits."""
    return {
        "joint": violation.joint,
        "name": violation.name,
        "value": violation.value,
        "limit": violation.limit,
        "unit": "m" if violation.kind == "prismatic" else "rad",
        "locked": violation.locked,
    }


def redundancy_answer(redundancy: Redundancy) -> RedundancyAnswer:
    """A redundancy parameter with its value and ranges."""
    intervals = [list(interval) for interval in redundancy.intervals]
    return {
        "name": redundancy.name,
        "label": redundancy.label,
        "value": redundancy.value,
        "intervals": intervals,
    }


def singularity_answer(found: Singularity) -> SingularityAnswer:
    """A singularity with its codes, numbers and meaning."""
    return {
        "kind": found.kind,
        "condition": found.condition,
        "lost": found.lost,
        "joints": [{"joint": at.joint, "value": at.value} for at in found.met_at],
        "meaning": singularity.long(found),
        "distance": found.distance,
        "unit": found.unit,
    }
