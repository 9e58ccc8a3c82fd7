"""A number, or a vector of numbers, with unit and tolerance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Self

from app.exercises.contract import Asked, Kind, texts, typed
from app.exercises.expressions import Expression
from app.exercises.fields import Fields
from app.exercises.judging import Verdict, judge, read, tolerance_text, value_text
from app.exercises.questions import WHOLE, Mistake, Number
from app.exercises.variant import Variant
from kin.units import DEGREES, PLAIN, RADIANS, Unit, Units

# Units of a file, and what one of them is in radians, metres or SI.
SCALES = {"deg": math.pi / 180, "rad": 1.0, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "": 1.0, "count": 1.0, "joint": 1.0}
MEASURES = {"deg": "angle", "rad": "angle", "mm": "length", "cm": "length", "m": "length"}
OTHER = ("m/s", "m/rad", "rad/s", "N", "N·m", "s", "kg", "J")


@dataclass(frozen=True)
class NumberKind(Kind):
    """See the module."""

    name: ClassVar[str] = "number"
    about: ClassVar[str] = "A number or a vector is typed; a unit may follow it."

    values: tuple[Expression, ...]
    labels: tuple[str, ...]
    unit: str
    tolerance: float
    method: str
    whole_turns: bool
    mistakes: tuple[tuple[tuple[Expression, ...], str], ...]

    @classmethod
    def read(cls, fields: Fields) -> Self:
        values = fields.expressions("value", 1)
        unit = fields.choice("unit", (*SCALES, *OTHER), "")
        labels = fields.texts("labels") or ("",) * len(values)
        if len(labels) != len(values):
            raise fields.refuse("labels", list(labels), f"as many labels as values: {len(values)}")
        tolerance = (
            WHOLE if unit in ("count", "joint") else fields.number("tolerance", above=0.0) * SCALES.get(unit, 1.0)
        )
        mistakes = []
        for item in fields.tables("mistakes"):
            wrong = item.expressions("value", 1)
            if len(wrong) != len(values):
                raise item.refuse("value", len(wrong), f"as many values as the answer has: {len(values)}")
            mistakes.append((wrong, item.text("reason")))
            item.done()
        return cls(
            values, labels, unit, tolerance, fields.text("method"), fields.flag("whole_turns"), tuple(mistakes)
        )

    def _shown_unit(self, units: Units) -> Unit:
        match MEASURES.get(self.unit):
            case "angle":
                return units.angles
            case "length":
                return units.lengths
        return Unit(self.unit, 1.0, 3) if self.unit in OTHER else PLAIN

    def _questions(self, variant: Variant, units: Units) -> list[Number]:
        unit, method = self._shown_unit(units), variant.text(self.method, units)
        wrong = [(variant.vector(values), variant.text(reason, units)) for values, reason in self.mistakes]
        return [
            Number(
                label or "Your answer", variant.number(value), unit, self.tolerance, method,
                tuple(Mistake(float(values[i]), reason) for values, reason in wrong), self.whole_turns,
                ordered=self.unit != "joint",
            )
            for i, (value, label) in enumerate(zip(self.values, self.labels, strict=True))
        ]  # fmt: skip

    def asked(self, variant: Variant, units: Units) -> Asked:
        questions = self._questions(variant, units)
        return Asked(
            "fields", self.labels, (questions[0].unit.name,) * len(questions), tolerance_text(questions[0])
        )

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        questions = self._questions(variant, units)
        typed_texts = texts(given, len(questions), "the numbers in the order asked")
        values = [read(question, text) for question, text in zip(questions, typed_texts, strict=True)]
        found = [judge(question, value) for question, value in zip(questions, values, strict=True)]
        slips = [_slip(question, value) for question, value in zip(questions, values, strict=True)]
        if len(questions) == 1:
            return Verdict(False, slips[0]) if slips[0] and not found[0].right else found[0]
        parts = [
            (one.right, f"{label}: {one.reason if one.right or not slip else slip}")
            for label, one, slip in zip(self.labels, found, slips, strict=True)
        ]
        verdict = Verdict.of(parts, "All parts are right.")
        if not verdict.right and (swap := _swapped(questions, values, self.labels)):
            return Verdict(False, swap, verdict.credit, verdict.parts)
        return verdict

    def answer(self, variant: Variant) -> object:
        return [typed(variant.number(value), self._shown_unit(Units())) for value in self.values]

    def solution(self, variant: Variant, units: Units) -> str:
        questions = self._questions(variant, units)
        shown = ", ".join(
            f"{label} = {value_text(question)}" if label else value_text(question)
            for label, question in zip(self.labels, questions, strict=True)
        )
        return f"{shown}. {questions[0].method}"


def _slip(question: Number, value: float) -> str:
    """What the number would be right in: another unit; "" if in none."""
    typed_number = value * question.unit.scale
    for name, scale, words in _other_units(question.unit):
        if abs(typed_number / scale - question.answer) <= question.tolerance and typed_number:
            return f"This is the value in {words}. The unit is {_words(question.unit)}; or type {name} after it."
    return ""


def _other_units(unit: Unit) -> list[tuple[str, float, str]]:
    """Name, how many make one SI unit, and words of the units that a number may have been meant in."""
    angles = [("rad", RADIANS.scale, "radians"), ("°", DEGREES.scale, "degrees")]
    lengths = [("m", 1.0, "metres"), ("cm", 1e2, "centimetres"), ("mm", 1e3, "millimetres")]
    for family in (angles, lengths):
        if unit.name in [name for name, *_ in family]:
            return [row for row in family if row[0] != unit.name]
    return []


def _words(unit: Unit) -> str:
    return {"°": "degrees", "rad": "radians", "mm": "millimetres", "cm": "centimetres", "m": "metres"}[unit.name]


def _swapped(questions: list[Number], values: list[float], labels: tuple[str, ...]) -> str:
    """Whether two components are exchanged, or all have the other sign."""

    def fits(question: Number, value: float) -> bool:
        return judge(question, value).right

    n = len(questions)
    if all(fits(question, -value) for question, value in zip(questions, values, strict=True)):
        return "All signs are the other way round."
    for i in range(n):
        for j in range(i + 1, n):
            order = list(values)
            order[i], order[j] = order[j], order[i]
            if all(fits(question, value) for question, value in zip(questions, order, strict=True)):
                return f"The numbers are right, but {labels[i]} and {labels[j]} are exchanged."
    return ""
