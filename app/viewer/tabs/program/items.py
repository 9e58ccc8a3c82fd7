"""The list of a program: waypoints and pauses, in order. Pure.

A waypoint is the configuration in which it was recorded; its kind says how the arm comes to it. The first waypoint
is where the program starts. Item ``i`` is segment ``i`` of the program that is planned, so that the number in the
list is the number in a sentence of the planner.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np

import kin
from app.viewer.own_arm import clean
from kin import InputError, Robot
from kin.motion import Dwell, JointTarget, Lin, PoseTarget, Program, Ptp
from kin.motion.program import LONGEST_DWELL, Segment
from kin.transforms import Array

Kind = Literal["ptp", "lin", "pause"]
MOST = 40  # items of a program; a link holds some 8000 bytes of all programs
NAME = 40  # characters
DIGITS = 7  # of a joint value in a link
PAUSE = 1.0  # s, of a new pause
SLOWEST = 0.01  # part of the limits
LARGEST = 1e6  # rad or m
LETTERS: dict[Kind, str] = {"ptp": "p", "lin": "l", "pause": "w"}


@dataclass(frozen=True, slots=True)
class Item:
    """A waypoint or a pause.

    Attributes:
        kind: how the arm comes to the waypoint; ``"pause"``: it waits.
        q: the configuration of a waypoint; empty for a pause.
        speed: part of the joints' limits of velocity that may be used, 0.01 to 1.
        seconds: of a pause.
        name: given by the visitor.
    """

    kind: Kind
    q: tuple[float, ...] = ()
    speed: float = 1.0
    seconds: float = 0.0
    name: str = ""


Items = tuple[Item, ...]


def waypoint(q: Array) -> Item:
    """A waypoint at a configuration ``(n,)``, rounded as in a link."""
    return Item("ptp", tuple(round(value, DIGITS) + 0.0 for value in q.tolist()))


def start_of(items: Items) -> Item | None:
    """The first waypoint; None: there is none."""
    return next((item for item in items if item.q), None)


def program_of(items: Items, robot: Robot, loop: bool) -> Program:
    """The program of a list with at least one waypoint; `loop`: it returns to the first one."""
    first = start_of(items)
    assert first is not None
    segments: list[Segment] = []
    for item in items:
        if not item.q:
            segments.append(Dwell(item.seconds, item.name))
        elif item.kind == "lin" and item is not first:
            target = PoseTarget.of(kin.fk(robot, np.array(item.q)))
            segments.append(Lin(target, speed=item.speed, name=item.name))
        else:
            segments.append(Ptp(JointTarget(item.q), speed=item.speed, name=item.name))
    if loop:
        segments.append(Ptp(JointTarget(first.q), name="back to the start"))
    return Program(tuple(segments))


def items_of(program: Program, robot: Robot, q: Array) -> Items:
    """The list for a program that was read from a file, which starts at q ``(n,)``.

    Raises:
        InputError: the program cannot be driven, or has something that the list cannot hold.
    """
    if len(program.segments) > MOST:
        raise InputError("segments", f"{len(program.segments)} segments", f"at most {MOST} in this page")
    _only_what_the_list_holds(program)
    first = program.segments[0]
    start = first.target.q if isinstance(first, Ptp) and isinstance(first.target, JointTarget) else q
    motion = kin.plan_motion(robot, program, start)
    if motion.refusal is not None:
        raise InputError("program", motion.refusal.reason, "a program that this arm can drive")
    found: list[Item] = []
    for segment, times in zip(program.segments, motion.segments, strict=True):
        if isinstance(segment, Dwell):
            found.append(Item("pause", seconds=segment.seconds, name=clean(segment.name, NAME)))
        else:
            end = robot.clip(motion.derivatives(times.end)[0])
            kind: Kind = "lin" if isinstance(segment, Lin) else "ptp"
            speed = max(segment.speed, SLOWEST)
            found.append(replace(waypoint(end), kind=kind, speed=speed, name=clean(segment.name, NAME)))
    if isinstance(first, Lin):
        found.insert(0, waypoint(robot.clip(q)))
    return tuple(found)


def _only_what_the_list_holds(program: Program) -> None:
    """Raise `InputError` for the first thing in a program that the list would lose."""
    usual = Program(program.segments)
    for field in ("task", "jerk_limited"):
        if getattr(program, field) != getattr(usual, field):
            raise InputError(field, getattr(program, field), "no other than the usual one in this page")
    for i, segment in enumerate(program.segments):
        if not isinstance(segment, Ptp | Lin | Dwell):
            raise InputError(
                f"segments[{i}].kind", type(segment).__name__.lower(), "ptp, lin or dwell in this page"
            )
        for field in ("acceleration", "tool_speed", "tool_turn", "blend", "orientation"):
            value = getattr(segment, field, None)
            if value not in (None, 1.0 if field == "acceleration" else 0.0, "geodesic"):
                raise InputError(f"segments[{i}].{field}", value, "no other than the usual one in this page")


def pack(items: Items) -> list[list[object]]:
    """The list as JSON for a link: kind, values, then what is not usual."""
    rows: list[list[object]] = []
    for item in items:
        if item.kind == "pause":
            row: list[object] = [LETTERS[item.kind], item.seconds, item.name]
        else:
            row = [LETTERS[item.kind], list(item.q), item.name, item.speed]
            if row[-1] == 1.0:
                row.pop()
        if row[-1] == "":
            row.pop()
        rows.append(row)
    return rows


def unpack(value: object, robot: Robot) -> Items | None:
    """The list of a link that anybody may have written; None: it is none for this arm."""
    if not isinstance(value, list) or not 1 <= len(value) <= MOST:
        return None
    items = tuple(_item(row, robot) for row in value)
    return None if None in items else items  # type: ignore[return-value]


def _item(row: object, robot: Robot) -> Item | None:
    match row:
        case ["w", seconds]:
            return _pause(seconds, "")
        case ["w", seconds, str(name)]:
            return _pause(seconds, name)
        case ["p" | "l" as letter, list(q), *rest] if len(rest) <= 2:
            given = rest[0] if rest else ""
            share = rest[1] if len(rest) > 1 else 1.0
            found = _waypoint(q, given, share, robot) if isinstance(given, str) else None
            return found if found is None or letter == "p" else replace(found, kind="lin")
    return None


def _pause(seconds: object, name: str) -> Item | None:
    value = _number(seconds, 0.0, LONGEST_DWELL)
    return None if value is None else Item("pause", seconds=value, name=clean(name, NAME))


def _waypoint(q: list[object], name: str, speed: object, robot: Robot) -> Item | None:
    values = [_number(value, -LARGEST, LARGEST) for value in q]
    share = _number(speed, SLOWEST, 1.0)
    if len(q) != robot.n or None in values or share is None:
        return None
    return Item("ptp", tuple(value for value in values if value is not None), share, name=clean(name, NAME))


def _number(value: object, low: float, high: float) -> float | None:
    if not isinstance(value, int | float) or isinstance(value, bool) or not low <= value <= high:
        return None
    return float(value)


# Changes


def changed(items: Items, index: int, **values: Any) -> Items:
    """The list with another value of one item."""
    return (*items[:index], replace(items[index], **values), *items[index + 1 :])


def inserted(items: Items, index: int, item: Item) -> Items:
    """The list with one more item at `index`."""
    return (*items[:index], item, *items[index:])


def removed(items: Items, index: int) -> Items:
    """The list without one item."""
    return items[:index] + items[index + 1 :]


def moved(items: Items, index: int, to: int) -> Items:
    """The list with one item elsewhere."""
    return inserted(removed(items, index), to, items[index])


def value_of(field: str, text: object) -> Mapping[str, Any]:
    """A typed value of an item: ``"name"``, ``"speed"`` (percent) or ``"seconds"``; raises `InputError`."""
    if not isinstance(text, str):
        raise InputError(field, text, "a text")
    if field == "name":
        return {"name": clean(text, NAME)}
    if field == "speed":
        return {"speed": _read(field, text.replace("%", ""), 1.0, 100.0, "a percentage from 1 to 100") / 100.0}
    if field == "seconds":
        expected = f"seconds from 0 to {LONGEST_DWELL:g}"
        return {"seconds": _read(field, text.removesuffix("s"), 0.0, LONGEST_DWELL, expected)}
    raise InputError("field", field, "name, speed or seconds")


def _read(field: str, text: str, low: float, high: float, expected: str) -> float:
    try:
        value = float(text.strip().replace(",", "."))
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        raise InputError(field, text, expected)
    return round(value, 3)


assert set(LETTERS) == set(get_args(Kind))
