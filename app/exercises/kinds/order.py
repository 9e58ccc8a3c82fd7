"""Put transforms in order so that their product is a given pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import ClassVar

import numpy as np

from app.exercises import cell
from app.exercises.contract import Kind
from app.exercises.poses import Elementary, axes_text, errors, list_of_motions, pose_text, product
from app.exercises.questions import Asked, Verdict
from app.exercises.variant import Variant
from kin import InputError
from kin.transforms import Array
from kin.units import Units

MOST = 6
_CLOSE = 1e-9


@dataclass(frozen=True)
class OrderKind(Kind):
    """See the module. Every order with the same product is right."""

    name: ClassVar[str] = "order"
    about: ClassVar[str] = "Motions are put in order; every order with the same product is right."
    in_words: ClassVar[bool] = True

    motions: tuple[Elementary, ...] = list_of_motions(2, MOST)
    fixed_axes: bool = cell.flag("About the axes of the base", "Otherwise about the frame’s own.")

    def _places(self, variant: Variant) -> list[int]:
        """The motion behind each label; never in the right order."""
        places = list(range(len(self.motions)))
        random = variant.draw("order")
        for _ in range(100):
            random.shuffle(places)
            if not self._is_right(variant, places):
                return places
        return list(reversed(range(len(self.motions))))

    def _product(self, variant: Variant, order: Sequence[int]) -> Array:
        """Motions about the frame's own axes are multiplied from the right, about fixed axes from the left."""
        matrices = [self.motions[i].matrix(variant) for i in order]
        return product(matrices[::-1] if self.fixed_axes else matrices)

    def _is_right(self, variant: Variant, order: Sequence[int]) -> bool:
        return self._same(variant, order, range(len(self.motions)))

    def _same(self, variant: Variant, one: Sequence[int], other: Sequence[int]) -> bool:
        """Whether two orders have the same product."""
        return max(errors(self._product(variant, one), self._product(variant, other))) < _CLOSE

    def leads(self, variant: Variant, given: Sequence[int]) -> Array:
        """Where the motions carry a frame in the order of an answer: poses ``(n + 1, 4, 4)`` from the start."""
        places = self._places(variant)
        order = [places[i] for i in given]
        return np.stack([self._product(variant, order[:k]) for k in range(len(order) + 1)])

    def asked(self, variant: Variant, units: Units) -> Asked:
        labels = tuple(self.motions[i].text(variant, units) for i in self._places(variant))
        axes = "the axes of the base" if self.fixed_axes else "the frame’s own axes at that moment"
        goal = self._product(variant, range(len(self.motions)))
        end = axes_text(goal) if all(motion.turns for motion in self.motions) else pose_text(goal, units)
        note = f"Motions are about {axes}; the first one is done first. At the end: {end}."
        return Asked("order", labels, note=note, goal=goal)

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        n = len(self.motions)
        if not isinstance(given, list | tuple) or sorted(map(str, given)) != sorted(map(str, range(n))):
            raise InputError("answer", given, f"each of the numbers 0 to {n - 1} once")
        places = self._places(variant)
        order = [places[int(i)] for i in given]
        if self._is_right(variant, order):
            return Verdict(True, "The product of these motions, in this order, is the pose.")
        credit = max(
            next((k for k, (a, b) in enumerate(zip(order, right, strict=True)) if a != b), n) / n
            for right in permutations(range(n))
            if self._is_right(variant, right)
        )
        if (crossed := self._other_row(variant)) and self._same(variant, order, crossed):
            why = (
                "This order is correct for the other convention, which begins with the other pair of motions: "
                "both of x, or both of z."
            )
        elif self._is_right(variant, order[::-1]):
            other = "the frame’s own axes" if self.fixed_axes else "the axes of the base"
            why = (
                f"This order is right for motions about {other}. Each motion is on the wrong side of the product."
            )
        else:
            first = self.motions[order[0]].text(variant, units)
            T, right = self._product(variant, order), self._product(variant, range(n))
            off, turned = errors(T, right)
            ends = [f"{units.lengths.text(off, 0)} away"] if off > _CLOSE else []
            ends += [f"turned by {units.angles.text(turned, 0)}"] if turned > _CLOSE else []
            why = f"After this order, which begins with “{first}”, the frame is {' and '.join(ends)}."
        return Verdict(False, why, round(credit, 3))

    def _other_row(self, variant: Variant) -> list[int]:
        """The four motions as a row of the other convention; empty if they are no row of either."""
        z, x = ([i for i, motion in enumerate(self.motions) if motion.axis == axis] for axis in (2, 0))
        pairs = [sorted(self.motions[i].turns for i in pair) for pair in (z, x)]
        if len(self.motions) == 4 and pairs == [[False, True]] * 2 and not self.fixed_axes:
            if self._is_right(variant, z + x):
                return x + z
            if self._is_right(variant, x + z):
                return z + x
        return []

    def answer(self, variant: Variant) -> object:
        places = self._places(variant)
        order = list(range(len(self.motions)))
        return [places.index(i) for i in order]

    def solution(self, variant: Variant, units: Units) -> str:
        return "First " + ", then ".join(motion.text(variant, units) for motion in self.motions) + "."

    def verify(self, variant: Variant) -> None:
        super().verify(variant)
        if np.all([self._is_right(variant, order) for order in permutations(range(len(self.motions)))]):
            raise ValueError("every order of the motions gives the same pose")
