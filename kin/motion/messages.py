"""Sentences about motions, made from codes and numbers in the reader's units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from kin.ik.messages import explain
from kin.ik.messages.singularity import short
from kin.ik.messages.values import joint, joint_value, listed, need
from kin.motion.details import (
    ArrivesOtherwise,
    BlendLeftOut,
    BlendShortened,
    Braked,
    BranchNeeded,
    CannotStop,
    Collides,
    Help,
    JerkCost,
    LimitMet,
    NoCircle,
    Note,
    NotKept,
    NotReached,
    RefusalDetails,
    SingularityMet,
    Slowed,
    StartOutside,
    TargetOutside,
)
from kin.units import Units

if TYPE_CHECKING:
    from kin.motion.program import Kind

_STOPS = {
    "last": "it is the last one",
    "short": "one of the two segments has no length",
    "small": "the zone is less than a thousandth of one of the two segments",
    "dwell": "the arm pauses there",
}
_HELP = {
    "ptp": "a PTP to the same target is possible",
    "posture": "the whole path is possible from another posture",
    "via": "a via point beside this place may help",
    "start": "move the joint inside its limits first",
    "closer": "choose a target closer to the arm",
    "task": "keep only the point, or point and approach direction",
    "shift": "the same path beside it is even, shifted by {} at least (along the world's axes: {})",
    "tilt": "the same path is even with the tool tilted by {} at least (about its own axes: {})",
}


def refusal(
    segment: int, kind: Kind, name: str, fraction: float | None, details: RefusalDetails,
    helps: Sequence[Help], units: Units,
) -> str:  # fmt: skip
    """Why a segment cannot be driven, where, and what would help."""
    which = f"Segment {segment + 1} ({kind.upper()}{f', {name}' if name else ''})"
    where = "" if fraction is None else f", {100.0 * fraction:.1f} % of the way"
    worst = "at the worst place after it, " if where and isinstance(details, NotReached) else ""
    text = f"{which} cannot be driven{where}: {worst}{_why(details, units)}."
    return text + _helps(helps, units)


def _helps(helps: Sequence[Help], units: Units) -> str:
    """What would help, a sentence each."""
    text = ""
    for help_ in helps:
        said = _HELP[help_.code] + (f" ({help_.posture})" if help_.posture else "")
        if help_.vector is not None:
            unit = units.lengths if help_.code == "shift" else units.angles
            parts = [f"{axis} {unit.value(each)}" for each, axis in zip(help_.vector, "xyz", strict=True) if each]
            said = said.format(unit.value(math.hypot(*help_.vector)), listed(parts))
        text += f" {said[0].upper()}{said[1:]}."
    return text


def _why(details: RefusalDetails, units: Units) -> str:
    match details:
        case StartOutside(violations):
            return f"the arm starts outside its limits: {listed([need(each, units) for each in violations])}"
        case CannotStop(violation, time, speed):
            who, kind = joint(violation.joint, violation.name), violation.kind
            fast = units.of(kind == "revolute").per_second().value(abs(speed))
            return (
                f"{who} cannot stop in time: it moves at {fast}, reaches its limit of "
                f"{joint_value(kind, violation.limit, units)} after {time:.3f} s and would need "
                f"{joint_value(kind, violation.value, units)}"
            )
        case TargetOutside(violations):
            return f"the target is outside the limits: {listed([need(each, units) for each in violations])}"
        case NotReached(facts, cause, task, singularities):
            said = explain(facts, cause, task, singularities, units)
            text = f"{said.headline}: {said.body}" if said.body else said.headline
            return text[0].lower() + text[1:]
        case LimitMet(violation):
            who, kind = joint(violation.joint, violation.name), violation.kind
            limit = joint_value(kind, violation.limit, units)
            return f"{who} reaches its limit of {limit} and would need {joint_value(kind, violation.value, units)}"
        case SingularityMet(singularity, move):
            text = "the path meets a singularity" + (f" ({short(singularity, units)})" if singularity else "")
            if move is not None:
                how = joint_value(move.kind, move.motion, units)
                text += f"; {joint(move.joint, move.name)} would have to jump by {how}"
            return text
        case BranchNeeded(start):
            posture = f" ({start})" if start else ""
            return f"the posture at the start{posture} does not lead to the target"
        case NoCircle(coincident):
            if coincident is None:
                return "the via point is in line with start and target, but not between them"
            return f"{coincident[0]} and {coincident[1]} are the same point, which defines no arc"
        case NotKept(joints, position, rotation):
            off = f"{units.lengths.value(position)} and {units.angles.value(rotation)}"
            return f"{joints} joints cannot keep the path: it would be missed by {off}"
        case Collides(time, contact):
            return f"{contact.text} after {time:.2f} s"


def note(fact: Note, units: Units) -> str:
    """Something worth knowing of a planned motion."""
    match fact:
        case ArrivesOtherwise(segment, posture, recorded, move):
            how = "with other joint values than recorded"
            if posture != recorded:
                how = f"in another posture than recorded ({posture}, not {recorded})"
            away = f"{joint(move.joint, move.name)} is {joint_value(move.kind, move.motion, units)} away"
            return (
                f"Segment {segment + 1} meets its target {how}: {away}. Record the joint values of arrival, start "
                "in another posture, or drive PTP."
            )
        case BlendShortened(segment, asked, used):
            sizes = f"{units.lengths.value(used)} instead of {units.lengths.value(asked)}"
            return f"Segment {segment + 1} is blended within {sizes}: at most half of the shorter segment is used."
        case BlendLeftOut(segment, "slower", passing, stopping):
            times = (
                f"from the middle of this segment to that of the next {passing:.3f} s instead of {stopping:.3f} s"
            )
            return (
                f"The arm stops at the end of segment {segment + 1}: with the blend it would take longer, {times}."
            )
        case BlendLeftOut(segment, why):
            return f"The arm stops at the end of segment {segment + 1} although a blend is set: {_STOPS[why]}."
        case Slowed(segment, fraction, index, name, quantity, ratio, singularity, helps):
            near = f", close to a singularity ({short(singularity, units)})" if singularity else ""
            said = (
                f"Segment {segment + 1} slows down to {100.0 * ratio:.2g} % of its usual speed at "
                f"{100.0 * fraction:.0f} % of the way{near}: {joint(index, name)} is at its limit of {quantity}."
            )
            return said + _helps(helps, units)
        case Braked(seconds):
            return f"The arm moves at the start: it brakes for {seconds:.3f} s before the first segment."
        case JerkCost(first, last, duration, without):
            which = f"segment {first + 1}" if first == last else f"segments {first + 1} to {last + 1}"
            share = 100.0 * (duration / without - 1.0)
            return f"The limits of jerk cost {duration - without:.3f} s ({share:.1f} %) on {which}."


def summary(motions: int, pauses: int, grips: int, duration: float) -> str:
    """A planned motion: how many segments move the arm, let it wait, move the gripper, and how long it takes."""
    counts = ((motions, "motion"), (pauses, "pause"), (grips, "gripper move"))
    parts = [f"{number} {name}{'s' * (number != 1)}" for number, name in counts if number]
    return f"{listed(parts)} in {duration:.3f} s." if parts else "No motion: the arm is there already."
