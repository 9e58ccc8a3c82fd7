"""One answer of several; each has its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from app.exercises.contract import Kind
from app.exercises.expressions import Expression
from app.exercises.fields import Fields, Words
from app.exercises.questions import Asked, Choice, Option, Verdict
from app.exercises.variant import Variant
from kin.units import Units


@dataclass(frozen=True)
class ChoiceKind(Kind):
    """See the module. Which options there are, and which one is right, may depend on numbers."""

    name: ClassVar[str] = "choice"
    about: ClassVar[str] = "One of several answers is chosen; each has its reason."
    in_words: ClassVar[bool] = True

    options: tuple[tuple[str, Expression, Words, Expression], ...]
    shuffle: bool

    @classmethod
    def read(cls, fields: Fields) -> Self:
        options = []
        for item in fields.tables("options", 2):
            right = "1" if item.flag("right") else "0"
            when, offered = item.expression("when", right), item.expression("offered", "1")
            options.append((item.text("text"), when, item.words("reason"), offered))
            item.done()
        if len({text for text, *_ in options}) < len(options):
            raise fields.refuse("options", [text for text, *_ in options], "a different text for each option")
        return cls(tuple(options), fields.flag("shuffle", True))

    def _options(self, variant: Variant, units: Units) -> list[Option]:
        options = [
            Option(variant.text(text, units), variant.text(reason, units), bool(variant.number(when)))
            for text, when, reason, offered in self.options
            if variant.number(offered)
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
