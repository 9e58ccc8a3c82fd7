"""Changes of an arm: typed cells, rows added, removed and moved, another convention. Pure: arm in, arm out.

A changed arm is described by the fields of a robot file and read by `kin.robot_from_dict`, which checks it. A
typed value has its own unit there, so that the other numbers stay exactly as they are.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import kin
from app.viewer.meshes.links import capsules_for
from app.viewer.own_arm import NAME, OF_MAKER, OwnArm, own_arm
from app.viewer.panel.entry import read_cell
from app.viewer.scene.meshes import body
from app.viewer.scene.mounting import turn_of
from kin import InputError, KinematicsError, Robot, RobotFileError
from kin.files.read import PER
from kin.motors import Motor
from kin.poses import roll_pitch_yaw
from kin.robot import MOUNTINGS, PEAK_FIELDS
from kin.typed import ReadError, cut
from kin.units import Units

# A cell: of a row, ``(index, column)``; of a frame, ``("tool", "x")``; ``("arm", "name")``.
Cell = tuple[int | str, str]
ANGLES = ("theta", "alpha")
NUMBERS = ("theta", "d", "a", "alpha", "low", "high")
MOTION = ("home", *(key for key in PEAK_FIELDS if key in PER))  # of a joint, besides the table
COLUMNS = (*NUMBERS, "name", "kind", *MOTION)
FRAMES = ("tool", "base")
PLACE = ("mounting", "floor")  # of the arm in the room, besides its base
AXES = ("x", "y", "z", "roll", "pitch", "yaw")
KINDS = ("revolute", "prismatic", "fixed")
NEW_LINK = 100  # mm: the length of a new row, so that it is seen
_PER_TIME = re.compile(r"/\s*s(?:\^?[23]|[²³])?\s*$")  # after a typed limit
_HOME = re.compile(r"home\.q\[(\d+)\]")  # the field of one joint
_SHOWN = {"theta": "θ", "alpha": "α", "low": "lower limit", "high": "upper limit"}
Fields = dict[str, Any]


class EditError(ValueError):
    """A change that gives no valid arm: the cell, if there is one, and what is wrong."""

    def __init__(self, cell: Cell | None, message: str) -> None:
        self.cell = cell
        self.message = message
        super().__init__(message)


def name_of(cell: Cell) -> str:
    """A cell in words, such as ``row 3, α``."""
    where, column = cell
    if isinstance(where, int):
        return f"row {where + 1}, {_SHOWN.get(column, column)}"
    if where.startswith("frame-"):
        return f"frame {int(where[6:]) + 1}, {column}"
    return column if where == "arm" else f"{where}, {column}"


def fields_of(robot: Robot, own: OwnArm | None) -> tuple[Fields, str]:
    """The fields of the arm before a change, and what that arm was made from."""
    data: Fields = kin.robot_to_dict(robot)
    if own is not None and own.robot == robot:
        return data, own.start
    data["name"] = f"{robot.name[: NAME - 8]} variant"
    data["source"] = f"{robot.name}, changed in the page"
    data.pop("description", None)
    return data, robot.id


def typed(robot: Robot, own: OwnArm | None, texts: Mapping[Cell, str], units: Units) -> OwnArm:
    """The arm with these texts in its cells; numbers without a unit are in `units`.

    Raises:
        EditError: naming the first cell that is wrong.
    """
    data, start = fields_of(robot, own)
    for cell, text in texts.items():
        where, column = cell
        try:
            if isinstance(where, int):
                _type_row(data, robot, where, column, text, units)
            elif where == "arm":
                _type_arm(data, robot, column, text, units)
            else:
                _type_frame(data, robot, where, column, text, units)
        except ReadError as error:
            raise EditError(cell, str(error)) from None
    limits = [(i, column) for i, column in texts if isinstance(i, int) and column in ("low", "high")]
    for i in {i for i, _ in limits}:
        pair = data["rows"][i].get("limits")
        if isinstance(pair, list) and None in pair:
            if pair == [None, None]:
                data["rows"][i]["limits"] = "none"
            else:
                raise EditError((i, "low" if pair[0] is None else "high"), "give both limits, or none")
    return built(data, start, robot, texts)


def built(data: Fields, start: str, before: Robot, texts: Mapping[Cell, str] | None = None) -> OwnArm:
    """The arm of these fields. A home value that is None, or not valid any more, is assumed; the others stay.

    It has the capsules of the arm `before`, as long as every joint moves the same link in the same way, and those
    of its motors whose joint is still there and of the same kind.

    Raises:
        EditError: with what is wrong; `texts` tells in which cell.
    """
    data = {key: value for key, value in data.items() if not key.startswith("capsules")}
    if "motors" in data:
        data["motors"] = [motor for motor in data["motors"] if _fits(motor, data["rows"])]
    if "nominal" in data and _moving(data["nominal"]["rows"]) != _moving(data["rows"]):
        del data["nominal"]  # the arm is another one than that which was calibrated
    try:
        own = _with_home(data, start)
        robot = capsules_for(before, own.robot)
        return own_arm(kin.robot_to_dict(robot), start) if robot.capsules else own
    except (InputError, RobotFileError) as error:
        cell = _cell_of(error.field, texts or {})
        text = "" if cell is None or texts is None else f"“{cut(texts[cell])}” is not valid: "
        raise EditError(cell, f"{text}expected {error.expected}") from None
    except KinematicsError as error:
        raise EditError(None, str(error)) from None


def _with_home(data: Fields, start: str) -> OwnArm:
    """The arm of these fields, with assumed values for the joints whose home is None or outside their limits."""
    q = list(data["home"]["q"])
    kept = {joint for joint, value in enumerate(q) if value is not None}
    while True:
        if len(kept) < len(q):
            homeless = own_arm({key: value for key, value in data.items() if key != "home"}, start)
            assumed = kin.robot_to_dict(homeless.robot)["home"]["q"]
            q = [q[joint] if joint in kept else value for joint, value in enumerate(assumed)]
        try:
            return own_arm({**data, "home": {"q": q}}, start)
        except RobotFileError as error:
            field = _HOME.fullmatch(error.field)
            if field is None or int(field[1]) not in kept:
                raise
            kept.remove(int(field[1]))


def _moving(rows: list[Fields]) -> list[tuple[object, ...]]:
    """What moves in a table: names, kinds, and what they follow."""
    kinds = [(row["name"], row.get("kind", "revolute"), row.get("follows")) for row in rows]
    return [each for each in kinds if each[1] != "fixed"]


def _fits(motor: Fields, rows: list[Fields]) -> bool:
    """Whether the joint of a motor is one of these rows, and slides if the motor is one of a slide."""
    if "joint" not in motor:
        return True
    kinds = [row.get("kind", "revolute") for row in rows if row["name"] == motor["joint"]]
    return kinds == ["prismatic" if "lead" in motor else "revolute"]


def changed_rows(robot: Robot, own: OwnArm | None, change: Callable[[list[Fields]], None]) -> OwnArm:
    """The arm with another list of rows; a joint takes its home value along. Raises `EditError`."""
    data, start = fields_of(robot, own)
    homes = _homes(data)
    change(data["rows"])
    data["home"] = {"q": [homes.get(id(row)) for row in data["rows"] if _is_joint(row)]}
    return built(data, start, robot)


def _is_joint(row: Fields) -> bool:
    """Whether a row moves by itself."""
    return row.get("kind") != "fixed" and "follows" not in row


def _homes(data: Fields) -> dict[int, object]:
    """The home values of the joints, by the identity of their rows."""
    joints = [row for row in data["rows"] if _is_joint(row)]
    return {id(row): value for row, value in zip(joints, data["home"]["q"], strict=True)}


def add_row(rows: list[Fields], after: int, unit: str) -> None:
    """Insert a revolute row below row `after`."""
    taken = {row["name"] for row in rows}
    name = next(name for k in range(1, len(rows) + 2) if (name := f"joint {k}") not in taken)
    rows.insert(after + 1, {"name": name, "a": NEW_LINK if unit == "mm" else f"{NEW_LINK / 1000} m"})


def move_row(rows: list[Fields], index: int, by: int) -> None:
    """Swap a row with the one above (`by` −1) or below (+1)."""
    rows[index], rows[index + by] = rows[index + by], rows[index]


def row_change(action: str, index: int, unit: str) -> Callable[[list[Fields]], None]:
    """What a button does to the rows; raises `kin.InputError` for an unknown one."""
    changes: dict[str, Callable[[list[Fields]], None]] = {
        "add": lambda rows: add_row(rows, index, unit),
        "remove": lambda rows: rows.__delitem__(index),
        "up": lambda rows: move_row(rows, index, -1),
        "down": lambda rows: move_row(rows, index, 1),
    }
    if action not in changes:
        raise InputError("row", action, "one of " + ", ".join(changes))
    return changes[action]


def reread(robot: Robot, own: OwnArm | None, convention: str) -> OwnArm:
    """The arm that the same table describes in this convention; raises `EditError`."""
    data, start = fields_of(robot, own)
    data.pop("nominal", None)
    return built({**data, "convention": convention}, start, robot)


def frame_values(robot: Robot, frame: str) -> tuple[float, ...]:
    """x, y, z (m), roll, pitch and yaw (rad) of the arm's tool or base."""
    T = robot.T_last_tool if frame == "tool" else robot.T_world_base
    return (*T[:3, 3].tolist(), *roll_pitch_yaw(T[:3, :3]))


