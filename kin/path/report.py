"""What is told of a path: errors measured by forward kinematics, jumps, gaps, and the whole in a sentence."""

from __future__ import annotations

import numpy as np

from kin.ik import messages
from kin.ik.branches import measure, solution
from kin.ik.candidates import POSITION_ERROR, ROTATION_ERROR
from kin.ik.results import Status
from kin.path.causes import jump_at
from kin.path.course import Course, Stop, Way, has_closed_form
from kin.path.results import PathGap, PathJump, PathResult
from kin.path.route import DeadEnd
from kin.transforms import Array


def report(course: Course, stops: list[Stop], q: Array, ends: list[DeadEnd]) -> PathResult:
    """The path ``(k, n)`` through all waypoints, jumps with their causes, gaps with their reasons."""
    way = course.way
    stats = np.concatenate(
        [measure(stop.asked.without_turns(), row[None])[1] for stop, row in zip(stops, q, strict=True)]
    )
    leaps = way.leaps(q, [1] * len(q))
    # The jump number t is what the ways with fewer than t jumps end in; one beside a gap is looked at by itself.
    free = [i for i in leaps if stops[i].gap is None and stops[i - 1].gap is None]
    forced = dict(zip(free, ends, strict=True)) if len(free) == len(ends) else {}
    jumps = tuple(jump_at(course, q, i, forced.get(i)) for i in leaps)
    gaps = tuple(_gap(stop, i, q[i], stats[i]) for i, stop in enumerate(stops) if stop.gap or stop.relaxed)
    match = way.question.match
    position, rotation = stats[:, POSITION_ERROR].copy(), stats[:, ROTATION_ERROR].copy()
    for array in (q, position, rotation):
        array.flags.writeable = False
    return PathResult(
        q=q,
        continuous=not jumps,
        jumps=jumps,
        gaps=gaps,
        position_error=position,
        rotation_error=rotation,
        solver=match.name if match is not None and has_closed_form(way.question) else "numeric",
        reason=_summary(way, q, jumps, gaps),
    )


def _gap(stop: Stop, index: int, q: Array, stats: Array) -> PathGap:
    if stop.gap is not None:
        return PathGap(index, stop.gap.status, stop.gap.reason, stop.gap.distance)
    reason = messages.approximate(stop.asked, solution(stop.asked, q, stats, compromise="roll"), ())
    return PathGap(index, Status.APPROXIMATE, reason, 0.0)


def _summary(way: Way, q: Array, jumps: tuple[PathJump, ...], gaps: tuple[PathGap, ...]) -> str:
    count = "one waypoint" if len(q) == 1 else f"{len(q)} waypoints"
    if jumps:
        where = ", ".join(f"before waypoint {jump.index} ({jump.cause})" for jump in jumps[:4])
        more = f" and {len(jumps) - 4} more" if len(jumps) > 4 else ""
        number = "one jump" if len(jumps) == 1 else f"{len(jumps)} jumps"
        text = f"{count} with {number}: {where}{more}."
    elif len(q) == 1:
        text = "One waypoint."
    else:
        moves = way.moves(q[:-1], q[1:]).max(axis=0)
        widest = int(np.argmax(moves))
        text = f"Continuous through {count}: the largest step is {way.told(widest, float(moves[widest]))}."
    if gaps:
        which = ", ".join(str(gap.index) for gap in gaps[:8]) + (", …" if len(gaps) > 8 else "")
        text += f" No exact answer at {len(gaps)} of {count}: {which}."
    return text
