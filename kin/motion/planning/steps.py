"""Adding segments to a plan: a pause, or all segments that are driven without a stop."""

from __future__ import annotations

from kin.motion.details import BlendLeftOut, BlendShortened, JerkCost
from kin.motion.paths import Run, alone, is_joint_move, joined, limited, stopping_times
from kin.motion.pieces import Hold
from kin.motion.planning.plan import Plan
from kin.motion.planning.runs import check_limits, run_from
from kin.motion.program import Move, Pause, Ptp
from kin.motion.refusals import slow_places
from kin.motion.timing.timed import timed

_SAME_ZONE = 1e-6  # part of a zone that may be missing without a note


def drive(plan: Plan, index: int) -> int:
    """Add the segment with this index to the plan, with those that it is blended into; the index after them."""
    segment = plan.program.segments[index]
    if isinstance(segment, Pause):
        plan.add(index, Hold(plan.q, segment.seconds), [segment.seconds], plan.q[None])
        return index + 1
    run, first = run_from(plan, index), index
    index = plan.done
    while run is not None and _joins(plan, index - 1):
        following, blend = run_from(plan, index), plan.move(index - 1).blend
        found = None if following is None else joined(plan.robot, run, following, blend)
        if found is None:
            plan.notes.append(BlendLeftOut(index - 1, "small" if following else "short"))
            _time(plan, first, run)
            run, first, index = following, index, plan.done
            continue
        run, used = found
        if used < blend * (1.0 - _SAME_ZONE):
            plan.notes.append(BlendShortened(index - 1, blend, used))
        check_limits(plan, run, ())
        index = plan.done
    if run is None:
        plan.add(first, None, [0.0], plan.q[None])
    else:
        _time(plan, first, run)
    return index


def _joins(plan: Plan, index: int) -> bool:
    """Whether a segment is blended into one of the other kind, of the joints or of the tool."""
    segment, after = plan.program.segments[index], plan.program.segments[index + 1 : index + 2]
    if not isinstance(segment, Move) or segment.blend == 0.0 or index in plan.stops:
        return False
    if not after or not isinstance(after[0], Move):
        return False
    return is_joint_move(after[0]) != is_joint_move(segment)


def _time(plan: Plan, first: int, run: Run) -> None:
    """Add a path to the plan, or a PTP that is alone."""
    segment, layout = plan.program.segments[first], run.layout
    if len(layout.owners) == 1 and isinstance(segment, Ptp):
        piece = alone(plan.robot, plan.limits, segment, run)
        plan.halves[first] = plan.time + 0.5 * piece.duration
        plan.add(first, piece, [piece.duration], run.ends[1:])
        return
    moves = {i: move for i, move in enumerate(plan.program.segments) if isinstance(move, Move)}
    own = range(first, first + len(layout.bounds) - 1)
    path = limited(plan.robot, plan.limits, moves, layout, run.knots, run.pieces)
    found = timed(path, plan.program.jerk_limited, plan.cancel)
    middles = found.when(0.5 * (layout.bounds[:-1] + layout.bounds[1:]))
    plan.halves.update(zip(own, (plan.time + middles).tolist(), strict=True))
    if len(own) > 1:
        stopping = stopping_times(plan.limits, [moves[i] for i in own], run, path, plan.program.jerk_limited)
        plan.stopping.update(zip(own, stopping, strict=True))
        plan.blended.extend(own[:-1])
    plan.add(first, found, [*found.when(layout.bounds[1:-1]).tolist(), found.duration], run.ends[1:])
    if plan.program.jerk_limited and found.duration > found.without * (1.0 + 1e-6):
        plan.notes.append(JerkCost(first, own[-1], found.duration, found.without))
    plan.notes.extend(slow_places(plan.robot, layout, path))
