"""The numbers behind an answer, one set of fields for each cause."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from msgspec import UNSET, UnsetType

from app.shared.answers.answer import Answer, From
from kin.ik.messages import singularity
from kin.path import PathJump
from kin.solvers.contract import ObstacleCode
from kin.solvers.singular import Condition, Lost


class RedundancyAnswer(Answer):
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


class Violation(Answer):
    """A joint value outside the joint's limits."""

    joint: int
    """Index into q, from 0."""
    name: str
    """Name of the joint."""
    value: float
    """The value that is outside, in radians (metres)."""
    limit: float
    """The limit it exceeds, in radians (metres)."""
    unit: Annotated[Literal["rad", "m"], From(lambda found: "m" if found.kind == "prismatic" else "rad")]
    """Unit of both."""
    locked: bool
    """Whether the limit is the value at which the request locks the joint."""


class JointValueAnswer(Answer):
    """A value of one joint."""

    joint: int
    """Index into q, from 0."""
    value: float
    """In radians (metres)."""


class SingularityAnswer(Answer):
    """A way in which a configuration is singular."""

    kind: Literal["elbow", "shoulder", "wrist", "algorithmic", "jacobian"]
    """Which part of the arm loses a motion; "algorithmic": only the closed form loses a parameter, the arm
    loses nothing; "jacobian": judged by the smallest singular value, for arms without a closed form."""
    condition: Condition
    """What aligns there."""
    lost: Lost
    """What the arm (for "algorithmic": the closed form) loses there."""
    joints: Annotated[list[JointValueAnswer], From("met_at")]
    """The joints that decide, with the values at which the condition is met; empty where no single joint
    decides."""
    meaning: Annotated[str, From(singularity.long)]
    """Condition, joint values and loss as one clause."""
    distance: float
    """How far away it is, in `unit`."""
    unit: str
    """"rad", "m", or "SI" for a singular value."""


class ObstacleAnswer(Answer):
    """Why the geometry of the arm does not close at a target."""

    code: ObstacleCode
    """What does not fit."""
    bound: Annotated[float | None, From(lambda found: None if math.isnan(found.bound) else found.bound)]
    """The length that decides, in metres; null if no single length does."""


class RestrictionAnswer(Answer):
    """Locks and narrowed limits that are what prevents an answer."""

    locked: list[int]
    """The locked joints, as indices into q."""
    narrowed: list[int]
    """The joints whose limits are narrowed, as indices into q."""
    distance: float
    """Metres by which the point is out of reach without them; 0 if it can be reached."""


class ContactAnswer(Answer):
    """Two bodies that touch, or the two that are nearest to each other."""

    distance: float
    """Metres between them; negative where they overlap. How far a link is inside a box or cylinder counts up to
    the axis of its capsule."""
    link: int
    """The link that joint `link` moves, from 1."""
    other_link: Annotated[int | None, From("other")]
    """The other link, 0 for the base; null for an obstacle."""
    obstacle: int | None
    """Index into `obstacles`; null for a link."""
    text: str
    """Both in words."""


class CurveAnswer(Answer):
    """A curve of configurations that meet the target."""

    q: list[float]
    """The solution that stands for it, in radians (metres)."""
    direction: list[float]
    """Unit vector of joint motion along the curve there."""


