"""Answers about ways around obstacles, and ways out of singularities."""

from __future__ import annotations

import math
from typing import Annotated, Any

from msgspec import UNSET, UnsetType

from app.shared.answers.answer import Answer, From
from app.shared.answers.details import ContactAnswer, SingularityAnswer, Violation
from app.shared.answers.fk import Matrix
from app.shared.answers.motion import MotionAnswer, motion_answer
from kin.escape import Exits
from kin.escape.results import Code as ExitCode
from kin.motion import Motion, program_to_dict
from kin.motors import to_pendant
from kin.way import Way
from kin.way.results import Code


class WayCauseAnswer(Answer):
    """Why there is no way, or none was found."""

    code: Code
    """"time": none was found in time, which does not mean that there is none. Otherwise start or goal are outside
    the limits, touch something, or the pose cannot be reached without touching anything."""
    violations: list[Violation]
    """The joint values outside the limits."""
    contact: ContactAnswer | None
    """What touches."""


class WayAnswer(Answer):
    """Waypoints between which the arm touches nothing, or why there are none."""

    found: bool
    """Whether there are."""
    q: Annotated[Matrix | None, From(lambda way: None if way.q is None else way.q.tolist())]
    """Waypoints from start to goal, in radians (metres); the joints move on straight lines between them."""
    length: float
    """Sum of the lengths of its parts in joint space: radians, a slide counting as a share of the arm's reach."""
    seconds: float
    """How long the search took, shortening included."""
    seed: int
    """Of the search: the same seed finds the same way, if it is found in time."""
    cause: WayCauseAnswer | None
    """Why there is none; null if one was found."""
    program: dict[str, Any] | None
    """A program of PTP segments with zones through the waypoints, as `motion` takes it, from `q_start`."""
    motion: MotionAnswer | None
    """Its motion, checked against the same obstacles, without samples."""
    reason: str
    """All of it in a sentence for people."""


def way_answer(way: Way, motion: Motion | None) -> WayAnswer:
    """A way, and the motion of its program."""
    return WayAnswer.of(
        way,
        program=None if motion is None else program_to_dict(motion.program),
        motion=None if motion is None else motion_answer(motion),
    )


class ExitAnswer(Answer):
    """A motion of the joints out of a singularity."""

    q: Matrix
    """Waypoints from where the arm is, in radians (metres); the joints move on straight lines between them."""
    sigma: float
    """σ at the end, at least the margin."""
    keeps_tool: bool
    """Whether the tool stays where it is."""
    translation: float
    """By how much the tool point is off on the way, at most, in metres."""
    rotation: float
    """By how much the orientation is off on the way, at most, in radians; of five joints that of the approach
    direction, of fewer 0."""
    deviation: float
    """Both in one: the largest root of the sum of squares, the translation as a share of the arm's size."""
    posture: str | None
    """Name of the branch at the end; null if the arm's branches have no names."""
    length: float
    """Of the motion in joint space: radians, a slide counting as a share of the arm's reach."""
    pendant: Matrix | UnsetType = UNSET
    """With `pendant` in the request: the waypoints as the arm's pendant shows them."""


class ExitCauseAnswer(Answer):
    """Why there is no way out."""

    code: ExitCode
    """"clear": the arm is beyond the margin already. "start outside", "start touches": it is outside its limits,
    or touches something. "margin": no configuration inside the limits that was found is beyond the margin.
    "blocked": none of the ways out that were found is proven free of contacts."""
    violations: list[Violation]
    """The joint values outside the limits."""
    contact: ContactAnswer | None
    """What touches."""
    largest: Annotated[float | None, From(lambda cause: None if math.isnan(cause.largest) else cause.largest)]
    """The largest σ that was found, for "margin"."""


class ExitsAnswer(Answer):
    """How near a configuration is to a singularity, and the motions that lead away from it."""

    found: bool
    """Whether there is a way out."""
    sigma: float
    """The smallest singular value of the task's Jacobian that is not zero everywhere, with lengths of the tool as
    shares of the arm's size, and slides as shares of its reach."""
    margin: float
    """What it has to be at the end, at least."""
    singularities: list[SingularityAnswer]
    """Those that the arm is at, or else the nearest one."""
    exits: list[ExitAnswer]
    """One for each posture: first those that keep the tool, then those with the least deviation of the tool."""
    cause: ExitCauseAnswer | None
    """Why there is none; null if there is one."""
    reason: str
    """All of it in sentences for people."""


def exits_answer(found: Exits, pendant: bool) -> ExitsAnswer:
    """The ways out of a singularity; `pendant`: also as the arm's pendant shows their waypoints."""
    answer = ExitsAnswer.of(found)
    if pendant:
        for said, each in zip(answer.exits, found.exits, strict=True):
            said.pendant = to_pendant(found.robot, each.q).tolist()
    return answer