def _type_row(data: Fields, robot: Robot, index: int, column: str, text: str, units: Units) -> None:
    row, joint = data["rows"][index], robot.rows[index]
    if column == "name":
        row["name"] = text
        nominal = data.get("nominal", {}).get("rows", [])
        for key, tables in {"joint": data.get("motors", []), "name": nominal, "follows": nominal}.items():
            for each in tables:
                if each.get(key) == joint.name:
                    each[key] = text
        for each in data["rows"]:
            if each.get("follows") == joint.name:
                each["follows"] = text
    elif column == "kind":
        homes = _homes(data) | {id(row): None}
        row["kind"] = text
        for key in ("limits", *PEAK_FIELDS):
            row.pop(key, None)
        if text == "fixed":
            row.pop("follows", None)
            row.pop("ratio", None)
        data["home"] = {"q": [homes.get(id(each)) for each in data["rows"] if _is_joint(each)]}
    elif column in ("low", "high"):
        if joint.kind == "fixed":
            raise ReadError("a fixed row has no limits")
        is_angle = joint.kind == "revolute"
        if not isinstance(row.get("limits"), list):
            row["limits"] = [None, None]
        value = quantity(text, units, is_angle) if text.strip() else None
        row["limits"][column == "high"] = value
    elif column in MOTION:
        _type_motion(data, robot, index, column, text, units)
    else:
        row[column] = quantity(text, units, column in ANGLES)


