"""Rows of a DH table. Every choice of frames that describes the same arm is right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from typing import ClassVar

import numpy as np

import kin
from app.exercises import cell
from app.exercises.contract import Kind
from app.exercises.fields import Fields
from app.exercises.questions import Asked, Verdict
from app.exercises.rows import ANGULAR, FACTORS, NAMES, Accepted, Line, Row, angle_between, read_rows, typed_rows
from app.exercises.variant import Variant
from kin import Robot
from kin.robot import CONVENTIONS, Convention
from kin.transforms import Array
from kin.units import DEGREES, Units

ACCEPTED = Accepted(math.radians(1.0), 2e-3)
_WORDS: dict[Convention, str] = {"standard": "the standard convention", "modified": "Craig’s convention"}


def _read_numbers_of_rows(table: Fields, name: str) -> tuple[int, ...]:
    rows = table.items(name, 1)
    if not all(type(row) is int and row >= 1 for row in rows) or rows != [*range(rows[0], rows[0] + len(rows))]:
        raise table.refuse(name, rows, "consecutive numbers of rows, from 1")
    return tuple(rows)


@dataclass(frozen=True)
class DHKind(Kind):
    """See the module.

    The values are those of the exercise’s posture, so that no zero of a joint has to be agreed. What counts are
    the joint axes, as lines, and the pose of the tool: two tables that agree in these move in the same way.
    """

    name: ClassVar[str] = "dh"
    about: ClassVar[str] = "Rows of a DH table are filled in; any legitimate choice of frames is right."
    shows_posture: ClassVar[bool] = True
    withholds: ClassVar[frozenset[str]] = frozenset({"table"})

    rows: tuple[int, ...] = cell.special(
        "Rows", "Consecutive numbers from 1, one in each line.", "numbers", _read_numbers_of_rows
    )
    convention: Convention | None = cell.special(
        "Convention",
        "None: that of the arm.",
        "choice",
        lambda table, name: table.choice(name, CONVENTIONS) if table.has(name) else None,
        options=CONVENTIONS,
    )

    @property
    def first(self) -> int:
        """The index of the first row."""
        return self.rows[0] - 1

    @property
    def last(self) -> int:
        """The index of the last row."""
        return self.rows[-1] - 1

    def _arm(self, variant: Variant) -> Robot:
        robot = variant.robot
        arm = robot if self.convention is None else kin.dh.convert_dh(robot, self.convention)
        if self.last >= len(arm.rows):
            raise ValueError(f"row {self.last + 1} does not exist: the arm has {len(arm.rows)} rows")
        return arm

    def asked(self, variant: Variant, units: Units) -> Asked:
        arm = self._arm(variant)
        names = tuple(units.of(angular).name for angular in ANGULAR)
        note = (
            f"In {_WORDS[arm.convention]}, with the values of the exercise’s posture. "
            f"± {units.angles.brief(ACCEPTED.angle)}, ± {units.lengths.brief(ACCEPTED.length)}. "
            "The tab Robot shows the arm’s table when the answer is known."
        )
        return Asked("table", NAMES, names, note, self.last - self.first + 1, self.first + 1)

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        arm, count = self._arm(variant), self.last - self.first + 1
        rows = read_rows(given, count, self.first, units)
        wrong = self._faults(arm, variant.q, rows)
        if not any(wrong):
            return Verdict(True, self._praise(variant, arm, rows))
        parts = tuple((not why, f"Row {self.first + i + 1}: {why or 'right.'}") for i, why in enumerate(wrong))
        credit = round(sum(not why for why in wrong) / count, 3)
        other: Convention = "modified" if arm.convention == "standard" else "standard"
        if not any(self._faults(kin.dh.convert_dh(arm, other), variant.q, rows)):
            said = f"This is correct for the other convention, {_WORDS[other]}. Asked is {_WORDS[arm.convention]}."
            return Verdict(False, said, 0.5, parts)
        if slip := self._unit_slip(arm, variant.q, rows, units):
            return Verdict(False, slip, 0.5, parts)
        place = next(i for i, why in enumerate(wrong) if why)
        sign = self._sign_slip(arm, variant.q, rows, place)
        return Verdict(False, sign or f"Row {self.first + place + 1}: {wrong[place]}", credit, parts)

    def _faults(self, arm: Robot, q: Array, rows: Sequence[Row]) -> list[str]:
        """What is wrong after each row; "" where nothing is. After a wrong row the right frame is taken."""
        frames = [arm.T_world_base, *_chain(arm.T_world_base, _rows_at(arm, q), arm.convention)]
        found: list[str] = []
        T = frames[self.first]
        for i, row in enumerate(rows):
            k = self.first + i
            T = T @ row.matrix(arm.convention)
            fault = _fault(arm, k, T, frames[k + 1])
            found.append(fault)
            if fault:
                T = frames[k + 1]
        return found

    def _praise(self, variant: Variant, arm: Robot, rows: Sequence[Row]) -> str:
        """Whether these are the arm's own rows, or another choice."""
        own = _rows_at(arm, variant.q)[self.first : self.last + 1]
        same = all(
            np.allclose(a.matrix(arm.convention), b.matrix(arm.convention), atol=ACCEPTED.length)
            for a, b in zip(rows, own, strict=True)
        )
        if same:
            return "These rows are those of the arm’s own table."
        return "Other frames than in the arm’s own table, for the same joint axes: the arm moves in the same way."

    def _unit_slip(self, arm: Robot, q: Array, rows: Sequence[Row], units: Units) -> str:
        if units.degrees:
            turned = [
                replace(row, theta=row.theta * DEGREES.scale, alpha=row.alpha * DEGREES.scale) for row in rows
            ]
            if not any(self._faults(arm, q, turned)):
                return "The angles are in radians; the unit is degrees. Type rad after a number to give radians."
        for scale, words in ((units.lengths.scale, "metres"), (1e-3 * units.lengths.scale, "millimetres")):
            longer = [replace(row, d=row.d * scale, a=row.a * scale) for row in rows]
            if abs(scale - 1.0) > 1e-9 and not any(self._faults(arm, q, longer)):
                return f"The lengths are in {words}; the unit is {units.lengths.name}."
        return ""

    def _sign_slip(self, arm: Robot, q: Array, rows: Sequence[Row], place: int) -> str:
        for name, factor in zip(NAMES, FACTORS, strict=True):
            other = replace(rows[place], **{factor: -getattr(rows[place], factor)})
            tried = [*rows[:place], other, *rows[place + 1 :]]
            if not self._faults(arm, q, tried)[place]:
                return f"Row {self.first + place + 1} is right but for the sign of {name}."
        return ""

    def answer(self, variant: Variant) -> object:
        return typed_rows(_rows_at(self._arm(variant), variant.q)[self.first : self.last + 1])

    def solution(self, variant: Variant, units: Units) -> str:
        rows = _rows_at(self._arm(variant), variant.q)[self.first : self.last + 1]
        said = [
            f"Row {self.first + i + 1}: "
            + ", ".join(
                f"{name} = {units.of(angular).text(value, 1)}"
                for name, value, angular in zip(NAMES, astuple(row), ANGULAR, strict=True)
            )
            for i, row in enumerate(rows)
        ]
        return f"{'; '.join(said)}."


