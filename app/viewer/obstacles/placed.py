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
from app.viewer.own_arm import clean
from app.viewer.scene.meshes import body
from kin import InputError, Obstacle, Robot
from kin.collision.obstacles import LARGEST, MOST_OBSTACLES, SHAPES, SMALLEST, Shape
from kin.poses import roll_pitch_yaw
from kin.transforms import Array

Obstacles = tuple[Obstacle, ...]
NAME = 24  # characters
FARTHEST = 1000.0  # m from the origin, as for targets
SIZES: dict[Shape, tuple[str, ...]] = {
    "table": ("length", "width", "height"),
    "box": ("length", "width", "height"),
    "sphere": ("radius",),
    "cylinder": ("radius", "height"),
}
PLACE, TURN = ("x", "y", "z"), ("roll", "pitch", "yaw")
_LETTERS: dict[Shape, str] = {"table": "t", "box": "b", "sphere": "s", "cylinder": "c"}
_SHAPES = {letter: shape for shape, letter in _LETTERS.items()}
_DIGITS = 6  # of metres and radians in a link
_TENTH = math.radians(0.1)  # to which a dragged rotation is rounded

# New obstacles, in reaches of the arm.
_TABLE, _TABLE_AT = (0.45, 0.7), 0.6
_NEW: dict[Shape, tuple[float, ...]] = {"box": (0.14, 0.14, 0.14), "sphere": (0.08,), "cylinder": (0.06, 0.24)}
_SMALL_AT = 0.6
_LOWER = (0.1, 0.0, -0.1, -0.2, -0.3, -0.5)  # heights of a table that are tried, from the base
_LEAST_TABLE = 0.04  # height of a table
_LEAST_ROOM = 0.01  # between a new obstacle and the arm
_AROUND = [math.radians(turn) for turn in (0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180)]


def sizes(obstacle: Obstacle) -> tuple[float, ...]:
    """The sizes (m) that `SIZES` names."""
    if obstacle.size is not None:
        return tuple(obstacle.size)
    return tuple(value for value in (obstacle.radius, obstacle.height) if value is not None)


def of_sizes(shape: Shape, values: Sequence[float]) -> dict[str, Any]:
    """The fields of an obstacle with these sizes."""
    if shape in ("box", "table"):
        return {"size": tuple(values)}
    return dict(zip(SIZES[shape], values, strict=True))


def pose(obstacle: Obstacle) -> Array:
    """The frame ``(4, 4)`` that its place and its rotation state: of a table, in the middle of its top."""
    return kin.pose_from_xyz_rpy(obstacle.xyz, obstacle.rpy)


def added(items: Obstacles, shape: object, robot: Robot, q: Array) -> Obstacles:
    """One more obstacle, sized to the arm. The arm touches it neither at `q` ``(n,)`` nor at home.

    Raises:
        InputError: no such shape, or there are as many as there may be.
    """
    if shape not in SHAPES:
        raise InputError("shape", shape, "one of " + ", ".join(SHAPES))
    if len(items) >= MOST_OBSTACLES:
        raise InputError("obstacles", f"{MOST_OBSTACLES + 1} obstacles", f"at most {MOST_OBSTACLES}")
    here = np.array([q, robot.q_home])
    tried = (_tables if shape == "table" else _others)(shape, items, robot)
    room = _LEAST_ROOM * robot.reach
    free = (each for each in tried if _alone(each, items) and kin.clearance(robot, here, [each]).min() >= room)
    found = next(free, None)
    if found is None:
        found = next(iter((_tables if shape == "table" else _others)(shape, items, robot)))
    return (*items, replace(found, name=_name(shape, items)))


