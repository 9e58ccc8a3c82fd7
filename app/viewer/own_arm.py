"""The visitor's own arm: one that is not among the service's robots. It lives in the visitor's page and its link.

In a link the arm is a compact form of the fields of a robot file. Links come from anybody: `unpack` checks what it
reads as strictly as a robot file, and bounds sizes more narrowly, because the page shows every name and sends the
whole arm with every link.
"""

from __future__ import annotations

import hashlib
import json
import unicodedata
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

import kin
from kin import InputError, Robot
from kin.files.read import MAX_ROWS
from kin.units import general

KEY = "own"  # stands for the arm in a link, and begins its id
MY_ARM = "My arm"
NAME, ROW_NAME, SOURCE, DESCRIPTION, CAPSULES_SOURCE = 60, 40, 200, 400, 400  # characters
SMALLEST, LARGEST = 1e-3, 1000.0  # m: reach of an arm that can be shown
LONGEST = 10_000  # characters of the compact form; a link holds 12 000 in all
# Fields that an own arm has not: nobody has built, weighed or published it.
OF_MAKER = ("maker", "payload", "mass", "ros_joints")
_KINDS = {"revolute": "", "prismatic": "p", "fixed": "f"}
_ROW = (
    *("theta", "d", "a", "alpha", "limits", "kind", "name", "velocity", "effort", "acceleration", "jerk"),
    *("follows", "ratio"),  # the joint by the index of its row
)
_MOTOR = ("id", "sign", "offset", "unit", "name", "ticks", "lead", "range", "drive_mode", "homing_offset")
_TOP = {
    "n": "name",
    "s": "source",
    "i": "description",
    "c": "convention",
    "b": "base",
    "t": "tool",
    "m": "mounting",
    "z": "floor",
}


@dataclass(frozen=True)
class OwnArm:
    """An arm of the visitor's own.

    Attributes:
        robot: the arm. Its id depends on everything else in it, so another arm never has the same.
        start: the arm it was made from: the id of a robot, the name of an example, or the id of the own arm that a
            file gave. A link may hold any text. Empty: none.
    """

    robot: Robot
    start: str = ""


def own_arm(data: Mapping[str, Any], start: str = "") -> OwnArm:
    """An arm described by the fields of a robot file; its id is replaced.

    What its maker says of it is left out. Capsules are left out if the arm is too long with them; its bodies are
    then assumed.

    Raises:
        kin.KinematicsError: naming the field, the value and what would be valid.
    """
    fields = {name: value for name, value in data.items() if name not in OF_MAKER}
    fields |= {"id": KEY, "source": clean(data.get("source"), SOURCE) or "a visitor's table"}
    fields["name"] = clean(data.get("name"), NAME) or MY_ARM
    fields["description"] = clean(data.get("description", ""), DESCRIPTION)
    if "capsules_source" in fields:
        fields["capsules_source"] = clean(fields["capsules_source"], CAPSULES_SOURCE)
    rows = data.get("rows")
    if isinstance(rows, Sequence) and not isinstance(rows, str):
        named = _named(rows)
        fields["rows"] = [_of_row(each, "follows", rows, named) for each in named]
        if isinstance(pendant := data.get("pendant"), Mapping):
            fields["pendant"] = _of_rows(pendant, rows, named)
        if isinstance(capsules := data.get("capsules"), Sequence):
            fields["capsules"] = [_of_row(each, "row", rows, fields["rows"]) for each in capsules]
        if isinstance(motors := data.get("motors"), Sequence) and not isinstance(motors, str):
            fields["motors"] = [_of_row(_tidy(each), "joint", rows, fields["rows"]) for each in motors]
        if isinstance(nominal := data.get("nominal"), Mapping) and isinstance(nominal.get("rows"), Sequence):
            of_arm = [_of_row(each, "name", rows, named) for each in nominal["rows"]]
            fields["nominal"] = {**nominal, "rows": [_of_row(each, "follows", rows, named) for each in of_arm]}
    robot = kin.robot_from_dict(fields, "your arm")
    if not SMALLEST <= robot.reach <= LARGEST:
        limits = f"lengths a and d (or a tool) that reach {SMALLEST * 1000:g} mm to {LARGEST:g} m"
        raise InputError("rows", f"a reach of {general(robot.reach, 3)} m", limits)
    away = float(np.abs(robot.T_world_base[:3, 3]).max())
    if away > LARGEST:
        raise InputError("base.xyz", f"{away:g} m", f"a base at most {LARGEST:g} m from the origin")
    if abs(robot.floor or 0.0) > LARGEST:
        raise InputError("floor", f"{robot.floor:g} m", f"a floor at most {LARGEST:g} m above or below z = 0")
    if robot.capsules and len(_text(robot)) > LONGEST:
        robot = replace(robot, capsules=(), capsules_source="")
    text = _text(robot)
    if len(text) > LONGEST:
        raise InputError("rows", f"{len(text)} characters", f"names and numbers that take at most {LONGEST}")
    digest = hashlib.sha256(text.encode()).hexdigest()[:12]
    return OwnArm(replace(robot, id=f"{KEY}-{digest}"), clean(start, ROW_NAME))


