"""A number, or a vector of numbers, with unit and tolerance."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

from app.exercises import cell
from app.exercises.cell import ONLY_WHERE, TO_WHOM, Declared
from app.exercises.contract import PLAIN_UNITS, Kind, typed
from app.exercises.expressions import Expression
from app.exercises.fields import Fields, Words
from app.exercises.mistakes import ROWS, Case, Models
from app.exercises.questions import (
    RELATED,
    WHOLE,
    Asked,
    Mistake,
    Number,
    Question,
    Verdict,
    apart,
    share,
    texts,
)
from app.exercises.variant import Variant
from kin.units import METRES, PLAIN, Unit, Units, general

RATE = "deg/s"  # in the angles of the reader; rad/s is not
# Units of a file, and what one of them is in radians, metres or SI.
_DEGREE = math.pi / 180
COUNTED = ("count", "joint")  # whole numbers
_PLAIN = dict.fromkeys(("", *COUNTED), 1.0)
SCALES = {"deg": _DEGREE, "rad": 1.0, **METRES, **_PLAIN, RATE: _DEGREE}
MEASURES = {"deg": "angle", "rad": "angle", **dict.fromkeys(METRES, "length")}
OTHER = {"m/s": 3, "m/rad": 3, "rad/s": 3, "N": 2, "N·m": 2, "s": 3, "kg": 3, "J": 3}  # decimals
_PERCENT = re.compile(r"([0-9]{1,15}(?:\.[0-9]{1,15})?) ?%")


@dataclass(frozen=True)
class Wrong(Declared):
    """Values that come of a mistake."""

    value: tuple[Expression, ...] = cell.expressions("Value", least=1)
    when: Expression = cell.expression("When", ONLY_WHERE, "1")
    reason: Words = cell.words("Reason", TO_WHOM)
    beyond: bool = cell.flag("All larger sizes", "No right value is as large.")


class Tolerance(NamedTuple):
    """The accepted error, or, if it is not 0, which part of the value it is."""

    size: float
    part: float


def _read_tolerance(table: Fields, name: str) -> Tolerance:
    unit, given = table.get("unit") or "", table.get(name)
    if unit in COUNTED:
        return Tolerance(WHOLE, 0.0)
    if not isinstance(given, str):
        return Tolerance(table.number(name, above=0.0) * SCALES.get(unit, 1.0), 0.0)
    percent = _PERCENT.fullmatch(given)
    if percent is None or not 0.0 < float(percent[1]) < 100.0:
        raise table.refuse(name, given, 'a number, or a share of the value such as "2 %"')
    return Tolerance(0.0, 0.01 * float(percent[1]))


@dataclass(frozen=True)
class NumberKind(Kind):
    """See the module."""

    name: ClassVar[str] = "number"
    about: ClassVar[str] = "A number or a vector is typed; a unit may follow it."
    in_words: ClassVar[bool] = True

    value: tuple[Expression, ...] = cell.expressions(
        "Right value", "An expression; of a vector one in each line.", least=1
    )
    labels: tuple[str, ...] = cell.lines("Names", "Of the parts of a vector, one in each line.")
    unit: str = cell.choice("Unit", "In which it is typed.", (*SCALES, *OTHER), "")
    tolerance: Tolerance = cell.special(
        "Tolerance", "In this unit, or a share such as 2 %.", "number", _read_tolerance
    )
    least: Expression | None = cell.optional_expression(
        "Finest tolerance", "It then also keeps off mistakes and zero."
    )
    method: Words = cell.words("Method", "How it is computed.")
    whole_turns: bool = cell.flag("Whole turns count", "360° more is another answer.")
    mistakes: tuple[Wrong, ...] = cell.rows(
        Wrong,
        "Known mistakes",
        "Values that students get by a mistake, and what is said.",
        "mistake",
        {"value": "0", "reason": "Why this is wrong."},
    )
    without: tuple[str, ...] = cell.lines(
        "Mistakes not to name", f"Of those that the page recognises, one in each line: {', '.join(ROWS)}."
    )

    def check(self, table: Fields) -> None:
        count = len(self.value)
        if self.labels and len(self.labels) != count:
            raise table.refuse("labels", list(self.names), f"as many labels as values: {count}")
        for i, each in enumerate(self.mistakes):
            if len(each.value) != count:
                valid = f"as many values as the answer has: {count}"
                raise table.refuse(f"mistakes[{i}].value", len(each.value), valid)
        for i, code in enumerate(self.without):
            if code not in ROWS:
                raise table.refuse(f"without[{i}]", code, "one of " + ", ".join(f'"{each}"' for each in ROWS))

    @property
    def names(self) -> tuple[str, ...]:
        """The labels; "" for each value without one."""
        return self.labels or ("",) * len(self.value)

    def _shown_unit(self, units: Units) -> Unit:
        match MEASURES.get(self.unit):
            case "angle":
                return units.angles
            case "length":
                return units.lengths
        if self.unit == RATE:
            return units.angles.per_second()
        return Unit(self.unit, 1.0, OTHER[self.unit]) if self.unit in OTHER else PLAIN

    def questions(self, variant: Variant, units: Units) -> list[Number]:
        """Each number that is asked."""
        unit, method = self._shown_unit(units), variant.text(self.method, units)
        wrong = [
            (variant.vector(each.value), variant.text(each.reason, units), each.beyond)
            for each in self.mistakes
            if variant.number(each.when)
        ]
        found = []
        for i, (expression, label) in enumerate(zip(self.value, self.names, strict=True)):
            value = variant.number(expression)
            tolerance = share(value, self.tolerance.part) if self.tolerance.part else self.tolerance.size
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
        if len(found) == 1 and self._explained:
            return [replace(found[0], models=self.models(variant, units, found))]
        return found

    @property
    def _explained(self) -> bool:
        """Whether mistakes are looked for: a count agrees with many by chance, and takes long to compute."""
        return self.unit not in COUNTED and not any("postures" in each.names for each in self.value)

    def models(self, variant: Variant, units: Units, questions: list[Number]) -> Models:
        """The mistakes that can be made in these numbers."""
        tolerances = tuple(question.tolerance for question in questions)
        return Models(Case(variant, self.value, units), tolerances, self.whole_turns, frozenset(self.without))

    def ask(self, prompt: str, variant: Variant, units: Units) -> Question:
        questions = self.questions(variant, units)
        return replace(questions[0], prompt=prompt) if len(questions) == 1 else super().ask(prompt, variant, units)

    def asked(self, variant: Variant, units: Units) -> Asked:
        questions = self.questions(variant, units)
        return Asked("fields", self.names, (questions[0].unit.name,) * len(questions), questions[0].tolerance_text)

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        verdict = self.in_stages(variant, given, units)
        if verdict.way and verdict.parts:
            return replace(Verdict.of(verdict.parts), cause=verdict.cause)
        return replace(verdict, reason=verdict.full, way="")

    def in_stages(self, variant: Variant, given: object, units: Units) -> Verdict:
        questions = self.questions(variant, units)
        typed_texts = texts(given, len(questions), "the numbers in the order asked")
        values = [question.read_text(text) for question, text in zip(questions, typed_texts, strict=True)]
        found = [question.judge(value) for question, value in zip(questions, values, strict=True)]
        if len(questions) == 1:
            return found[0]
        parts = [(one.right, f"{label}: {one.full}") for label, one in zip(self.names, found, strict=True)]
        verdict = Verdict.of(parts, "All parts are right.")
        if verdict.right:
            return verdict
        if swap := _swapped(questions, values, self.names):
            return replace(verdict, reason=swap, cause=RELATED)
        label, wrong = next(pair for pair in zip(self.names, found, strict=True) if not pair[1].right)
        unexplained = self._explained and any(not one.right and not one.cause for one in found)
        if unexplained and (model := self.models(variant, units, questions).named(values)) is not None:
            return replace(verdict, reason=model.said, cause=model.code, mistaken=model.variant)
        reason = f"{label}: {wrong.reason or 'This is not right.'}"
        return replace(verdict, reason=reason, way=wrong.way, cause=wrong.cause)

    def answer(self, variant: Variant) -> object:
        return [typed(variant.number(value), self._shown_unit(Units())) for value in self.value]

    def verify(self, variant: Variant) -> None:
        super().verify(variant)
        for question in self.questions(variant, PLAIN_UNITS):
            if question.whole and abs(question.answer - round(question.answer)) > 1e-6:
                raise ValueError(f"the value is {general(question.answer)}: a {self.unit} is a whole number")

    def solution(self, variant: Variant, units: Units) -> str:
        questions = self.questions(variant, units)
        shown = ", ".join(
            f"{label} = {question.value_text}" if label else question.value_text
            for label, question in zip(self.names, questions, strict=True)
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
