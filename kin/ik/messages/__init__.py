"""Sentences about IK answers, made from codes and numbers in the reader's units.

This is where answers of :mod:`kin.ik` become sentences. An `Explanation` has a title and a detail
for a page that sets them apart; its `text` is one line.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from kin.ik.details import (
    Details,
    MaskNotMet,
    NotOnBranch,
    OrientationNotMet,
    OutOfReach,
    OutsideLimits,
    Restriction,
    RollError,
    RotationError,
    Solved,
    Touching,
)
from kin.ik.messages.obstacle import clause_of
from kin.ik.messages.singularity import short
from kin.ik.messages.values import are, count, listed, need, numbered, ranges
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
    if isinstance(details, Solved) and not singularities:
        return _reached(details, task, units)
    headline, body = _outcome(details, cause, task, units)
    solved = isinstance(details, Solved | RollError | RotationError)
    note = _singular(singularities, "This" if solved else "The closest", units)
    return Explanation(_title(details, headline, units), headline, body, note)


@lru_cache(maxsize=512)
def _reached(details: Solved, task: str, units: Units) -> Explanation:
    """Most answers: there are few different ones."""
    headline, body = _outcome(details, "", task, units)
    return Explanation(_title(details, headline, units), headline, body)


def rounded_target(error: float, tolerances: tuple[float, float], units: Units, path: bool = False) -> str:
    """A sentence about a target whose rotation had to be made one, or about the most rounded target of a path."""
    position, rotation = units.lengths.value(tolerances[0]), units.angles.value(tolerances[1])
    which = "Targets are rounded (by up to" if path else "The target is rounded (by"
    return f"{which} {error:.1g}): met to within {position} and {rotation}."


def _title(details: Details, headline: str, units: Units) -> str:
    """The headline, or a shorter one with rounded numbers."""
    match details:
        case RollError(_, error):
            return f"Reached with roll error {units.angle(error)}"
        case RotationError(_, error):
            return f"Point reached, orientation off by {units.angle(error)}"
        case OutsideLimits(_, violations):
            beyond = [v.joint for v in violations if not v.locked]
            return f"{headline}: {numbered(beyond)}" if beyond else headline
        case OrientationNotMet():
            return "Orientation not possible here"
        case OutOfReach(distance, restriction) if distance > 0.0:
            return _beyond(units.distance(distance), restriction)
    return headline


def _beyond(distance: str, restriction: Restriction | None) -> str:
    """The headline of a target that is out of reach by a distance in words, or by one that is not known."""
    return f"Out of reach{distance and f' by {distance}'}{_while(restriction)}"


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
            return _refusing(details), _outside(details, units)
        case Touching():
            return "No collision-free posture found", _touching(details, units)
        case NotOnBranch(elsewhere, outside, locked):
            why = f"{count(outside, 'other posture exists', 'other postures exist')}, outside the joint limits"
            if locked:
                why += f" or only with {numbered(locked)} unlocked"
            if elsewhere:
                reach = count(elsewhere, "configuration reaches", "configurations reach")
                why = f"{reach} this target in other postures"
            return "No solution in the chosen posture", why
        case MaskNotMet(position, rotation, restriction):
            where = " in the chosen posture" if position is None or rotation is None else ""
            headline = f"These coordinates cannot be met together{where}{_while(restriction)}"
            if position is None or rotation is None:
                return headline, _possible(restriction, "they can be met")
            off = f"the closest configuration is off by {length(position)} and {angle(rotation)}"
            return headline, "; ".join(filter(None, (off, _possible(restriction, "they can be met"))))
        case OutOfReach(distance, restriction):
            off = length(distance) if distance > 0.0 else ""
            return _beyond(off, restriction), _out_of_reach(restriction, cause, units)
        case OrientationNotMet():
            held = f"The arm cannot hold this orientation at this point{_while(details.restriction)}"
            parts = _orientation(details, units), _possible(details.restriction, "it can")
            return held, "; ".join(filter(None, parts))


def _named(branch: str) -> str:
    """The name of a posture in brackets; "" for one that has only a number, or was found by search."""
    return "" if branch == "numeric" or branch.startswith("solution ") else f" ({branch})"


def _touching(details: Touching, units: Units) -> str:
    """What touches what in the posture with the fewest contacts, before redundancy parameters were searched."""
    contact, name = details.contact, _named(details.branch)
    text = f"{contact.text} by {units.lengths.value(-contact.distance)}"
    if details.contacts > 1:
        text += f", the deepest of {details.contacts} contacts"
    if details.postures == 1:
        text += name
    else:
        others = count(details.postures - 1, "other posture has", "other postures have")
        text += f" in the posture with the fewest contacts{name}; {others} at least as many"
    if details.searched:
        text += f"; a search over {listed(details.searched)} found no value without a collision"
    return text


def _solved(details: Solved, task: str) -> str:
    """How many configurations there are, and whether these are all."""
    text = _counted(details, task)
    if not details.touching:
        return text
    return f"{text}; {count(details.touching, 'other one collides', 'others collide')}"


def _counted(details: Solved, task: str) -> str:
    """How many configurations there are, and whether these are all."""
    chosen = details.chosen_branches
    inside = "" if chosen is None else f" in the chosen posture{'s' * (chosen != 1)}"
    target = f"{inside} for this {_TASKS[task]}"
    if details.free:
        free = f"{listed(details.free)} {are(details.free)} free, so there are infinitely many configurations"
        if chosen is not None:
            return f"{free}{target}"
        return f"{count(details.postures, 'posture', 'postures')}; {free}"
    if details.curves:
        text = f"infinitely many configurations{target}, on {count(len(details.curves), 'curve', 'curves')}"
        if alone := details.configurations - len(details.curves):
            text += f", and {count(alone, 'isolated one', 'isolated ones')}"
        return text if details.complete else f"{text}; others may exist"
    if details.infinite:
        found = "one was" if details.configurations == 1 else f"{details.configurations} were"
        return f"infinitely many configurations{target}; {found} found"
    text = count(details.configurations, "configuration", "configurations")
    if details.fixed:
        target += f" and the requested {listed(details.fixed)}"
    text = f"{text}{target}" if details.complete else f"{text} found{target}; others may exist"
    if not details.multiple:
        return text
    which = "it is" if details.configurations == 1 else count(details.multiple, "of them is", "of them are")
    return (
        f"{text}; {which} {'a multiple root' if details.multiple == 1 else 'multiple roots'}, where postures merge"
    )


def _while(restriction: Restriction | None) -> str:
    """Under which condition an answer holds: ``" while joint 1 is locked"``."""
    if restriction is None:
        return ""
    parts = []
    if restriction.locked:
        parts.append(f"{numbered(restriction.locked)} {are(restriction.locked)} locked")
    if restriction.narrowed:
        parts.append(f"the limits of {numbered(restriction.narrowed)} are narrowed")
    return f" while {listed(parts)}"


def _possible(restriction: Restriction | None, what: str) -> str:
    """What is possible without the locks and narrowed limits: ``"with joint 1 unlocked, they can be met"``."""
    if restriction is None:
        return ""
    own = "within the arm's own limits"
    unlocked = f"with {numbered(restriction.locked)} unlocked" if restriction.locked else own
    return f"{unlocked}{f' and {own}' if restriction.locked and restriction.narrowed else ''}, {what}"


def _out_of_reach(restriction: Restriction | None, cause: str, units: Units) -> str:
    """On which side the point is, and what locks have to do with it."""
    if restriction is None:
        return _SIDES[cause]
    if restriction.distance == 0.0:
        return _possible(restriction, "the point can be reached")
    missing = units.lengths.value(restriction.distance)
    return f"{_SIDES[cause]}; {_possible(restriction, f'it would still be out of reach by {missing}')}"


def _refusing(details: OutsideLimits) -> str:
    """What refuses the posture that comes closest: limits, locks or both."""
    locked = [v.joint for v in details.violations if v.locked]
    if not locked:
        return "Outside the limits"
    lock = f"while {numbered(locked)} {are(locked)} locked"
    return f"Not possible {lock}" if len(locked) == len(details.violations) else f"Outside the limits {lock}"


def _outside(details: OutsideLimits, units: Units) -> str:
    """Which joints would be where, on the posture that is closest to the limits."""
    locks = any(v.locked for v in details.violations)
    limits = "limits and locks" if locks else "limits"
    which = f"the posture closest to the {limits}" if details.branches > 1 else "the posture"
    given = ", ".join(f"{r.label} = {units.angles.value(r.value)}" for r in details.requested)
    needs = listed([need(violation, units) for violation in details.violations])
    name = _named(details.branch)
    text = f"{f'with {given} ' if given else ''}{which}{name} needs {needs}"
    if details.branches > 1:
        others = count(details.branches - 1, "other posture is", "other postures are")
        text += f". {others[0].upper()}{others[1:]} {'not possible either' if locks else 'outside the limits too'}"
    possible = [r for r in details.requested if r.intervals]
    for r in possible:
        text += f". Possible {r.label}: {ranges(r.intervals, units)}"
    if details.elsewhere:
        others = count(details.elsewhere, "configuration is", "configurations are")
        text += f". {others[0].upper()}{others[1:]} inside the limits in postures that were not chosen"
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
    if not real:
        return ""
    aligned = short(real[0], units)
    what = f"the {aligned} vanishes" if real[0].condition == "smallest singular value" else aligned
    return f"{which} configuration is singular: {what}."
