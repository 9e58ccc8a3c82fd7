"""One answer of several; each has its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from app.exercises import cell
from app.exercises.cell import ONLY_WHERE, TO_WHOM, Declared
from app.exercises.contract import Kind
from app.exercises.expressions import Expression
from app.exercises.fields import Fields, Words
from app.exercises.questions import Asked, Choice, Option, Verdict
from app.exercises.variant import Variant
from kin.units import Units


@dataclass(frozen=True)
class Offer(Declared):
    """One of the answers."""

    text: str = cell.text("Text")
    right: bool = cell.flag("Right")
    when: Expression | None = cell.optional_expression("Right when", "Instead: where this expression is true.")
    offered: Expression = cell.expression("Offered when", ONLY_WHERE, "1")
    reason: Words = cell.words("Reason", TO_WHOM)


@dataclass(frozen=True)
class ChoiceKind(Kind):
    """See the module. Which options there are, and which one is right, may depend on numbers."""

    name: ClassVar[str] = "choice"
    about: ClassVar[str] = "One of several answers is chosen; each has its reason."
    in_words: ClassVar[bool] = True

    options: tuple[Offer, ...] = cell.rows(
        Offer,
        "Options",
        "At least two.",
        "option",
        {"text": "Another answer", "reason": "Why this is wrong."},
        least=2,
    )
    shuffle: bool = cell.flag("Shuffle the options", default=True)

    def check(self, table: Fields) -> None:
        texts = [each.text for each in self.options]
        if len(set(texts)) < len(texts):
            raise table.refuse("options", texts, "a different text for each option")

    def _options(self, variant: Variant, units: Units) -> list[Option]:
        options = [
            Option(
                variant.text(each.text, units),
                variant.text(each.reason, units),
                each.right if each.when is None else bool(variant.number(each.when)),
            )
            for each in self.options
            if variant.number(each.offered)
        ]
        if self.shuffle:
            variant.draw("options").shuffle(options)
        return options

    def ask(self, prompt: str, variant: Variant, units: Units) -> Choice:
        return Choice(prompt, tuple(self._options(variant, units)))

    def asked(self, variant: Variant, units: Units) -> Asked:
        return self.ask("", variant, units).asked()

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        question = self.ask("", variant, units)
        return question.judge(question.read(given))

    def answer(self, variant: Variant) -> object:
        return next((i for i, option in enumerate(self._options(variant, Units())) if option.right), 0)

    def solution(self, variant: Variant, units: Units) -> str:
        return self.ask("", variant, units).solution()
