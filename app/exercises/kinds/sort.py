"""Sort things by size: joints by their distance from a point, methods by their steps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar, Self

from app.exercises.contract import Kind
from app.exercises.expressions import Expression
from app.exercises.fields import Fields, Words
from app.exercises.kinds.find import MEASURES, size_text
from app.exercises.questions import Asked, Verdict
from app.exercises.variant import Variant
from kin import InputError
from kin.units import Units

MOST = 6
SAME = 1e-6  # of the largest value: closer than this are equal


@dataclass(frozen=True)
class SortKind(Kind):
    """See the module. The smallest comes first; equal ones may stand either way.

    Attributes:
        items: each with its value, whether it is offered, and how its value is shown; "": as a number.
        larger: what is said of a larger one, such as "farther away".
        measure: of the values, which are shown with the answer.
    """

    name: ClassVar[str] = "sort"
    about: ClassVar[str] = "Things are sorted by size, the smallest first; equal ones may stand either way."
    in_words: ClassVar[bool] = True

    items: tuple[tuple[str, Expression, Expression, str], ...]
    larger: str
    measure: str
    method: Words

    @classmethod
    def read(cls, fields: Fields) -> Self:
        items = []
        for item in fields.tables("items", 2):
            value, offered = item.expression("value"), item.expression("offered", "1")
            items.append((item.text("text"), value, offered, item.text("shown", "")))
            item.done()
        if len(items) > MOST or len({text for text, *_ in items}) < len(items):
            raise fields.refuse("items", [text for text, *_ in items], f"2 to {MOST} items with different texts")
        larger, measure = fields.text("larger", "larger"), fields.choice("measure", MEASURES, MEASURES[0])
        return cls(tuple(items), larger, measure, fields.words("method"))

    def _items(self, variant: Variant, units: Units) -> list[tuple[str, float, str]]:
        """What is offered: its text, its value, and how this is shown; never in the right order."""
        items = []
        for text, expression, offered, shown in self.items:
            if variant.number(offered):
                value = variant.number(expression)
                words = variant.text(shown, units) or size_text(value, self.measure, units)
                items.append((variant.text(text, units), value, words))
        random = variant.draw("items")
        for _ in range(100):
            random.shuffle(items)
            if self._wrong(items):
                return items
        return items[::-1]

    @staticmethod
    def _wrong(items: list[tuple[str, float, str]]) -> list[tuple[str, str]]:
        """The pairs that stand the wrong way round."""
        same = SAME * max((abs(value) for _, value, _ in items), default=0.0)
        return [(a, b) for (a, x, _), (b, y, _) in combinations(items, 2) if x > y + same]

    def asked(self, variant: Variant, units: Units) -> Asked:
        labels = tuple(text for text, *_ in self._items(variant, units))
        return Asked("order", labels, note="The smallest comes first; equal ones may stand either way.")

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        items = self._items(variant, units)
        n = len(items)
        if (
            not isinstance(given, list | tuple)
            or not all(type(place) is int for place in given)
            or sorted(given) != list(range(n))
        ):
            raise InputError("answer", given, f"each of the numbers 0 to {n - 1} once")
        wrong = self._wrong([items[place] for place in given])
        if not wrong:
            return Verdict(True, self._in_order(variant, units))
        first, second = wrong[0]
        pairs = n * (n - 1) // 2
        return Verdict(
            False,
            f"“{first}” stands before “{second}”, but is {self.larger}.",
            round(1.0 - len(wrong) / pairs, 3),
            way=variant.text(self.method, units),
        )

    def answer(self, variant: Variant) -> object:
        items = self._items(variant, Units())
        return sorted(range(len(items)), key=lambda place: items[place][1])

    def _in_order(self, variant: Variant, units: Units) -> str:
        items = sorted(self._items(variant, units), key=lambda item: item[1])
        shown = [f"{text} ({words})" for text, _, words in items]
        return f"In order: {', '.join(shown)}."

    def solution(self, variant: Variant, units: Units) -> str:
        return f"{self._in_order(variant, units)} {variant.text(self.method, units)}"

    def verify(self, variant: Variant) -> None:
        super().verify(variant)
        if not self._wrong(self._items(variant, Units())):
            raise ValueError("all items are equal, so that every order is right")
