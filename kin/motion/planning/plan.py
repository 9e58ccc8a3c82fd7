"""A motion while it is planned, and what ends the planning."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from kin.differential.task import Task
from kin.motion.arrivals import Arrival
from kin.motion.details import ArrivesOtherwise, Cause, Help, Note, RefusalDetails
from kin.motion.limits import MotionLimits
from kin.motion.pieces import Piece
from kin.motion.program import Gripper, Move, Program, kind_of
from kin.motion.results import InMotion, Motion, Refusal, SegmentTimes
from kin.motion.tasks import most_kept
from kin.robot import Robot
from kin.transforms import Array


def task_of(program: Program, robot: Robot) -> Task:
    """What the tool keeps of a pose: by default as much as the joints of the arm can keep."""
    return most_kept(robot) if program.task is None else program.task


class RefusedError(Exception):
    """Ends the planning of a segment that cannot be driven."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.reason)
        self.refusal = refusal


@dataclass(slots=True, eq=False)
class Plan:
    """A motion being planned: what is known so far, and where the arm is at its end.

    Attributes:
        robot, program, limits, cancel: what is asked for.
        q: where the arm is ``(n,)``.
        start: how it moves at the start, until that is planned; None if it is at rest.
        stops: the segments at whose ends the arm stops although a blend is set.
        pieces, segments, notes: what is planned.
        time: when it ends.
        done: the index after the last segment that has a path.
        blended: the segments that are blended into the next one.
        halves: by segment, when half of its length is covered.
        stopping: by segment, about how long it takes from rest to rest.
    """

    robot: Robot
    program: Program
    limits: MotionLimits
    q: Array
    cancel: Callable[[], None]
    stops: frozenset[int] = frozenset()
    start: InMotion | None = None
    pieces: list[Piece] = field(default_factory=list)
    segments: list[SegmentTimes] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    time: float = 0.0
    done: int = 0
    blended: list[int] = field(default_factory=list)
    halves: dict[int, float] = field(default_factory=dict)
    stopping: dict[int, float] = field(default_factory=dict)

    @property
    def task(self) -> Task:
        """What the tool keeps of a pose."""
        return task_of(self.program, self.robot)

    def branch(self, stops: frozenset[int] = frozenset()) -> Plan:
        """An empty plan that continues this one."""
        return Plan(self.robot, self.program, self.limits, self.q, self.cancel, stops, time=self.time)

    def take(self, other: Plan) -> None:
        """Add what a branch has planned."""
        self.pieces += other.pieces
        self.segments += other.segments
        self.notes += other.notes
        self.q, self.time = other.q, other.time

    def add(self, first: int, piece: Piece | None, ends: Sequence[float], arrivals: Array) -> None:
        """A piece that is some segments, the first of them with this index.

        Args:
            ends, arrivals: when each ends, from the start of the piece, and in which configurations ``(k, n)``.
        """
        start = 0.0
        for k, (end, q) in enumerate(zip(ends, arrivals, strict=True)):
            segment = self.program.segments[first + k]
            times = self.time + start, self.time + end
            arrival = Arrival.of(self.robot, segment, q) if isinstance(segment, Move) else None
            opening = segment.opening if isinstance(segment, Gripper) else None
            self.segments.append(SegmentTimes(first + k, kind_of(segment), segment.name, *times, arrival, opening))
            if arrival is not None and not arrival.as_recorded:
                self.notes.append(ArrivesOtherwise.of(first + k, arrival))
            start = end
        if piece is not None and piece.duration > 0.0:
            self.pieces.append(piece)
            self.time += piece.duration

    def motion(self, q_start: Array, start: InMotion | None = None) -> Motion:
        """What is planned, as a motion that began at a configuration ``(n,)``, and how the arm moved there."""
        parts = tuple(self.segments), tuple(self.notes), tuple(self.pieces)
        return Motion(self.robot, self.program, self.limits, q_start, None, *parts, start=start)

    def move(self, index: int) -> Move:
        """A segment that is not a pause."""
        segment = self.program.segments[index]
        assert isinstance(segment, Move)
        return segment

    def refused(
        self,
        index: int,
        cause: Cause,
        details: RefusalDetails,
        helps: tuple[Help, ...] = (),
        place: tuple[float, float] | None = None,
    ) -> RefusedError:
        """The refusal of a segment; `place`: the part of it that is covered, and how many metres that is."""
        segment = self.program.segments[index]
        fraction, distance = (None, None) if place is None else place
        return RefusedError(
            Refusal(index, kind_of(segment), segment.name, fraction, distance, cause, details, helps)
        )
