"""Reads robot files and robot descriptions: TOML, or the same fields as a dict, → `Robot`."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kin.errors import InputError, KinematicsError, RobotFileError, shorten
from kin.files.home import default_home
from kin.files.numbers import LARGEST, NUMBER, scaled
from kin.frames import matrix_of
from kin.joint import Shown, check_followers, joints_of, map_of
from kin.motor import MOTOR_UNITS, Motor, checked_motors, fit_joints
from kin.parsing import Limits, TextError, read_toml
from kin.robot import (
    CONVENTIONS,
    DEFAULT_LIMITS,
    IDENTITY,
    KIND_CODES,
    LENGTHS,
    MOUNTINGS,
    PEAK_FIELDS,
    Capsule,
    Joint,
    Matrix,
    NominalTable,
    Robot,
)
from kin.transforms import as_transform
from kin.typed import ReadError, cut, read, valid
from kin.units import ANGLES as ANGLE_UNITS
from kin.units import LENGTH_UNITS, NAMES, PLAIN

ANGLES = {"deg": math.pi / 180, "rad": 1.0}
MAX_ROWS, MAX_CAPSULES, MAX_MOTORS = 32, 64, 64
LIMITS = Limits(1_000_000, 20_000, 16)  # of a robot file
MAX_REACH = 1e5  # metres; targets may have coordinates up to 1e6 m
_TOP = {
    *("id", "name", "source", "description", "convention", "units", "rows", "home", "base", "tool"),
    *("capsules", "capsules_source", "maker", "payload", "mass", "mounting", "floor", "motors", "pendant"),
    *("ros_joints", "nominal"),
}
_CAPSULE = {"row", "start", "end", "radius", "assumed"}
_MOTOR = {
    *("joint", "id", "name", "sign", "offset", "unit", "ticks", "lead", "range", "drive_mode", "homing_offset"),
}
_ROW = {"name", "kind", "theta", "d", "a", "alpha", "limits", "follows", "ratio", "sign", *PEAK_FIELDS}
_QUANTITY = re.compile(rf"\s*({NUMBER})\s*({NAMES})(/s[23²³]?)?\s*")
PER = {"velocity": "/s", "acceleration": "/s2", "jerk": "/s3"}
_POWERS = str.maketrans("²³", "23")
_LONGEST = 80  # characters of a number with a unit
_SURROGATE = re.compile("[\ud800-\udfff]")  # half a character, which no encoding can write
_LONGEST_PATH = 4096
UNLIMITED = "none"


def load_robots(folder: Path | str) -> dict[str, Robot]:
    """The robots of every ``*.toml`` file in a folder, by id.

    Args:
        folder: that contains the files; folders inside it are not read.

    Returns:
        A dict from id to arm, in the order of the file names.

    Raises:
        RobotFileError: a file is invalid, or two files have the same id.
        InputError: `folder` is no path, or a folder that cannot be read.

    Examples:
        >>> import kin, tempfile, pathlib
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> kin.save_robot("scara", folder / "scara.toml")
        >>> list(kin.files.load_robots(folder))
        ['scara']
    """
    robots: dict[str, Robot] = {}
    if not isinstance(folder, str | os.PathLike):
        raise InputError("folder", folder, "a path, as pathlib.Path or str")
    folder = Path(folder)
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix == ".toml")
    except (OSError, ValueError) as error:  # glob would report an empty folder instead
        raise InputError("folder", str(error), "a folder that can be read") from error
    for path in paths:
        robot = load_toml(path)
        if robot.id in robots:
            raise RobotFileError(str(path), "id", robot.id, "an id that no other file of the folder uses")
        robots[robot.id] = robot
    return robots


def load_toml(path: Path) -> Robot:
    """The robot of a robot file; raises `RobotFileError`."""
    try:
        text = path.read_text(encoding="utf-8-sig")  # some editors on Windows write a byte order mark
    except (OSError, ValueError) as error:  # a path may contain a null character
        raise RobotFileError(str(path), "file", str(error), "a readable UTF-8 text file") from error
    return parse_robot(text, str(path))


def parse_robot(text: str, file: str = "robot") -> Robot:
    """The robot described by TOML text, which is never a path; `file` is the name used in messages.

    Args:
        text: of a robot file (TOML).
        file: name of the file, for messages.

    Returns:
        The arm.

    Raises:
        RobotFileError: the text is invalid, or the path of a file, which `load_robot` takes.
        InputError: `text` is no text, but a `Path`, say.

    Examples:
        >>> import kin
        >>> kin.files.parse_robot(kin.robot_to_toml("planar2r")).name
        'Planar 2R'
    """
    if not isinstance(text, str):
        raise InputError("text", text, "the text of a robot file as str; kin.load_robot takes a path")
    if is_path(text):
        raise RobotFileError(file, "file", text, "the text of a robot file (TOML); kin.load_robot takes a path")
    try:
        data = read_toml(text, LIMITS)
    except TextError as error:
        raise RobotFileError(file, "file", error.value, error.expected) from None
    return Reader(file).robot(data)


def robot_from_dict(data: dict[str, Any], source: str = "robot") -> Robot:
    """The robot described by the fields of a robot file as plain data; `source` is the name used in messages.

    Args:
        data: the fields of a robot file.
        source: name used in messages.

    Returns:
        The arm.

    Raises:
        RobotFileError: naming the field, e.g. ``rows[2].alpha``, the value and what would be valid.

    Examples:
        >>> import kin
        >>> fields = kin.robot_to_dict("planar2r")
        >>> kin.robot_from_dict(fields) == kin.get_robot("planar2r")
        True
    """
    if not isinstance(data, dict):
        raise RobotFileError(source, "robot", data, "a table with the fields " + ", ".join(sorted(_TOP)))
    return Reader(source).robot(data)


def is_path(text: str) -> bool:
    """Whether a text is plainly the path of a file: one line with a folder or an ending, and no TOML or JSON."""
    line = text.strip()
    if len(line) > _LONGEST_PATH or any(character in line for character in "\n=[{#"):
        return False
    return "/" in line or "\\" in line or Path(line).suffix != ""


class Reader:
    """Turns the fields of a file into a `Robot`; every error names the field."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.length = 1.0
        self.angle = 1.0

    def refuse(self, field: str, value: object, expected: str) -> KinematicsError:
        """The error for one of the fields."""
        return RobotFileError(self.file, field, value, expected)

    def robot(self, data: dict[str, Any]) -> Robot:
        self.only_known_fields("", data, _TOP)
        robot_id = self.text(data, "id")
        if not re.fullmatch(r"[a-z0-9][a-z0-9-]{0,39}", robot_id):
            raise self.refuse("id", robot_id, "lower-case letters, digits and hyphens, at most 40")
        units = self.table(data, "units", 'length ("m", "cm" or "mm") and angle ("deg" or "rad")')
        self.only_known_fields("units.", units, {"length", "angle"})
        length = self.choice(units, "length", tuple(LENGTHS), "units.")
        self.length = LENGTHS[length]
        self.angle = ANGLES[self.choice(units, "angle", tuple(ANGLES), "units.")]
        convention = self.choice(data, "convention", CONVENTIONS)
        rows = self.rows(data)
        joints = self.joints(rows, data["rows"])
        robot = Robot(
            id=robot_id,
            name=self.text(data, "name"),
            source=self.text(data, "source"),
            description=self.text(data, "description", ""),
            convention=convention,  # type: ignore[arg-type]  # checked by choice()
            rows=rows,
            home=self.home(data, joints),
            units=length,
            maker=self.text(data, "maker", ""),
            payload=self.weight(data, "payload"),
            mass=self.weight(data, "mass"),
            base=self.transform(data, "base"),
            tool=self.transform(data, "tool"),
            capsules=self.capsules(data, rows),
            capsules_source=self.text(data, "capsules_source", ""),
            mounting=self.choice(data, "mounting", MOUNTINGS) if "mounting" in data else None,  # type: ignore[arg-type]
            floor=self.length_of("floor", data["floor"]) if "floor" in data else None,
            motors=self.motors(data, joints),
            pendant=self.pendant(data, joints),
            ros_joints=self.ros_joints(data, joints),
            nominal=self.nominal(data, rows),
        )
        if robot.reach + float(np.linalg.norm(robot.T_world_base[:3, 3])) > MAX_REACH:
            raise self.refuse(
                "rows", f"a reach of {robot.reach:g} m", f"at most {MAX_REACH:g} m with base and tool"
            )
        return robot if "home" in data else replace(robot, home=default_home(robot))

    def rows(self, data: dict[str, Any], within: str = "") -> tuple[Joint, ...]:
        """The rows of a table."""
        raw_rows = data.get("rows")
        if not isinstance(raw_rows, list) or not 1 <= len(raw_rows) <= MAX_ROWS:
            raise self.refuse(f"{within}rows", raw_rows, f"1 to {MAX_ROWS} [[rows]] tables, one per DH row")
        rows = tuple(self.row(i, row, within) for i, row in enumerate(raw_rows))
        if not any(row.driven for row in rows):
            expected = "at least one revolute or prismatic row"
            raise self.refuse(f"{within}rows", "no row that moves by itself", expected)
        names = [row.name for row in rows]
        for name in names:
            if names.count(name) > 1:
                raise self.refuse(f"{within}rows[].name", name, "a different name for each row")
        return rows

    def nominal(self, data: dict[str, Any], rows: Sequence[Joint]) -> NominalTable | None:
        """The table from which an arm was calibrated."""
        if "nominal" not in data:
            return None
        table = self.table(data, "nominal", "rows and tool")
        self.only_known_fields("nominal.", table, {"rows", "tool"})
        found = self.rows(table, "nominal.")
        moving, own = ([(row.name, row.kind, row.follows) for row in each if row.moves] for each in (found, rows))
        if moving != own:
            names = ", ".join(row.name for row in rows if row.moves)
            raise self.refuse("nominal.rows", [name for name, *_ in moving], f"the rows that move: {names}")
        known = [row.name for row in found]
        if (here := [row.name for row in rows if row.name in known]) != known:
            raise self.refuse("nominal.rows", known, f"rows of the arm in their order, such as {', '.join(here)}")
        return NominalTable(found, self.transform(table, "tool", "nominal."))

    def joints(self, rows: Sequence[Joint], given: Sequence[Any]) -> tuple[Joint, ...]:
        """The rows that move by themselves, with what the rows that follow them leave of their limits."""
        try:
            check_followers(rows)
            return joints_of(rows)
        except InputError as error:
            key, _, name = error.field.partition(" of ")
            index = [row.name for row in rows].index(name)
            raise self.refuse(f"rows[{index}].{key}", given[index].get(key), error.expected) from None

    def row(self, index: int, data: object, within: str = "") -> Joint:
        where = f"{within}rows[{index}]."
        if not isinstance(data, dict):
            raise self.refuse(where[:-1], data, "a table with theta, d, a, alpha")
        self.only_known_fields(where, data, _ROW)
        kind = self.choice(data, "kind", tuple(KIND_CODES), where, default="revolute")
        for key in ("limits", "follows", "sign", *PEAK_FIELDS):
            if kind == "fixed" and key in data:
                raise self.refuse(where + key, data[key], f"no {key}, because the row is fixed")
        slides = kind == "prismatic"
        follows = self.text(data, "follows", None, where) if "follows" in data else ""
        unstated = None if follows else DEFAULT_LIMITS[kind]
        return Joint(
            name=self.text(data, "name", f"joint {index + 1}", where),
            theta=self.angle_of(where + "theta", data.get("theta", 0)),
            d=self.length_of(where + "d", data.get("d", 0)),
            a=self.length_of(where + "a", data.get("a", 0)),
            alpha=self.angle_of(where + "alpha", data.get("alpha", 0)),
            kind=kind,  # type: ignore[arg-type]  # checked by choice()
            limits=self.limits(data["limits"], where, slides) if "limits" in data else unstated,
            velocity=self.positive(data, "velocity", where, slides),
            effort=self.positive(data, "effort", where, None),
            acceleration=self.positive(data, "acceleration", where, slides),
            jerk=self.positive(data, "jerk", where, slides),
            follows=follows,
            ratio=self.ratio(data, follows, where),
        )

    def ratio(self, data: dict[str, Any], follows: str, where: str) -> float:
        """By how many times the value of its joint a row moves."""
        given = data.get("ratio", 1)
        if "ratio" in data and not follows:
            raise self.refuse(where + "ratio", given, "no ratio, because the row follows no joint")
        if (found := self.plain(where + "ratio", given)) == 0.0:
            raise self.refuse(where + "ratio", given, "a number that is not 0")
        return found

    def plain(self, field: str, given: object) -> float:
        """A number without a unit, or a text such as ``"-1/2"``."""
        try:
            value = read(given, PLAIN) if isinstance(given, str) and len(given) <= _LONGEST else given
        except ReadError as error:
            raise self.refuse(field, given, f"a number ({error.reason})") from None
        return self.number(field, value)

    def pendant(self, data: dict[str, Any], joints: Sequence[Joint]) -> tuple[Shown, ...]:
        """What a pendant shows of joints: the signs of rows, and the table `pendant`."""
        table: dict[Any, Any] = {}
        if "pendant" in data:
            table = self.table(data, "pendant", "a table for each joint that it names")
        slides = {joint.name: joint.kind == "prismatic" for joint in joints}
        found = []
        for i, row in enumerate(data["rows"]):
            if "sign" in row and (shown := self.sign(i, row, slides, table)) is not None:
                found.append(shown)
        found += [self.shown(name, parts, slides) for name, parts in table.items()]
        try:
            map_of(joints, found)
        except InputError as error:
            name = error.field.removeprefix("pendant of ")
            raise self.refuse(f"pendant.{name}", table.get(name), error.expected) from None
        return tuple(found)

    def ros_joints(self, data: dict[str, Any], joints: Sequence[Joint]) -> tuple[tuple[str, str], ...]:
        """What joints are called in the description for ROS."""
        table = self.table(data, "ros_joints", "a name for each joint") if "ros_joints" in data else {}
        names = [joint.name for joint in joints]
        for joint in table:
            if joint not in names:
                raise self.refuse(f"ros_joints.{joint}", table[joint], "one of the joints " + ", ".join(names))
        found = {joint: self.text(table, joint, None, "ros_joints.") for joint in table}
        if len({found.get(name, name) for name in names}) < len(names):
            raise self.refuse("ros_joints", table, "a different name for each joint")
        return tuple(found.items())

    def sign(
        self, index: int, row: dict[str, Any], slides: dict[str, bool], table: dict[Any, Any]
    ) -> Shown | None:
        """What the sign of a row says a pendant shows of it; None if it counts as the table does."""
        field, sign, name = f"rows[{index}].sign", row["sign"], row.get("name", f"joint {index + 1}")
        if isinstance(sign, bool) or sign not in (1, -1):
            raise self.refuse(field, sign, "1, or -1 for a joint that a pendant counts backwards")
        if name not in slides:
            raise self.refuse(field, sign, "no sign, because the row follows a joint")
        if name in table:
            raise self.refuse(field, sign, f"no sign, because pendant.{name} says what is shown")
        return Shown(name, ((name, -1.0),)) if sign == -1 else None

    def shown(self, name: object, parts: object, slides: dict[str, bool]) -> Shown:
        """What a pendant shows of a joint."""
        if not isinstance(name, str) or name not in slides:
            shown = name if isinstance(name, str) and name.isprintable() and len(name) <= 80 else shorten(name)
            raise self.refuse(f"pendant.{shown}", parts, "one of the joints " + ", ".join(slides))
        where = f"pendant.{name}"
        if not isinstance(parts, dict):
            raise self.refuse(where, parts, "a table of joints and how many times each counts, and offset")
        self.only_known_fields(where + ".", parts, {*slides, "offset"})
        read_offset = self.length_of if slides[name] else self.angle_of
        offset = read_offset(where + ".offset", parts.get("offset", 0))
        counted = [(key, self.plain(f"{where}.{key}", share)) for key, share in parts.items() if key != "offset"]
        return Shown(name, tuple(counted), offset)

    def limits(self, pair: object, where: str, slides: bool) -> tuple[float, float] | None:
        where += "limits"
        if pair == UNLIMITED and not slides:
            return None
        if not isinstance(pair, list | tuple) or len(pair) != 2:
            none = "" if slides else f', or "{UNLIMITED}" for a joint without limits'
            raise self.refuse(where, pair, "two numbers [lower, upper]" + none)
        read = self.length_of if slides else self.angle_of
        low, high = (read(f"{where}[{k}]", v) for k, v in enumerate(pair))
        if not low < high:
            raise self.refuse(where, pair, "lower below upper")
        return low, high

    def positive(self, data: dict[str, Any], key: str, where: str, slides: bool | None) -> float | None:
        """A limit of the joint's velocity, acceleration, jerk, or effort (`slides` None), if it is stated."""
        if key not in data:
            return None
        given = data[key]
        if slides is None:
            value = self.number(where + key, given)
        else:
            value = (self.length_of if slides else self.angle_of)(where + key, given, PER[key])
        if not value > 0.0:
            raise self.refuse(where + key, given, "a positive number")
        return value

    def weight(self, data: dict[str, Any], key: str) -> float | None:
        """A number of kilograms, if it is stated."""
        if key not in data:
            return None
        value = self.number(key, data[key])
        if not value > 0.0:
            raise self.refuse(key, data[key], "a positive number of kg")
        return value

    def home(self, data: dict[str, Any], joints: Sequence[Joint]) -> tuple[float, ...]:
        if "home" not in data:
            return tuple(0.5 * sum(j.limits) if j.limits else 0.0 for j in joints)
        table = self.table(data, "home", "q")
        self.only_known_fields("home.", table, {"q"})
        q = table.get("q")
        if not isinstance(q, list) or len(q) != len(joints):
            raise self.refuse("home.q", q, f"{len(joints)} numbers, one per moving joint")
        values = []
        for k, (joint, raw) in enumerate(zip(joints, q, strict=True)):
            value = (self.length_of if joint.kind == "prismatic" else self.angle_of)(f"home.q[{k}]", raw)
            if joint.limits and not joint.limits[0] <= value <= joint.limits[1]:
                raise self.refuse(f"home.q[{k}]", raw, f"a value inside the limits of {joint.name}")
            values.append(value)
        return tuple(values)

    def capsules(self, data: dict[str, Any], rows: Sequence[Joint]) -> tuple[Capsule, ...]:
        """The bodies of the links, base first."""
        given = data.get("capsules", [])
        if not isinstance(given, list) or len(given) > MAX_CAPSULES:
            shown = f"{len(given)} tables" if isinstance(given, list) else given
            raise self.refuse("capsules", shown, f"at most {MAX_CAPSULES} [[capsules]] tables")
        names = [row.name for row in rows]
        found = []
        for i, each in enumerate(given):
            where = f"capsules[{i}]"
            if not isinstance(each, dict):
                raise self.refuse(where, each, "a table with row, start, end and radius")
            self.only_known_fields(where + ".", each, _CAPSULE)
            name = each.get("row")
            if name is not None and name not in names:
                valid = "the name of a row, or none for what stands still: " + ", ".join(names)
                raise self.refuse(where + ".row", name, valid)
            row = -1 if name is None else names.index(name)
            start = self.point(each.get("start"), where + ".start")
            end = self.point(each["end"], where + ".end") if "end" in each else start
            radius = self.length_of(where + ".radius", each.get("radius"))
            if not radius > 0.0:
                raise self.refuse(where + ".radius", each.get("radius"), "a positive number")
            assumed = each.get("assumed", False)
            if not isinstance(assumed, bool):
                raise self.refuse(where + ".assumed", assumed, "true or false")
            link = sum(joint.moves for joint in rows[: row + 1])
            found.append(Capsule(link, row, start, end, radius, assumed))
        return tuple(sorted(found, key=lambda capsule: capsule.row))

    def motors(self, data: dict[str, Any], joints: Sequence[Joint]) -> tuple[Motor, ...]:
        """The motors of the joints."""
        given = data.get("motors", [])
        if not isinstance(given, list) or len(given) > MAX_MOTORS:
            shown = f"{len(given)} tables" if isinstance(given, list) else given
            raise self.refuse("motors", shown, f"at most {MAX_MOTORS} [[motors]] tables")
        found = tuple(self.motor(each, f"motors[{i}]") for i, each in enumerate(given))
        try:
            fit_joints(checked_motors(found), {joint.name: joint.kind == "prismatic" for joint in joints})
        except InputError as error:
            index, key = error.field.removeprefix("motors[").split("].")
            raise self.refuse(error.field, given[int(index)].get(key), error.expected) from None
        return found

    def motor(self, data: object, where: str) -> Motor:
        if not isinstance(data, dict):
            raise self.refuse(where, data, "a table with joint, id, sign, offset and unit")
        self.only_known_fields(where + ".", data, _MOTOR)
        if "id" not in data:
            raise self.refuse(where + ".id", None, "the number of the motor on its bus")
        texts = {key: self.text(data, key, None, where + ".") for key in ("joint", "name") if key in data}
        fields: dict[str, Any] = {"joint": "", **data, **texts}
        if "offset" in data:
            fields["offset"] = self.number(where + ".offset", data["offset"])
        if "unit" in data:
            fields["unit"] = self.choice(data, "unit", MOTOR_UNITS, where + ".")
        if "lead" in data:
            fields["lead"] = self.length_of(where + ".lead", data["lead"])
        try:
            return Motor(**fields)
        except InputError as error:
            raise self.refuse(f"{where}.{error.field}", data.get(error.field), error.expected) from None

    def point(self, value: object, where: str) -> tuple[float, float, float]:
        x, y, z = (self.length_of(f"{where}[{k}]", v) for k, v in enumerate(self.items(value, where, 3)))
        return x, y, z

    def transform(self, data: dict[str, Any], key: str, within: str = "") -> Matrix:
        if key not in data:
            return IDENTITY
        where = f"{within}{key}."
        given = data[key]
        if not isinstance(given, dict):
            raise self.refuse(where[:-1], given, f"a table [{where[:-1]}] with xyz and rpy, or matrix")
        self.only_known_fields(where, given, {"matrix"} if "matrix" in given else {"xyz", "rpy"})
        if "matrix" in given:
            return self.matrix(given["matrix"], where + "matrix")
        xyz, rpy = (self.items(given.get(part, [0, 0, 0]), where + part, 3) for part in ("xyz", "rpy"))
        return matrix_of(
            [self.length_of(f"{where}xyz[{i}]", v) for i, v in enumerate(xyz)],
            [self.angle_of(f"{where}rpy[{i}]", v) for i, v in enumerate(rpy)],
        )

    def matrix(self, value: object, where: str) -> Matrix:
        rows = [self.items(row, f"{where}[{i}]", 4) for i, row in enumerate(self.items(value, where, 4))]
        T = tuple(
            tuple(
                (self.length_of if i < 3 and j == 3 else self.number)(f"{where}[{i}][{j}]", v)
                for j, v in enumerate(row)
            )
            for i, row in enumerate(rows)
        )
        try:
            as_transform(T, where)
        except InputError as error:
            raise self.refuse(error.field, value, error.expected) from None
        return T

    def items(self, value: object, field: str, count: int) -> list[Any]:
        if not isinstance(value, list | tuple) or len(value) != count:
            raise self.refuse(field, value, {3: "three numbers", 4: "four rows of four numbers"}[count])
        return list(value)

    def angle_of(self, field: str, value: object, per: str = "") -> float:
        return self.quantity(field, value, self.angle, ANGLES | {"°": ANGLES["deg"]}, per)

    def length_of(self, field: str, value: object, per: str = "") -> float:
        return self.quantity(field, value, self.length, LENGTHS, per)

    def quantity(self, field: str, value: object, scale: float, units: dict[str, float], per: str) -> float:
        """A number in the unit of the file, or a text with a unit of its own such as ``"0.13 m"``."""
        if isinstance(value, str):
            found = _QUANTITY.fullmatch(value) if len(value) <= _LONGEST else None
            if found is not None and found[2] in units and (found[3] or "").translate(_POWERS) in ("", per):
                value, scale = float(found[1]), units[found[2]]
            else:
                value, scale = self.expression(field, value, "rad" in units, per), 1.0
        return self.number(field, value, scale, " radians" if "rad" in units else " metres")

    def expression(self, field: str, text: str, turns: bool, per: str) -> float:
        """A text such as ``"-pi/2"`` or ``"2*400"`` in radians or metres, by default in the unit of the file."""
        names = ANGLES if turns else LENGTHS
        scale = self.angle if turns else self.length
        unit = (ANGLE_UNITS if turns else LENGTH_UNITS)[next(name for name in names if names[name] == scale)]
        try:
            if "/s" in text and not text.translate(_POWERS).endswith(per or " "):
                raise ReadError(f"“{cut(text)}” has another unit of time")
            return read(text.translate(_POWERS).removesuffix(per) if per else text, unit)
        except ReadError as error:
            example = f'"1.5 {next(iter(names))}{per}", or {valid(unit)}'
            expected = f"a finite number, a text with its unit such as {example} ({error.reason})"
            raise self.refuse(field, text, expected) from None

    def number(self, field: str, value: object, scale: float = 1.0, unit: str = "") -> float:
        """A number times the scale of its unit."""
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < LARGEST / scale:
            raise self.refuse(field, value, "a finite number, smaller than a million" + unit)
        return scaled(float(value), scale)

    def text(self, data: dict[str, Any], key: str, default: str | None = None, where: str = "") -> str:
        value = data.get(key, default)
        if not isinstance(value, str) or (default is None and not value.strip()) or len(value) > 4000:
            raise self.refuse(where + key, value, "a text of 1 to 4000 characters")
        if _SURROGATE.search(value):
            raise self.refuse(where + key, value, "a text without halves of characters (surrogates)")
        return value.strip()

    def table(self, data: dict[str, Any], key: str, fields: str) -> dict[str, Any]:
        value = data.get(key)
        if not isinstance(value, dict):
            raise self.refuse(key, value, f"a table [{key}] with {fields}")
        return value

    def choice(
        self,
        data: dict[str, Any],
        key: str,
        valid: tuple[str, ...],
        where: str = "",
        default: str | None = None,
    ) -> str:
        value = data.get(key, default)
        if value not in valid:
            raise self.refuse(where + key, value, "one of " + ", ".join(f'"{v}"' for v in valid))
        return str(value)

    def only_known_fields(self, where: str, data: dict[Any, Any], fields: set[str]) -> None:
        for key in data:
            if key not in fields:
                name = key if isinstance(key, str) and key.isprintable() and len(key) <= 80 else shorten(key)
                raise self.refuse(where + name, data[key], "only the fields " + ", ".join(sorted(fields)))