def _rows_at(arm: Robot, q: Array) -> list[Row]:
    """The rows with the joint values added."""
    values = dict(zip(arm.joint_rows, q.tolist(), strict=True))
    return [Row.of(row, values.get(i, 0.0)) for i, row in enumerate(arm.rows)]


def _chain(base: Array, rows: Sequence[Row], convention: Convention) -> list[Array]:
    frames, T = [], base
    for row in rows:
        T = T @ row.matrix(convention)
        frames.append(T)
    return frames


def _fault(arm: Robot, k: int, T: Array, right: Array) -> str:
    """What is wrong with the frame after row k; "" if its z axis is the joint's line, or the tool is right."""
    joint_row = k + 1 if arm.convention == "standard" else k
    last = k == len(arm.rows) - 1
    kind = arm.rows[joint_row].kind if joint_row < len(arm.rows) else "fixed"
    if kind == "fixed" or last:
        distance, angle = float(np.linalg.norm(T[:3, 3] - right[:3, 3])), angle_between(T[:3, 2], right[:3, 2])
        if distance > ACCEPTED.length:
            return f"the frame after it is {1e3 * distance:.0f} mm from its place."
        if angle > ACCEPTED.angle:
            return f"the z axis after it is off by {math.degrees(angle):.0f}°."
        return ""
    number = 1 + arm.joint_rows.index(joint_row)
    miss = Line(right[:3, 3], right[:3, 2]).missed_by(T)
    if miss.angle > ACCEPTED.angle:
        return f"the axis of joint {number} points elsewhere, off by {math.degrees(miss.angle):.0f}°."
    if kind == "revolute" and miss.distance > ACCEPTED.length:
        away = f"{1e3 * miss.distance:.0f} mm from its place."
        return f"the axis of joint {number} has the right direction, but it is {away}"
    return ""