def _type_motion(data: Fields, robot: Robot, index: int, column: str, text: str, units: Units) -> None:
    """The value of a joint in the home configuration, or one of its limits; without a text that is assumed."""
    row, turning = robot.rows[index], robot.rows[index].kind == "revolute"
    if row.kind == "fixed":
        raise ReadError("a fixed row does not move")
    if row.follows and column == "home":
        raise ReadError(f"this row follows {row.follows}")
    if column == "home":
        joint = sum(_is_joint(each) for each in data["rows"][:index])
        unit, low, high = units.of(turning), float(robot.lower[joint]), float(robot.upper[joint])
        if not low <= read_cell(text, unit) <= high:
            raise ReadError(f"“{cut(text)}” is outside the limits: {unit.text(low)} to {unit.text(high)}")
        data["home"]["q"][joint] = quantity(text, units, turning)
        return
    given = _PER_TIME.sub("", text).strip()
    data["rows"][index].pop(column, None)
    if given:
        data["rows"][index][column] = quantity(given, units, turning) + PER[column]


def _type_arm(data: Fields, robot: Robot, column: str, text: str, units: Units) -> None:
    """The name of the arm, what it is mounted on, or the height of the floor; without a text that is assumed."""
    if column == "mounting":
        _mount(data, robot, text)
    elif column == "floor":
        data.pop("floor", None)
        if text.strip():
            data["floor"] = quantity(text, units, False)
    else:
        data["name"] = text


