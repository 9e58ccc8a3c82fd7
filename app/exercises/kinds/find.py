"""Drive the arm to where conditions hold: a singularity, a counterexample, another posture of the same pose.

Nothing is drawn to be reached: what the answer has to meet is a condition on the configuration, which the student
finds by moving the arm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Self

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
class Condition:
    """What an answer has to meet.

    Attributes:
        text: what is required, as a part of a sentence.
        holds: whether it is met; of the arm at the answer, as all names of the arm are.
        wrong: what is said if it is not.
        value, measure: said after `wrong`: a number, and whether it is an angle, a length or a plain number.
    """

    text: Words
    holds: Expression
    wrong: Words
    value: Expression | None
    measure: str

    @classmethod
    def read(cls, fields: Fields) -> Condition:
        """From a table."""
        found = cls(
            fields.words("text"),
            fields.expression("holds"),
            fields.words("wrong"),
            fields.expression("value") if fields.has("value") else None,
            fields.choice("measure", MEASURES, MEASURES[0]),
        )
        fields.done()
        return found

    def judge(self, asked: Variant, there: Variant, units: Units) -> tuple[bool, str]:
        """Whether it is met `there`, and what is said."""
        if there.number(self.holds):
            return True, f"Met: {asked.text(self.text, units)}."
        value = ""
        if self.value is not None:
            value = f" Here it is {size_text(there.number(self.value), self.measure, units)}."
        return False, f"{asked.text(self.wrong, units)}{value}"


@dataclass(frozen=True)
class FindKind(Kind):
    """See the module. The answer is a configuration: in the page, that of the arm.

    Attributes:
        stays: what of the tool must be as in the target, or at the configuration asked about; `NONE`: nothing.
        at: one right configuration, or the name of a function of the number of a joint that gives it.
        method: how it is found.
    """

    name: ClassVar[str] = "find"
    about: ClassVar[str] = "The arm is driven to where conditions hold."

    conditions: tuple[Condition, ...]
    stays: str
    at: tuple[Expression, ...] | str
    method: Words

    @classmethod
    def read(cls, fields: Fields) -> Self:
        conditions = tuple(Condition.read(item) for item in fields.tables("conditions", 1))
        if len(conditions) > _MOST:
            raise fields.refuse("conditions", len(conditions), f"1 to {_MOST} conditions")
        at: tuple[Expression, ...] | str = ()
        if isinstance(fields.get("at"), str):
            at = fields.text("at")
            fields.check_function("at", at)
        else:
            at = fields.expressions("at", 1)
        return cls(conditions, fields.choice("stays", (NONE, *TASKS), NONE), at, fields.words("method"))

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
