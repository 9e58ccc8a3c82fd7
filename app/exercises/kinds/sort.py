"""Sort things by size: joints by their distance from a point, methods by their steps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

from app.exercises import cell
from app.exercises.cell import ONLY_WHERE, Declared
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
class Thing(Declared):
    """One of the things."""

    text: str = cell.text("Text")
    value: Expression = cell.expression("Size")
    shown: str = cell.line("Size in words", "Instead of the number.", "")
    offered: Expression = cell.expression("Offered when", ONLY_WHERE, "1")


@dataclass(frozen=True)
class SortKind(Kind):
    """See the module. The smallest comes first; equal ones may stand either way."""

    name: ClassVar[str] = "sort"
    about: ClassVar[str] = "Things are sorted by size, the smallest first; equal ones may stand either way."
    in_words: ClassVar[bool] = True

    items: tuple[Thing, ...] = cell.rows(
        Thing, "Things", "At least two.", "thing", {"text": "Another one", "value": "0"}, least=2, most=MOST
    )
    larger: str = cell.line("Larger ones are", "Such as: farther away.", "larger")
    measure: str = cell.choice("Sizes are shown as", "", MEASURES, MEASURES[0])
    method: Words = cell.words("Method", "How sizes are found.")

    def check(self, table: Fields) -> None:
        texts = [each.text for each in self.items]
        if len(set(texts)) < len(texts):
            raise table.refuse("items", texts, f"2 to {MOST} items with different texts")

    def _items(self, variant: Variant, units: Units) -> list[tuple[str, float, str]]:
        """What is offered: its text, its value, and how this is shown; never in the right order."""
        items = []
        for each in self.items:
            if variant.number(each.offered):
                value = variant.number(each.value)
                shown = variant.text(each.shown, units) or size_text(value, self.measure, units)
                items.append((variant.text(each.text, units), value, shown))
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