def _mount(data: Fields, robot: Robot, kind: str) -> None:
    """Mount the arm on something else: it is turned with its base, which stays where it is."""
    if kind not in MOUNTINGS:
        raise ReadError(f"“{cut(kind)}” is none of " + ", ".join(MOUNTINGS))
    before, T = body(robot).mount, robot.T_world_base.copy()
    if kind != before.kind:
        data.pop("floor", None)
    data["mounting"] = kind
    T[:3, :3] = turn_of(kind) @ turn_of(before.kind).T @ T[:3, :3]
    data.pop("base", None)
    turned = kin.robot_to_dict(robot.with_base(T + 0.0))  # without zeros that are negative
    if "base" in turned:
        data["base"] = turned["base"]


def _type_frame(data: Fields, robot: Robot, frame: str, axis: str, text: str, units: Units) -> None:
    if "xyz" not in data.get(frame, {}) or "rpy" not in data[frame]:
        values = frame_values(robot, frame)
        data[frame] = {"xyz": [f"{v!r} m" for v in values[:3]], "rpy": [f"{v!r} rad" for v in values[3:]]}
    index = AXES.index(axis)
    data[frame]["xyz" if index < 3 else "rpy"][index % 3] = quantity(text, units, index >= 3)


def quantity(text: str, units: Units, is_angle: bool) -> str:
    """A typed number with its unit, as robot files take it."""
    return f"{read_cell(text, units.of(is_angle))!r} {'rad' if is_angle else 'm'}"


def _cell_of(field: str, texts: Mapping[Cell, str]) -> Cell | None:
    """The typed cell that an error of a robot file is about; None if it is about none of them."""
    if not texts:
        return None
    field = field.replace("limits", "low")
    for cell in texts:
        where, column = cell
        begin = f"rows[{where}]." if isinstance(where, int) else "" if where == "arm" else f"{where}."
        wanted = begin + ("low" if column == "high" else column)
        if field.startswith(wanted) or field == f"rows[].{column}":
            return cell
    return next(reversed(list(texts)))


def converted(robot: Robot, own: OwnArm | None) -> OwnArm:
    """The same arm as a table in the other convention; raises `EditError`."""
    other = kin.dh.convert_dh(robot, "modified" if robot.convention == "standard" else "standard")
    return with_table(robot, own, other)


def with_table(robot: Robot, own: OwnArm | None, other: Robot) -> OwnArm:
    """The arm with the table, base and tool of another one; raises `EditError`."""
    data, start = fields_of(robot, own)
    table = kin.robot_to_dict(replace(other, motors=()))
    kept: Fields = {key: data[key] for key in ("name", "source", "motors") if key in data}
    return built({**table, **kept}, start, robot)


def with_motors(robot: Robot, own: OwnArm | None, motors: Sequence[Motor]) -> OwnArm:
    """The arm with these motors; raises `EditError`, or `kin.InputError` for motors that do not fit it."""
    data, start = fields_of(robot, own)
    data["motors"] = kin.robot_to_dict(replace(robot, motors=tuple(motors))).get("motors", [])
    return built(data, start, robot)


def part_of(cell: Cell) -> str:
    """The part of the tab that a cell is in."""
    where, column = cell
    if isinstance(where, int):
        return "motion" if column in MOTION else "table"
    return "start" if cell == ("arm", "name") else "frames"


def alike(one: Robot, other: Robot, named: bool) -> bool:
    """Whether two robots have the same table and, if `named`, the same name."""
    about = {key: getattr(one, key) for key in ("id", "name", "source", "description", *OF_MAKER)}
    unnamed = replace(other, **about)
    return one == unnamed and (not named or one.name == other.name)
