"""Find the printed term that is wrong."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from app.exercises import cell
from app.exercises.cell import TO_WHOM, Declared
from app.exercises.contract import Kind
from app.exercises.expressions import Expression
from app.exercises.fields import MOST_ITEMS, Fields
from app.exercises.questions import Asked, Verdict, index
from app.exercises.variant import Variant
from kin.units import Units, general

_CLOSE, _APART = 1e-9, 1e-3
_SAMPLES = 6


@dataclass(frozen=True)
class Term(Declared):
    """A term of the entry."""

    value: Expression = cell.expression("Value")
    shown: str = cell.line("As printed")


@dataclass(frozen=True)
class Misprint(Declared):
    """One way to print a term wrongly: the number of the term, from 1, and what stands there instead."""

    term: int = cell.whole("Term", "Its number.", 1, MOST_ITEMS)
    value: Expression = cell.expression("Value")
    shown: str = cell.line("As printed")
    reason: str = cell.text("Reason", TO_WHOM)


@dataclass(frozen=True)
class TermKind(Kind):
    """See the module. The seed draws which term is printed wrongly, and how."""

    name: ClassVar[str] = "term"
    about: ClassVar[str] = "An equation is printed with one wrong term, which is to be found."
    in_words: ClassVar[bool] = True
    shows_posture: ClassVar[bool] = True

    name_of_entry: str = cell.line("Name of the entry", "Such as: p_x.", name="name")
    entry: Expression = cell.expression("Its value")
    terms: tuple[Term, ...] = cell.rows(
        Term, "Terms", "At least two; their sum is the entry.", "term", {"value": "0", "shown": "0"}, least=2
    )
    misprints: tuple[Misprint, ...] = cell.rows(
        Misprint,
        "Misprints",
        "One of them is drawn.",
        "misprint",
        {"term": 1, "value": "0", "shown": "0", "reason": "Why this is wrong."},
        least=1,
    )

    def check(self, table: Fields) -> None:
        for i, each in enumerate(self.misprints):
            if each.term > len(self.terms):
                raise table.refuse(
                    f"misprints[{i}].term", each.term, f"a whole number from 1 to {len(self.terms)}"
                )

    def _misprint(self, variant: Variant) -> Misprint:
        return variant.draw("misprint").choice(self.misprints)

    def asked(self, variant: Variant, units: Units) -> Asked:
        wrong = self._misprint(variant)
        labels = tuple(wrong.shown if i == wrong.term else each.shown for i, each in enumerate(self.terms, 1))
        return Asked("options", labels, note=f"{self.name_of_entry} = {' + '.join(labels)}".replace("+ −", "− "))

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        wrong, chosen = self._misprint(variant), index(given, len(self.terms))
        if chosen == wrong.term - 1:
            return Verdict(True, wrong.reason)
        value = variant.number(self.terms[chosen].value)
        return Verdict(
            False,
            f"This term is right: in the posture of this exercise it is {general(value, 4)}, as it has to be. "
            "Choose a posture in which the other terms vanish, and compare.",
        )

    def answer(self, variant: Variant) -> object:
        return self._misprint(variant).term - 1

    def solution(self, variant: Variant, units: Units) -> str:
        wrong = self._misprint(variant)
        return f"{wrong.shown} should be {self.terms[wrong.term - 1].shown}. {wrong.reason}"

    def verify(self, variant: Variant) -> None:
        super().verify(variant)
        draw = variant.draw("verify")
        robot = variant.robot
        apart = 0.0
        wrong = self._misprint(variant)
        for _ in range(_SAMPLES):
            q = robot.lower + (robot.upper - robot.lower) * np.array([draw.random() for _ in range(robot.n)])
            there = replace(variant, q=q)
            total = sum(there.number(each.value) for each in self.terms)
            if abs(total - there.number(self.entry)) > _CLOSE:
                raise ValueError("the sum of the terms is not the entry")
            apart = max(apart, abs(there.number(wrong.value) - there.number(self.terms[wrong.term - 1].value)))
        if apart < _APART:
            raise ValueError(f"the misprint “{wrong.shown}” has the value of the right term")
