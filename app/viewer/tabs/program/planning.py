"""From the list of a program to its motion, and from a file to the list.

Points of one spline are several items of the list and one segment of the program. A :class:`Plan` knows which item
belongs to which segment, and words refusals and notes with the numbers of the list.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

import kin
from app.viewer.own_arm import clean
from app.viewer.tabs.program.items import (
    MOST,
    NAME,
    SLOWEST,
    Item,
    Items,
    Kind,
    configuration,
    passed_through,
    point,
    start_of,
    waypoint,
)
from kin import InputError, Obstacle, Robot
from kin.collision.contacts import surroundings
from kin.motion import Circ, Dwell, JointTarget, Lin, Motion, PoseTarget, Program, Ptp, Spline
from kin.motion.details import Collides, JerkCost, Note
from kin.motion.planning.collisions import checked
from kin.motion.program import Segment, Target, kind_of
from kin.motion.results import Refusal
from kin.transforms import Array
from kin.units import Units

_LOOKS = 200  # times in a spline at which its distance from a point is looked at


@dataclass(frozen=True, eq=False)
class Plan:
    """A list and its motion.

    Attributes:
        items: the list, with at least one waypoint.
        motion: it may be refused.
        segments: index of the segment of each item.
        touch: where the motion touches something although it can be driven; None: nowhere, or it is not known.
    """

    items: Items
    motion: Motion
    segments: tuple[int, ...]
    touch: Refusal | None = None

    @property
    def motion_or_none(self) -> Motion | None:
        """The motion, if it can be driven."""
        return self.motion if self.motion.planned else None

    def item_of(self, segment: int) -> int:
        """Index of the item at which a segment ends; that of the way back is the number of items."""
        return max((i for i, each in enumerate(self.segments) if each == segment), default=len(self.items))

    def touches(self) -> str:
        """Where the motion touches something, with the number of the list; "" if nowhere is known."""
        if self.touch is None or not isinstance(self.touch.details, Collides):
            return ""
        index, contact = self.item_of(self.touch.segment), self.touch.details.contact
        where = (
            "Back to the start" if index >= len(self.items) else f"{index + 1} ({self.items[index].kind.upper()})"
        )
        return f"{where}: {contact.text} after {self.touch.details.time:.2f} s."

    @cached_property
    def ends(self) -> tuple[float, ...]:
        """When each item is reached, and the way back; empty for a refused motion."""
        times = self.motion.segments
        if not times:
            return ()
        inner = [passed_through(self.items, i) for i in range(len(self.items))]
        found = [times[s].end if not inner[i] else self._passed(i) for i, s in enumerate(self.segments)]
        return (*found, self.motion.duration)

    def _passed(self, index: int) -> float:
        """When the tool is closest to an inner point of a spline."""
        times = self.motion.segments[self.segments[index]]
        at = np.linspace(times.start, times.end, _LOOKS)
        wanted = kin.fk(self.motion.robot, np.array(self.items[index].q))[:3, 3]
        first = self.segments.index(self.segments[index])
        count = self.segments.count(self.segments[index])
        off = np.linalg.norm(self.motion.sample(at).T[:, :3, 3] - wanted, axis=1)
        # Of a curve that comes there twice, the place that fits the order of the points.
        usual = np.linspace(0.0, 1.0, _LOOKS) - (index - first + 1) / count
        return float(at[int(np.argmin(off + 1e-6 * np.abs(usual)))])

    def item_at(self, time: float) -> int | None:
        """Index of the item that is driven to at a time; None after a refusal."""
        return next((i for i, end in enumerate(self.ends) if time <= end), None)

    def explain(self, units: Units) -> str:
        """What is worth knowing of the motion, or why it is refused, with the numbers of the list."""
        motion = self.motion
        if motion.refusal is not None:
            return replace(motion.refusal, segment=self.item_of(motion.refusal.segment)).explain(units)
        return replace(motion, notes=tuple(map(self._numbered, motion.notes))).explain(units)

    def _numbered(self, note: Note) -> Note:
        if isinstance(note, JerkCost):
            return note._replace(first=self.item_of(note.first), last=self.item_of(note.last))
        return note._replace(segment=self.item_of(note.segment))


def plan(
    items: Items, robot: Robot, loop: bool, avoid: bool = False, obstacles: tuple[Obstacle, ...] = ()
) -> Plan | None:
    """The motion of a list; None: it has no waypoint.

    Args:
        loop: whether it returns to the first one.
        avoid: whether a motion that touches something is refused; otherwise `Plan.touch` says where it does.
    """
    first = start_of(items)
    if first is None:
        return None
    program = program_of(items, robot, loop)
    motion = kin.plan_motion(
        robot, program, first.q, avoid_self_collision=avoid, obstacles=obstacles if avoid else ()
    )
    touch = None
    if not avoid and (obstacles or robot.capsules):
        touch = checked(motion, surroundings(robot, obstacles, bool(robot.capsules)), lambda: None).refusal
    return Plan(items, motion, segments_of(items), touch if motion.planned else None)


def segments_of(items: Items) -> tuple[int, ...]:
    """Index of the segment of each item."""
    starts = [i == 0 or not passed_through(items, i - 1) for i in range(len(items))]
    return tuple(int(number) - 1 for number in np.cumsum(starts))


def program_of(items: Items, robot: Robot, loop: bool) -> Program:
    """The program of a list with at least one waypoint; `loop`: it returns to the first one."""
    first = start_of(items)
    assert first is not None
    segments: list[Segment] = []
    points: list[PoseTarget] = []
    for i, item in enumerate(items):
        if item.kind == "spline" and item is not first:
            points.append(_pose(item, robot))
            if passed_through(items, i):
                continue
        segments.append(_segment(item, robot, item is first, points))
        points = []
    if loop:
        segments.append(Ptp(JointTarget(first.q), name="back to the start"))
    return Program(tuple(segments))


def _pose(item: Item, robot: Robot) -> PoseTarget:
    return PoseTarget.of(kin.fk(robot, np.array(item.q)))


def _segment(item: Item, robot: Robot, first: bool, points: list[PoseTarget]) -> Segment:
    if item.kind == "pause":
        return Dwell(item.seconds, item.name)
    if first:
        return Ptp(JointTarget(item.q), name=item.name)
    options: dict[str, Any] = {
        key: getattr(item, key) for key in ("speed", "acceleration", "blend", "tool_speed", "tool_turn", "name")
    }
    match item.kind:
        case "lin":
            return Lin(_pose(item, robot), **options)
        case "circ":
            assert item.via is not None
            return Circ(item.via, _pose(item, robot), **options)
        case "spline":
            return Spline(tuple(points), **options)
    return Ptp(JointTarget(item.q), **options)


def halfway(items: Items, index: int, robot: Robot) -> tuple[float, float, float]:
    """A via point for an arc to an item: where the tool is halfway of the PTP to it."""
    before = next((item for item in reversed(items[:index]) if item.q), items[index])
    middle = 0.5 * (np.array(before.q) + np.array(items[index].q))
    return point(kin.fk(robot, middle)[:3, 3])


# Files


def items_of(program: Program, robot: Robot, q: Array) -> Items:
    """The list for a program that was read from a file, which starts at q ``(n,)``.

    Raises:
        InputError: the program cannot be driven, or has something that the list cannot hold.
    """
    _only_what_the_list_holds(program)
    first = program.segments[0]
    start = first.target.q if isinstance(first, Ptp) and isinstance(first.target, JointTarget) else q
    motion = kin.plan_motion(robot, program, start)
    if motion.refusal is not None:
        raise InputError("program", motion.refusal.reason, "a program that this arm can drive")
    found: list[Item] = []
    for k, segment in enumerate(program.segments):
        if isinstance(segment, Dwell):
            found.append(Item("pause", seconds=segment.seconds, name=clean(segment.name, NAME)))
        else:
            before = np.array(found[-1].q) if found and found[-1].q else np.array(start)
            found += _waypoints(segment, robot, motion, k, before)
    if not isinstance(first, Ptp | Dwell):
        found.insert(0, waypoint(robot.clip(q)))
    if len(found) > MOST:
        raise InputError("segments", f"{len(found)} waypoints and pauses", f"at most {MOST} in this page")
    return tuple(found)


def _waypoints(segment: Segment, robot: Robot, motion: Motion, index: int, before: Array) -> list[Item]:
    """The waypoints of one segment: the points of a spline, else one."""
    assert not isinstance(segment, Dwell)
    kind: Kind = "ptp" if isinstance(segment, Ptp) else "lin"
    if isinstance(segment, Circ):
        kind = "circ"
    targets: Sequence[Target] = [segment.target]
    if isinstance(segment, Spline):
        kind, targets = "spline", segment.points
    found = []
    for k, target in enumerate(targets):
        end = motion.derivatives(motion.segments[index].end)[0]
        if isinstance(target, JointTarget):
            end = np.array(target.q)
        elif k < len(targets) - 1 or segment.blend:
            end = _configuration(target, robot, before if k < len(targets) - 1 else end)
        before = end
        found.append(replace(waypoint(robot.clip(end)), kind=kind))
    via = segment.via if isinstance(segment, Circ) else None
    found[-1] = replace(
        found[-1], via=via, speed=max(segment.speed, SLOWEST), acceleration=max(segment.acceleration, SLOWEST),
        blend=segment.blend, tool_speed=segment.tool_speed, tool_turn=segment.tool_turn,
        name=clean(segment.name, NAME),
    )  # fmt: skip
    return found


def _configuration(target: PoseTarget, robot: Robot, seed: Array) -> Array:
    """The configuration closest to `seed` ``(n,)`` with the tool at a pose, as well as the arm can keep it."""
    wanted = target.pose(kin.fk(robot, seed))
    result = kin.solve_ik(robot, wanted, q_seed=seed)
    if result.best is None:
        result = kin.solve_ik(robot, wanted, q_seed=seed, task="position")
    return seed if result.best is None else result.best.q


def _only_what_the_list_holds(program: Program) -> None:
    """Raise `InputError` for the first thing in a program that the list would lose."""
    usual = Program(program.segments)
    for field in ("task", "jerk_limited"):
        if getattr(program, field) != getattr(usual, field):
            raise InputError(field, getattr(program, field), "no other than the usual one in this page")
    for i, segment in enumerate(program.segments):
        if getattr(segment, "orientation", "geodesic") != "geodesic":
            raise InputError(f"segments[{i}].orientation", "two-axis", "geodesic in this page")
        if isinstance(segment, Spline) and isinstance(segment.points[0], JointTarget):
            raise InputError(f"segments[{i}].points", "configurations", "poses in this page")
        if i == 0 and isinstance(segment, Ptp) and (segment.blend or segment.tool_speed or segment.tool_turn):
            expected = "no blend and no limits of the tool at the start of a program in this page"
            raise InputError("segments[0]", kind_of(segment), expected)


__all__ = ["Plan", "configuration", "halfway", "items_of", "plan", "program_of", "segments_of"]
