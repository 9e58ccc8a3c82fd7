"""From a program to a motion: segments that are blended into each other are driven as one path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from kin.fk import fk
from kin.ik import solve_ik
from kin.ik.options import Task
from kin.ik.results import Status
from kin.motion.details import (
    BlendLeftOut,
    BlendShortened,
    Cause,
    Help,
    JerkCost,
    LimitMet,
    NoCircle,
    Note,
    NotReached,
    RefusalDetails,
    StartOutside,
    TargetOutside,
)
from kin.motion.geometry.chain import Chain, LostError, followed
from kin.motion.geometry.curves import Curve, poses
from kin.motion.geometry.splines import turning_points, values
from kin.motion.limits import MotionLimits
from kin.motion.paths import (
    NO_LENGTH,
    JointCurve,
    Layout,
    Run,
    alone,
    chained,
    curve_of,
    is_joint_move,
    joined,
    joint_path,
    joint_radius,
    left_out,
    limited,
    radius_of,
)
from kin.motion.pieces import Hold, Piece
from kin.motion.program import (
    Circ,
    Dwell,
    JointTarget,
    Lin,
    Move,
    Program,
    Ptp,
    Spline,
    Target,
    kind_of,
)
from kin.motion.refusals import helps_at, helps_for, limit_met, lost, slow_places, violations
from kin.motion.results import Motion, Refusal, SegmentTimes
from kin.motion.tasks import most_kept
from kin.motion.timing.timed import timed
from kin.robot import Robot
from kin.solvers.contract import APPROACH, POSE, POSITION
from kin.transforms import Array

CODES: dict[Task, int] = {"pose": POSE, "approach": APPROACH, "position": POSITION}


def task_of(program: Program, robot: Robot) -> Task:
    """What the tool keeps of a pose: by default as much as the joints of the arm can keep."""
    return most_kept(robot) if program.task is None else program.task


_SAME_ZONE = 1e-6  # part of a zone that may be missing without a note


class RefusedError(Exception):
    """Ends the planning of a segment that cannot be driven."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.reason)
        self.refusal = refusal


@dataclass(slots=True, eq=False)
class Plan:
    """A motion being planned: what is known so far, and where the arm is at its end."""

    robot: Robot
    program: Program
    limits: MotionLimits
    q: Array
    stop: Callable[[], None]
    pieces: list[Piece] = field(default_factory=list)
    segments: list[SegmentTimes] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    time: float = 0.0
    done: int = 0  # the index after the last segment that has a path

    @property
    def task(self) -> Task:
        """What the tool keeps of a pose."""
        return task_of(self.program, self.robot)

    def add(self, first: int, piece: Piece | None, ends: Sequence[float]) -> None:
        """A piece that is some segments, the first of them with this index; when each ends, from its start."""
        start = 0.0
        for k, end in enumerate(ends):
            segment = self.program.segments[first + k]
            times = self.time + start, self.time + end
            self.segments.append(SegmentTimes(first + k, kind_of(segment), segment.name, *times))
            start = end
        if piece is not None and piece.duration > 0.0:
            self.pieces.append(piece)
            self.time += piece.duration

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


def planned(
    robot: Robot, program: Program, limits: MotionLimits, q_start: Array, stop: Callable[[], None]
) -> Motion:
    """The motion of a program from a configuration ``(n,)``."""
    _check_targets(robot, program)
    plan = Plan(robot, program, limits, q_start.copy(), stop)
    try:
        outside = violations(robot, q_start)
        if outside:
            raise plan.refused(0, "start", StartOutside(outside), (Help("start"),))
        index = 0
        while index < len(program.segments):
            stop()
            index = _drive(plan, index)
    except RefusedError as error:
        return Motion(robot, program, limits, q_start, error.refusal, ())
    parts = tuple(plan.segments), tuple(plan.notes), tuple(plan.pieces)
    return Motion(robot, program, limits, q_start, None, *parts)


def _check_targets(robot: Robot, program: Program) -> None:
    """Raise `InputError` for a configuration with another number of joints."""
    for i, segment in enumerate(program.segments):
        points = segment.points if isinstance(segment, Spline) else (getattr(segment, "target", None),)
        for k, point in enumerate(points):
            where = f"segments[{i}].points[{k}].q" if isinstance(segment, Spline) else f"segments[{i}].q"
            if isinstance(point, JointTarget):
                robot.check_q(point.q, where)


