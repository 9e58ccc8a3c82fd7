"""What is typed into the fields of a waypoint or a pause, in the visitor's units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import kin
from app.viewer.own_arm import clean
from app.viewer.panel.entry import read_value
from app.viewer.tabs.program.items import LEAST, NAME, Item, configuration, point
from kin import InputError, Robot, Task
from kin.axes import inverse
from kin.files.numbers import index_of
from kin.motion.program import LONGEST_DWELL
from kin.poses import PoseKind, read_pose, roll_pitch_yaw
from kin.transforms import Array
from kin.typed import EntryError, ReadError, cut, read
from kin.units import Unit, Units, general

FARTHEST, FASTEST = 1000.0, 1000.0  # m; m/s or rad/s
SECONDS, PERCENT = Unit("s", 1.0, 3), Unit("%", 1.0, 0)
EXACT = 12  # digits of a typed joint value


@dataclass(frozen=True, eq=False)
class Fields:
    """How the values of an item are written and read.

    Attributes:
        robot, units: of the visitor.
        frame: the frame ``(4, 4)`` in which poses are shown, in the world frame.
        task: how much of a typed pose is to be met.
    """

    robot: Robot
    units: Units
    frame: Array
    task: Task

    def joints(self, item: Item) -> list[tuple[str, str, str]]:
        """Name, value and unit of each joint."""
        rows = zip(self.robot.joints, self.robot.revolute.tolist(), item.q, strict=True)
        named = [(joint.name, self.units.of(turning), value) for joint, turning, value in rows]
        return [(name, unit.number(value, 3), unit.name) for name, unit, value in named]

    def place(self, item: Item) -> tuple[str, str]:
        """The tool's position, and roll, pitch and yaw."""
        T = inverse(self.frame) @ kin.fk(self.robot, np.array(item.q))
        lengths, angles = self.units.lengths, self.units.angles
        turns = " ".join(angles.number(value, 3) for value in roll_pitch_yaw(T[:3, :3]))
        return " ".join(lengths.number(value, 3) for value in T[:3, 3].tolist()), turns

    def via(self, item: Item) -> str:
        """The via point of an arc."""
        shown = inverse(self.frame) @ [*(item.via or (0.0, 0.0, 0.0)), 1.0]
        return " ".join(self.units.lengths.number(value, 3) for value in shown[:3].tolist())

    def size(self, value: float | None, is_angle: bool = False) -> str:
        """A zone or a limit of the tool; empty if there is none."""
        return "" if not value else general(value * self.units.of(is_angle).scale)

    def read(self, field: str, text: object, item: Item) -> Mapping[str, Any]:
        """The values of an item that a typed text changes.

        Raises:
            EntryError: with what would be valid.
            InputError: no field of an item.
        """
        if not isinstance(text, str):
            raise InputError(field, text, "a text")
        match field:
            case "name":
                return {"name": clean(text, NAME)}
            case "speed" | "acceleration":
                return {field: read_number(text, PERCENT, 1.0, 100.0) / 100.0}
            case "seconds":
                return {"seconds": read_number(text, SECONDS, 0.0, LONGEST_DWELL)}
            case "blend":
                return {"blend": self._blend(text)}
            case "tool_speed" | "tool_turn":
                return {field: self._limit(text, field == "tool_turn")}
        if not item.q:
            raise InputError("field", field, "name or seconds")
        return self._pose(field, text, item)

    def _blend(self, text: str) -> float:
        """A typed radius of a zone (m); 0 for an empty text."""
        unit = self.units.lengths
        valid = f"0 to {unit.short(FARTHEST)}{unit.suffix}, or nothing: the arm stops"
        return _within(text, unit, 0.0, FARTHEST, valid) if text.strip() else 0.0

    def _limit(self, text: str, is_angle: bool) -> float | None:
        """A typed limit of the tool (m/s, rad/s); None for an empty text."""
        unit, cleaned = self.units.of(is_angle), text.replace("/s", "").strip()
        valid = f"above 0, at most {unit.short(FASTEST)}{unit.suffix}/s, or nothing: no limit"
        return _within(cleaned, unit, LEAST, FASTEST, valid) if cleaned else None

    def _pose(self, field: str, text: str, item: Item) -> Mapping[str, Any]:
        robot, kind = self.robot, field.rstrip("0123456789")
        joint = index_of(field[1:], robot.n) if kind == "q" else None
        if joint is not None:
            turning = bool(robot.revolute[joint])
            limits = float(robot.lower[joint]), float(robot.upper[joint])
            value = read_value(text, f"Joint {joint + 1}", self.units.of(turning), limits)
            return {"q": (*item.q[:joint], round(value, EXACT), *item.q[joint + 1 :])}
        present = inverse(self.frame) @ kin.fk(robot, np.array(item.q))
        if field == "via":
            T, _ = read_pose("position", text, self.units, present)
            return {"via": point((self.frame @ T)[:3, 3])}
        named: dict[str, PoseKind] = {"position": "position", "angles": "angles"}
        if field in named:
            T, _ = read_pose(named[field], text, self.units, present)
            return {"q": self._solved(self.frame @ T, item)}
        raise InputError("field", field, "a field of a waypoint")

    def _solved(self, T: Array, item: Item) -> tuple[float, ...]:
        """The configuration closest to that of the item with the tool at a pose ``(4, 4)``."""
        found = kin.solve_ik(self.robot, T, q_seed=np.array(item.q), task=self.task)
        if not found.solutions:
            said = found.explain(self.units)
            raise EntryError("The waypoint stays as it was", f"{said.headline}: {said.body}")
        return configuration(found.solutions[0].q, EXACT)


def read_number(text: object, unit: Unit, low: float, high: float) -> float:
    """A number that a text in a field is, rounded to a thousandth.

    Raises:
        EntryError: with what would be valid.
        InputError: no text.
    """
    if not isinstance(text, str):
        raise InputError("field", text, "a text")
    return round(_within(text, unit, low, high, f"{low:.10g} to {high:.10g} {unit.name}".rstrip()), 3)


def _within(text: str, unit: Unit, low: float, high: float, valid: str) -> float:
    """A number between two others; raises `EntryError` with what is `valid`."""
    title = "The field stays as it was"
    try:
        value = read(text, unit, (low, high))
    except ReadError as error:
        raise EntryError(title, f"{error.sentence} Valid: {valid}.", error.readings) from None
    if not low <= value <= high:
        raise EntryError(title, f"“{cut(text)}” is not valid. Valid: {valid}.")
    return value
