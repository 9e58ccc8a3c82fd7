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
from kin.motion import Circ, Dwell, JointTarget, Lin, Motion, PoseTarget, Program, Ptp, Spline, start_as_recorded
from kin.motion.arrivals import Arrival
from kin.motion.details import ArrivesOtherwise, Braked, Collides, JerkCost, Note
from kin.motion.messages import note
from kin.motion.planning.collisions import checked
from kin.motion.program import Segment, Target, kind_of
from kin.motion.results import Refusal, SegmentTimes
from kin.transforms import Array
from kin.units import Units, typeset

_MET = 1e-6  # m
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
    def driven(self) -> Motion | None:
        """The motion, or the part of it that can be driven; None if that is nothing."""
        return self.motion.driven

    @cached_property
    def otherwise(self) -> dict[int, Arrival]:
        """By item, the arrivals in other joint values than recorded."""
        found = {}
        for index, (item, end) in enumerate(zip(self.items, self.ends, strict=False)):
            arrival = self._arrival(index, item, end) if item.q else None
            if arrival is not None and not arrival.as_recorded:
                found[index] = arrival
        return found

    def _arrival(self, index: int, item: Item, end: float) -> Arrival | None:
        assert self.driven is not None  # there are ends
        arrival = self.driven.segments[self.segments[index]].arrival
        if arrival is None or item.kind != "spline":
            return arrival
        if passed_through(self.items, index):
            near = self.driven.derivatives(end)[0]
            pose = PoseTarget.of(kin.fk(self.motion.robot, np.array(item.q)))
            return Arrival(self.motion.robot, _configuration(pose, self.motion.robot, near), np.array(item.q))
        return replace(arrival, recorded=np.array(item.q))

    def start_as_recorded(self, index: int) -> tuple[int, Array] | None:
        """The waypoint before an item, and the configuration ``(n,)`` from which the item is met as recorded."""
        if index not in self._starts:
            before = max((i for i, item in enumerate(self.items[:index]) if item.q), default=None)
            known = before is not None and index < len(self.items)
            q = start_as_recorded(self.motion, self.segments[index]) if known else None
            self._starts[index] = None if q is None or before is None else (before, q)
        return self._starts[index]

    @cached_property
    def _starts(self) -> dict[int, tuple[int, Array] | None]:
        """What `start_as_recorded` has found."""
        return {}

    def item_of(self, segment: int) -> int:
        """Index of the item at which a segment ends; that of the way back is the number of items."""
        return max((i for i, each in enumerate(self.segments) if each == segment), default=len(self.items))

    @property
    def touched_on_way_to(self) -> int | None:
        """Index of the item on the way to which something is touched; None: nowhere, at the start, or way back."""
        if self.touch is None:
            return None
        index = self.item_of(self.touch.segment)
        return index if index < len(self.items) and self.items[index] is not start_of(self.items) else None

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
        """When each item is reached, and the way back; of a refused motion those before the place."""
        driven = self.driven
        if driven is None:
            return ()
        count = len(driven.segments) if self.motion.refusal is None else self.motion.refusal.segment
        times = driven.segments[:count]
        inner = [passed_through(self.items, i) for i in range(len(self.items))]
        found = [
            times[s].end if not inner[i] else self._passed(i, times[s])
            for i, s in enumerate(self.segments)
            if s < len(times)
        ]
        return (*found, driven.duration) if self.motion.planned else tuple(found)

    def _passed(self, index: int, times: SegmentTimes) -> float:
        """When the tool is closest to an inner point of a spline."""
        assert self.driven is not None  # it has these times
        at = np.linspace(times.start, times.end, _LOOKS)
        wanted = kin.fk(self.motion.robot, np.array(self.items[index].q))[:3, 3]
        first = self.segments.index(self.segments[index])
        count = self.segments.count(self.segments[index])
        off = np.linalg.norm(self.driven.sample(at).T[:, :3, 3] - wanted, axis=1)
        # Of a curve that comes there twice, the place that fits the order of the points.
        usual = np.linspace(0.0, 1.0, _LOOKS) - (index - first + 1) / count
        return float(at[int(np.argmin(off + 1e-6 * np.abs(usual)))])

    def item_at(self, time: float) -> int | None:
        """Index of the item that is driven to at a time; None if nothing can be driven."""
        if self.driven is None:
            return None
        return next((i for i, end in enumerate(self.ends) if time <= end), len(self.ends))

    def explain(self, units: Units) -> str:
        """Why the motion is refused, with the numbers of the list, as the page writes them; "" if it is not."""
        refusal = self.motion.refusal
        if refusal is None:
            return ""
        return typeset(replace(refusal, segment=self.item_of(refusal.segment)).explain(units))

    def notes(self, units: Units) -> str:
        """What is worth knowing of what can be driven, with the numbers of the list.

        Arrivals in other joint values are left out: the list says them at their waypoints.
        """
        facts = () if self.driven is None else self.driven.notes
        said = [note(self._numbered(fact), units) for fact in facts if not isinstance(fact, ArrivesOtherwise)]
        return " ".join(said)

    def _numbered(self, note: Note) -> Note:
        if isinstance(note, Braked):
            return note
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
    if not avoid and motion.driven is not None and (obstacles or robot.capsules):
        near = surroundings(robot, obstacles, bool(robot.capsules))
        touch = checked(motion.driven, near, lambda: None).refusal
    return Plan(items, motion, segments_of(items), touch)


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
            return Lin(JointTarget(item.q), **options)
        case "circ":
            assert item.via is not None
            return Circ(item.via, JointTarget(item.q), **options)
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
    """The list for a program from a file. It starts at q ``(n,)``.

    Raises:
        InputError: a pose that the arm cannot reach, or something that the list cannot hold.
    """
    _only_what_the_list_holds(program)
    _check_count(sum(len(each.points) if isinstance(each, Spline) else 1 for each in program.segments))
    first = program.segments[0]
    start = first.target.q if isinstance(first, Ptp) and isinstance(first.target, JointTarget) else q
    motion = kin.plan_motion(robot, program, start)
    found: list[Item] = []
    for k, segment in enumerate(program.segments):
        if isinstance(segment, Dwell):
            found.append(Item("pause", seconds=segment.seconds, name=clean(segment.name, NAME)))
        else:
            before = np.array(found[-1].q) if found and found[-1].q else np.array(start)
            found += _waypoints(segment, robot, motion, k, before)
    if not isinstance(first, Ptp | Dwell):
        found.insert(0, waypoint(robot.clip(q)))
    _check_count(len(found))
    return tuple(found)


