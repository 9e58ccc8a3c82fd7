"""One answer of several; each has its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from app.exercises.contract import Asked, Kind, index
from app.exercises.expressions import Expression
from app.exercises.fields import Fields
from app.exercises.judging import Verdict
from app.exercises.questions import Option
from app.exercises.variant import Variant
from kin.units import Units


@dataclass(frozen=True)
class ChoiceKind(Kind):
    """See the module. Which option is right may depend on the numbers drawn."""

    name: ClassVar[str] = "choice"
    about: ClassVar[str] = "One of several answers is chosen; each has its reason."

    options: tuple[tuple[str, Expression, str], ...]
    shuffle: bool

    @classmethod
    def read(cls, fields: Fields) -> Self:
        options = []
        for item in fields.tables("options", 2):
            right = "1" if item.flag("right") else "0"
            when = item.expression("when", right)
            options.append((item.text("text"), when, item.text("reason")))
            item.done()
        if len({text for text, *_ in options}) < len(options):
            raise fields.refuse("options", [text for text, *_ in options], "a different text for each option")
        return cls(tuple(options), fields.flag("shuffle", True))

    def _options(self, variant: Variant, units: Units) -> list[Option]:
        options = [
            Option(variant.text(text, units), variant.text(reason, units), bool(variant.number(when)))
            for text, when, reason in self.options
        ]
        if self.shuffle:
            variant.draw("options").shuffle(options)
        return options

    def asked(self, variant: Variant, units: Units) -> Asked:
        return Asked("options", tuple(option.text for option in self._options(variant, units)))

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        options = self._options(variant, units)
        chosen = options[index(given, len(options))]
        return Verdict(chosen.right, chosen.reason)

    def answer(self, variant: Variant) -> object:
        options = self._options(variant, Units())
        return next((i for i, option in enumerate(options) if option.right), 0)

    def solution(self, variant: Variant, units: Units) -> str:
        right = [option for option in self._options(variant, units) if option.right]
        return " ".join(f"{option.text.rstrip('.')}. {option.reason}" for option in right)
