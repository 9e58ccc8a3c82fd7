"""The obstacles of a page: where new ones are put, how they are changed, and their form in a link.

Pure: tuples of `kin.Obstacle` in and out. Links come from anybody: `unpack` keeps what is valid.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

import kin
from app.viewer.declared.fields import Measure, Number
from app.viewer.own_arm import clean
from app.viewer.scene.meshes import body
from kin import InputError, Obstacle, Robot
from kin.collision.obstacles import KINDS, LARGEST, MOST_OBSTACLES, SMALLEST, Shape
from kin.collision.solids import SPHERE
from kin.poses import roll_pitch_yaw
from kin.transforms import Array
from kin.units import Units

Obstacles = tuple[Obstacle, ...]
NAME = 24  # characters
FARTHEST, MOST_TURN = 1000.0, 200.0 * math.pi  # m from the origin, as for targets; rad
PLACE, TURN = ("x", "y", "z"), ("roll", "pitch", "yaw")
_SHAPES = {kind.letter: shape for shape, kind in KINDS.items()}
_DIGITS = 6  # of metres and radians in a link
_TENTH = math.radians(0.1)  # to which a dragged rotation is rounded

# New obstacles, in reaches of the arm.
_AT = 0.6  # from the base
_LOWER = (0.1, 0.0, -0.1, -0.2, -0.3, -0.5)  # heights of a table that are tried, from the base
_LEAST_TABLE = 0.04  # height of a table
_LEAST_ROOM = 0.01  # between a new obstacle and the arm
_AROUND = [math.radians(turn) for turn in (0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180)]


def pose(obstacle: Obstacle) -> Array:
    """The frame ``(4, 4)`` that its place and its rotation state: of a table, in the middle of its top."""
    return kin.pose_from_xyz_rpy(obstacle.xyz, obstacle.rpy)


def added(items: Obstacles, shape: object, robot: Robot, q: Array) -> Obstacles:
    """One more obstacle, sized to the arm. The arm touches it neither at `q` ``(n,)`` nor at home.

    Raises:
        InputError: no such shape, or there are as many as there may be.
    """
    if not isinstance(shape, str) or shape not in KINDS:
        raise InputError("shape", shape, "one of " + ", ".join(KINDS))
    if len(items) >= MOST_OBSTACLES:
        raise InputError("obstacles", f"{MOST_OBSTACLES + 1} obstacles", f"at most {MOST_OBSTACLES}")
    here = np.array([q, robot.q_home])
    places = _tables if KINDS[shape].topped else _others
    room = _LEAST_ROOM * robot.reach
    free = (
        each
        for each in places(shape, items, robot)
        if _alone(each, items) and kin.clearance(robot, here, [each]).min() >= room
    )
    found = next(free, None) or next(places(shape, items, robot))
    return (*items, replace(found, name=_name(shape, items)))


def _tables(shape: Shape, items: Obstacles, robot: Robot) -> Iterator[Obstacle]:
    """Tables around the arm, that before it first, as high as they can be."""
    step, base, mount = _step(robot), robot.T_world_base[:3, 3], body(robot).mount
    length, width = (_rounded(share * robot.reach, step) for share in KINDS[shape].new)
    for turn in _AROUND:
        yaw = _front(robot) + turn
        x, y = base[:2] + _AT * robot.reach * np.array([math.cos(yaw), math.sin(yaw)])
        for low in _LOWER:
            top = _rounded(base[2] + low * robot.reach, step)
            height = _rounded(top - mount.floor, step)
            if height < _LEAST_TABLE * robot.reach and low != _LOWER[0]:
                continue
            height = max(height, step)
            place = (_rounded(x, step), _rounded(y, step), top)
            yield Obstacle(shape, place, (0.0, 0.0, _wrapped(yaw)), (length, width, height))


def _others(shape: Shape, items: Obstacles, robot: Robot) -> Iterator[Obstacle]:
    """Smaller bodies around the arm, on the floor, or on a table if there is one."""
    step, base, mount = _step(robot), robot.T_world_base[:3, 3], body(robot).mount
    values = [_rounded(share * robot.reach, step) for share in KINDS[shape].new]
    each = Obstacle(shape, **KINDS[shape].with_sizes(values))
    for turn in _AROUND:
        yaw = _front(robot) + turn
        x, y = base[:2] + _AT * robot.reach * np.array([math.cos(yaw), math.sin(yaw)])
        stands = max((other.xyz[2] for other in items if _carries(other, x, y)), default=mount.surface(x, y))
        yield replace(each, xyz=(_rounded(x, step), _rounded(y, step), stands + float(each.half[2])))


def _step(robot: Robot) -> float:
    """What new sizes and places are rounded to: a centimetre, for a small arm a millimetre."""
    return 0.01 if robot.reach > 0.3 else 0.001


def _rounded(value: float, step: float) -> float:
    return round(max(round(float(value) / step), -(10**6)) * step, _DIGITS) + 0.0


def _front(robot: Robot) -> float:
    """The direction in which the tool is at home, seen from above, in whole degrees."""
    x, y = (kin.fk(robot, robot.q_home)[:3, 3] - robot.T_world_base[:3, 3])[:2].tolist()
    return math.radians(round(math.degrees(math.atan2(y, x)))) if math.hypot(x, y) > 0.05 * robot.reach else 0.0


def _wrapped(angle: float) -> float:
    return round(math.remainder(angle, 2.0 * math.pi), 9) + 0.0


def _carries(each: Obstacle, x: float, y: float) -> bool:
    """Whether a point of its top is at x, y."""
    if not each.kind.topped or any(map(abs, each.rpy[:2])):
        return False
    local = pose(each)[:3, :3].T @ [x - each.xyz[0], y - each.xyz[1], 0.0]
    return bool((abs(local[:2]) <= each.half[:2]).all())


def _alone(new: Obstacle, items: Obstacles) -> bool:
    """Whether a new obstacle is beside the others, or on a table."""
    tables = new.kind.topped
    others = [each for each in items if each.kind.topped == tables]
    share = 0.7 if tables else 1.0  # a ball around a table is much larger than the table
    return all(
        float(np.linalg.norm(new.T[:3, 3] - each.T[:3, 3])) >= share * float(new.row[16] + each.row[16])
        if not tables
        else math.dist(new.xyz[:2], each.xyz[:2]) >= share * _width(new, each)
        for each in others
    )


def _width(one: Obstacle, other: Obstacle) -> float:
    """Half of the diagonals of two tables."""
    return math.hypot(*one.half[:2]) + math.hypot(*other.half[:2])


def _name(shape: Shape, items: Obstacles) -> str:
    taken = {each.label for each in items}
    names = (shape, *(f"{shape} {k}" for k in range(2, MOST_OBSTACLES + 2)))
    return next(name for name in names if name not in taken)


def removed(items: Obstacles, index: int) -> Obstacles:
    """Without the one at this place."""
    return (*items[:index], *items[index + 1 :])


def fields_of(each: Obstacle) -> list[tuple[str, dict[str, tuple[Number, float]]]]:
    """The numbers of an obstacle, by groups, as its kind has them: how each is typed, and its value (m, rad)."""
    place = "Middle of the top" if each.kind.topped else "Centre"
    found: list[tuple[str, Sequence[str], Sequence[float], tuple[float, float], Measure]]
    found = [(place, PLACE, each.xyz, (-FARTHEST, FARTHEST), "length")]
    if each.kind.solid != SPHERE:
        found.append(("Rotation", TURN, each.rpy, (-MOST_TURN, MOST_TURN), "angle"))
    found.append(("Size", each.kind.names, each.sizes, (SMALLEST, LARGEST), "length"))
    groups = []
    for title, names, values, ends, measure in found:
        specs = [Number(label=name, limits=ends, measure=measure) for name in names]
        groups.append((title, dict(zip(names, zip(specs, values, strict=True), strict=True))))
    return groups


def typed(items: Obstacles, index: int, field: str, text: str, units: Units) -> Obstacles:
    """With what was typed into a field of one.

    Raises:
        EntryError: with what would be valid.
        InputError: it has no such field.
    """
    each = items[index]
    known = {name: one for _, group in fields_of(each) for name, (one, _) in group.items()}
    if field not in known:
        raise InputError("field", field, "one of " + ", ".join(known))
    value = known[field].typed(text, units)
    assert value is not None
    if field in PLACE:
        new = replace(each, xyz=_with(each.xyz, PLACE.index(field), value))
    elif field in TURN:
        new = replace(each, rpy=_with(each.rpy, TURN.index(field), value))
    else:
        new = replace(each, **each.kind.with_sizes(_with(each.sizes, each.kind.names.index(field), value)))
    return (*items[:index], new, *items[index + 1 :])


def moved(items: Obstacles, index: int, T: Array) -> Obstacles:
    """With one of them at another pose ``(4, 4)``: to the millimetre, and to a tenth of a degree."""
    place = [min(max(round(value, 3), -FARTHEST), FARTHEST) + 0.0 for value in T[:3, 3].tolist()]
    turn = [round(round(value / _TENTH) * _TENTH, 9) + 0.0 for value in roll_pitch_yaw(T[:3, :3])]
    new = replace(items[index], xyz=place, rpy=turn)
    return (*items[:index], new, *items[index + 1 :])


def _with(values: Sequence[float], index: int, value: float) -> tuple[float, ...]:
    return (*values[:index], value, *values[index + 1 :])


def pack(items: Obstacles) -> list[list[object]]:
    """The obstacles as JSON for a link: letter, name, place, rotation, sizes."""
    return [
        [
            each.kind.letter,
            each.label,
            *(round(v, _DIGITS) + 0.0 for v in (*each.xyz, *each.rpy, *each.sizes)),
        ]
        for each in items
    ]


def unpack(value: object) -> Obstacles:
    """The obstacles of a link, as far as they are valid."""
    found: list[Obstacle] = []
    for row in value[:MOST_OBSTACLES] if isinstance(value, list) else ():
        match row:
            case [str(letter), str(name), *values] if letter in _SHAPES:
                each = _read(_SHAPES[letter], clean(name, NAME), values)
                if each is not None and each.name not in {other.name for other in found}:
                    found.append(each)
    return tuple(found)


def _read(shape: Shape, name: str, values: list[Any]) -> Obstacle | None:
    if not name or len(values) != 6 + len(KINDS[shape].names):
        return None
    try:
        each = Obstacle(shape, values[:3], values[3:6], **KINDS[shape].with_sizes(values[6:]), name=name)
    except InputError:
        return None
    return each if max(map(abs, each.xyz)) <= FARTHEST else None
