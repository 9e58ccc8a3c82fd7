"""Answers about joint paths through a list of targets."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import UNSET, UnsetType

from app.shared.answers.answer import Answer, From
from app.shared.answers.details import ContactAnswer, IkDetails, JumpDetailsAnswer, jump_details_answer
from app.shared.answers.fk import Matrix
from app.shared.answers.ik import Tolerances, tolerances_answer
from kin import PathResult
from kin.ik.results import Cause

GapStatus = Literal["approximate", "limits", "orientation", "unreachable", "collision"]


class JumpAnswer(Answer):
    """A step of the path that is not continuous."""

    index: int
    """The jump is between waypoint index − 1 and waypoint index, counted from 0."""
    joints: list[int]
    """The joints that jump, as indices into q."""
    step: float
    """The largest of their motions, in radians (4 per metre for a sliding joint)."""
    cause: Literal["limits", "singularity", "branch", "spacing"]
    """"limits": the motion would go on, but outside the joint limits. "singularity": at or near one, joints must
    turn fast. "branch": the branch being followed ends. "spacing": the waypoints are too far apart for
    `max_step`."""
    details: JumpDetailsAnswer
    """The numbers behind `cause`."""
    reason: str
    """The same in a sentence for people."""


class GapAnswer(Answer):
    """A waypoint without an exact answer."""

    index: int
    """Which waypoint, counted from 0."""
    status: Annotated[GapStatus, From("status.value")]
    """The kind of answer that `ik` gives there."""
    cause: Cause
    """Its cause, as in the answers of `ik`."""
    details: IkDetails
    """The numbers behind `cause`, as in the answers of `ik`."""
    reason: str
    """Its sentence for people."""
    distance: float
    """How far out of reach it is, in metres; 0 within reach."""


class TouchAnswer(Answer):
    """Where a path still touches something."""

    index: Annotated[int, From("waypoint")]
    """It is on the way from waypoint index − 1 to waypoint index, counted from 0."""
    share: float
    """The share of this way at which the first touch was found, 0 to 1; 1 at the waypoint itself."""
    contact: ContactAnswer
    """The deepest contact on this way."""


class PathAnswer(Answer):
    """A joint path through a list of targets."""

    q: Matrix
    """One configuration per waypoint, in radians (metres for sliding joints), inside the limits."""
    continuous: bool
    """Whether there is no jump."""
    jumps: list[JumpAnswer]
    """Every jump that is left, in order."""
    gaps: list[GapAnswer]
    """Every waypoint without an exact answer, in order; q holds the closest configuration there."""
    position_error: list[float]
    """Distance of the tool point from each waypoint, in metres, measured by forward kinematics."""
    rotation_error: list[float]
    """Rotation left to each waypoint, in radians, as in the solutions of `ik`."""
    solver: str
    """Name of the method that answered."""
    reason: str
    """The whole in a sentence for people."""
    contacts: list[TouchAnswer] | UnsetType = UNSET
    """If collisions are avoided: where the path still touches something, at gaps or between waypoints."""
    tolerances: Tolerances | UnsetType = UNSET
    """The errors that count as none, if they are not 1e-9; the largest ones of all waypoints."""


def path_answer(result: PathResult) -> PathAnswer:
    """One result of `kin.solve_path`."""
    return PathAnswer.of(
        result,
        jumps=[JumpAnswer.of(jump, details=jump_details_answer(jump)) for jump in result.jumps],
        contacts=[TouchAnswer.of(touch) for touch in result.contacts] if result.avoids else UNSET,
        tolerances=tolerances_answer(result),
    )
