"""The programs of a page: `kin.motion.Program`, changed row by row, and their form in a link. Pure.

A row is a segment. The first move is a PTP to joint values, where the program starts. A spline is one row; its
points are poses, as it is a curve of the tool, unless a file has configurations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

import kin
from app.viewer.own_arm import clean
from kin import InputError, Robot
from kin.ik.messages.values import listed
from kin.motion import (
    Circ,
    Dwell,
    Gripper,
    JointTarget,
    Lin,
    PoseTarget,
    Program,
    Ptp,
    Spline,
    program_from_dict,
    program_to_dict,
)
from kin.motion.program import Kind, Move, Pause, Segment, Target, field_names
from kin.transforms import Array

Segments = tuple[Segment, ...]
Point = tuple[float, float, float]
MOST = 40  # waypoints, points of splines and other rows; a link holds some 8000 bytes of all programs
NAME = 40  # characters
DIGITS = 7  # of a recorded joint value
PAUSE = 1.0  # s, of a new pause
LARGEST = 30_000  # bytes of a file: it comes in one message of the page
_MET = 1e-6  # m


def recorded(q: Array, digits: int = DIGITS) -> JointTarget:
    """Joint values ``(n,)`` as a target, rounded as in a link."""
    return JointTarget(tuple(round(value, digits) + 0.0 for value in q.tolist()))


def point(values: Array) -> Point:
    """A point ``(3,)`` (m) rounded as in a link."""
    x, y, z = (round(value, DIGITS) + 0.0 for value in values.tolist())
    return x, y, z


def posed(q: Array, robot: Robot) -> PoseTarget:
    """The pose of the tool at q ``(n,)`` as a target, its position rounded as in a link."""
    found = PoseTarget.of(kin.fk(robot, q))
    return replace(found, position=point(np.array(found.position)))


def targets(segment: Segment) -> tuple[Target, ...]:
    """The points of a spline, or the one target; none where the arm stands still."""
    if isinstance(segment, Pause):
        return ()
    return segment.points if isinstance(segment, Spline) else (segment.target,)


def places(segments: Segments) -> int:
    """How many waypoints, points of splines and other rows there are."""
    return sum(max(1, len(targets(each))) for each in segments)


def counted(segments: Segments) -> str:
    """The same as a sentence."""
    still = [type(each) for each in segments if isinstance(each, Pause)]
    counts = (
        (places(segments) - len(still), "waypoint"),
        (still.count(Dwell), "pause"),
        (still.count(Gripper), "gripper row"),
    )
    return listed([f"{count} {what}{'s' * (count != 1)}" for count, what in counts if count]) + "."


def start_of(segments: Segments) -> int | None:
    """Index of the first move; None: there is none."""
    return next((i for i, each in enumerate(segments) if not isinstance(each, Pause)), None)


def fits(segments: Segments, robot: Robot) -> bool:
    """Whether all configurations are of this arm."""
    q = [each for row in segments for each in targets(row) if isinstance(each, JointTarget)]
    return all(len(each.q) == robot.n for each in q)


# Changes


def replaced(segments: Segments, index: int, *rows: Segment) -> Segments:
    """The rows with these in the place of one."""
    return (*segments[:index], *rows, *segments[index + 1 :])


def moved(segments: Segments, index: int, to: int) -> Segments:
    """The rows with one of them elsewhere."""
    rest = replaced(segments, index)
    return (*rest[:to], segments[index], *rest[to:])


def begun(segments: Segments, robot: Robot, q: Array) -> Segments:
    """The rows with a PTP to joint values as the first move; none if there are pauses alone.

    `q`: configuration ``(n,)`` near which the first move ends, if it is to a pose.
    """
    index = start_of(segments)
    if index is None:
        return ()
    move = segments[index]
    first, *rest = targets(move)
    if isinstance(move, Ptp) and isinstance(first, JointTarget):
        return segments
    at = first if isinstance(first, JointTarget) else recorded(configuration(first, robot, q))
    return replaced(segments, index, Ptp(at, **options(move)), *([Spline(rest, **options(move))] if rest else []))


def with_target(segment: Segment, index: int, q: JointTarget, robot: Robot) -> Segment:
    """A move to another configuration, or a spline with another point at `index`; what stands still as it is."""
    if isinstance(segment, Pause):
        return segment
    if not isinstance(segment, Spline):
        return replace(segment, target=q)
    points = list(segment.points)
    points[index] = as_point(segment, q, robot)
    return replace(segment, points=tuple(points))


def as_point(spline: Spline, q: JointTarget, robot: Robot) -> Target:
    """A configuration as a point of this spline."""
    return q if isinstance(spline.points[0], JointTarget) else posed(np.array(q.q), robot)


def as_kind(
    segments: Segments, index: int, kind: Kind, q: Sequence[Array], before: Array, robot: Robot
) -> tuple[Segments, int]:
    """The rows with one of another kind, and where it is then.

    A spline becomes a row for each of its points; what becomes a spline beside a spline joins it.

    Args:
        q: configurations ``(n,)`` of its targets.
        before: configuration ``(n,)`` at its start.
    """
    row = segments[index]
    if kind == "spline":
        points: list[Target] = [posed(each, robot) for each in q]
        first, last = index, index
        if index > 0 and _of_poses(segments[index - 1]):
            points, first = [*targets(segments[index - 1]), *points], index - 1
        if index + 1 < len(segments) and _of_poses(segments[index + 1]):
            points, last = [*points, *targets(segments[index + 1])], index + 1
        return (*segments[:first], Spline(points, **options(segments[last])), *segments[last + 1 :]), first
    rows: list[Segment] = []
    for k, each in enumerate(q):
        shared = options(row) | ({} if k == len(q) - 1 else {"name": "", "blend": 0.0})
        target = recorded(each) if isinstance(row, Spline) else targets(row)[0]
        if kind == "circ":
            rows.append(Circ(point(kin.fk(robot, 0.5 * (before + each))[:3, 3]), target, **shared))
        else:
            rows.append((Lin if kind == "lin" else Ptp)(target, **shared))
        before = each
    return replaced(segments, index, *rows), index + len(rows) - 1


def _of_poses(segment: Segment) -> bool:
    return isinstance(segment, Spline) and isinstance(segment.points[0], PoseTarget)


def options(segment: Segment) -> dict[str, Any]:
    """The fields that all moves have, as keywords."""
    return {name: getattr(segment, name) for name in field_names(Move)}  # type: ignore[arg-type]


def configuration(target: Target, robot: Robot, seed: Array) -> Array:
    """The configuration closest to `seed` ``(n,)`` that meets a target, as well as the arm can."""
    if isinstance(target, JointTarget):
        return np.array(target.q)
    wanted = target.pose(kin.fk(robot, seed))
    result = kin.solve_ik(robot, wanted, q_seed=seed)
    if result.best is None:
        result = kin.solve_ik(robot, wanted, q_seed=seed, task="position")
    return seed if result.best is None else result.best.q


# Files and links


def opened(program: Program, robot: Robot, q: Array) -> Program:
    """A program of a file as one of the page; one that begins with a curve starts at q ``(n,)``.

    Raises:
        InputError: a pose that the arm cannot reach, or more than a page holds.
    """
    program = _held(program)
    segments = program.segments
    first = start_of(segments)
    if first is not None and not isinstance(segments[first], Ptp):
        segments = (Ptp(recorded(robot.clip(q))), *segments)
        program = _held(replace(program, segments=segments))
    motion, seed = kin.plan_motion(robot, program, q), q
    done = () if motion.driven is None else motion.driven.segments
    done = done if motion.refusal is None else done[: motion.refusal.segment]
    for index, segment in enumerate(segments):
        arrival = done[index].arrival if index < len(done) else None
        for target in targets(segment):
            seed = configuration(target, robot, seed)
            off = 0.0
            if isinstance(target, PoseTarget) and (arrival is None or target is not targets(segment)[-1]):
                off = float(np.linalg.norm(kin.fk(robot, seed)[:3, 3] - target.position))
            if off > _MET:
                expected = f"a point that the arm can reach; the nearest is {off:.3f} m away"
                raise InputError(f"segments[{index}]", list(target.position), expected)  # type: ignore[union-attr]
    return replace(program, segments=begun(segments, robot, q))


def _held(program: Program) -> Program:
    """The program with names as a page shows them; raises `InputError` if there is more than a page holds."""
    if (count := places(program.segments)) > MOST:
        raise InputError("segments", f"{count} waypoints and pauses", f"at most {MOST} in this page")
    segments = tuple(replace(each, name=clean(each.name, NAME)) for each in program.segments)
    return replace(program, name=clean(program.name, NAME), segments=segments)


def packed(programs: Mapping[str, Program]) -> dict[str, object]:
    """Programs as JSON for a link."""
    return {key: program_to_dict(program) for key, program in programs.items()}


def unpack(value: object, robot: Robot) -> Program | None:
    """The program of a link, which anybody may have written; None: it is none for this arm."""
    try:
        data: Any = value  # checked by the reader
        found = _held(
            Program(_of_rows(value, robot)) if isinstance(value, list) else program_from_dict(data, robot)
        )
        return replace(found, segments=begun(found.segments, robot, robot.q_home))
    except InputError:
        return None


# What links had before they had programs: a list of waypoints and pauses, with letters for the kinds and fields.
_KINDS = {"p": "ptp", "l": "lin", "c": "circ", "s": "lin", "w": "dwell"}
_FIELDS = {"a": "acceleration", "b": "blend", "v": "tool_speed", "t": "tool_turn", "o": "via"}


def _of_rows(rows: list[Any], robot: Robot) -> Segments:
    """Neighbours with the letter of splines, but for the start, are the points of one."""
    if not 1 <= len(rows) <= MOST:
        raise InputError("program", f"{len(rows)} rows", f"1 to {MOST}")
    read = program_from_dict({"segments": [_of_row(row) for row in rows]}, robot).segments
    found: list[Segment] = []
    for row, segment in zip(rows, read, strict=True):
        if row[0] == "s" and start_of(tuple(found)) is not None and isinstance(segment, Lin):
            here = posed(np.array(row[1]), robot)
            before = targets(found.pop()) if isinstance(found[-1], Spline) else ()
            segment = Spline((*before, here), **options(segment))
        found.append(segment)
    return tuple(found)


def _of_row(row: object) -> dict[str, Any]:
    match row:
        case ["w", seconds]:
            return {"kind": "dwell", "seconds": seconds}
        case ["w", seconds, name]:
            return {"kind": "dwell", "seconds": seconds, "name": name}
        case [("p" | "l" | "c" | "s") as letter, list(q), *rest] if len(rest) <= 3:
            name, speed, more = [*rest, *["", 1.0, {}][len(rest) :]]
            if isinstance(more, dict) and more.keys() <= _FIELDS.keys():
                given = {_FIELDS[key]: value for key, value in more.items()}
                return {"kind": _KINDS[letter], "q": q, "name": name, "speed": speed} | given
    raise InputError("program", row, "the letter of a waypoint or a pause, and its values")
