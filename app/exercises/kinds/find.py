"""Drive the arm to where conditions hold: a singularity, a counterexample, another posture of the same pose.

Nothing is drawn to be reached: what the answer has to meet is a condition on the configuration, which the student
finds by moving the arm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from app.exercises import cell
from app.exercises.cell import Declared
from app.exercises.contract import Kind, listed, numbers
from app.exercises.expressions import Expression
from app.exercises.fields import Fields, Words
from app.exercises.kinds.reach import at_target, outside_limits
from app.exercises.questions import Asked, Verdict
from app.exercises.variant import Quantity, Variant
from kin import InputError
from kin.ik.options import TASKS
from kin.transforms import Array
from kin.units import Units, general

NONE = "none"
MEASURES = ("number", "angle", "length")
POSITION, ROTATION = 5e-3, math.radians(3.0)  # by which the tool may be off where it has to stay
_MOST = 6  # conditions


@dataclass(frozen=True)
class Condition(Declared):
    """What an answer has to meet. Names of the arm in `holds` and `value` are of the arm at the answer."""

    text: Words = cell.words("Required", "As a part of a sentence.")
    holds: Expression = cell.expression("Holds if", "An expression about the arm at the answer.")
    wrong: Words = cell.words("Otherwise", "Said if it does not hold.")
    value: Expression | None = cell.optional_expression("Value", "Said after that.")
    measure: str = cell.choice("Shown as", "", MEASURES, MEASURES[0])

    def judge(self, asked: Variant, there: Variant, units: Units) -> tuple[bool, str]:
        """Whether it is met `there`, and what is said."""
        if there.number(self.holds):
            return True, f"Met: {asked.text(self.text, units)}."
        value = ""
        if self.value is not None:
            value = f" Here it is {size_text(there.number(self.value), self.measure, units)}."
        return False, f"{asked.text(self.wrong, units)}{value}"


def _read_instance(table: Fields, name: str) -> tuple[Expression, ...] | str:
    if not isinstance(table.get(name), str):
        return table.expressions(name, 1)
    function = table.text(name)
    table.check_function(name, function)
    return function


@dataclass(frozen=True)
class FindKind(Kind):
    """See the module. The answer is a configuration: in the page, that of the arm.

    Attributes:
        stays: what of the tool must be as in the target, or at the configuration asked about; `NONE`: nothing.
        at: one right configuration, or the name of a function of the number of a joint that gives it.
    """

    name: ClassVar[str] = "find"
    about: ClassVar[str] = "The arm is driven to where conditions hold."

    conditions: tuple[Condition, ...] = cell.rows(
        Condition,
        "Conditions",
        "All of them must hold where the arm is driven.",
        "condition",
        {"text": "the tool is above the base", "holds": "z > pz(0)", "wrong": "It is not above the base."},
        least=1,
        most=_MOST,
    )
    stays: str = cell.choice("What stays", "Of the tool, as in the target.", (NONE, *TASKS), NONE)
    at: tuple[Expression, ...] | str = cell.special(
        "For instance at", "One right configuration, one joint in each line.", "expressions", _read_instance
    )
    method: Words = cell.words("Method", "How one is found.")

    def asked(self, variant: Variant, units: Units) -> Asked:
        wanted = [variant.text(one.text, units) for one in self.conditions]
        if self.stays != NONE:
            what = {"pose": "the tool stays in its pose", "position": "the tool point stays"}
            wanted.insert(0, what.get(self.stays, "tool point and approach direction stay"))
        return Asked(
            "posture", note=f"Required: {listed(wanted)}.", goal=None if self.stays == NONE else variant.pose
        )

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        robot = variant.robot
        q = numbers(given, robot.n, "one configuration in radians and metres")
        there = replace(variant, q=q)
        parts = [one.judge(variant, there, units) for one in self.conditions]
        if self.stays != NONE:
            parts.insert(0, at_target(variant, q, units, self.stays, POSITION, ROTATION))
        if outside := outside_limits(robot, q):
            parts.append((False, outside))
        verdict = Verdict.of(parts, "All that is required holds here.")
        return verdict if verdict.right else replace(verdict, way=variant.text(self.method, units))

    def answer(self, variant: Variant) -> object:
        if isinstance(self.at, str):
            function = variant.scope[self.at]
            assert callable(function)
            return [float(function(joint)) for joint in range(1, variant.robot.n + 1)]
        found: Array = variant.vector(self.at)
        if len(found) != variant.robot.n:
            raise InputError("at", len(found), f"{variant.robot.n} values, one per joint")
        return found.tolist()

    def solution(self, variant: Variant, units: Units) -> str:
        values: list[float] = self.answer(variant)  # type: ignore[assignment]
        joints = listed(
            [
                f"joint {i + 1} at {units.of(bool(turns)).text(value, 1)}"
                for i, (value, turns) in enumerate(zip(values, variant.robot.revolute, strict=True))
            ]
        )
        return f"{variant.text(self.method, units)} For instance {joints}."


def size_text(value: float, measure: str, units: Units) -> str:
    """A value in the reader's units; a plain number with three digits."""
    return Quantity(value, measure).text(units) if measure != MEASURES[0] else general(value, 3)
