"""Answers about the ways out of a singularity."""

from __future__ import annotations

import math
from typing import Annotated

from app.shared.answers.answer import Answer, From
from app.shared.answers.details import ContactAnswer, SingularityAnswer, Violation
from app.shared.answers.fk import Matrix
from kin.escape.results import Code


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


class ExitCauseAnswer(Answer):
    """Why there is no way out."""

    code: Code
    """"clear": the arm is beyond the margin already. "start outside", "start touches": it is outside its limits,
    or touches something. "margin": no configuration inside the limits that was found is beyond the margin.
    "blocked": on each way out something touches."""
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
