"""Why a program cannot be driven, and at which item."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import kin
from app.viewer.feature import Stage
from app.viewer.tabs.program.items import Item, Items, Point, passed_through, point, start_of
from app.viewer.tabs.program.planning import Plan
from kin.motion import Motion

SAME = 1e-6  # rad or m: a locked joint has this value
LOOSE, SAMPLES = 1e-4, 400  # rad or m on the way, and where it is looked at
_TOOL = ("lin", "circ", "spline")


@dataclass(frozen=True)
class Fault:
    """Why the program cannot be driven.

    Attributes:
        index: of the item at fault; that of the way back to the start is the number of items.
        words: sentences.
        ptp: whether a PTP to the same waypoint would help.
        way: points of the tool's way at fault (m); a line is drawn through them.
        place: where on it the arm cannot go on (m); None: at its end, or not known.
        whole: whether nothing can be played, as a locked joint would move; otherwise all before it can be.
        start: whether the item can be met from another posture at its start.
        touches: whether something would be touched on the way to the item.
    """

    index: int
    words: str
    ptp: bool = False
    way: tuple[Point, ...] = ()
    place: Point | None = None
    whole: bool = False
    start: bool = False
    touches: bool = False


def find_fault(plan: Plan | None, stage: Stage) -> Fault | None:
    """The planner's refusal, or a locked joint that would have to move; None: nothing."""
    if plan is None:
        return None
    if plan.motion.refusal is not None:
        return _refused(plan, stage)
    constraints = stage.now.options.constraints
    locked = () if constraints is None or constraints.locked is None else constraints.locked
    for index, item in enumerate(plan.items):
        for joint, (q, value) in enumerate(zip(item.q, locked, strict=False)):
            if value is not None and abs(q - value) > SAME:
                unit = stage.units.of(bool(stage.now.robot.revolute[joint]))
                words = (
                    f"Joint {joint + 1} is locked at {unit.text(value)}, and this waypoint has it at "
                    f"{unit.text(q)}. Unlock the joint, or set the waypoint to another pose."
                )
                return Fault(index, words, whole=True)
    return _moved(plan, plan.motion, locked)


def _refused(plan: Plan, stage: Stage) -> Fault:
    refusal, items = plan.motion.refusal, plan.items
    assert refusal is not None
    index = plan.item_of(refusal.segment)
    touches = refusal.cause == "collision" and index < len(items) and items[index] is not start_of(items)
    helps = any(each.code == "ptp" for each in refusal.helps)
    if index >= len(items) or items[index].kind not in _TOOL:
        return Fault(index, plan.explain(stage.units), touches=touches)
    way = _way(items, index, stage)
    place = None
    if refusal.fraction is not None and items[index].kind == "lin" and len(way) == 2:
        start, end = np.array(way)
        place = point(start + refusal.fraction * (end - start))
    start = plan.start_as_recorded(index) is not None
    return Fault(index, plan.explain(stage.units), helps, way, place, start=start, touches=touches)


def _way(items: Items, index: int, stage: Stage) -> tuple[Point, ...]:
    """From the waypoint before a segment of the tool to its end, by its via point or its inner points."""
    first = index
    while first > 0 and passed_through(items, first - 1):
        first -= 1
    before = [item for item in items[:first] if item.q][-1:]
    found: list[Point] = []
    for item in (*before, *items[first : index + 1]):
        if item.kind == "circ" and item is items[index] and item.via is not None:
            found.append(item.via)
        found.append(_place(item, stage))
    return tuple(found)


def _place(item: Item, stage: Stage) -> Point:
    return point(kin.fk(stage.now.robot, np.array(item.q))[:3, 3])


def _moved(plan: Plan, motion: Motion, locked: Sequence[float | None]) -> Fault | None:
    """A path on which a locked joint would move between two waypoints."""
    joints = [(joint, value) for joint, value in enumerate(locked) if value is not None]
    times = np.linspace(0.0, motion.duration, SAMPLES)
    q = motion.derivatives(times)[0] if joints else np.zeros((0, motion.robot.n))
    for joint, value in joints:
        off = np.flatnonzero(np.abs(q[:, joint] - value) > LOOSE)
        if off.size:
            index = plan.item_at(float(times[off[0]])) or 0
            words = f"Joint {joint + 1} is locked, and would move on the way. Unlock the joint, or choose PTP."
            ptp = index < len(plan.items) and plan.items[index].kind in _TOOL
            return Fault(index, words, ptp, whole=True)
    return None