class IkDetails(Answer):
    """The numbers behind `cause`; which fields there are depends on it. Metres and radians."""

    configurations: int | UnsetType = UNSET
    """Cause "" (solved): how many configurations were found; `max_solutions` may return fewer."""
    redundant: bool | UnsetType = UNSET
    """Cause "" (solved): whether the task leaves a redundancy parameter."""
    chosen_branches: int | UnsetType | None = UNSET
    """Cause "" (solved): how many postures, branches of one name, were requested; null for all."""
    complete: bool | UnsetType = UNSET
    """Cause "" (solved): whether these are all configurations, as in the answer's own `complete`."""
    infinite: bool | UnsetType = UNSET
    """Cause "" (solved): whether there are infinitely many configurations, since the task leaves the joints a
    motion or the target is met on a curve."""
    multiple: Annotated[int | UnsetType, From("multiple", unless_empty=True)] = UNSET
    """Cause "" (solved): how many of the configurations are multiple roots, in which several postures have merged;
    absent if none are."""
    branch: str | UnsetType = UNSET
    """Cause "joint limits": the posture that is closest to the limits. Causes "self-collision" and "obstacle": the
    one with the fewest contacts."""
    violations: list[Violation] | UnsetType = UNSET
    """Cause "joint limits": its joint values outside the limits."""
    branches: int | UnsetType = UNSET
    """Cause "joint limits": how many postures are outside the limits."""
    requested: list[RedundancyAnswer] | UnsetType = UNSET
    """Cause "joint limits": the requested redundancy parameters, with the values that satisfy the limits."""
    elsewhere: int | UnsetType = UNSET
    """Causes "joint limits" and "branch": how many solutions there are on branches that were not requested."""
    outside_limits: int | UnsetType = UNSET
    """Cause "branch": how many other branches exist, but outside the limits."""
    locked: Annotated[list[int] | UnsetType, From("locked", unless_empty=True)] = UNSET
    """Cause "branch": indices of the locked joints; absent if there are none."""
    contact: ContactAnswer | UnsetType = UNSET
    """Causes "self-collision" and "obstacle": the deepest contact in the posture `branch`."""
    postures: int | UnsetType = UNSET
    """Cause "" (solved): on how many branches the configurations are."""
    free: list[str] | UnsetType = UNSET
    """Cause "" (solved): labels of the redundancy parameters that may have other values."""
    fixed: list[str] | UnsetType = UNSET
    """Cause "" (solved): labels of the redundancy parameters whose values were requested."""
    searched: list[str] | UnsetType = UNSET
    """Causes "self-collision" and "obstacle": labels of the redundancy parameters that were searched."""
    contacts: int | UnsetType = UNSET
    """Causes "self-collision" and "obstacle": how many pairs of links, and of links and obstacles, touch there."""
    touching: Annotated[int | UnsetType, From("touching", unless_empty=True)] = UNSET
    """Cause "" (solved): how many configurations were left out because something touches; absent if none were."""
    curves: Annotated[list[CurveAnswer] | UnsetType, From("curves", unless_empty=True)] = UNSET
    """Cause "" (solved): the curves of configurations at a singular target, such as joints 4 and 6 in line, one of
    the solutions for each; absent if there are none."""
    joints: int | UnsetType = UNSET
    """Causes "roll" and "rotation": number of joints of the arm."""
    distance: float | UnsetType = UNSET
    """Causes "too far", "too near", "around the axis" and "outside": metres by which the point is out of reach."""
    obstacle: ObstacleAnswer | UnsetType | None = UNSET
    """Cause "orientation": what does not fit geometrically; null if nothing is known."""
    gap: float | UnsetType | None = UNSET
    """Cause "orientation": metres by which it does not fit."""
    nearest_rotation: float | UnsetType | None = UNSET
    """Cause "orientation": rotation from the target to the nearest orientation found at this point."""
    position_error: float | UnsetType | None = UNSET
    """Cause "orientation", and "outside" for a mask: position error of `closest`; null if there is none."""
    rotation_error: float | UnsetType | None = UNSET
    """Causes "roll" and "rotation": rotation that is left. Cause "orientation", and "outside" for a mask: that of
    `closest`; null if there is none."""
    violation: Violation | UnsetType | None = UNSET
    """Cause "rotation": the limit that keeps the arm from the approach direction; null if no limit does."""
    restriction: RestrictionAnswer | UnsetType | None = UNSET
    """Causes "too far", "too near", "around the axis", "outside" and "orientation": the locks and narrowed limits
    without which the arm could do better; null if there are none."""


class JumpDetailsAnswer(Answer):
    """The numbers behind a jump; which fields there are depends on its cause. Metres and radians."""

    between: list[int] | UnsetType = UNSET
    """The two neighbouring waypoints between which the continuous motion ends."""
    backwards: bool | UnsetType = UNSET
    """Whether the motion was followed from the end of the path to its start."""
    joint: int | UnsetType = UNSET
    """The joint that jumps farthest, as an index into q."""
    motion: float | UnsetType = UNSET
    """How far it moves, in radians (metres)."""
    violation: Violation | UnsetType = UNSET
    """Cause "limits": the joint limit in the way."""
    met: bool | UnsetType = UNSET
    """Cause "singularity": whether the motion meets it; otherwise it passes close to it."""
    branch: str | UnsetType | None = UNSET
    """Cause "branch": the branch that ends; null if the arm's branches have no names."""
    singularity: SingularityAnswer | UnsetType | None = UNSET
    """Causes "singularity" and "branch": the nearest singularity; null if none is near."""
    max_step: Annotated[float | UnsetType, From("max_step.motion")] = UNSET
    """Cause "spacing": the largest step allowed, as a motion of `step_joint` in radians (metres)."""
    step_joint: Annotated[int | UnsetType, From("max_step.joint")] = UNSET
    """Cause "spacing": the joint that would move most, as an index into q."""
    distance: float | UnsetType = UNSET
    """Cause "spacing": distance between the tool points of the two waypoints."""
    rotation: float | UnsetType = UNSET
    """Cause "spacing": rotation between their orientations; 0 if the task does not count it."""


def jump_details_answer(jump: PathJump) -> JumpDetailsAnswer:
    """The details of a jump."""
    place, widest = jump.place, jump.widest
    return JumpDetailsAnswer.of(
        jump.details,
        between=[place.before, place.after],
        backwards=place.backwards,
        joint=widest.joint,
        motion=widest.motion,
    )
