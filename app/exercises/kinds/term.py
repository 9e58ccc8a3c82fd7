"""Find the printed term that is wrong."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from app.exercises.contract import Kind
from app.exercises.expressions import Expression
from app.exercises.fields import Fields
from app.exercises.questions import Asked, Verdict, index
from app.exercises.variant import Variant
from kin.units import Units, general

_CLOSE, _APART = 1e-9, 1e-3
_SAMPLES = 6


@dataclass(frozen=True)
class Misprint:
    """One way to print a term wrongly: the index of the term, and what stands there instead."""

    term: int
    value: Expression
    shown: str
    reason: str


@dataclass(frozen=True)
class TermKind(Kind):
    """See the module. The seed draws which term is printed wrongly, and how."""

    name: ClassVar[str] = "term"
    about: ClassVar[str] = "An equation is printed with one wrong term, which is to be found."
    in_words: ClassVar[bool] = True
    shows_posture: ClassVar[bool] = True

    entry: Expression
    name_of_entry: str
    terms: tuple[tuple[Expression, str], ...]
    misprints: tuple[Misprint, ...]

    @classmethod
    def read(cls, fields: Fields) -> Self:
        terms = []
        for item in fields.tables("terms", 2):
            terms.append((item.expression("value"), item.text("shown")))
            item.done()
        misprints = []
        for item in fields.tables("misprints", 1):
            number = item.whole("term", 1, len(terms))
            misprints.append(
                Misprint(number - 1, item.expression("value"), item.text("shown"), item.text("reason"))
            )
            item.done()
        return cls(fields.expression("entry"), fields.text("name"), tuple(terms), tuple(misprints))

    def _misprint(self, variant: Variant) -> Misprint:
        return variant.draw("misprint").choice(self.misprints)

    def asked(self, variant: Variant, units: Units) -> Asked:
        wrong = self._misprint(variant)
        labels = tuple(wrong.shown if i == wrong.term else shown for i, (_, shown) in enumerate(self.terms))
        return Asked("options", labels, note=f"{self.name_of_entry} = {' + '.join(labels)}".replace("+ −", "− "))

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        wrong, chosen = self._misprint(variant), index(given, len(self.terms))
        if chosen == wrong.term:
            return Verdict(True, wrong.reason)
        value = variant.number(self.terms[chosen][0])
        return Verdict(
            False,
            f"This term is right: in the posture of this exercise it is {general(value, 4)}, as it has to be. "
            "Choose a posture in which the other terms vanish, and compare.",
        )

    def answer(self, variant: Variant) -> object:
        return self._misprint(variant).term

    def solution(self, variant: Variant, units: Units) -> str:
        wrong = self._misprint(variant)
        return f"{wrong.shown} should be {self.terms[wrong.term][1]}. {wrong.reason}"

    def verify(self, variant: Variant) -> None:
        super().verify(variant)
        draw = variant.draw("verify")
        robot = variant.robot
        apart = 0.0
        wrong = self._misprint(variant)
        for _ in range(_SAMPLES):
            q = robot.lower + (robot.upper - robot.lower) * np.array([draw.random() for _ in range(robot.n)])
            there = replace(variant, q=q)
            total = sum(there.number(value) for value, _ in self.terms)
            if abs(total - there.number(self.entry)) > _CLOSE:
                raise ValueError("the sum of the terms is not the entry")
            apart = max(apart, abs(there.number(wrong.value) - there.number(self.terms[wrong.term][0])))
        if apart < _APART:
            raise ValueError(f"the misprint “{wrong.shown}” has the value of the right term")
