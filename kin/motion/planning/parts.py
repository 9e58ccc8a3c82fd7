"""What can be driven of a program that is refused: up to just before the place where it cannot go on.

The segments before that place are planned again, without a blend into the one that is refused. Of a line or an arc
that is refused on its way, its beginning is driven too.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from kin.fk import fk
from kin.motion.geometry.curves import poses
from kin.motion.paths import NO_LENGTH, curve_of
from kin.motion.planning.plan import Plan, RefusedError
from kin.motion.planning.setting_off import set_off
from kin.motion.planning.zones import drive_fastest
from kin.motion.program import Circ, Lin, Pause, PoseTarget, Program, Segment
from kin.motion.results import InMotion, Motion, Refusal
from kin.transforms import Array

_SHORTER = (0.98, 0.9)  # of the way to the place: how much of it is driven, at first and where that fails


def driven(plan: Plan, index: int) -> None:
    """Add the segments of the program from this one on to the plan; raises `RefusedError`."""
    if plan.start is not None:
        index = set_off(plan)
    while index < len(plan.program.segments):
        plan.cancel()
        index = drive_fastest(plan, index)


def part_before(plan: Plan, q_start: Array, refusal: Refusal, start: InMotion | None = None) -> Motion | None:
    """The motion up to a refusal that has ended the planning; None if that is nothing.

    `plan` holds what was planned before it, `q_start` ``(n,)`` is where it began, and `start` how it moved there.
    """
    whole, count = plan.program, refusal.segment
    try:
        _drive_first(plan, whole, count)
    except RefusedError:  # without the blend into the refused segment another one is refused
        return _motion(plan, whole, q_start, start)
    segment = whole.segments[count]
    for share in _SHORTER if isinstance(segment, Lin | Circ) and refusal.fraction else ():
        assert isinstance(segment, Lin | Circ)
        assert refusal.fraction is not None
        shorter = _beginning(plan, segment, share * refusal.fraction)
        if shorter is None:
            break
        trial = plan.branch()
        trial.program = replace(whole, segments=(*ended(whole, count), shorter))
        with suppress(RefusedError):
            drive_fastest(trial, count)
            plan.take(trial)
            return _motion(plan, trial.program, q_start, start)
    return _motion(plan, whole, q_start, start)


def part_of(motion: Motion, count: int, cancel: Callable[[], None]) -> Motion | None:
    """The motion of the first segments of a planned one, with a stop at their end; None if there are none."""
    plan = Plan(motion.robot, motion.program, motion.limits, motion.q_start.copy(), cancel, start=motion.start)
    with suppress(RefusedError):
        _drive_first(plan, motion.program, count)
    return _motion(plan, motion.program, motion.q_start, motion.start)


def ended(program: Program, count: int) -> tuple[Segment, ...]:
    """The first segments of a program, with a stop at the end."""
    *most, last = program.segments[:count] or (None,)
    if last is None:
        return ()
    return (*(each for each in most if each), last if isinstance(last, Pause) else replace(last, blend=0.0))


def _drive_first(plan: Plan, whole: Program, count: int) -> None:
    """Plan the first segments of a program that are not planned yet; raises `RefusedError`."""
    kept = ended(whole, count)
    if kept:
        plan.program = replace(whole, segments=kept)
        driven(plan, len(plan.segments))


def _motion(plan: Plan, whole: Program, q_start: Array, start: InMotion | None) -> Motion | None:
    """What is planned, as the motion of the program's beginning."""
    if not plan.segments:
        return None
    plan.program = replace(whole, segments=ended(whole, len(plan.segments)))
    return plan.motion(q_start, start)


def _beginning(plan: Plan, segment: Lin | Circ, fraction: float) -> Lin | Circ | None:
    """A part of a segment from where the plan ends; None if it has no length."""
    curve = curve_of(plan.robot, segment, fk(plan.robot, plan.q), plan.task != "approach")
    if curve is None or isinstance(curve, tuple) or fraction * curve.length < NO_LENGTH:
        return None
    middle, end = poses(curve, np.array([0.5, 1.0]) * fraction * curve.length)
    target = PoseTarget.of(end)
    if isinstance(segment, Circ):
        x, y, z = middle[:3, 3].tolist()
        return replace(segment, via=(x, y, z), target=target, blend=0.0)
    return replace(segment, target=target, blend=0.0)
