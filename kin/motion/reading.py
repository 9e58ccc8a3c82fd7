"""Programs as plain data: TOML or JSON text, or a dict → `Program`, and back.

```toml
units = { length = "mm", angle = "deg" }   # by default metres and radians

[[segments]]
kind = "ptp"
q = [0, -90, 90, 0, 90, 0]

[[segments]]
kind = "lin"
position = [400, 100, 300]
wxyz = [0, 1, 0, 0]
blend = 20
```

A target is `q`, or `position` with or without `wxyz`, or `pose`: a 4×4 matrix, or a text as
`kin.pose_from_text` reads it, such as ``"kuka X 400 Y 100 Z 300 A 0 B 180 C 0"``. Poses and via points are in
the world frame, or in the one that `frame` names: ``"base"``, or a workpiece. With ``pendant = true`` at the
top, joint values are those that the arm's pendant shows. Every error names the field, as in
``segments[1].blend``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError, finite_number, shorten
from kin.files.numbers import scaled
from kin.files.read import ANGLES, is_path
from kin.frames import BASE, WORLD
from kin.motion.program import (
    KINDS,
    MOST_POINTS,
    MOST_SEGMENTS,
    Circ,
    JointTarget,
    Move,
    Pause,
    PoseTarget,
    Program,
    Segment,
    Spline,
    Target,
    field_names,
    kind_of,
)
from kin.named import robot_of
from kin.parsing import Limits, TextError, read_json, read_toml
from kin.poses import read_target
from kin.robot import LENGTHS, Robot
from kin.transforms import Array, as_transform
from kin.typed import ReadError
from kin.units import Units

_TARGET = ("q", "position", "wxyz", "pose", "frame")
_NEEDED = {  # of segments in which the arm stands still
    "dwell": ("seconds", "the length of the pause in seconds"),
    "gripper": ("opening", "how far the gripper is open then, from 0 (closed) to 1 (open)"),
}
LIMITS = Limits(16_000_000, 4_000_000, 16)  # of a program; a page takes shorter ones
_TOP = (*field_names(Program), "units", "pendant")
_LENGTHS, _ANGLES = ("tool_speed", "blend"), ("tool_turn",)


def parse_program(
    text: str, robot: Robot | str | None = None, workpieces: Mapping[str, ArrayLike] | None = None
) -> Program:
    r"""The program described by TOML or JSON text; see `program_from_dict`.

    Args:
        text: of a program file: JSON if it begins with a brace, else TOML.
        robot: the arm, or the id of a built-in one: it tells which joint values are lengths; without it all are
            angles.
        workpieces: poses ``(4, 4)`` of workpiece frames in the world frame, by the names that a `frame` has.

    Returns:
        The program.

    Raises:
        InputError: the text is neither, or a path; or naming the field, the value and what would be valid.

    Examples:
        >>> import kin
        >>> len(kin.motion.parse_program('[[segments]]\nkind = "dwell"\nseconds = 0.5').segments)
        1
    """
    if not isinstance(text, str) or is_path(text):
        raise InputError("text", text, 'the text of a program, such as pathlib.Path("program.toml").read_text()')
    is_json = text.lstrip("\ufeff \t\r\n").startswith("{")  # no TOML begins so
    try:
        data = (read_json if is_json else read_toml)(text.lstrip("\ufeff"), LIMITS)
    except TextError as error:
        raise InputError("program", error.value, error.expected) from None
    return program_from_dict(data, robot, workpieces)


def program_from_dict(
    data: Mapping[str, Any],
    robot: Robot | str | None = None,
    workpieces: Mapping[str, ArrayLike] | None = None,
) -> Program:
    """The program described by plain data.

    Args:
        data: the fields of `Program`, with each segment as a dict; ``units`` for the numbers in it.
        robot: the arm, or the id of a built-in one: it tells which joint values are lengths; without it all are
            angles.
        workpieces: poses ``(4, 4)`` of workpiece frames in the world frame, by the names that a `frame` has.

    Returns:
        The program, with its poses in the world frame.

    Raises:
        InputError: naming the field, the value and what would be valid.

    Examples:
        >>> import kin
        >>> kin.motion.program_from_dict({"segments": [{"kind": "dwell", "seconds": 0.5}]}).segments[0].seconds
        0.5
    """
    if not isinstance(data, Mapping):
        raise InputError("program", data, "a table with the fields " + ", ".join(_TOP))
    _only(data, _TOP, "")
    pendant = data.get("pendant", False)
    if not isinstance(pendant, bool) or (pendant and robot is None):
        expected = "true or false" if not isinstance(pendant, bool) else "a robot as well, whose pendant is meant"
        raise InputError("pendant", pendant, expected)
    reader = _Reader(data.get("units", {}), None if robot is None else robot_of(robot), workpieces or {}, pendant)
    segments = data.get("segments")
    if not isinstance(segments, list | tuple) or not 1 <= len(segments) <= MOST_SEGMENTS:
        raise InputError("segments", _counted(segments, "segments"), f"1 to {MOST_SEGMENTS} segments")
    read = tuple(reader.segment(segment, f"segments[{i}]") for i, segment in enumerate(segments))
    return Program(read, **{key: data[key] for key in field_names(Program)[1:] if key in data})


def program_to_dict(program: Program) -> dict[str, Any]:
    """The program as plain data in metres and radians; `program_from_dict` reads it. Defaults are left out.

    Args:
        program: whose segments are written.

    Returns:
        Plain values, as JSON has them.

    Raises:
        InputError: `program` is no `Program`.

    Examples:
        >>> import kin
        >>> kin.motion.program_to_dict(kin.motion.Program((kin.motion.Dwell(0.5),)))["segments"]
        [{'kind': 'dwell', 'seconds': 0.5}]
    """
    if not isinstance(program, Program):
        raise InputError("program", program, "a kin.motion.Program")
    data: dict[str, Any] = {}
    if program.name:
        data["name"] = program.name
    if program.task is not None:
        data["task"] = program.task
    if not program.jerk_limited:
        data["jerk_limited"] = False
    return data | {"segments": [_segment_to_dict(segment) for segment in program.segments]}


def _segment_to_dict(segment: Segment) -> dict[str, Any]:
    data: dict[str, Any] = {"kind": kind_of(segment)}
    if isinstance(segment, Pause):
        own = {key: getattr(segment, key) for key in field_names(type(segment))}
        return data | {key: value for key, value in own.items() if key != "name" or value}
    if isinstance(segment, Spline):
        data["points"] = [_target_to_dict(point) for point in segment.points]
    else:
        data |= _target_to_dict(segment.target)
    if isinstance(segment, Circ):
        data["via"] = list(segment.via)
    if getattr(segment, "orientation", "geodesic") != "geodesic":
        data["orientation"] = "two-axis"
    for key in field_names(Move):  # type: ignore[arg-type]
        value = getattr(segment, key)
        if value != getattr(_PLAIN, key):
            data[key] = value
    return data


def _counted(value: object, what: str) -> object:
    """How many there are, in the place of a list; anything else as it is."""
    return f"{len(value)} {what}" if isinstance(value, list | tuple) else value


def _target_to_dict(target: Target) -> dict[str, Any]:
    if isinstance(target, JointTarget):
        return {"q": list(target.q)}
    data: dict[str, Any] = {"position": list(target.position)}
    return data if target.wxyz is None else data | {"wxyz": list(target.wxyz)}


_PLAIN = Move()


class _Reader:
    """Reads numbers in the units of the file."""

    def __init__(
        self, units: object, robot: Robot | None, workpieces: Mapping[str, ArrayLike], pendant: bool
    ) -> None:
        if not isinstance(units, Mapping):
            raise InputError("units", units, 'a table such as { length = "mm", angle = "deg" }')
        _only(units, ("length", "angle"), "units.")
        self.length = _unit(units, "length", LENGTHS, "m")
        self.angle = _unit(units, "angle", ANGLES, "rad")
        self.units = Units(units.get("angle") == "deg", units.get("length", "m"))
        self.robot, self.workpieces, self.pendant = robot, workpieces, pendant

    def segment(self, data: object, where: str) -> Segment:
        if not isinstance(data, Mapping):
            raise InputError(where, data, "a table with kind and target")
        kind = data.get("kind")
        if not isinstance(kind, str) or kind not in KINDS:
            raise InputError(f"{where}.kind", kind, "one of " + ", ".join(f'"{each}"' for each in KINDS))
        cls: Any = KINDS[kind]
        own = [name for name in field_names(cls) if name != "target"]
        _only(data, ("kind", *own, *(_TARGET if kind in ("ptp", "lin", "circ") else ())), f"{where}.")
        given = {key: self.scaled(key, data[key], where) for key in own if key in data}
        if kind == "spline":
            given["points"] = self.points(data.get("points"), f"{where}.points")
        elif kind in _NEEDED:
            name, what = _NEEDED[kind]
            if name not in data:
                raise InputError(f"{where}.{name}", None, what)
        else:
            given["target"] = self.target(data, where)
        if kind == "circ":
            given["via"] = self.via(data.get("via"), f"{where}.via", self.frame(data, where))
        try:
            made: Segment = cls(**given)
        except InputError as error:
            raise error.within(where) from None
        return made

    def scaled(self, key: str, value: object, where: str) -> object:
        if value is None or key not in (*_LENGTHS, *_ANGLES):
            return value
        scale = self.length if key in _LENGTHS else self.angle
        return scaled(finite_number(f"{where}.{key}", value, "a finite number"), scale)

    def points(self, data: object, where: str) -> tuple[Target, ...]:
        if not isinstance(data, list | tuple) or not 1 <= len(data) <= MOST_POINTS:
            raise InputError(where, _counted(data, "targets"), f"1 to {MOST_POINTS} targets")
        found = []
        for i, item in enumerate(data):
            if not isinstance(item, Mapping):
                raise InputError(f"{where}[{i}]", item, "a table with q, position or pose")
            _only(item, _TARGET, f"{where}[{i}].")
            found.append(self.target(item, f"{where}[{i}]"))
        return tuple(found)

    def target(self, data: Mapping[str, Any], where: str) -> Target:
        given = [key for key in ("q", "position", "pose") if key in data]
        if len(given) != 1 or ("wxyz" in data and given != ["position"]):
            keys = ", ".join(key for key in _TARGET if key in data)
            raise InputError(where, keys or "no target", "one of q; position with or without wxyz; pose")
        frame = self.frame(data, where)
        try:
            if given == ["q"]:
                return self.joints(JointTarget(data["q"]))
            if given == ["pose"] and isinstance(data["pose"], str):
                return self.typed(data["pose"], frame)
            if given == ["pose"]:
                T = as_transform(data["pose"], "pose")
                T[:3, 3] = _times(tuple(T[:3, 3].tolist()), self.length)
                return PoseTarget.of(T if frame is None else frame @ T)
            read = PoseTarget(data["position"], data.get("wxyz"))
        except InputError as error:
            raise error.within(where) from None
        read = PoseTarget(_times(read.position, self.length), read.wxyz)
        if frame is None:
            return read
        placed = frame @ read.pose(np.eye(4))
        return PoseTarget.of(placed) if read.wxyz is not None else PoseTarget(_point(placed))

    def typed(self, text: str, frame: Array | None) -> Target:
        """The target of a text, whose numbers are in the units of the file unless its form has its own."""
        try:
            T, task = read_target(text, None, self.units, "" if self.robot is None else self.robot.maker)
        except ReadError as error:
            raise InputError("pose", text, f"a pose that can be read in one way. {error.sentence}") from None
        if task == "approach":
            raise InputError("pose", text, "a whole pose, or a point")
        placed = T if frame is None else frame @ T
        return PoseTarget.of(placed) if task == "pose" else PoseTarget(_point(placed))

    def frame(self, data: Mapping[str, Any], where: str) -> Array | None:
        """T_world_frame ``(4, 4)`` of the frame in which a segment or point has its poses; None for the world."""
        name = data.get("frame", WORLD)
        if name == WORLD:
            return None
        base = {} if self.robot is None else {BASE: self.robot.T_world_base}
        frames: dict[str, ArrayLike] = {**self.workpieces, **base}
        if not isinstance(name, str) or name not in frames or "q" in data:
            expected = "no frame besides q" if "q" in data else "one of " + ", ".join([WORLD, *frames])
            raise InputError(f"{where}.frame", name, expected)
        return as_transform(frames[name], f"workpieces.{name}")

    def joints(self, target: JointTarget) -> JointTarget:
        if self.robot is None:
            return JointTarget(tuple(scaled(value, self.angle) for value in target.q))
        if len(target.q) != self.robot.n:
            raise InputError("q", list(target.q), f"{self.robot.n} joint values")
        scale = np.where(self.robot.revolute, self.angle, self.length).tolist()
        q = tuple(scaled(value, each) for value, each in zip(target.q, scale, strict=True))
        found = self.robot.pendant_map if self.pendant else None
        return JointTarget(q if found is None else tuple(found.joint_values(np.array(q)).tolist()))

    def via(self, data: object, where: str, frame: Array | None) -> tuple[float, float, float]:
        if isinstance(data, Mapping):
            _only(data, ("position",), f"{where}.")
            data = data.get("position")
        try:
            point = _times(PoseTarget(data).position, self.length)  # type: ignore[arg-type]  # checked there
        except InputError as error:
            raise InputError(where, data, error.expected) from None
        return point if frame is None else _point(frame @ PoseTarget(point).pose(np.eye(4)))


def _times(position: tuple[float, float, float], scale: float) -> tuple[float, float, float]:
    x, y, z = position
    return scaled(x, scale), scaled(y, scale), scaled(z, scale)


def _point(T: Array) -> tuple[float, float, float]:
    x, y, z = T[:3, 3].tolist()
    return x, y, z


def _unit(units: Mapping[str, Any], key: str, valid: Mapping[str, float], default: str) -> float:
    value = units.get(key, default)
    if not isinstance(value, str) or value not in valid:
        raise InputError(f"units.{key}", value, "one of " + ", ".join(f'"{each}"' for each in valid))
    return valid[value]


def _only(data: Mapping[Any, Any], known: tuple[str, ...], where: str) -> None:
    for key in data:
        if key not in known:
            name = key if isinstance(key, str) and key.isprintable() and len(key) <= 80 else shorten(key)
            raise InputError(where + name, data[key], "only the fields " + ", ".join(known))
