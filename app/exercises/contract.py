"""What a kind of exercise provides: it reads its fields, says what is asked, and judges an answer.

Answers are plain data, as they come from a page or a program: see `Asked`.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from app.exercises.cell import Declared
from app.exercises.questions import Asked, Question, Verdict
from app.exercises.typed import is_number
from app.exercises.variant import Variant
from kin import InputError, KinematicsError
from kin.transforms import Array
from kin.units import ANGLES, LENGTH_UNITS, Unit, Units, general

LONGEST_PROGRAM = 4000  # characters
DIGITS = (4, 5, 6, 8)  # significant ones of a right answer on show: the fewest with which it is right
NOISE = 9  # decimals beyond which a computed number is zero


class Kind(Declared, ABC):
    """One question; a class per kind of exercise. Its fields are those of a file's table ``[answer]``.

    Attributes:
        name: as in files.
        about: one sentence for the documentation.
        shows_posture: whether the arm may stand at the exercise's configuration before the answer.
        in_words: whether its text asks it by itself, without the scene and without the arm as the answer.
        withholds: facts that nothing in the page shows while the question is open, because they are the answer:
            see `app.viewer.activity.activity.Activity.withheld`.
    """

    name: ClassVar[str]
    about: ClassVar[str]
    shows_posture: ClassVar[bool] = False
    in_words: ClassVar[bool] = False
    withholds: ClassVar[frozenset[str]] = frozenset()

    @abstractmethod
    def asked(self, variant: Variant, units: Units) -> Asked:
        """What is asked."""

    @abstractmethod
    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        """Judge an answer.

        Raises:
            InputError: not an answer in the right form; it says what is valid.
            EntryError: a typed number cannot be read.
        """

    def in_stages(self, variant: Variant, given: object, units: Units) -> Verdict:
        """The same verdict; if its `way` says how to find the answer, its `reason` says only what is wrong."""
        return self.judge(variant, given, units)

    @abstractmethod
    def answer(self, variant: Variant) -> object:
        """A right answer, in the form of `judge`'s, in `PLAIN_UNITS`."""

    @abstractmethod
    def solution(self, variant: Variant, units: Units) -> str:
        """The right answer in words."""

    def ask(self, prompt: str, variant: Variant, units: Units) -> Question:
        """The question of a variant, in the reader's units; what is no answer raises `kin.InputError`."""
        return Posed(prompt, self, variant, units)

    def verify(self, variant: Variant) -> None:
        """Raise `ValueError` if the question makes no sense for this variant. Its own answer must be right."""
        verdict = self.judge(variant, self.answer(variant), PLAIN_UNITS)
        if not verdict.right:
            raise ValueError(f"the exercise's own answer is not right: {verdict.reason}")


PLAIN_UNITS = Units(degrees=True, length="mm")


@dataclass(frozen=True, eq=False)
class Posed(Question):
    """A question of a kind for a variant, in these units. Kept texts name their units."""

    prompt: str
    kind: Kind
    variant: Variant
    units: Units

    def asked(self) -> Asked:
        return self.kind.asked(self.variant, self.units)

    def read(self, given: object) -> object:
        self.judge(given)  # raises for what is no answer
        return _named(given, self.asked())

    def is_answer(self, answer: object) -> bool:
        try:
            self.judge(answer)
        except KinematicsError:
            return False
        return True

    def judge(self, answer: Any) -> Verdict:
        return self.kind.in_stages(self.variant, answer, self.units)

    def right(self) -> object:
        return _named(self.kind.answer(self.variant), self.kind.asked(self.variant, PLAIN_UNITS))

    def solution(self) -> str:
        return self.kind.solution(self.variant, self.units)

    def cells(self, answer: Any) -> list[list[str]]:
        form = self.asked().form
        if form in ("table", "postures"):
            return [list(row) for row in answer]
        return [list(answer)] if form == "fields" else [[answer]] if form == "program" else []

    def right_cells(self) -> list[list[str]]:
        answer: Any = self.kind.answer(self.variant)
        own = self.asked()
        if own.form not in ("fields", "table", "postures"):
            return self.cells(answer)
        units = list(zip(self.kind.asked(self.variant, PLAIN_UNITS).units, own.units, strict=True))
        exact = [list(row) for row in ([answer] if own.form == "fields" else answer)]
        for digits in DIGITS:
            rows = [
                [_rounded(text, *pair, digits) for text, pair in zip(row, units, strict=True)] for row in exact
            ]
            if self.judge(rows[0] if own.form == "fields" else rows).right:
                return rows
        return self.cells(self.right())


_BARE = re.compile(r"\s*[-+−]?[\d.,]+(?:e[-+−]?\d+)?\s*")


def _named(answer: Any, asked: Asked) -> object:
    """An answer whose numbers without a unit are given that of their column."""
    match answer:
        case [[*_], *_] if asked.form in ("table", "postures"):
            return [_with_units(row, asked.units) for row in answer]
        case [*cells] if asked.form == "fields":
            return _with_units(cells, asked.units)
    return answer


def _with_units(cells: Sequence[str], units: Sequence[str]) -> list[str]:
    pairs = zip(cells, units, strict=True)
    lengths = (*LENGTH_UNITS, *(f"{name}/s" for name in LENGTH_UNITS))
    known = {*ANGLES, "°/s", "rad/s", *lengths}  # those that depend on the reader
    return [f"{text} {unit}" if unit in known and _BARE.fullmatch(text) else text for text, unit in pairs]


def _rounded(text: str, unit: str, shown: str, digits: int) -> str:
    """A typed number in the unit that is shown, with this many significant digits; another text as it is."""
    try:
        value = float(text)
    except ValueError:
        return text
    if unit != shown:
        known = {**ANGLES, **LENGTH_UNITS}
        value *= known[shown.removesuffix("/s")].scale / known[unit.removesuffix("/s")].scale
    return general(round(value, NOISE), digits)


def numbers(given: object, count: int, what: str) -> Array:
    """Finite numbers ``(count,)``."""
    if not isinstance(given, list | tuple) or len(given) != count or not all(map(is_number, given)):
        raise InputError("answer", given, f"{count} numbers: {what}")
    return np.array([float(value) for value in given])


def typed(value: float, unit: Unit) -> str:
    """A value as a student may type it: with all its digits."""
    return repr(value * unit.scale)


def listed(names: list[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
