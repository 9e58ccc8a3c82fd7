"""What a kind of exercise provides: it reads its fields, says what is asked, and judges an answer.

Answers are plain data, as they come from a page or a program: see `Form`. An `Asked` holds nothing from which the
answer could be read, so it may be sent to the browser.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import numpy as np

from app.exercises.fields import Fields
from app.exercises.judging import Verdict
from app.exercises.variant import Variant
from kin import InputError
from kin.transforms import Array
from kin.typed import LONGEST
from kin.units import Unit, Units

Form = Literal["fields", "options", "order", "posture", "postures", "frame", "table", "program"]
LONGEST_PROGRAM = 4000  # characters


@dataclass(frozen=True, eq=False)
class Asked:
    """What the student sees of a question.

    Attributes:
        form: how it is answered. ``fields``: one text per label. ``options``: the index of a label. ``order``: the
            indices of the labels, in order. ``posture``: a configuration ``(n,)``. ``postures``: rows of texts,
            one per label. ``frame``: a pose as x, y, z and a quaternion w, x, y, z. ``table``: rows of texts, one
            per label. ``program``: a text, as `kin.parse_program` reads it.
        labels: of fields, options or columns.
        units: of the fields or columns.
        note: the accepted error, and what else an answer needs.
        rows: how many rows a table has.
        first: the number of the first one.
        start: a text or a pose to begin with.
        cells: texts to begin with, of a table.
        goal: a pose ``(4, 4)`` that is drawn.
    """

    form: Form
    labels: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    note: str = ""
    rows: int = 1
    first: int = 1
    start: str = ""
    cells: tuple[tuple[str, ...], ...] = ()
    goal: Array | None = None


class Kind(ABC):
    """One question; a class per kind of exercise.

    Attributes:
        name: as in files.
        about: one sentence for the documentation.
        shows_posture: whether the arm may stand at the exercise's configuration before the answer.
        withholds: what no tab shows while the question is open, because it is the answer: "table", or nothing.
    """

    name: ClassVar[str]
    about: ClassVar[str]
    shows_posture: ClassVar[bool] = False
    withholds: ClassVar[str] = ""

    @classmethod
    @abstractmethod
    def read(cls, fields: Fields) -> Self:
        """The question of a file's table ``[answer]``; raises `ExerciseFileError`."""

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

    @abstractmethod
    def answer(self, variant: Variant) -> object:
        """A right answer, in the form of `judge`'s, in `PLAIN_UNITS`."""

    @abstractmethod
    def solution(self, variant: Variant, units: Units) -> str:
        """The right answer in words."""

    def verify(self, variant: Variant) -> None:
        """Raise `ValueError` if the question makes no sense for this variant. Its own answer must be right."""
        verdict = self.judge(variant, self.answer(variant), PLAIN_UNITS)
        if not verdict.right:
            raise ValueError(f"the exercise's own answer is not right: {verdict.reason}")


PLAIN_UNITS = Units(degrees=True, length="mm")


def numbers(given: object, count: int, what: str) -> Array:
    """Finite numbers ``(count,)``."""
    if (
        not isinstance(given, list | tuple)
        or len(given) != count
        or not all(type(value) in (int, float) and math.isfinite(value) for value in given)
    ):
        raise InputError("answer", given, f"{count} numbers: {what}")
    return np.array([float(value) for value in given])


def texts(given: object, count: int, what: str) -> list[str]:
    """Typed texts, cut to a sensible length."""
    if not isinstance(given, list | tuple) or len(given) != count or not all(isinstance(x, str) for x in given):
        raise InputError("answer", given, f"{count} texts: {what}")
    return [text[: LONGEST + 1] for text in given]  # still too long to be valid


def index(given: object, count: int) -> int:
    """The index of an option."""
    if type(given) is not int or not 0 <= given < count:
        raise InputError("answer", given, f"the index of an option, 0 to {count - 1}")
    return given


def typed(value: float, unit: Unit) -> str:
    """A value as a student may type it: with all its digits."""
    return repr(value * unit.scale)


def listed(names: list[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
