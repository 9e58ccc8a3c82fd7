"""What is typed into the fields of a row, in the visitor's units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import kin
from app.viewer.own_arm import clean
from app.viewer.panel.entry import read_value
from app.viewer.tabs.program.program import NAME, Point, point, recorded, with_target
from kin import InputError, Robot
from kin.axes import inverse
from kin.files.numbers import index_of
from kin.ik import Task
from kin.motion import Circ, Dwell, JointTarget
from kin.motion.program import LONGEST_DWELL, Segment
from kin.poses import PoseKind, read_pose, roll_pitch_yaw
from kin.transforms import Array
from kin.typed import EntryError, ReadError, cut, read
from kin.units import Unit, Units, general

SLOWEST, FARTHEST, LEAST, FASTEST = 1.0, 1000.0, 1e-9, 1000.0  # %; m; m/s or rad/s
SECONDS, PERCENT = Unit("s", 1.0, 3), Unit("%", 1.0, 0)
EXACT = 12  # digits of a typed joint value


@dataclass(frozen=True, eq=False)
class Fields:
    """How the values of a row are written and read.

    Attributes:
        robot, units: of the visitor.
        frame: the frame ``(4, 4)`` in which poses are shown, in the world frame.
        task: how much of a typed pose is to be met.
    """

    robot: Robot
    units: Units
    frame: Array
    task: Task

    def joints(self, q: Array) -> list[tuple[str, str, str]]:
        """Name, value and unit of each joint."""
        rows = zip(self.robot.joints, self.robot.revolute.tolist(), q.tolist(), strict=True)
        named = [(joint.name, self.units.of(turning), value) for joint, turning, value in rows]
        return [(name, unit.number(value, 3), unit.name) for name, unit, value in named]

    def place(self, q: Array) -> tuple[str, str]:
        """The tool's position, and roll, pitch and yaw."""
        T = inverse(self.frame) @ kin.fk(self.robot, q)
        lengths, angles = self.units.lengths, self.units.angles
        turns = " ".join(angles.number(value, 3) for value in roll_pitch_yaw(T[:3, :3]))
        return " ".join(lengths.number(value, 3) for value in T[:3, 3].tolist()), turns

    def via(self, place: Point) -> str:
        """The via point of an arc."""
        shown = inverse(self.frame) @ [*place, 1.0]
        return " ".join(self.units.lengths.number(value, 3) for value in shown[:3].tolist())

    def size(self, value: float | None, is_angle: bool = False) -> str:
        """A zone or a limit of the tool; empty if there is none."""
        return "" if not value else general(value * self.units.of(is_angle).scale)

    def read(self, field: str, text: object, row: Segment, q: Sequence[Array] = (), index: int = 0) -> Segment:
        """The row with what was typed into a field.

        Args:
            q: configurations ``(n,)`` of its targets.
            index: of the point of a spline.

        Raises:
            EntryError: with what would be valid.
            InputError: no field of this row.
        """
        if not isinstance(text, str):
            raise InputError(field, text, "a text")
        if field == "name":
            return replace(row, name=clean(text, NAME))
        if isinstance(row, Dwell):
            if field != "seconds":
                raise InputError("field", field, "name or seconds")
            return replace(row, seconds=read_number(text, SECONDS, 0.0, LONGEST_DWELL))
        match field:
            case "speed":
                return replace(row, speed=self.part(text))
            case "acceleration":
                return replace(row, acceleration=self.part(text))
            case "blend":
                return replace(row, blend=self.blend(text))
            case "tool_speed":
                return replace(row, tool_speed=self._limit(text, False))
            case "tool_turn":
                return replace(row, tool_turn=self._limit(text, True))
        if field == "via" and isinstance(row, Circ):
            T, _ = read_pose("position", text, self.units, inverse(self.frame) @ kin.fk(self.robot, q[index]))
            return replace(row, via=point((self.frame @ T)[:3, 3]))
        return with_target(row, index, self._target(field, text, q[index]), self.robot)

    @staticmethod
    def part(text: str) -> float:
        """A typed part of the limits, from 0.01 to 1."""
        return read_number(text, PERCENT, SLOWEST, 100.0) / 100.0

    def blend(self, text: str) -> float:
        """A typed radius of a zone (m); 0 for an empty text."""
        unit = self.units.lengths
        valid = f"0 to {unit.short(FARTHEST)}{unit.suffix}, or nothing: the arm stops"
        return _within(text, unit, 0.0, FARTHEST, valid) if text.strip() else 0.0

    def _limit(self, text: str, is_angle: bool) -> float | None:
        """A typed limit of the tool (m/s, rad/s); None for an empty text."""
        unit, cleaned = self.units.of(is_angle), text.replace("/s", "").strip()
        valid = f"above 0, at most {unit.short(FASTEST)}{unit.suffix}/s, or nothing: no limit"
        return _within(cleaned, unit, LEAST, FASTEST, valid) if cleaned else None

    def _target(self, field: str, text: str, q: Array) -> JointTarget:
        """The configuration q ``(n,)`` with another joint value, or the closest one with the tool elsewhere."""
        joint = index_of(field[1:], self.robot.n) if field.startswith("q") else None
        if joint is not None:
            limits = float(self.robot.lower[joint]), float(self.robot.upper[joint])
            unit = self.units.of(bool(self.robot.revolute[joint]))
            changed = q.copy()
            changed[joint] = read_value(text, f"Joint {joint + 1}", unit, limits)
            return recorded(changed, EXACT)
        named: dict[str, PoseKind] = {"position": "position", "angles": "angles"}
        if field not in named:
            raise InputError("field", field, "a field of a waypoint")
        T, _ = read_pose(named[field], text, self.units, inverse(self.frame) @ kin.fk(self.robot, q))
        found = kin.solve_ik(self.robot, self.frame @ T, q_seed=q, task=self.task)
        if not found.solutions:
            said = found.explain(self.units)
            raise EntryError("The waypoint stays as it was", f"{said.headline}: {said.body}")
        return recorded(found.solutions[0].q, EXACT)


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
