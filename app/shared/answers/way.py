"""Answers about ways around obstacles."""

from __future__ import annotations

from typing import Annotated, Any

from app.shared.answers.answer import Answer, From
from app.shared.answers.details import ContactAnswer, Violation
from app.shared.answers.fk import Matrix
from app.shared.answers.motion import MotionAnswer, motion_answer
from kin.motion import Motion, program_to_dict
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
