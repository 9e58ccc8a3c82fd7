"""Robot files: TOML → `Robot`. The only module of the core that reads files.

A file states its units, so a table can be copied as its source prints it::

    id = "my-arm"
    name = "My arm"
    source = "where the numbers come from"
    convention = "standard"            # or "modified" (Craig)
    units = { length = "mm", angle = "deg" }

    [[rows]]
    name = "shoulder"
    kind = "revolute"                  # or "prismatic", "fixed"
    theta = 0
    d = 130
    a = 70
    alpha = -90
    limits = [0, 180]

    [home]
    q = [90]

Only ``id``, ``name``, ``source``, ``convention``, ``units`` and ``rows`` are required; in a row, a missing number
is zero. Without ``limits`` a revolute joint turns ±180° and a prismatic one slides 0 to 1 m. Without ``home`` the
arm starts in the middle of its limits, or bent if that configuration is singular (:mod:`kin.home`). ``base`` and
``tool`` are tables ``{ xyz = [x, y, z], rpy = [roll, pitch, yaw] }``.

An error in a file raises `RobotFileError` with the file, the field, the value and what would be valid.
"""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from kin.errors import RobotFileError, UnknownRobotError
from kin.home import default_home
from kin.robot import CONVENTIONS, IDENTITY, KIND_CODES, LENGTHS, Joint, Matrix, Robot, exact_cos_sin

BUILTIN = Path(__file__).parent / "robots"
FIRST = ("pioneer5", "redundant7", "redundant7-craig")  # the chapter's arms come first in every list
ANGLES = {"deg": math.pi / 180, "rad": 1.0}
MAX_ROWS = 32
_TOP = {"id", "name", "source", "description", "convention", "units", "rows", "home", "base", "tool"}
_ROW = {"name", "kind", "theta", "d", "a", "alpha", "limits"}


@lru_cache(maxsize=1)
def builtin_robots() -> dict[str, Robot]:
    """The built-in robots by id: the chapter's first, then in alphabetical order."""
    robots = load_folder(BUILTIN)
    return {robot_id: robots[robot_id] for robot_id in dict.fromkeys((*FIRST, *robots))}


def get_robot(robot_id: str) -> Robot:
    """A built-in robot; raises `UnknownRobotError` listing the valid ids."""
    robots = builtin_robots()
    if robot_id not in robots:
        raise UnknownRobotError(robot_id, tuple(robots))
    return robots[robot_id]


def load_folder(folder: Path) -> dict[str, Robot]:
    """The robots of every ``*.toml`` file in a folder, by id.

    Raises:
        RobotFileError: a file is invalid, two files have the same id, or the folder cannot be read.
    """
    robots: dict[str, Robot] = {}
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix == ".toml")
    except OSError as error:  # glob would report an empty folder instead
        raise RobotFileError(str(folder), "folder", str(error), "a folder that can be read") from error
    for path in paths:
        robot = load_robot(path)
        if robot.id in robots:
            raise RobotFileError(str(path), "id", robot.id, "an id that no other file of the folder uses")
        robots[robot.id] = robot
    return robots