def _drive(plan: Plan, index: int) -> int:
    """Add the segment with this index to the plan, with those that it is blended into; the index after them."""
    segment = plan.program.segments[index]
    if isinstance(segment, Dwell):
        plan.add(index, Hold(plan.q, segment.seconds), [segment.seconds])
        return index + 1
    run, first = _run(plan, index), index
    index = plan.done
    while run is not None and _joins(plan, index - 1):
        following, blend = _run(plan, index), plan.move(index - 1).blend
        found = None if following is None else joined(plan.robot, run, following, blend)
        if found is None:
            plan.notes.append(BlendLeftOut(index - 1, "small" if following else "short"))
            _time(plan, first, run)
            run, first, index = following, index, plan.done
            continue
        run, used = found
        if used < blend * (1.0 - _SAME_ZONE):
            plan.notes.append(BlendShortened(index - 1, blend, used))
        _check_limits(plan, run, ())
        index = plan.done
    if run is None:
        plan.add(first, None, [0.0])
    else:
        _time(plan, first, run)
    return index


def _run(plan: Plan, first: int) -> Run | None:
    """The segments from this one on that are one path of the joints or of the tool; None if it has no length.

    `plan.done` becomes the index after them, and `plan.q` where they end.
    """
    return _joint_run(plan, first) if is_joint_move(plan.move(first)) else _tool_run(plan, first)


def _joins(plan: Plan, index: int) -> bool:
    """Whether a segment is blended into one of the other kind, of the joints or of the tool."""
    segment, after = plan.program.segments[index], plan.program.segments[index + 1 : index + 2]
    if not isinstance(segment, Move) or segment.blend == 0.0 or not after or not isinstance(after[0], Move):
        return False
    return is_joint_move(after[0]) != is_joint_move(segment)


def _follows(plan: Plan, index: int, length: float) -> bool:
    """Whether a segment is blended into the next one; if not although it was asked for, a note says why."""
    if plan.move(index).blend == 0.0:
        return False
    why: Literal["last", "short", "dwell"] | None = None
    following = plan.program.segments[index + 1 : index + 2]
    if not following:
        why = "last"
    elif isinstance(following[0], Dwell):
        why = "dwell"
    elif length < NO_LENGTH:
        why = "short"
    elif is_joint_move(following[0]) != is_joint_move(plan.move(index)):
        return False
    if why is not None:
        plan.notes.append(BlendLeftOut(index, why))
    return why is None


def _joint_run(plan: Plan, first: int) -> Run | None:
    """PTP and splines of the joints, blended into each other or alone."""
    robot, q = plan.robot, plan.q
    curves: list[JointCurve] = []
    radii: list[float] = []
    index = first
    while True:
        segment = plan.program.segments[index]
        assert isinstance(segment, Ptp | Spline)
        points = segment.points if isinstance(segment, Spline) else (segment.target,)
        rows = [q]
        for point in points:
            rows.append(_configuration(plan, index, point, rows[-1]))
        curve = JointCurve.through(np.array(rows))
        if curves:
            radius = joint_radius(robot, plan.move(index - 1).blend, curves[-1], curve)
            why = left_out(radius, curves[-1].length, curve.length)
            if why:
                plan.notes.append(BlendLeftOut(index - 1, why))
                break
            radii.append(radius)
        curves.append(curve)
        q = rows[-1]
        index += 1
        if not _follows(plan, index - 1, curve.length):
            break
    plan.q, plan.done = q, index
    if curves[0].length < NO_LENGTH:
        return None
    layout = Layout.of([curve.length for curve in curves], radii, first)
    if len(curves) == 1 and isinstance(plan.program.segments[first], Ptp):
        return Run(layout, curves[0].knots, curves[0].pieces)
    run = Run(layout, *joint_path(curves, radii, layout))
    _check_limits(plan, run, ())
    return run


def _tool_run(plan: Plan, first: int) -> Run | None:
    """Lines, arcs and splines of the tool, blended into each other or alone."""
    robot, before = plan.robot, fk(plan.robot, plan.q)
    curves: list[Curve] = []
    radii: list[float] = []
    index = first
    while True:
        segment = plan.program.segments[index]
        assert isinstance(segment, Lin | Circ | Spline)
        curve = curve_of(robot, segment, before, plan.task != "approach")
        if curve is None or isinstance(curve, tuple):
            raise plan.refused(index, "circle", NoCircle(curve))
        if curves:
            blend = plan.move(index - 1).blend
            radius, used = radius_of(blend, curves[-1], curve)
            why = left_out(radius, curves[-1].length, curve.length)
            if why:
                plan.notes.append(BlendLeftOut(index - 1, why))
                break
            radii.append(radius)
            if used < blend * (1.0 - 1e-9):
                plan.notes.append(BlendShortened(index - 1, blend, used))
        curves.append(curve)
        if curve.length >= NO_LENGTH:
            before = poses(curve, np.array([curve.length]))[0]
        index += 1
        if not _follows(plan, index - 1, curve.length):
            break
    plan.done = index
    if curves[0].length < NO_LENGTH:
        return None
    layout = Layout.of([curve.length for curve in curves], radii, first)
    chain = chained(curves, radii, layout)
    try:
        run = Run(layout, *followed(robot, chain, plan.q, CODES[plan.task], plan.stop))
    except LostError as error:
        raise _lost(plan, layout, chain, error) from None
    _check_limits(plan, run, chain)
    plan.q = robot.clip(values(run.knots, run.pieces, run.knots[-1:])[0])
    return run


