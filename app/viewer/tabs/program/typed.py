"""What is typed into the fields of a row, in the visitor's units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import kin
from app.viewer.declared.fields import Measure, Number
from app.viewer.own_arm import clean
from app.viewer.panel.entry import read_value
from app.viewer.tabs.program.program import NAME, Point, point, recorded, with_target
from kin import InputError, Robot
from kin.axes import inverse
from kin.files.numbers import index_of
from kin.ik import Task
from kin.motion import Circ, JointTarget
from kin.motion.program import LONGEST_DWELL, Pause, Segment, field_names
from kin.poses import PoseKind, read_pose, roll_pitch_yaw
from kin.transforms import Array
from kin.typed import EntryError
from kin.units import Units

SLOWEST, FARTHEST = 0.01, 1000.0  # of the limits; m
LEAST, FASTEST = 1e-7, 1000.0  # m/s or rad/s
EXACT = 12  # digits of a typed joint value
# By the fields of segments: a row has those of its class.
NUMBERS = {
    "opening": Number(
        label="Opening",
        limits=(0.0, 1.0),
        measure="%",
        hint="How far the gripper is open then: 0 % closed, 100 % open",
    ),
    "seconds": Number(label="Wait", limits=(0.0, LONGEST_DWELL), measure="s"),
    "speed": Number(
        label="Speed", limits=(SLOWEST, 1.0), measure="%", hint="Part of the velocity limits of the joints"
    ),
    "acceleration": Number(
        label="Acceleration",
        limits=(SLOWEST, 1.0),
        measure="%",
        hint="Part of the acceleration and jerk limits of the joints",
    ),
    "blend": Number(
        label="Zone radius",
        limits=(0.0, FARTHEST),
        measure="length",
        hint="Blend radius: within it the path may leave for the next waypoint. Empty: the arm stops here",
        empty="the arm stops",
        nothing=0.0,
    ),
    "tool_speed": Number(
        label="Tool speed ≤",
        limits=(LEAST, FASTEST),
        measure="length",
        hint="Largest speed of the tool point, for a process such as welding, or for safety beside people. Empty: "
        "only the joints limit it",
        rate=True,
        empty="no limit",
    ),
    "tool_turn": Number(
        label="Tool turn ≤",
        limits=(LEAST, FASTEST),
        measure="angle",
        hint="Largest angular velocity of the tool, for example so that a full cup does not spill. Empty: only "
        "the joints limit it",
        rate=True,
        empty="no limit",
    ),
}


class Fields(NamedTuple):
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

    def numbers(self, row: Segment) -> list[dict[str, object]]:
        """The numbers of its class, for a form."""
        known = field_names(type(row))
        return [
            field.cell(name, getattr(row, name), self.units) for name, field in NUMBERS.items() if name in known
        ]

    def joints(self, q: Array) -> list[dict[str, object]]:
        """The joint values, likewise."""
        found = []
        for i, (joint, turning) in enumerate(zip(self.robot.joints, self.robot.revolute.tolist(), strict=True)):
            measure: Measure = "angle" if turning else "length"
            spec = Number(label=f"{i + 1} {joint.name}", measure=measure, hint=joint.name)
            value = self.units.of(turning).number(float(q[i]), 3)
            found.append(spec.cell(f"q{i}", None, self.units) | {"value": value})
        return found

    def place(self, q: Array) -> tuple[str, str]:
        """The tool's position, and roll, pitch and yaw."""
        T = inverse(self.frame) @ kin.fk(self.robot, q)
        turns = " ".join(self.units.angles.number(value, 3) for value in roll_pitch_yaw(T[:3, :3]))
        return self._point(T[:3, 3]), turns

    def via(self, place: Point) -> str:
        """The via point of an arc."""
        return self._point((inverse(self.frame) @ [*place, 1.0])[:3])

    def _point(self, values: Array) -> str:
        return " ".join(self.units.lengths.number(value, 3) for value in values.tolist())

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
        if field in NUMBERS and field in field_names(type(row)):
            changed: Any = {field: NUMBERS[field].typed(text, self.units)}
            return replace(row, **changed)
        if isinstance(row, Pause):
            raise InputError("field", field, "one of " + ", ".join(field_names(type(row))))
        if field == "via" and isinstance(row, Circ):
            T, _ = read_pose("position", text, self.units, inverse(self.frame) @ kin.fk(self.robot, q[index]))
            return replace(row, via=point((self.frame @ T)[:3, 3]))
        return with_target(row, index, self._target(field, text, q[index]), self.robot)

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