def load_robot(path: Path | str) -> Robot:
    """The robot described by a TOML file; raises `RobotFileError` if the file is invalid."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig")  # some editors on Windows write a byte order mark
    except (OSError, UnicodeDecodeError) as error:
        raise RobotFileError(str(path), "file", str(error), "a readable UTF-8 text file") from error
    return parse_robot(text, str(path))


def parse_robot(text: str, file: str = "robot") -> Robot:
    """The robot described by TOML text; `file` is the name used in messages."""
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # TOMLDecodeError is a ValueError, as is an integer too long
        raise RobotFileError(file, "file", str(error), "valid TOML") from None
    return _Reader(file).robot(data)


class _Reader:
    """Turns parsed TOML into a `Robot`; every error names the field."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.length = 1.0
        self.angle = 1.0

    def refuse(self, field: str, value: object, expected: str) -> RobotFileError:
        return RobotFileError(self.file, field, value, expected)

    def robot(self, data: dict[str, Any]) -> Robot:
        self.only_known_fields("", data, _TOP)
        robot_id = self.text(data, "id")
        if not re.fullmatch(r"[a-z0-9][a-z0-9-]{0,39}", robot_id):
            raise self.refuse("id", robot_id, "lower-case letters, digits and hyphens, at most 40")
        units = self.table(data, "units")
        self.only_known_fields("units.", units, {"length", "angle"})
        length = self.choice(units, "length", tuple(LENGTHS), "units.")
        self.length = LENGTHS[length]
        self.angle = ANGLES[self.choice(units, "angle", tuple(ANGLES), "units.")]
        convention = self.choice(data, "convention", CONVENTIONS)
        raw_rows = data.get("rows")
        if not isinstance(raw_rows, list) or not 1 <= len(raw_rows) <= MAX_ROWS:
            raise self.refuse("rows", raw_rows, f"1 to {MAX_ROWS} [[rows]] tables, one per DH row")
        rows = tuple(self.row(i, row) for i, row in enumerate(raw_rows))
        joints = [row for row in rows if row.kind != "fixed"]
        if not joints:
            raise self.refuse("rows", "only fixed rows", "at least one revolute or prismatic row")
        names = [row.name for row in rows]
        for name in names:
            if names.count(name) > 1:
                raise self.refuse("rows[].name", name, "a different name for each row")
        robot = Robot(
            id=robot_id,
            name=self.text(data, "name"),
            source=self.text(data, "source"),
            description=self.text(data, "description", ""),
            convention=convention,  # type: ignore[arg-type]  # checked by choice()
            rows=rows,
            home=self.home(data, joints),
            units=length,
            base=self.transform(data, "base"),
            tool=self.transform(data, "tool"),
        )
        return robot if "home" in data else replace(robot, home=default_home(robot))

    def row(self, index: int, data: object) -> Joint:
        where = f"rows[{index}]."
        if not isinstance(data, dict):
            raise self.refuse(f"rows[{index}]", data, "a table with theta, d, a, alpha")
        self.only_known_fields(where, data, _ROW)
        kind = self.choice(data, "kind", tuple(KIND_CODES), where, default="revolute")
        scale = self.length if kind == "prismatic" else self.angle
        limits: tuple[float, float] | None = None
        if "limits" in data:
            pair = data["limits"]
            if kind == "fixed":
                raise self.refuse(where + "limits", pair, "no limits, because the row is fixed")
            if not isinstance(pair, list) or len(pair) != 2:
                raise self.refuse(where + "limits", pair, "two numbers [lower, upper]")
            low, high = (self.number(f"{where}limits[{k}]", v) * scale for k, v in enumerate(pair))
            if not low < high:
                raise self.refuse(where + "limits", pair, "lower below upper")
            limits = (low, high)
        elif kind != "fixed":
            # A slider needs limits: one turn about zero, or one metre of stroke.
            limits = (-math.pi, math.pi) if kind == "revolute" else (0.0, 1.0)
        return Joint(
            name=self.text(data, "name", f"joint {index + 1}", where),
            theta=self.number(where + "theta", data.get("theta", 0)) * self.angle,
            d=self.number(where + "d", data.get("d", 0)) * self.length,
            a=self.number(where + "a", data.get("a", 0)) * self.length,
            alpha=self.number(where + "alpha", data.get("alpha", 0)) * self.angle,
            kind=kind,  # type: ignore[arg-type]  # checked by choice()
            limits=limits,
        )

    def home(self, data: dict[str, Any], joints: list[Joint]) -> tuple[float, ...]:
        if "home" not in data:
            return tuple(0.5 * sum(j.limits) if j.limits else 0.0 for j in joints)
        table = self.table(data, "home")
        self.only_known_fields("home.", table, {"q"})
        q = table.get("q")
        if not isinstance(q, list) or len(q) != len(joints):
            raise self.refuse("home.q", q, f"{len(joints)} numbers, one per moving joint")
        values = []
        for k, (joint, raw) in enumerate(zip(joints, q, strict=True)):
            value = self.number(f"home.q[{k}]", raw)
            value *= self.length if joint.kind == "prismatic" else self.angle
            if joint.limits and not joint.limits[0] <= value <= joint.limits[1]:
                raise self.refuse(f"home.q[{k}]", raw, f"a value inside the limits of {joint.name}")
            values.append(value)
        return tuple(values)

    def transform(self, data: dict[str, Any], key: str) -> Matrix:
        if key not in data:
            return IDENTITY
        table = self.table(data, key)
        self.only_known_fields(key + ".", table, {"xyz", "rpy"})
        x, y, z = (v * self.length for v in self.triple(table, "xyz", key + "."))
        (cr, sr), (cp, sp), (cy, sy) = (
            exact_cos_sin(v * self.angle) for v in self.triple(table, "rpy", key + ".")
        )
        return (
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, x),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, y),
            (-sp, cp * sr, cp * cr, z),
            (0.0, 0.0, 0.0, 1.0),
        )

    def triple(self, table: dict[str, Any], key: str, where: str) -> list[float]:
        value = table.get(key, [0, 0, 0])
        if not isinstance(value, list) or len(value) != 3:
            raise self.refuse(where + key, value, "three numbers")
        return [self.number(f"{where}{key}[{i}]", v) for i, v in enumerate(value)]

    def number(self, field: str, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e6:
            raise self.refuse(field, value, "a finite number, smaller than a million")
        return float(value)

    def text(self, data: dict[str, Any], key: str, default: str | None = None, where: str = "") -> str:
        value = data.get(key, default)
        if not isinstance(value, str) or (default is None and not value.strip()) or len(value) > 4000:
            raise self.refuse(where + key, value, "a text of 1 to 4000 characters")
        return value.strip()

    def table(self, data: dict[str, Any], key: str) -> dict[str, Any]:
        value = data.get(key)
        if not isinstance(value, dict):
            raise self.refuse(key, value, f"a table [{key}]")
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

    def only_known_fields(self, where: str, data: dict[str, Any], fields: set[str]) -> None:
        for key in data:
            if key not in fields:
                raise self.refuse(where + key, data[key], "only the fields " + ", ".join(sorted(fields)))
