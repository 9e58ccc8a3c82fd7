"""Sentences about paths, made from codes and numbers in the reader's units."""

from __future__ import annotations

from collections.abc import Sequence

from kin.collision.sweep import Touch
from kin.ik.messages.singularity import short
from kin.ik.messages.values import count, joint, joint_value
from kin.path.details import (
    BranchEnds,
    JointMove,
    JumpDetails,
    LimitInTheWay,
    MotionEnd,
    NearSingularity,
    TooFarApart,
)
from kin.solvers.singular import Singularity
from kin.units import Units

_MOST_JUMPS, _MOST_GAPS = 4, 8  # listed in a summary


def move(size: JointMove, units: Units) -> str:
    """The size of a joint motion."""
    return joint_value(size.kind, size.motion, units)


def jump(
    index: int, joints: Sequence[int], widest: JointMove, place: MotionEnd, details: JumpDetails, units: Units
) -> str:
    """A jump before waypoint `index`: which joint moves how far, and why there is no way around it."""
    others = f" (and {len(joints) - 1} more)" if len(joints) > 1 else ""
    what = f"{joint(widest.joint, widest.name)}{others} jumps by {move(widest, units)}"
    return f"Between waypoints {index - 1} and {index} {what}: {_where(place)} {_why(place, details, units)}."


def summary(
    waypoints: int,
    largest_step: JointMove | None,
    jumps: Sequence[tuple[int, str]],
    gaps: Sequence[int],
    units: Units,
) -> str:
    """The whole path: its largest step or its jumps (index, cause), and its gaps (index)."""
    number = count(waypoints, "waypoint", "waypoints")
    if jumps:
        where = ", ".join(f"before waypoint {index} ({cause})" for index, cause in jumps[:_MOST_JUMPS])
        more = f" and {len(jumps) - _MOST_JUMPS} more" if len(jumps) > _MOST_JUMPS else ""
        text = f"{number} with {count(len(jumps), 'jump', 'jumps')}: {where}{more}."
    elif largest_step is None:
        text = "One waypoint."
    else:
        text = f"Continuous through {number}: the largest step is {move(largest_step, units)}."
    if gaps:
        which = ", ".join(map(str, gaps[:_MOST_GAPS])) + (", …" if len(gaps) > _MOST_GAPS else "")
        text += f" No exact solution at {len(gaps)} of {number}: {which}."
    return text


def contacts(found: Sequence[Touch], units: Units) -> str:
    """Where the arm touches something."""
    parts = []
    for touch in found[:_MOST_JUMPS]:
        place = (
            f"at waypoint {touch.waypoint}"
            if touch.share == 1.0
            else f"between waypoints {touch.waypoint - 1} and {touch.waypoint}"
        )
        parts.append(f"{place} {touch.contact.text} by {units.lengths.value(-touch.contact.distance)}")
    more = f", and in {len(found) - _MOST_JUMPS} more places" if len(found) > _MOST_JUMPS else ""
    return f"Collisions: {'; '.join(parts)}{more}."


def _where(place: MotionEnd) -> str:
    """The beginning of a clause that says where a motion ends."""
    if place.is_jump:
        return "there"
    motion = "followed backwards, the motion" if place.backwards else "without the jump, the motion"
    return f"{motion} ends between waypoints {place.before} and {place.after}, where"


def _why(place: MotionEnd, details: JumpDetails, units: Units) -> str:
    """The end of that clause."""
    match details:
        case LimitInTheWay(violation):
            name, limit = joint(violation.joint, violation.name), violation.limit
            bound = "is locked at" if violation.locked else "reaches its limit of"
            return f"{name} {bound} {joint_value(violation.kind, limit, units)}"
        case NearSingularity(met, singularity):
            does = "meets" if met else "passes close to"
            return f"the motion {does} a singularity{_clause(singularity, units)}"
        case BranchEnds(branch, singularity):
            which = f" ({branch})" if branch is not None else ""
            return f"the posture being followed{which} ends{_clause(singularity, units)}"
        case TooFarApart(max_step, distance, rotation):
            turns = f" and turns by {units.angles.value(rotation)}" if rotation > 0.0 else ""
            which = "they" if place.is_jump else "the waypoints"
            return (
                f"{which} are too far apart for steps of {move(max_step, units)}: "
                f"the tool moves by {units.lengths.value(distance)}{turns}"
            )


def _clause(singularity: Singularity | None, units: Units) -> str:
    return f", {short(singularity, units)}" if singularity is not None else ""