def _named(rows: Sequence[Any]) -> list[Any]:
    """The rows with names that can be shown. Names that only this makes equal get a number."""
    named: list[Any] = []
    taken = {
        row.get("name") for row in rows[:MAX_ROWS] if isinstance(row, Mapping) and isinstance(row.get("name"), str)
    }
    for i, row in enumerate(rows):
        if isinstance(row, Mapping):
            given = row.get("name", "")
            name = clean(given, ROW_NAME) or f"joint {i + 1}"
            if isinstance(name, str) and name != given and i < MAX_ROWS:
                name = _unused(name, taken)
                taken.add(name)
            row = {**row, "name": name}
        named.append(row)
    return named


def _tidy(motor: Any) -> Any:
    """A motor with a name that can be shown."""
    if not isinstance(motor, Mapping) or not (name := clean(motor.get("name"), ROW_NAME)):
        return motor
    return {**motor, "name": name}


def _of_row(part: Any, key: str, before: Sequence[Any], rows: Sequence[Any]) -> Any:
    """A capsule or motor with the name that its row has now; the row may be given by its index."""
    if not isinstance(part, Mapping) or (row := part.get(key)) is None:
        return part
    if isinstance(row, str):
        row = next(
            (i for i, each in enumerate(before) if isinstance(each, Mapping) and each.get("name") == row), -1
        )
    if isinstance(row, bool) or not isinstance(row, int) or not 0 <= row < len(rows):
        return part  # what is no row is refused elsewhere
    return {**part, key: rows[row].get("name") if isinstance(rows[row], Mapping) else row}


def _of_rows(pendant: Mapping[Any, Any], before: Sequence[Any], rows: Sequence[Any]) -> dict[Any, Any]:
    """What a pendant shows, with the names that its rows have now."""

    def named(name: Any) -> Any:
        return _of_row({"row": name}, "row", before, rows)["row"]

    return {
        named(joint): {named(name) if name != "offset" else name: value for name, value in parts.items()}
        if isinstance(parts, Mapping)
        else parts
        for joint, parts in pendant.items()
    }


def _unused(name: str, taken: Set[Any]) -> str:
    """The name, with a number if it is taken."""
    endings = ("", *(f"_{k}" for k in range(2, MAX_ROWS + 2)))
    cut = (name if len(name + end) <= ROW_NAME else name[: ROW_NAME - len(end) - 1] + "…" for end in endings)
    return next(one for start, end in zip(cut, endings, strict=True) if (one := start + end) not in taken)


def clean(value: object, length: int) -> Any:
    """A name on one line, cut to `length`, without characters that are invisible or change the order of others.

    What is no text is returned as it is: it is refused elsewhere.
    """
    if not isinstance(value, str):
        return value
    value = value[: 10 * length]
    visible = "".join(" " if unicodedata.category(c) in ("Cc", "Zl", "Zp") else c for c in value)
    kept = "".join(c for c in visible if unicodedata.category(c) not in ("Cf", "Cs", "Co", "Cn"))
    words = " ".join(kept.split())
    return words if len(words) <= length else words[: length - 1] + "…"


def label(robot: Robot) -> str:
    """The name in the menu of robots."""
    return MY_ARM if robot.name == MY_ARM else f"{MY_ARM} ({robot.name})"


def pack(own: OwnArm) -> dict[str, Any]:
    """The compact form: JSON."""
    packed: dict[str, Any] = json.loads(_text(own.robot))
    return {**packed, "from": own.start} if own.start else packed


def unpack(value: object) -> OwnArm:
    """The arm of a compact form that anybody may have written.

    Raises:
        kin.KinematicsError: naming the field, the value and what would be valid.
    """
    if not isinstance(value, dict):
        raise InputError("arm", value, "a table of rows")
    data: dict[str, Any] = {name: value[key] for key, name in _TOP.items() if key in value}
    data["convention"] = "modified" if data.get("convention") == "m" else "standard"
    data["units"] = {"length": value.get("u", "mm"), "angle": "deg"}
    rows = value.get("r")
    data["rows"] = [_row(i, row) for i, row in enumerate(rows)] if isinstance(rows, list) else rows
    if "h" in value:
        data["home"] = {"q": value["h"]}
    if isinstance(capsules := value.get("k"), list):
        data["capsules"] = [_capsule(i, each) for i, each in enumerate(capsules)]
        data["capsules_source"] = value.get("ks", "")
    if (motors := value.get("o")) is not None:
        data["motors"] = [_motor(i, each) for i, each in enumerate(motors)] if isinstance(motors, list) else motors
    if isinstance(nominal := value.get("nt"), list) and len(nominal) in (1, 2):
        table, *tool = nominal
        data["nominal"] = {"rows": [_row(i, row) for i, row in enumerate(table)] if isinstance(table, list) else 0}
        data["nominal"] |= dict(zip(("tool",), tool, strict=False))
    if (pendant := value.get("p")) is not None:
        data["pendant"] = dict(map(_shown, pendant)) if isinstance(pendant, list) else pendant
    start = value.get("from", "")
    return own_arm(data, start if isinstance(start, str) else "")