def _tables(shape: Shape, items: Obstacles, robot: Robot) -> Iterator[Obstacle]:
    """Tables around the arm, that before it first, as high as they can be."""
    step, base, mount = _step(robot), robot.T_world_base[:3, 3], body(robot).mount
    length, width = (_rounded(share * robot.reach, step) for share in _TABLE)
    for turn in _AROUND:
        yaw = _front(robot) + turn
        x, y = base[:2] + _TABLE_AT * robot.reach * np.array([math.cos(yaw), math.sin(yaw)])
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
    values = [_rounded(share * robot.reach, step) for share in _NEW[shape]]
    half = values[0] if shape == "sphere" else 0.5 * values[-1]
    for turn in _AROUND:
        yaw = _front(robot) + turn
        x, y = base[:2] + _SMALL_AT * robot.reach * np.array([math.cos(yaw), math.sin(yaw)])
        stands = max((each.xyz[2] for each in items if _carries(each, x, y)), default=mount.surface(x, y))
        place = (_rounded(x, step), _rounded(y, step), stands + half)
        yield Obstacle(shape, place, (0.0, 0.0, 0.0), **of_sizes(shape, values))


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
    if each.shape != "table" or each.size is None or any(map(abs, each.rpy[:2])):
        return False
    local = pose(each)[:3, :3].T @ [x - each.xyz[0], y - each.xyz[1], 0.0]
    return bool(abs(local[0]) <= 0.5 * each.size[0] and abs(local[1]) <= 0.5 * each.size[1])


def _alone(new: Obstacle, items: Obstacles) -> bool:
    """Whether a new obstacle is beside the others, or on a table."""
    tables = new.shape == "table"
    others = [each for each in items if (each.shape == "table") == tables]
    share = 0.7 if tables else 1.0  # a ball around a table is much larger than the table
    return all(
        float(np.linalg.norm(new.T[:3, 3] - each.T[:3, 3])) >= share * float(new.row[16] + each.row[16])
        if not tables
        else math.dist(new.xyz[:2], each.xyz[:2]) >= share * _width(new, each)
        for each in others
    )


def _width(one: Obstacle, other: Obstacle) -> float:
    """Half of the diagonals of two tables."""
    return sum(0.5 * math.hypot(*each.size[:2]) for each in (one, other) if each.size is not None)


def _name(shape: Shape, items: Obstacles) -> str:
    taken = {each.label for each in items}
    names = (shape, *(f"{shape} {k}" for k in range(2, MOST_OBSTACLES + 2)))
    return next(name for name in names if name not in taken)


def removed(items: Obstacles, index: int) -> Obstacles:
    """Without the one at this place."""
    return (*items[:index], *items[index + 1 :])


def changed(items: Obstacles, index: int, field: str, value: float) -> Obstacles:
    """With another value (m, rad) of x, y, z, roll, pitch, yaw or one of `SIZES`.

    Raises:
        InputError: naming the field, the value and what is valid.
    """
    each = items[index]
    if field in PLACE:
        if not abs(value) <= FARTHEST:
            raise InputError(field, f"{value:g} m", f"at most {FARTHEST:g} m from the origin")
        new = replace(each, xyz=_with(each.xyz, PLACE.index(field), value))
    elif field in TURN:
        new = replace(each, rpy=_with(each.rpy, TURN.index(field), value))
    elif field in SIZES[each.shape]:
        if not SMALLEST <= value <= LARGEST:
            raise InputError(field, f"{value:g} m", f"{1000 * SMALLEST:g} mm to {LARGEST:g} m")
        values = _with(sizes(each), SIZES[each.shape].index(field), value)
        new = replace(each, **of_sizes(each.shape, values))
    else:
        raise InputError("field", field, "one of " + ", ".join((*PLACE, *TURN, *SIZES[each.shape])))
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
            _LETTERS[each.shape],
            each.label,
            *(round(v, _DIGITS) + 0.0 for v in (*each.xyz, *each.rpy, *sizes(each))),
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
    if not name or len(values) != 6 + len(SIZES[shape]):
        return None
    try:
        each = Obstacle(shape, values[:3], values[3:6], **of_sizes(shape, values[6:]), name=name)
    except InputError:
        return None
    return each if max(map(abs, each.xyz)) <= FARTHEST else None
