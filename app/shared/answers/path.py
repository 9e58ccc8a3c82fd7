"""Answers about joint paths through a list of targets."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import UNSET, UnsetType

from app.shared.answers.answer import Answer, From
from app.shared.answers.details import ContactAnswer, IkDetails, JumpDetailsAnswer, jump_details_answer
from app.shared.answers.fk import Matrix
from app.shared.answers.ik import Tolerances, tolerances_answer
from kin.ik.results import Cause
from kin.path import PathPostures, PathResult
from kin.path.postures import STATES, State

GapStatus = Literal["approximate", "limits", "orientation", "unreachable", "collision"]


class JumpAnswer(Answer):
    """A step of the path that is not continuous."""

    index: int
    """The jump is between waypoint index − 1 and waypoint index, counted from 0."""
    joints: list[int]
    """The joints that jump, as indices into q."""
    step: float
    """The largest of their motions, in radians (of a sliding joint as a share of the arm's reach)."""
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


class StretchAnswer(Answer):
    """Neighbouring waypoints of one posture with the same state."""

    posture: int
    """Which of `postures`."""
    first: int
    """Its first waypoint, counted from 0."""
    last: int
    """Its last waypoint."""
    state: State
    """"free", "near limit", "near singularity": can be driven. "outside" the limits, "touches": in the way.
    "none": the pose cannot be met in this posture."""
    joined: bool
    """Whether the arm can go on in this posture from the last waypoint to the next one."""
    reason: str
    """What is near or in the way in the middle of the stretch; empty if free."""


class PosturesAnswer(Answer):
    """The postures of the arm along a path: a table of waypoints and postures."""

    postures: list[str]
    """Their names; numbers where the arm's postures have none."""
    through: list[int]
    """From which postures at the first waypoint the arm gets through the whole path without a jump."""
    states: list[list[State]]
    """By waypoint and posture: the state, as in `stretches`."""
    reach: Annotated[list[list[int]], From(lambda found: found.reach.tolist())]
    """By waypoint and posture: the last waypoint to which the arm can go on without a jump; −1 where there is no
    configuration that can be driven."""
    q: list[list[list[float | None]]]
    """By waypoint and posture: a configuration, of those that can be driven the one that leads farthest; nulls
    where there is none."""
    stretches: list[StretchAnswer]
    """The same table, posture by posture, in stretches."""
    rows: Annotated[list[int], From(lambda found: found.rows.tolist())]
    """The posture of `best` at each waypoint; −1 in a gap."""
    best: PathAnswer
    """The path that `ik/path` gives."""
    reason: str
    """From which postures the arm gets through, in a sentence for people."""


def postures_answer(found: PathPostures) -> PosturesAnswer:
    """One result of `kin.path.path_postures`."""
    return PosturesAnswer.of(
        found,
        through=list(found.through),
        states=[[STATES[state] for state in row] for row in found.states.tolist()],
        best=path_answer(found.best),
    )
