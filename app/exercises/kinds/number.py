"""A number, or a vector of numbers, with unit and tolerance."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from app.exercises.contract import PLAIN_UNITS, Kind, typed
from app.exercises.expressions import Expression
from app.exercises.fields import Fields, Words
from app.exercises.questions import WHOLE, Asked, Mistake, Number, Question, Verdict, apart, share, texts
from app.exercises.variant import Variant
from kin.units import PLAIN, Unit, Units, general

RATE = "deg/s"  # in the angles of the reader; rad/s is not
# Units of a file, and what one of them is in radians, metres or SI.
_DEGREE = math.pi / 180
COUNTED = ("count", "joint")  # whole numbers
_PLAIN = dict.fromkeys(("", *COUNTED), 1.0)
SCALES = {"deg": _DEGREE, "rad": 1.0, "mm": 1e-3, "cm": 1e-2, "m": 1.0, **_PLAIN, RATE: _DEGREE}
MEASURES = {"deg": "angle", "rad": "angle", "mm": "length", "cm": "length", "m": "length"}
OTHER = {"m/s": 3, "m/rad": 3, "rad/s": 3, "N": 2, "N·m": 2, "s": 3, "kg": 3, "J": 3}  # decimals
_PERCENT = re.compile(r"([0-9]{1,15}(?:\.[0-9]{1,15})?) ?%")


@dataclass(frozen=True)
class NumberKind(Kind):
    """See the module.

    Attributes:
        tolerance: the accepted error, or as `part` of the value.
        part: the tolerance as a part of the value, in place of `tolerance`; 0: it is no part.
        least: the finest tolerance; with it, the tolerance keeps off known mistakes and zero as well.
        mistakes: known wrong values, whether they are, the reason, and whether all larger sizes are meant.
    """

    name: ClassVar[str] = "number"
    about: ClassVar[str] = "A number or a vector is typed; a unit may follow it."
    in_words: ClassVar[bool] = True

    values: tuple[Expression, ...]
    labels: tuple[str, ...]
    unit: str
    tolerance: float
    method: Words
    whole_turns: bool
    mistakes: tuple[tuple[tuple[Expression, ...], Expression, Words, bool], ...]
    part: float = 0.0
    least: Expression | None = None

    @classmethod
    def read(cls, fields: Fields) -> Self:
        values = fields.expressions("value", 1)
        unit = fields.choice("unit", (*SCALES, *OTHER), "")
        labels = fields.texts("labels") or ("",) * len(values)
        if len(labels) != len(values):
            raise fields.refuse("labels", list(labels), f"as many labels as values: {len(values)}")
        tolerance = part = 0.0
        given = fields.get("tolerance")
        if unit in COUNTED:
            tolerance = WHOLE
        elif isinstance(given, str):
            percent = _PERCENT.fullmatch(given)
            if percent is None or not 0.0 < float(percent[1]) < 100.0:
                raise fields.refuse("tolerance", given, 'a number, or a share of the value such as "2 %"')
            part = 0.01 * float(percent[1])
        else:
            tolerance = fields.number("tolerance", above=0.0) * SCALES.get(unit, 1.0)
        mistakes = []
        for item in fields.tables("mistakes"):
            wrong = item.expressions("value", 1)
            if len(wrong) != len(values):
                raise item.refuse("value", len(wrong), f"as many values as the answer has: {len(values)}")
            reason, beyond = item.words("reason"), item.flag("beyond")
            mistakes.append((wrong, item.expression("when", "1"), reason, beyond))
            item.done()
        least = fields.expression("least") if fields.has("least") else None
        method, turns = fields.words("method"), fields.flag("whole_turns")
        return cls(values, labels, unit, tolerance, method, turns, tuple(mistakes), part, least)

    def _shown_unit(self, units: Units) -> Unit:
        match MEASURES.get(self.unit):
            case "angle":
                return units.angles
            case "length":
                return units.lengths
        if self.unit == RATE:
            return units.angles.per_second()
        return Unit(self.unit, 1.0, OTHER[self.unit]) if self.unit in OTHER else PLAIN

    def _questions(self, variant: Variant, units: Units) -> list[Number]:
        unit, method = self._shown_unit(units), variant.text(self.method, units)
        wrong = [
            (variant.vector(values), variant.text(reason, units), beyond)
            for values, when, reason, beyond in self.mistakes
            if variant.number(when)
        ]
        found = []
        for i, (expression, label) in enumerate(zip(self.values, self.labels, strict=True)):
            value = variant.number(expression)
            tolerance = share(value, self.part) if self.part else self.tolerance
            question = Number(
                label or "Your answer",
                value,
                unit,
                tolerance,
                method,
                tuple(Mistake(float(values[i]), reason, beyond) for values, reason, beyond in wrong),
                self.whole_turns,
                ordered=self.unit != "joint",
                whole=self.unit in COUNTED,
            )
            if self.least is not None:
                question = apart(question, variant.number(self.least) * SCALES.get(self.unit, 1.0))
            found.append(question)
        return found

    def ask(self, prompt: str, variant: Variant, units: Units) -> Question:
        questions = self._questions(variant, units)
        return replace(questions[0], prompt=prompt) if len(questions) == 1 else super().ask(prompt, variant, units)

    def asked(self, variant: Variant, units: Units) -> Asked:
        questions = self._questions(variant, units)
        return Asked(
            "fields", self.labels, (questions[0].unit.name,) * len(questions), questions[0].tolerance_text
        )

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        verdict = self.in_stages(variant, given, units)
        if verdict.way and verdict.parts:
            return Verdict.of(verdict.parts)
        return replace(verdict, reason=verdict.full, way="")

    def in_stages(self, variant: Variant, given: object, units: Units) -> Verdict:
        questions = self._questions(variant, units)
        typed_texts = texts(given, len(questions), "the numbers in the order asked")
        values = [question.read_text(text) for question, text in zip(questions, typed_texts, strict=True)]
        found = [question.judge(value) for question, value in zip(questions, values, strict=True)]
        if len(questions) == 1:
            return found[0]
        parts = [(one.right, f"{label}: {one.full}") for label, one in zip(self.labels, found, strict=True)]
        verdict = Verdict.of(parts, "All parts are right.")
        if verdict.right:
            return verdict
        if swap := _swapped(questions, values, self.labels):
            return replace(verdict, reason=swap)
        label, wrong = next(pair for pair in zip(self.labels, found, strict=True) if not pair[1].right)
        return replace(verdict, reason=f"{label}: {wrong.reason or 'This is not right.'}", way=wrong.way)

    def answer(self, variant: Variant) -> object:
        return [typed(variant.number(value), self._shown_unit(Units())) for value in self.values]

    def verify(self, variant: Variant) -> None:
        super().verify(variant)
        for question in self._questions(variant, PLAIN_UNITS):
            if question.whole and abs(question.answer - round(question.answer)) > 1e-6:
                raise ValueError(f"the value is {general(question.answer)}: a {self.unit} is a whole number")

    def solution(self, variant: Variant, units: Units) -> str:
        questions = self._questions(variant, units)
        shown = ", ".join(
            f"{label} = {question.value_text}" if label else question.value_text
            for label, question in zip(self.labels, questions, strict=True)
        )
        return f"{shown}. {questions[0].method}"


def _swapped(questions: list[Number], values: list[float], labels: tuple[str, ...]) -> str:
    """Whether two components are exchanged, or all have the other sign."""

    def fits(question: Number, value: float) -> bool:
        return question.judge(value).right

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