def _check_count(count: int) -> None:
    if count > MOST:
        raise InputError("segments", f"{count} waypoints and pauses", f"at most {MOST} in this page")


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
    done = () if motion.driven is None else motion.driven.segments
    refused = len(done) if motion.refusal is None else motion.refusal.segment
    arrival = done[index].arrival if index < min(len(done), refused) else None
    for k, target in enumerate(targets):
        if isinstance(target, JointTarget):
            before = np.array(target.q)
        elif k == len(targets) - 1 and arrival is not None:
            before = arrival.q
        else:
            before = _reached(target, robot, before, f"segments[{index}]")
        found.append(replace(waypoint(robot.clip(before)), kind=kind))
    via = segment.via if isinstance(segment, Circ) else None
    found[-1] = replace(
        found[-1],
        via=via,
        speed=max(segment.speed, SLOWEST),
        acceleration=max(segment.acceleration, SLOWEST),
        blend=segment.blend,
        tool_speed=segment.tool_speed,
        tool_turn=segment.tool_turn,
        name=clean(segment.name, NAME),
    )
    return found


def _reached(target: PoseTarget, robot: Robot, seed: Array, where: str) -> Array:
    """As `_configuration`; raises `InputError` for a point out of reach."""
    q = _configuration(target, robot, seed)
    off = float(np.linalg.norm(kin.fk(robot, q)[:3, 3] - target.position))
    if off > _MET:
        raise InputError(
            where, list(target.position), f"a point that the arm can reach; the nearest is {off:.3f} m away"
        )
    return q


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
