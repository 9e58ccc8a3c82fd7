"""Motion result types."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import repeat
from operator import itemgetter
from os import PathLike
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError
from kin.explained import Explained
from kin.fk import fk, jacobian
from kin.motion import messages, tables
from kin.motion.arrivals import Arrival
from kin.motion.details import Braked, Cause, Help, Note, RefusalDetails
from kin.motion.limits import MotionLimits
from kin.motion.pieces import Piece
from kin.motion.program import Kind, Pause, Program
from kin.robot import Robot
from kin.transforms import Array, finite_array
from kin.units import DEFAULT_UNITS, Units

Quantity = Literal["velocity", "acceleration", "jerk", "tool_speed", "tool_turn"]
_JOINT: tuple[Quantity, ...] = ("velocity", "acceleration", "jerk")
_TOOL: tuple[Quantity, ...] = ("tool_speed", "tool_turn")
_ROUNDING = 1e-13  # of the time at which a segment ends: a shorter overlap with a piece is none
_CLOSER, _FINE = 3, 33  # how often the tool's peak is looked at, and at how many points each time but the first


def _times(t: ArrayLike) -> Array:
    """Times as a finite array of any shape."""
    times = finite_array("t", np.asarray(t)[..., None], (1,))
    return times.reshape(times.shape[:-1])


@dataclass(frozen=True, slots=True)
class SegmentTimes:
    """When a segment is driven, in seconds from the start; blends are shared half and half.

    Attributes:
        arrival: in which configuration it meets its target; None where the arm stands still.
        opening: how far the gripper is open at its end, 0 (closed) to 1 (open); None if it does not move it.
    """

    index: int
    kind: Kind
    name: str
    start: float
    end: float
    arrival: Arrival | None = None
    opening: float | None = None


@dataclass(frozen=True, slots=True)
class Peak:
    """The largest value of a quantity.

    Attributes:
        joint, name: whose; None and ``"tool"`` for the tool.
        quantity: of what. `tool_speed` is that of the tool point (m/s), `tool_turn` the angular velocity (rad/s).
        peak, time: the largest size, and when it is met.
        limit: None if there is none.
        assumed: whether the limit is assumed, see `kin.motion.MotionLimits`.
    """

    joint: int | None
    name: str
    quantity: Quantity
    peak: float
    time: float
    limit: float | None
    assumed: bool = False

    @property
    def ratio(self) -> float | None:
        """Peak / limit."""
        return None if self.limit is None else self.peak / self.limit


@dataclass(frozen=True, slots=True)
class Refusal(Explained):
    """Why a program cannot be driven.

    Attributes:
        segment, kind, name: which segment.
        fraction: how much of it is covered, 0 to 1; None if it is not a matter of a place.
        distance: the same in metres of the tool's path; None likewise.
        cause, details: code and numbers, see :mod:`kin.motion.details`.
        helps: what would help.
    """

    segment: int
    kind: Kind
    name: str
    fraction: float | None
    distance: float | None
    cause: Cause
    details: RefusalDetails
    helps: tuple[Help, ...] = ()

    def explain(self, units: Units = DEFAULT_UNITS) -> str:
        """The refusal in sentences, in any units.

        Args:
            units: in which numbers are written, a `kin.units.Units`; by default degrees and millimetres.

        Returns:
            The sentences; `reason` is the same in the default units.

        Examples:
            >>> import kin
            >>> far = kin.plan_motion("ur5", [kin.motion.Lin(kin.motion.PoseTarget((3.0, 0.0, 0.0)))])
            >>> far.refusal.explain() == far.refusal.reason
            True
        """
        return messages.refusal(self.segment, self.kind, self.name, self.fraction, self.details, self.helps, units)


@dataclass(frozen=True, slots=True, eq=False)
class MotionSample:
    """A motion at times ``(...)``: arrays with the same leading axes.

    Attributes:
        t: seconds, ``(...)``.
        q, qd, qdd, qddd: joint values and their derivatives ``(..., n)``.
        T: tool poses ``(..., 4, 4)``.
        twist: velocity of the tool point and angular velocity ``(..., 6)``, both in the world frame.
    """

    t: Array
    q: Array
    qd: Array
    qdd: Array
    qddd: Array
    T: Array
    twist: Array

    @property
    def tool_speed(self) -> Array:
        """Speed of the tool point ``(...)``, m/s."""
        return np.asarray(np.linalg.norm(self.twist[..., :3], axis=-1))

    @property
    def tool_turn(self) -> Array:
        """Angular velocity of the tool ``(...)``, rad/s."""
        return np.asarray(np.linalg.norm(self.twist[..., 3:], axis=-1))


@dataclass(frozen=True, slots=True, eq=False)
class InMotion:
    """How the joints move at the start: `qd` and `qdd` ``(n,)``, radians (metres) per second and per s²."""

    qd: Array
    qdd: Array


@dataclass(frozen=True, eq=False, repr=False)
class Motion(Explained):
    """The answer to a program: a motion, or why there is none.

    Attributes:
        robot, program, limits: what was asked for, and the limits that were kept.
        q_start: ``(n,)``, where it begins.
        refusal: why it cannot be driven; None if it can.
        segments: when each segment is driven; empty after a refusal, as is the motion.
        part: after a refusal the motion of a shorter program: what can be driven, at rest just before the place
            where it cannot go on. None if that is nothing, or nothing was refused.
        notes: what is worth knowing, see :mod:`kin.motion.details`.
        pieces: the joints as functions of time, one after the other.
        start: how the joints move at the start; None at rest.
    """

    robot: Robot
    program: Program
    limits: MotionLimits
    q_start: Array
    refusal: Refusal | None
    segments: tuple[SegmentTimes, ...]
    notes: tuple[Note, ...] = ()
    pieces: tuple[Piece, ...] = field(default=())
    part: Motion | None = None
    start: InMotion | None = None

    @property
    def planned(self) -> bool:
        """Whether it can be driven."""
        return self.refusal is None

    @property
    def driven(self) -> Motion | None:
        """The motion itself, or after a refusal the part of it that can be driven; None if that is nothing."""
        return self if self.planned else self.part

    @cached_property
    def starts(self) -> Array:
        """When each piece begins, and the end ``(k + 1,)``."""
        return np.concatenate([[0.0], np.cumsum([piece.duration for piece in self.pieces])])

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.starts[-1])

    def explain(self, units: Units = DEFAULT_UNITS) -> str:
        """The motion in sentences, in any units.

        Args:
            units: in which numbers are written, a `kin.units.Units`; by default degrees and millimetres.

        Returns:
            The sentences; `reason` is the same in the default units.

        Examples:
            >>> import kin
            >>> kin.plan_motion("planar2r", [kin.motion.Ptp([0.5, 0.5]), kin.motion.Dwell(1.0)]).explain()
            '1 motion and 1 pause in 1.529 s.'
        """
        if self.refusal is not None:
            return self.refusal.explain(units)
        said = [messages.note(fact, units) for fact in self.notes]
        kinds = [each.kind for each in self.segments]
        pauses, grips = kinds.count("dwell"), kinds.count("gripper")
        moved = [each for each in self.segments if each.kind not in ("dwell", "gripper")]
        motions = sum(each.end > each.start for each in moved)
        return " ".join([messages.summary(motions, pauses, grips, self.duration), *said])

    def q_before(self, index: int) -> Array | None:
        """Where a segment begins.

        Args:
            index: which segment, from 0.

        Returns:
            Joint values ``(n,)`` in radians (metres) at which the segment before arrives; None if that one is not
            planned.

        Examples:
            >>> import kin
            >>> motion = kin.plan_motion("planar2r", [kin.motion.Ptp([0.5, 0.5]), kin.motion.Ptp([0.0, 1.0])])
            >>> motion.q_before(1)
            array([0.5, 0.5])
        """
        done = () if self.driven is None else self.driven.segments
        if index > len(done):
            return None
        arrivals = [each.arrival for each in done[:index] if each.arrival is not None]
        if arrivals:
            return arrivals[-1].q
        driven = self.driven
        braked = driven is not None and any(isinstance(note, Braked) for note in driven.notes)
        if driven is None or not braked:
            return self.q_start
        return np.asarray(driven.pieces[0].at(np.array([driven.pieces[0].duration]))[0, 0])

    def derivatives(self, t: ArrayLike) -> Array:
        """Joint values and their first three derivatives, without the poses that `sample` computes.

        Before the start and after the end the arm is at rest where it begins and ends.

        Args:
            t: seconds from the start, a number or an array ``(...)``.

        Returns:
            ``(4, ..., n)``: radians (metres), and the same per second, per s² and per s³.

        Raises:
            InputError: times that are no finite numbers.

        Examples:
            >>> import kin
            >>> motion = kin.plan_motion("planar2r", [kin.motion.Ptp([0.5, 0.5])])
            >>> q, qd, qdd, qddd = motion.derivatives([0.0, 0.5, motion.duration])
            >>> q[-1]
            array([0.5, 0.5])
        """
        times = _times(t)
        flat = times.ravel()
        out = np.zeros((4, flat.size, self.robot.n))
        out[0] = self.q_start
        which = np.clip(np.searchsorted(self.starts, flat, side="right") - 1, 0, max(len(self.pieces) - 1, 0))
        for k in np.unique(which).tolist() if self.pieces else []:
            rows = which == k
            piece = self.pieces[k]
            local = flat[rows] - self.starts[k]
            out[:, rows] = piece.at(np.clip(local, 0.0, piece.duration))
            if k in (0, len(self.pieces) - 1):
                out[1:, np.flatnonzero(rows)[(local < 0.0) | (local > piece.duration)]] = 0.0
        return out.reshape(4, *times.shape, self.robot.n)

    def opening(self, t: ArrayLike, before: float = math.nan) -> Array:
        """How far the gripper is open over time.

        It moves steadily during each of its segments, and stays as it is until the next one.

        Args:
            t: seconds from the start, a number or an array ``(...)``.
            before: how far it is open at the start, from 0 (closed) to 1 (open); NaN: that is not known.

        Returns:
            ``(...)`` from 0 to 1. If `before` is not known, NaN until the first segment of the gripper begins; all
            of that one has the opening that it asks for.

        Raises:
            InputError: times that are no finite numbers.

        Examples:
            >>> import kin
            >>> motion = kin.plan_motion("planar2r", [kin.motion.Gripper(0.2, 1.0), kin.motion.Gripper(1.0, 1.0)])
            >>> motion.opening([0.5, 1.5, 2.0])
            array([0.2, 0.6, 1. ])
        """
        times = _times(t)
        out = np.full(times.shape, before)
        for each in self.segments:
            if each.opening is not None:
                first = each.opening if math.isnan(before) else before
                seconds = each.end - each.start
                part = np.clip((times - each.start) / seconds, 0.0, 1.0) if seconds else np.ones(times.shape)
                moving = (1.0 - part) * first + part * each.opening  # exact at both ends
                out, before = np.where(times >= each.start, moving, out), each.opening
        return np.asarray(out)

    def sample(self, t: ArrayLike) -> MotionSample:
        """Joints, tool poses and tool speeds; before the start and after the end the arm is at rest.

        Args:
            t: seconds from the start, a number or an array ``(...)``.

        Returns:
            Arrays with the axes of `t` first.

        Raises:
            InputError: times that are no finite numbers.

        Examples:
            >>> import kin
            >>> import numpy as np
            >>> motion = kin.plan_motion("planar2r", [kin.motion.Ptp([0.5, 0.5])])
            >>> motion.sample(np.linspace(0.0, motion.duration, 50)).T.shape
            (50, 4, 4)
        """
        times = _times(t)
        q, qd, qdd, qddd = self.derivatives(times)
        twist = (jacobian(self.robot, q) @ qd[..., None])[..., 0]
        return MotionSample(times, q, qd, qdd, qddd, fk(self.robot, q), twist)

    def step_times(self, rate: float) -> Array:
        """The times of samples at a rate, from the start to the end, which is one of them.

        Args:
            rate: samples per second.

        Returns:
            Seconds ``(k,)``; empty after a refusal.

        Raises:
            InputError: a rate that is not above 0.

        Examples:
            >>> import kin
            >>> kin.plan_motion("planar2r", [kin.motion.Dwell(0.25)]).step_times(10.0)
            array([0.  , 0.1 , 0.2 , 0.25])
        """
        times = tables.step_times(self.duration, rate)
        return times if self.planned else times[:0]

    def steps(self, rate: float) -> Iterator[MotionSample]:
        """The motion at `step_times`, piece by piece, so that a long one need not fit into memory.

        Args:
            rate: samples per second.

        Returns:
            An iterator of samples, each at some of the times.

        Raises:
            InputError: a rate that is not above 0.

        Examples:
            >>> import kin
            >>> motion = kin.plan_motion("planar2r", [kin.motion.Ptp([0.5, 0.5])])
            >>> sum(len(some.t) for some in motion.steps(1000.0)) == len(motion.step_times(1000.0))
            True
        """
        times = self.step_times(rate)
        for start in range(0, len(times), tables.AT_ONCE):
            yield self.sample(times[start : start + tables.AT_ONCE])

    def csv_pieces(self, rate: float = 100.0) -> Iterator[str]:
        """What `to_csv` writes, as pieces of text.

        Args:
            rate: samples per second.

        Returns:
            An iterator of texts; the first one is the heading.

        Raises:
            InputError: a rate that is not above 0.

        Examples:
            >>> import kin
            >>> next(kin.plan_motion("planar2r", [kin.motion.Ptp([0.5, 0.5])]).csv_pieces())[:8]
            't,q1,q2,'
        """
        grips = any(each.opening is not None for each in self.segments)
        yield ",".join(tables.columns(self.robot.n, grips)) + "\n"
        for sample in self.steps(rate):
            last = [sample.tool_speed, self.opening(sample.t)] if grips else [sample.tool_speed]
            yield tables.lines(sample.t, (sample.q, sample.qd, sample.qdd), sample.T, last)

    def to_csv(self, file: str | PathLike[str], rate: float = 100.0) -> None:
        """Write a table of samples: time, joint values, speeds, accelerations, pose and speed of the tool.

        Of a program that moves the gripper, the last column, `gripper`, says how far it is open; it is empty
        before the first segment that does.

        Args:
            file: path of the file; one that exists is replaced.
            rate: samples per second.

        Raises:
            InputError: a refused program, of which `driven` is what can be driven, or a rate that is not above 0.
            OSError: the file cannot be written.

        Examples:
            >>> import kin, pathlib, tempfile
            >>> file = pathlib.Path(tempfile.mkdtemp()) / "motion.csv"
            >>> kin.plan_motion("planar2r", [kin.motion.Ptp([0.5, 0.5])]).to_csv(file, rate=50.0)
            >>> file.read_text().splitlines()[0]
            't,q1,q2,qd1,qd2,qdd1,qdd2,x,y,z,qw,qx,qy,qz,tool_speed'
        """
        if not self.planned:
            raise InputError(
                "motion", self.reason, "a program that can be driven; motion.driven is its part that can"
            )
        tables.step_times(self.duration, rate)
        with Path(file).open("w", encoding="utf-8", newline="") as written:
            written.writelines(self.csv_pieces(rate))

    @cached_property
    def peaks(self) -> tuple[Peak, ...]:
        """The largest velocity, acceleration and jerk of each joint, and those of the tool.

        They are read off the motion itself by fine sampling, without what the planner knows; about its largest
        value the tool is sampled more finely.
        """
        return self._peaks(0.0, self.duration, 1.0, 1.0, (None, None))

    def segment_peaks(self, index: int) -> tuple[Peak, ...]:
        """`peaks` during one segment, against its own limits: those of the arm times its scales.

        Args:
            index: which segment, from 0.

        Returns:
            Velocity, acceleration and jerk of each joint, and the speeds of the tool.

        Raises:
            IndexError: a refused program, which has no segments, or an index beyond the last one.

        Examples:
            >>> import kin
            >>> motion = kin.plan_motion("planar2r", [kin.motion.Ptp([0.5, 0.5], speed=0.25)])
            >>> max(peak.ratio for peak in motion.segment_peaks(0) if peak.ratio) <= 1.0 + 1e-9
            True
        """
        times, segment = self.segments[index], self.program.segments[index]
        if isinstance(segment, Pause):
            return self._peaks(times.start, times.end, 1.0, 1.0, (None, None))
        tool = (segment.tool_speed, segment.tool_turn)
        return self._peaks(times.start, times.end, segment.speed, segment.acceleration, tool)

    def _peaks(
        self, start: float, end: float, speed: float, acceleration: float, tool: tuple[float | None, float | None]
    ) -> tuple[Peak, ...]:
        parts = [
            each for each in map(_Part.of, self.pieces, self.starts.tolist(), repeat(start), repeat(end)) if each
        ]
        times = np.concatenate([[start], *(part.first + part.times for part in parts)])
        rest = np.zeros((3, 1, self.robot.n))
        rows = np.concatenate([rest, *(part.values[1:] for part in parts)], axis=1)
        found = []
        scales = (speed, acceleration, acceleration)
        for quantity, values, scale in zip(_JOINT, rows, scales, strict=True):
            sizes = np.abs(values)
            limit = getattr(self.limits, quantity) * scale
            for i, at in enumerate(np.argmax(sizes, axis=0).tolist()):
                name, assumed = self.robot.joints[i].name, quantity in self.limits.assumed[i]
                size, when = float(sizes[at, i]), float(times[at])
                found.append(Peak(i, name, quantity, size, when, float(limit[i]), assumed))
        for k, quantity in enumerate(_TOOL):
            peaks = [part.tool_peak(self.robot, slice(3 * k, 3 * k + 3)) for part in parts]
            size, when = max(peaks, default=(0.0, start), key=itemgetter(0))
            found.append(Peak(None, "tool", quantity, size, when, tool[k]))
        return tuple(found)


class _Part(NamedTuple):
    """The part of a piece that lies between two times of the motion.

    Attributes:
        piece, first: the piece, and when it begins.
        times, values: when it is looked at, from its beginning, and the joints then ``(4, k, n)``.
    """

    piece: Piece
    first: float
    times: Array
    values: Array

    @classmethod
    def of(cls, piece: Piece, first: float, start: float, end: float) -> _Part | None:
        """The part between two times of the motion; None if there is none."""
        low, high = max(start - first, 0.0), min(end - first, piece.duration)
        if high - low <= _ROUNDING * end:
            return None
        grid = piece.grid()
        times = np.concatenate([[low], grid[(grid > low) & (grid < high)], [high]])
        return cls(piece, first, times, piece.at(times))

    def tool_peak(self, robot: Robot, rows: slice) -> tuple[float, float]:
        """The largest size of these rows of the tool's twist, and when. About it, times are closer."""
        times, values = self.times, self.values
        for _ in range(_CLOSER):
            sizes = np.linalg.norm((jacobian(robot, values[0]) @ values[1][..., None])[:, rows, 0], axis=1)
            k = int(np.argmax(sizes))
            size, when = float(sizes[k]), float(times[k])
            times = np.linspace(times[max(k - 1, 0)], times[min(k + 1, len(times) - 1)], _FINE)
            values = self.piece.at(times)
        return size, self.first + when