def _row(index: int, row: object) -> dict[str, Any]:
    if not isinstance(row, list) or len(row) > len(_ROW):
        raise InputError(f"rows[{index}]", row, "a list of " + ", ".join(_ROW))
    given = {name: item for name, item in zip(_ROW, row, strict=False) if item is not None}
    kind = given.get("kind", "")
    given["kind"] = next((name for name, code in _KINDS.items() if code == kind), kind)
    if given["kind"] == "fixed":
        given.pop("limits", None)
    return given


def _capsule(index: int, given: object) -> dict[str, Any]:
    if not isinstance(given, list) or len(given) not in (8, 9):
        raise InputError(f"capsules[{index}]", given, "a list of row, start, end, radius, and 1 if it is assumed")
    row, x, y, z, u, v, w, radius = given[:8]
    found = {"start": [x, y, z], "end": [u, v, w], "radius": radius, "assumed": given[8:] == [1]}
    return found if row == -1 else {**found, "row": row}


def _shown(given: object) -> tuple[int, dict[Any, Any]]:
    if not isinstance(given, list) or len(given) % 2 or not all(isinstance(row, int) for row in given[::2]):
        raise InputError("pendant", given, "a list of row, offset, and then rows with how many times each counts")
    parts: dict[Any, Any] = {"offset": given[1], **dict(zip(given[2::2], given[3::2], strict=True))}
    return given[0], parts


def _motor(index: int, given: object) -> dict[str, Any]:
    if not isinstance(given, list) or not 1 <= len(given) <= len(_MOTOR) + 1:
        raise InputError(f"motors[{index}]", given, "a list of joint, " + ", ".join(_MOTOR))
    found = {name: item for name, item in zip(_MOTOR, given[1:], strict=False) if item is not None}
    return found if given[0] == -1 else {**found, "joint": given[0]}


@lru_cache(maxsize=128)
def _text(robot: Robot) -> str:
    """The compact form as JSON, without what Reset returns to."""
    data = kin.robot_to_dict(robot, angle="deg")
    packed: dict[str, Any] = {key: data[name] for key, name in _TOP.items() if name in data}
    if data["convention"] == "modified":
        packed["c"] = "m"
    else:
        del packed["c"]
    if data["units"]["length"] != "mm":
        packed["u"] = data["units"]["length"]
    places = {row.name: i for i, row in enumerate(robot.rows)}
    packed["r"] = [_packed_row(row, places) for row in data["rows"]]
    packed["h"] = data["home"]["q"]
    if robot.capsules:
        stated = zip(robot.capsules, data["capsules"], strict=True)
        packed["k"] = [
            [each.row, *item["start"], *item.get("end", item["start"]), item["radius"], *[1] * each.assumed]
            for each, item in stated
        ]
        packed["ks"] = robot.capsules_source
    if robot.motors:
        packed["o"] = [
            _without_end([places[item["joint"]] if "joint" in item else -1, *map(item.get, _MOTOR)])
            for item in data["motors"]
        ]
    if "nominal" in data:
        table = data["nominal"]
        packed["nt"] = [[_packed_row(row, places) for row in table["rows"]]]
        packed["nt"] += [table["tool"]] if "tool" in table else []
    if "pendant" in data:
        packed["p"] = [
            [
                places[joint],
                parts.pop("offset", 0),
                *(x for name, share in parts.items() for x in (places[name], share)),
            ]
            for joint, parts in data["pendant"].items()
        ]
    return json.dumps(packed, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def _packed_row(row: Mapping[str, Any], places: Mapping[str, int]) -> list[Any]:
    """The items of a row, without trailing ones that are missing."""
    items = [row.get(name, 0) for name in _ROW[:4]]
    items += [row.get("limits"), _KINDS[row.get("kind", "revolute")], row["name"], *map(row.get, _ROW[7:11])]
    items += [places[row["follows"]], row["ratio"]] if "follows" in row else []
    return _without_end(items)


def _without_end(items: list[Any]) -> list[Any]:
    """The items without trailing ones that are missing."""
    while items and items[-1] is None:
        items.pop()
    return items
