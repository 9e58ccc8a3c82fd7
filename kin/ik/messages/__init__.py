"""Sentences about IK answers, made from codes and numbers in the reader's units.

This is the only place where answers of :mod:`kin.ik` become words. An `Explanation` has a title and a detail
for a page that sets them apart; its `text` is one line.
"""

from __future__ import annotations

from typing import NamedTuple

from kin.ik.details import (
    Details,
    MaskNotMet,
    NotOnBranch,
    OrientationNotMet,
    OutOfReach,
    OutsideLimits,
    RollError,
    RotationError,
    Solved,
)
from kin.ik.messages.obstacle import clause_of
from kin.ik.messages.singularity import short
from kin.ik.messages.values import count, listed, need, ranges
from kin.solvers.singular import Singularity
from kin.units import Units

_TASKS = {
    "pose": "pose",
    "approach": "point and approach direction",
    "position": "point",
    "mask": "set of coordinates",
}
_SIDES = {
    "too far": "the point is too far away",
    "too near": "the point is too close to the shoulder",
    "around the axis": "the point is in the hole around the first axis",
    "outside": "the point is outside the workspace that the joint limits leave",
}


class Explanation(NamedTuple):
    """An answer in words.

    Attributes:
        title: the outcome for a narrow place: short, with rounded numbers, without a full stop.
        headline: the outcome, without a full stop.
        body: why, without a full stop, beginning in lower case; empty if the headline says it all.
        note: a further sentence, or empty.
    """

    title: str
    headline: str
    body: str = ""
    note: str = ""

    @property
    def text(self) -> str:
        """Everything in one line, e.g. ``"Out of reach by 12.0 mm: the point is too far away."``."""
        body = f": {self.body}" if self.body else ""
        return f"{self.headline}{body}.{self.note and ' '}{self.note}"

    @property
    def detail(self) -> str:
        """Everything but the headline, as sentences."""
        body = f"{self.body[0].upper()}{self.body[1:]}." if self.body else ""
        return " ".join(filter(None, (body, self.note)))


def explain(
    details: Details,
    cause: str,
    task: str,
    singularities: tuple[Singularity, ...],
    units: Units,
) -> Explanation:
    """The facts of an answer in words.

    Args:
        details, cause: what is known of the answer.
        task: ``"pose"``, ``"approach"``, ``"position"`` or ``"mask"``.
        singularities: those of the solution, or of the closest configuration where there is no solution.
        units: of all numbers.
    """
    headline, body = _outcome(details, cause, task, units)
    solved = isinstance(details, Solved | RollError | RotationError)
    note = _singular(singularities, "This" if solved else "The closest", units)
    return Explanation(_title(details, headline, units), headline, body, note)


def _title(details: Details, headline: str, units: Units) -> str:
    """The headline, or a shorter one with rounded numbers."""
    match details:
        case RollError(_, error):
            return f"Reached with roll error {units.angle(error)}"
        case RotationError(_, error):
            return f"Point reached, orientation off by {units.angle(error)}"
        case OutsideLimits(_, violations):
            numbers = ", ".join(str(v.joint + 1) for v in violations)
            return f"{headline}: joint{'s' if len(violations) > 1 else ''} {numbers}"
        case OrientationNotMet():
            return "Orientation not possible here"
        case OutOfReach(distance) if distance > 0.0:
            return f"Out of reach by {units.distance(distance)}"
    return headline


def _outcome(details: Details, cause: str, task: str, units: Units) -> tuple[str, str]:
    """Headline and body."""
    angle, length = units.angles.value, units.lengths.value
    match details:
        case Solved():
            return "Reached", _solved(details, task)
        case RollError(joints, error):
            kept = f"{joints} joints keep the point and the approach direction, not the roll about it"
            return f"Reached with roll error {angle(error)}", kept
        case RotationError(joints, error, violation):
            why = f"{joints} joints cannot hold this orientation at this point"
            if violation is not None:
                why = f"the approach direction would need {need(violation, units)}"
            return f"Point reached, orientation off by {angle(error)}", why
        case OutsideLimits():
            return "Outside the limits", _outside(details, units)
        case NotOnBranch(elsewhere, outside):
            why = f"{count(outside, 'other branch exists', 'other branches exist')}, outside the joint limits"
            if elsewhere:
                reach = count(elsewhere, "configuration reaches", "configurations reach")
                why = f"{reach} this target on other branches"
            return "No solution on the chosen branch", why
        case MaskNotMet(position, rotation):
            headline = "These coordinates cannot be met together"
            if position is None or rotation is None:
                return f"{headline} on the chosen branch", ""
            return headline, f"the closest configuration is off by {length(position)} and {angle(rotation)}"
        case OutOfReach(distance):
            by = f" by {length(distance)}" if distance > 0.0 else ""
            return f"Out of reach{by}", _SIDES[cause]
        case OrientationNotMet():
            return "The arm cannot hold this orientation at this point", _orientation(details, units)


def _solved(details: Solved, task: str) -> str:
    """How many configurations there are, and whether these are all."""
    text = count(details.configurations, "configuration", "configurations")
    if not details.complete:
        text += " found"
    if details.chosen_branches is not None:
        text += " on the chosen branch" + "es" * (details.chosen_branches != 1)
    if details.redundant:
        text += f", {'each ' if details.configurations > 1 else ''}with a redundancy parameter,"
    return f"{text} for this {_TASKS[task]}" + ("" if details.complete else "; others may exist")


def _outside(details: OutsideLimits, units: Units) -> str:
    """Which joints would be where, on the posture that is closest to the limits."""
    which = "the posture closest to the limits" if details.branches > 1 else "the posture"
    given = ", ".join(f"{r.label} = {units.angles.value(r.value)}" for r in details.requested)
    needs = listed([need(violation, units) for violation in details.violations])
    name = f" ({details.branch})" if details.branch != "numeric" else ""
    text = f"{f'with {given} ' if given else ''}{which}{name} needs {needs}"
    if details.branches > 1:
        others = count(details.branches - 1, "other posture is", "other postures are")
        text += f". {others[0].upper()}{others[1:]} outside the limits too"
    possible = [r for r in details.requested if r.intervals]
    for r in possible:
        text += f". Possible {r.label}: {ranges(r.intervals, units)}"
    if details.elsewhere:
        others = count(details.elsewhere, "configuration is", "configurations are")
        text += f". {others[0].upper()}{others[1:]} inside the limits on branches that were not chosen"
    return text


def _orientation(details: OrientationNotMet, units: Units) -> str:
    """What does not fit, the nearest orientation, and the closest configuration."""
    angle, length = units.angles.value, units.lengths.value
    parts = []
    if details.obstacle is not None and details.gap is not None:
        parts.append(f"{clause_of(details.obstacle, units)}, by {length(details.gap)}")
    if details.nearest_rotation is not None:
        parts.append(f"the nearest orientation found is {angle(details.nearest_rotation)} away")
    if details.position_error is not None and details.rotation_error is not None:
        off = f"{length(details.position_error)} and {angle(details.rotation_error)}"
        parts.append(f"the closest pose found is off by {off}")
    return "; ".join(parts)


def _singular(found: tuple[Singularity, ...], which: str, units: Units) -> str:
    """A sentence about a singular configuration; singularities of the closed form alone do not count."""
    real = [s for s in found if s.kind != "algorithmic"]
    return f"{which} configuration is singular: {short(real[0], units)}." if real else ""