def _lost(plan: Plan, layout: Layout, chain: Chain, error: LostError) -> RefusedError:
    """The refusal of a path that the joints cannot follow."""
    robot = plan.robot
    met = limit_met(robot, error.q[:-1])
    s = float(error.s[-1])
    if met is not None:
        cause: Cause = "limits"
        details: RefusalDetails = LimitMet(met[1])
        s = float(error.s[met[0]])
    else:
        end = float(layout.bounds[np.searchsorted(layout.bounds[:-1], s, side="left")])
        T, last = chain.poses(np.array([s, end]))
        cause, details = lost(robot, T, last, error.q[-2], plan.task)
    return _refused_at(plan, layout, chain, s, cause, details)


def _check_limits(plan: Plan, run: Run, chain: Chain | tuple[()]) -> None:
    """Refuse a path that leaves the limits of the joints anywhere."""
    at = turning_points(run.knots, run.pieces)
    met = limit_met(plan.robot, values(run.knots, run.pieces, at))
    if met is not None:
        raise _refused_at(plan, run.layout, chain, float(at[met[0]]), "limits", LimitMet(met[1]))


def _refused_at(
    plan: Plan, layout: Layout, chain: Chain | tuple[()], s: float, cause: Cause, details: RefusalDetails
) -> RefusedError:
    """The refusal at a place of a path."""
    k = int(np.clip(np.searchsorted(layout.bounds, s, side="right") - 1, 0, len(layout.bounds) - 2))
    low, high = float(layout.bounds[k]), float(layout.bounds[k + 1])
    fraction = (s - low) / (high - low)
    if isinstance(chain, tuple):
        return plan.refused(layout.owners[0][0] + k, cause, details, (), (fraction, 0.0))
    grid = np.linspace(0.0, s, 65)
    points = chain.poses(grid[grid >= low])[:, :3, 3]
    distance = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    poses = chain.poses(np.linspace(0.0, high, 65))

    def can_follow(q: Array) -> bool:
        try:
            knots, pieces = followed(plan.robot, chain, q, CODES[plan.task], plan.stop)
        except LostError:
            return False
        return limit_met(plan.robot, values(knots, pieces, np.linspace(0.0, float(knots[-1]), 999))) is None

    helps = helps_for(plan.robot, poses, plan.q, plan.task, cause, can_follow)
    return plan.refused(layout.owners[0][0] + k, cause, details, helps, (fraction, distance))


def _time(plan: Plan, first: int, run: Run) -> None:
    """Add a path to the plan, or a PTP that is alone."""
    segment, layout = plan.program.segments[first], run.layout
    if len(layout.owners) == 1 and isinstance(segment, Ptp):
        piece = alone(plan.robot, plan.limits, segment, run)
        plan.add(first, piece, [piece.duration])
        return
    moves = {i: move for i, move in enumerate(plan.program.segments) if isinstance(move, Move)}
    path = limited(plan.robot, plan.limits, moves, layout, run.knots, run.pieces)
    found = timed(path, plan.program.jerk_limited, plan.stop)
    plan.add(first, found, [*found.when(layout.bounds[1:-1]).tolist(), found.duration])
    last = first + len(layout.bounds) - 2
    if plan.program.jerk_limited and found.duration > found.without * (1.0 + 1e-6):
        plan.notes.append(JerkCost(first, last, found.duration, found.without))
    plan.notes.extend(slow_places(plan.robot, layout, path))


def _configuration(plan: Plan, index: int, target: Target, q: Array) -> Array:
    """Where a PTP ends ``(n,)``; `q`: where it begins."""
    robot = plan.robot
    if isinstance(target, JointTarget):
        end = np.array(target.q)
        outside = violations(robot, end)
        if outside:
            raise plan.refused(index, "target", TargetOutside(outside))
        return robot.clip(end)
    T = target.pose(fk(robot, q))
    if plan.program.task is None and plan.task != "pose":
        # An arm of few joints may meet the whole pose nevertheless.
        result = solve_ik(robot, T, q_seed=q, task="pose")
        if result.status is Status.SOLVED:
            return robot.clip(result.solutions[0].q)
    result = solve_ik(robot, T, q_seed=q, task=plan.task)
    if result.status is not Status.SOLVED:
        facts = NotReached(result.details, result.cause, result.task, result.singularities)
        raise plan.refused(index, "unreachable", facts, helps_at(robot, T, q, result))
    return robot.clip(result.solutions[0].q)
