"""Which blends save time: at a small zone passing the corner may take longer than a stop.

Between the middles of two segments that are blended, the time is compared with an estimate for a stop between
them. Where it is longer, the motion is planned with stops there, too, and the fastest one is taken.
"""

from __future__ import annotations

from kin.motion.details import BlendLeftOut
from kin.motion.planning.plan import Plan, RefusedError
from kin.motion.planning.steps import drive

_DOUBT = {True: 0.97, False: 0.95}  # with and without limits of jerk: a larger part of the estimate is a doubt
_WORTH = 2e-3  # part of its time by which a motion must be faster with a stop, so that a blend is left out


def drive_fastest(plan: Plan, index: int) -> int:
    """As `drive`, but the arm stops where that is faster than the blend that is set."""
    best = plan.branch()
    after = drive(best, index)
    doubtful = _doubtful(best)
    if doubtful:
        best = _fastest(plan, index, after, best, doubtful)
    plan.take(best)
    return after


def _doubtful(plan: Plan) -> frozenset[int]:
    """The segments whose blend may take longer than a stop; all if the whole does."""
    doubt = _DOUBT[plan.program.jerk_limited]
    whole = sum(each.end - each.start for each in plan.segments if each.index in plan.stopping)
    if whole > doubt * sum(plan.stopping.values()):
        return frozenset(plan.blended)
    pairs = {k: 0.5 * (plan.stopping[k] + plan.stopping[k + 1]) for k in plan.blended}
    return frozenset(k for k, seconds in pairs.items() if _passing(plan, k) > doubt * seconds)


def _fastest(plan: Plan, index: int, after: int, blended: Plan, doubtful: frozenset[int]) -> Plan:
    """The fastest motion: with all blends, without the doubtful ones, or without those of them that cost time."""
    stopped = _with_stops(plan, index, after, doubtful)
    if stopped is None:
        return blended
    slower = frozenset(k for k in doubtful if _passing(blended, k) > _passing(stopped, k))
    some = _with_stops(plan, index, after, slower) if slower and slower != doubtful else None
    found = [each for each in (stopped, some) if each is not None]
    best = min(found, key=lambda each: each.time)
    if best.time - plan.time > (blended.time - plan.time) * (1.0 - _WORTH):
        return blended
    notes = [BlendLeftOut(k, "slower", _passing(blended, k), _passing(best, k)) for k in sorted(best.stops)]
    best.notes.extend(notes)
    return best


def _passing(plan: Plan, index: int) -> float:
    """Seconds from the middle of a segment to the middle of the next one."""
    return plan.halves[index + 1] - plan.halves[index]


def _with_stops(plan: Plan, index: int, after: int, stops: frozenset[int]) -> Plan | None:
    """The segments from one index to another with these stops; None if they cannot be driven so."""
    found = plan.branch(stops)
    try:
        while index < after:
            index = drive(found, index)
    except RefusedError:
        return None
    return found
