"""A program of a page, planned: its motion, where each row is met, and why it cannot be driven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

import kin
from app.viewer.arm import Arm
from app.viewer.tabs.program.program import Point, Segments, configuration, point, start_of, targets
from kin import Obstacle, Robot
from kin.collision.contacts import surroundings
from kin.motion import Circ, JointTarget, Lin, Motion, PoseTarget, Program, Ptp, Spline, start_as_recorded
from kin.motion.arrivals import Arrival
from kin.motion.details import ArrivesOtherwise, Collides
from kin.motion.messages import note
from kin.motion.planning.collisions import checked
from kin.motion.program import Pause, kind_of
from kin.motion.results import Refusal
from kin.transforms import Array
from kin.units import Units, typeset

_LOOKS = 200  # times in a spline at which its distance from a point is looked at
SAME = 1e-6  # rad or m: a locked joint has this value
LOOSE, SAMPLES = 1e-4, 400  # rad or m on the way, and where it is looked at
FINEST, MOST_SAMPLES = 0.01, 1200  # s between two samples of the tool's path; samples at most


@dataclass(frozen=True, eq=False)
class Plan:
    """A program and its motion.

    Attributes:
        segments: the rows, with at least one move.
        motion: it may be refused; of a program that loops it has the way back as well.
        touch: where the motion touches something although it can be driven; None: nowhere, or it is not known.
    """

    segments: Segments
    motion: Motion
    touch: Refusal | None = None

    @property
    def driven(self) -> Motion | None:
        """The motion, or the part of it that can be driven; None if that is nothing."""
        return self.motion.driven

    @property
    def duration(self) -> float:
        """Seconds of what can be driven."""
        return 0.0 if self.driven is None else self.driven.duration

    @cached_property
    def ends(self) -> tuple[float, ...]:
        """When each row is reached, and the way back; of a refused motion those before the place."""
        done = () if self.driven is None else self.driven.segments
        refusal = self.motion.refusal
        return tuple(each.end for each in (done if refusal is None else done[: refusal.segment]))

    def row_at(self, time: float) -> int | None:
        """Index of the row that is driven at a time; None if nothing can be driven."""
        if self.driven is None:
            return None
        return next((i for i, end in enumerate(self.ends) if time <= end), len(self.ends))

    def before(self, index: int) -> int | None:
        """Index of the move before a row; None: there is none."""
        return max(
            (i for i, each in enumerate(self.segments[:index]) if not isinstance(each, Pause)), default=None
        )

    @cached_property
    def q(self) -> tuple[tuple[Array, ...], ...]:
        """The configuration of each target of each row: as recorded, else in which a pose is met, or would be."""
        found, seed = [], self.motion.q_start
        for index, segment in enumerate(self.segments):
            row = []
            for k, target in enumerate(targets(segment)):
                seed = self._configuration(index, k, target, seed)
                row.append(seed)
            found.append(tuple(row))
        return tuple(found)

    @cached_property
    def waypoints(self) -> Array:
        """The configurations ``(k, n)`` of all targets."""
        return np.array([q for row in self.q for q in row])

    @cached_property
    def path(self) -> tuple[Array, Array]:
        """Poses ``(k, 4, 4)`` of the tool along what can be driven, and its speed there."""
        return (np.zeros((0, 4, 4)), np.zeros(0)) if self.driven is None else tool_path(self.driven)

    @property
    def top_speed(self) -> float:
        """The largest of these speeds, m/s."""
        return float(self.path[1].max(initial=0.0))

    def _configuration(self, index: int, k: int, target: JointTarget | PoseTarget, seed: Array) -> Array:
        arrival = self.arrival(index)
        if isinstance(target, PoseTarget) and arrival is not None:
            if k == len(targets(self.segments[index])) - 1:
                return arrival.q
            seed = self.met(index, k)[1]
        return configuration(target, self.motion.robot, seed)

    def arrival(self, index: int) -> Arrival | None:
        """In which configuration the arm arrives at the end of a row; None: it does not, or stands still there."""
        return self.driven.segments[index].arrival if self.driven is not None and index < len(self.ends) else None

    def arrives_otherwise(self, index: int) -> Arrival | None:
        """The arrival, if it is in other joint values than recorded."""
        arrival = self.arrival(index)
        return None if arrival is None or arrival.as_recorded else arrival

    def met(self, index: int, k: int) -> tuple[float | None, Array]:
        """When and in which configuration the arm is at a target; the recorded one if the motion ends before."""
        if self.driven is None or index >= len(self.ends):
            before = [q for row in self.q[:index] for q in row] or [self.motion.q_start]
            return None, (self.q[index] or before[-1:])[min(k, len(self.q[index]) - 1)]
        times, points = self.driven.segments[index], targets(self.segments[index])
        if k >= len(points) - 1:
            arrival = times.arrival
            return times.end, self.driven.derivatives(times.end)[0] if arrival is None else arrival.q
        at = np.linspace(times.start, times.end, _LOOKS)
        off = np.linalg.norm(self.driven.sample(at).T[:, :3, 3] - _place(points[k], self.motion.robot), axis=1)
        # Of a curve that comes there twice, the place that fits the order of the points.
        usual = np.linspace(0.0, 1.0, _LOOKS) - (k + 1) / len(points)
        time = float(at[int(np.argmin(off + 1e-6 * np.abs(usual)))])
        return time, self.driven.derivatives(time)[0]

    def start_as_recorded(self, index: int) -> tuple[int, Array] | None:
        """The move before a row, and the configuration ``(n,)`` from which the row arrives as recorded."""
        before = self.before(index) if index < len(self.segments) else None
        q = None if before is None else start_as_recorded(self.motion, index)
        return None if q is None or before is None else (before, q)

    def can_have_way(self, index: int) -> bool:
        """Whether a way around obstacles can be searched to a row: to one target, from a move before."""
        return (
            index < len(self.segments)
            and len(targets(self.segments[index])) == 1
            and self.before(index) is not None
        )

    def touches(self) -> str:
        """Where the motion touches something, with the number of the row; "" if nowhere is known."""
        if self.touch is None or not isinstance(self.touch.details, Collides):
            return ""
        index, details = self.touch.segment, self.touch.details
        where = "Back to the start"
        if index < len(self.segments):
            where = f"{index + 1} ({kind_of(self.segments[index]).upper()})"
        return f"{where}: {details.contact.text} after {details.time:.2f} s."

    def explain(self, units: Units) -> str:
        """Why the motion is refused, as the page writes it; "" if it is not."""
        return "" if self.motion.refusal is None else typeset(self.motion.refusal.explain(units))

    def notes(self, units: Units) -> str:
        """What is worth knowing of what can be driven, but for arrivals, which are said at their rows."""
        facts = () if self.driven is None else self.driven.notes
        return " ".join(note(fact, units) for fact in facts if not isinstance(fact, ArrivesOtherwise))


@dataclass(frozen=True, eq=False)
class Asked:
    """What is computed for a row: of which plan, and for which arm."""

    index: int
    plan: Plan
    arm: Arm


def plan(
    program: Program,
    robot: Robot,
    loop: bool = False,
    avoid: bool = False,
    obstacles: tuple[Obstacle, ...] = (),
) -> Plan:
    """The motion of a program.

    Args:
        loop: whether it returns to the start.
        avoid: whether a motion that touches something is refused; otherwise `Plan.touch` says where it does.
    """
    motion = kin.plan_motion(
        robot,
        looped(program) if loop else program,
        start(program),
        avoid_self_collision=avoid,
        obstacles=obstacles if avoid else (),
    )
    touch = None
    if not avoid and motion.driven is not None and (obstacles or robot.capsules):
        near = surroundings(robot, obstacles, bool(robot.capsules))
        touch = checked(motion.driven, near, lambda: None).refusal
    return Plan(program.segments, motion, touch)


def tool_path(motion: Motion) -> tuple[Array, Array]:
    """Poses ``(k, 4, 4)`` of the tool along a motion, and its speed there."""
    count = int(min(max(2.0, motion.duration / FINEST), MOST_SAMPLES))
    sample = motion.sample(np.linspace(0.0, motion.duration, count))
    return sample.T, sample.tool_speed


def start(program: Program) -> Array:
    """The configuration ``(n,)`` in which a program of the page starts."""
    index = start_of(program.segments)
    assert index is not None
    first = targets(program.segments[index])[0]
    assert isinstance(first, JointTarget)
    return np.array(first.q)


def looped(program: Program) -> Program:
    """The program with the way back to its start."""
    back = Ptp(JointTarget(tuple(start(program).tolist())), name="back to the start")
    return replace(program, segments=(*program.segments, back))


def _place(target: JointTarget | PoseTarget, robot: Robot) -> Array:
    """The tool point ``(3,)`` at a target."""
    return (
        np.array(target.position) if isinstance(target, PoseTarget) else kin.fk(robot, np.array(target.q))[:3, 3]
    )


# Why a program cannot be driven


@dataclass(frozen=True)
class Fault:
    """Why the program cannot be driven.

    Attributes:
        index: of the row at fault; that of the way back to the start is the number of rows.
        words: sentences.
        ptp: whether a PTP to the same waypoint would help.
        way: points of the tool's way at fault (m); a line is drawn through them.
        place: where on it the arm cannot go on (m); None: at its end, or not known.
        whole: whether nothing can be played, as a locked joint would move; otherwise all before it can be.
        start: whether the row can be met from another posture at its start.
        way_helps: whether something would be touched, and a way around it can be searched.
    """

    index: int
    words: str
    ptp: bool = False
    way: tuple[Point, ...] = ()
    place: Point | None = None
    whole: bool = False
    start: bool = False
    way_helps: bool = False


def find_fault(plan: Plan, locked: Sequence[float | None], units: Units) -> Fault | None:
    """The planner's refusal, or a locked joint that would have to move; None: nothing.

    Args:
        locked: the values at which joints are locked, or None; empty: none is.
    """
    if plan.motion.refusal is not None:
        return _refused(plan, plan.motion.refusal, units)
    held = [(joint, value) for joint, value in enumerate(locked) if value is not None]
    for index, row in enumerate(plan.q):
        for joint, value in held:
            if off := [float(q[joint]) for q in row if abs(q[joint] - value) > SAME]:
                unit = units.of(bool(plan.motion.robot.revolute[joint]))
                words = (
                    f"Joint {joint + 1} is locked at {unit.text(value)}, and this waypoint has it at "
                    f"{unit.text(off[0])}. Unlock the joint, or set the waypoint to another pose."
                )
                return Fault(index, words, whole=True)
    return _moved(plan, held)


def _refused(plan: Plan, refusal: Refusal, units: Units) -> Fault:
    index, words = refusal.segment, plan.explain(units)
    way_helps = refusal.cause == "collision" and plan.can_have_way(index)
    if not _of_tool(plan, index):
        return Fault(index, words, way_helps=way_helps)
    segment, robot = plan.segments[index], plan.motion.robot
    before = plan.before(index)
    way = [] if before is None else [kin.fk(robot, plan.q[before][-1])[:3, 3]]
    way += [np.array(segment.via)] if isinstance(segment, Circ) else []
    way += [_place(each, robot) for each in targets(segment)]
    place = None
    if refusal.fraction is not None and isinstance(segment, Lin) and len(way) == 2:
        place = point(way[0] + refusal.fraction * (way[1] - way[0]))
    ptp = any(each.code == "ptp" for each in refusal.helps)
    starts = plan.start_as_recorded(index) is not None
    return Fault(index, words, ptp, tuple(map(point, way)), place, start=starts, way_helps=way_helps)


def _of_tool(plan: Plan, index: int) -> bool:
    """Whether a row leads the tool along a curve."""
    return index < len(plan.segments) and isinstance(plan.segments[index], Lin | Circ | Spline)


def _moved(plan: Plan, held: Sequence[tuple[int, float]]) -> Fault | None:
    """A path on which a joint that is held at a value would move between two waypoints."""
    times = np.linspace(0.0, plan.duration, SAMPLES if held else 0)
    q = plan.motion.derivatives(times)[0]
    for joint, value in held:
        off = np.flatnonzero(np.abs(q[:, joint] - value) > LOOSE)
        if off.size:
            index = plan.row_at(float(times[off[0]])) or 0
            words = f"Joint {joint + 1} is locked, and would move on the way. Unlock the joint, or choose PTP."
            return Fault(index, words, _of_tool(plan, index), whole=True)
    return None
