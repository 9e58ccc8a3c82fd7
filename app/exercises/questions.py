"""Questions that are asked now: of one arm and in the reader's units, with the judge of their answers.

Lessons and exercises share them. `Number` and `Choice` are made of values, by a lesson; a kind of exercise makes
a question of a file and a variant (`app.exercises.contract.Kind.ask`). What shows a question needs only
`Question`: what is asked, how an answer is read and judged, and what is right.

Values are in radians, metres and SI units.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from app.exercises.mistakes import Models
from app.exercises.typed import is_number, read_number, units_like
from app.exercises.variant import Variant
from kin import InputError
from kin.transforms import Array
from kin.typed import LONGEST
from kin.units import ANGLES, DEGREES, LENGTH_UNITS, PLAIN, RADIANS, Unit, general

WRITTEN, UNIT, RELATED = "written", "unit", "related"
Form = Literal["fields", "options", "order", "posture", "postures", "frame", "table", "program"]


@dataclass(frozen=True)
class Verdict:
    """Whether an answer is right, and why: never only "wrong".

    Attributes:
        credit: the part of the answer that is right, 0 to 1.
        parts: what was asked in parts: whether each is right, and why.
        way: how to find the answer, if `reason` only says what is wrong with this one.
        cause: of a wrong number: the mistake by its code in `app.exercises.mistakes`, `WRITTEN` if the file knows
            it, `UNIT`, or `RELATED` for a relation to the right one; "" if it is not known.
        mistaken: what the question is about if that mistake is made.
    """

    right: bool
    reason: str
    credit: float = 0.0
    parts: tuple[tuple[bool, str], ...] = ()
    way: str = ""
    cause: str = ""
    mistaken: Variant | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        """What is right has full credit."""
        if self.right:
            object.__setattr__(self, "credit", 1.0)

    @property
    def full(self) -> str:
        """The reason and the way."""
        return " ".join(filter(None, (self.reason, self.way)))

    @classmethod
    def of(cls, parts: Sequence[tuple[bool, str]], right: str = "") -> Verdict:
        """The verdict on an answer in parts: right if all are; the reason is that of the first wrong one."""
        wrong = [reason for fine, reason in parts if not fine]
        share = 1.0 - len(wrong) / len(parts)
        return cls(not wrong, wrong[0] if wrong else right or parts[-1][1], share, tuple(parts))


@dataclass(frozen=True, eq=False)
class Asked:
    """What the student sees of a question; nothing in it gives the answer away, so it may be sent to the browser.

    Attributes:
        form: how it is answered. ``fields``: one text per label. ``options``: the index of a label. ``order``: the
            indices of the labels, in order. ``posture``: a configuration ``(n,)``. ``postures``: rows of texts,
            one per label. ``frame``: a pose as x, y, z and a quaternion w, x, y, z. ``table``: rows of texts, one
            per label. ``program``: a text, as `kin.motion.parse_program` reads it.
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


class Question(ABC):
    """One question, of one arm and in the reader's units.

    An answer is plain data and means the same in all units, so links may keep it.
    """

    prompt: str

    @abstractmethod
    def asked(self) -> Asked:
        """What is asked."""

    @abstractmethod
    def read(self, given: object) -> object:
        """The answer that the page sends, in the form of `asked`, as it is kept.

        Raises:
            InputError: not an answer in the right form; it says what is valid.
            EntryError: a typed number cannot be read.
        """

    @abstractmethod
    def is_answer(self, answer: object) -> bool:
        """Whether something, from a link for example, can be a kept answer at all."""

    @abstractmethod
    def judge(self, answer: Any) -> Verdict:
        """Judge a kept answer."""

    def compared(self, answer: Any, before: Any) -> str:
        """What is said of a wrong answer beside the wrong one before it, which was another one; "": nothing."""
        alike = self.judge(answer).reason == self.judge(before).reason
        return "The same holds for your answer before." if alike else ""

    @abstractmethod
    def right(self) -> object:
        """A right answer, as it is kept."""

    @abstractmethod
    def solution(self) -> str:
        """The right answer and its reason in words, as they are shown on request."""

    @abstractmethod
    def cells(self, answer: Any) -> list[list[str]]:
        """A kept answer as the typed rows of the form; empty if it is not typed."""

    def right_cells(self) -> list[list[str]]:
        """A right answer as `cells`, in the reader's units and rounded as it is asked."""
        return self.cells(self.right())


@dataclass(frozen=True)
class Option:
    """One answer to choose, and the reason why it is right or wrong."""

    text: str
    reason: str
    right: bool = False


@dataclass(frozen=True)
class Choice(Question):
    """A question with answers to choose from; more than one may be right. An answer is the index of an option."""

    prompt: str
    options: tuple[Option, ...]

    def __post_init__(self) -> None:
        """Check that it can be answered."""
        texts = {option.text for option in self.options}
        if len(texts) < max(2, len(self.options)) or not any(option.right for option in self.options):
            raise ValueError(
                f"{self.prompt}: two or more different options are needed, at least one of them right"
            )

    def asked(self) -> Asked:
        return Asked("options", tuple(option.text for option in self.options))

    def read(self, given: object) -> int:
        return index(given, len(self.options))

    def is_answer(self, answer: object) -> bool:
        return type(answer) is int and 0 <= answer < len(self.options)

    def judge(self, answer: int) -> Verdict:
        option = self.options[answer]
        return Verdict(option.right, option.reason)

    def right(self) -> int:
        return next(i for i, option in enumerate(self.options) if option.right)

    def solution(self) -> str:
        rights = (option for option in self.options if option.right)
        return " ".join(f"{option.text.rstrip('.')}. {option.reason}" for option in rights)

    def cells(self, answer: int) -> list[list[str]]:
        return []


@dataclass(frozen=True)
class Mistake:
    """A value that a usual mistake gives, and the reason why it is wrong.

    Attributes:
        beyond: whether it is about all larger sizes instead: no right value has one.
    """

    value: float
    reason: str
    beyond: bool = False


@dataclass(frozen=True)
class Way:
    """Another value that is right, and a sentence that names it."""

    value: float
    reason: str


@dataclass(frozen=True)
class Number(Question):
    """A question whose answer is typed; it is kept as a value in radians, metres or SI units.

    Attributes:
        answer: the right value, in radians, metres or SI units.
        unit: of typed numbers, unless another unit follows them.
        tolerance: the largest accepted error, as `answer`.
        method: how to find the answer, shown after a wrong one that is no known mistake.
        mistakes: known wrong values.
        whole_turns: whether values that differ by whole turns are equal.
        ways: further right values.
        named: a sentence that tells `answer` from the other ways.
        ordered: whether it helps to know that an answer is too large: not if it is the number of a joint.
        whole: whether it is a whole number, such as a count.
        models: the mistakes that can be made in it.
    """

    prompt: str
    answer: float
    unit: Unit
    tolerance: float
    method: str
    mistakes: tuple[Mistake, ...] = ()
    whole_turns: bool = False
    ways: tuple[Way, ...] = ()
    named: str = ""
    ordered: bool = True
    whole: bool = False
    models: Models | None = field(default=None, compare=False, repr=False)

    def asked(self) -> Asked:
        return Asked("fields", ("",), (self.unit.name,), self.tolerance_text)

    def read(self, given: object) -> float:
        return self.read_text(texts(given, 1, "the number that is asked")[0])

    def read_text(self, text: str) -> float:
        """A typed answer in radians, metres or SI units; raises `EntryError` with what is valid."""
        if self.unit == PLAIN and not self.whole and text.rstrip().endswith("%"):
            return read_number(text.rstrip()[:-1], self.unit) / 100.0
        return read_number(text, self.unit)

    def is_answer(self, answer: object) -> bool:
        return is_number(answer)

    def judge(self, answer: float) -> Verdict:
        if self._near(answer, self.answer):
            return Verdict(True, " ".join(filter(None, (self._confirmed(), self.named))))
        for way in self.ways:
            if self._near(answer, way.value):
                return Verdict(True, way.reason)
        if slip := self.slip(answer):  # nearer than a mistake may be: the tolerance is that of the right value
            return Verdict(False, slip, way=self.method, cause=UNIT)
        for mistake in self.mistakes:
            if not mistake.beyond and self._near(answer, mistake.value):
                return Verdict(False, mistake.reason, cause=WRITTEN)
        for mistake in self.mistakes:
            if mistake.beyond and abs(answer) > abs(mistake.value) + self.tolerance:
                return Verdict(False, mistake.reason, way=self.method, cause=WRITTEN)
        if relation := self._relation(answer):
            return Verdict(False, relation, way=self.method, cause=RELATED)
        if self.models is not None and (model := self.models.named([answer])) is not None:
            return Verdict(False, model.said, way=self.method, cause=model.code, mistaken=model.variant)
        return Verdict(False, self._what_is_wrong(answer), way=self.method)

    def compared(self, answer: float, before: float) -> str:
        if not self.ordered or self.whole_turns:
            return super().compared(answer, before)
        rights = (self.answer, *(way.value for way in self.ways))
        far, was = (min(abs(value - right) for right in rights) for value in (answer, before))
        nearer = "nearer" if far < was else "no nearer"
        return f"It is {nearer} than {self.unit.brief(before, 6)}, your answer before."

    def right(self) -> float:
        return self.answer

    def solution(self) -> str:
        return f"{self.value_text}. {self.method}"

    def cells(self, answer: float) -> list[list[str]]:
        return [[general(answer * self.unit.scale)]]

    def right_cells(self) -> list[list[str]]:
        return [[self.value_text.removesuffix(self.unit.suffix.rstrip())]]

    def way_of(self, answer: float) -> int:
        """Which right value is given: 0 for the answer, 1 for the first of the other ways, −1 for none."""
        rights = (self.answer, *(way.value for way in self.ways))
        return next((i for i, right in enumerate(rights) if self._near(answer, right)), -1)

    @property
    def value_text(self) -> str:
        """The right value, in decimals that the tolerance leaves meaningful."""
        if self.whole:
            return f"{self.answer:.0f}"
        return self.unit.text(self.answer, self.decimals - self.unit.finer).rstrip()

    @property
    def tolerance_text(self) -> str:
        """The accepted error, such as ± 1°."""
        if self.whole:
            return "a whole number"
        shown = _rounded_down(self.tolerance * self.unit.scale) / self.unit.scale
        return f"± {self.unit.brief(shown)}".rstrip()

    def _what_is_wrong(self, answer: float) -> str:
        """What is wrong with an answer that is no known mistake."""
        if self._is_no_count(answer):
            return "The answer is a whole number, and not negative."
        if self.whole_turns or not self.ordered:
            return ""
        size = "large" if abs(answer) > abs(self.answer) else "small"
        if answer * self.answer < 0.0:
            return f"The sign is not right, and the size is too {size}."
        return f"{'The size is too' if min(self.answer, answer) < 0.0 else 'Too'} {size}."

    def _is_no_count(self, answer: float) -> bool:
        return (self.whole or not self.ordered) and (answer < 0.0 or abs(answer - round(answer)) > WHOLE)

    def slip(self, answer: float) -> str:
        """What the typed number would be right in: another unit, whatever its sign; "" if in none."""
        if self.whole or not self.ordered or self._is_about_zero:
            return ""
        typed_number = answer * self.unit.scale
        for name, scale, words in _other_units(self.unit):
            for sign, remark in ((1.0, ""), (-1.0, ", with the wrong sign")):
                if typed_number and abs(sign * typed_number / scale - self.answer) <= self.tolerance:
                    unit = f" The unit is {_words(self.unit)}; or type" if self.unit.name else " Type"
                    return f"This is the value in {words}{remark}.{unit} {name} after it."
        return ""

    def _relation(self, answer: float) -> str:
        """How an answer is related to the right value, if it is in a way that mistakes lead to; "" otherwise."""
        if self._is_no_count(answer):
            return ""
        if self._near(-answer, self.answer):
            return "The size is right, the sign is not."
        if self.whole or not self.ordered:
            return ""
        if self.unit.is_angle:
            turn = 2.0 * math.pi
            for value, words in (
                (answer + turn, "A whole turn is missing."),
                (answer - turn, "This is a whole turn too much."),
                (0.5 * math.pi - answer, "The two angles make a right angle: were sine and cosine exchanged?"),
                (math.pi - answer, "The two angles make half a turn: is it the other angle of the two lines?"),
            ):
                if self._near(value, self.answer):
                    return words
        elif self.unit == PLAIN and abs(answer) <= 1.0 and abs(self.answer) <= 1.0:
            other = math.sqrt(1.0 - answer * answer)
            if abs(self.answer) > self.tolerance and self._near(math.copysign(other, self.answer), self.answer):
                return "The squares of this and of the right value add up to 1: were sine and cosine exchanged?"
        for factor, words in ((2.0, "half"), (0.5, "twice")):
            if answer and not self._is_about_zero and self._near(factor * answer, self.answer):
                return f"This is {words} the right value."
        return ""

    @property
    def _is_about_zero(self) -> bool:
        """Whether the tolerance leaves no scale: a small number is near the right one in any unit."""
        return abs(self.answer) <= 2.0 * self.tolerance

    @property
    def decimals(self) -> int:
        """Of the unit, as the tolerance leaves them meaningful; none of a share of zero."""
        return 0 if self.tolerance == 0.0 else max(0, -math.floor(math.log10(self.tolerance * self.unit.scale)))

    def _confirmed(self) -> str:
        """The right value, and whether it is rounded."""
        if self.whole:
            return f"The value is {self.value_text}."
        shown = self.answer * self.unit.scale
        exact = math.isclose(shown, round(shown, self.decimals), rel_tol=1e-9, abs_tol=1e-9)
        return f"The exact value is {self.value_text}." if exact else f"Rounded, it is {self.value_text}."

    def _near(self, given: float, value: float) -> bool:
        difference = given - value
        if self.whole_turns:
            difference = math.remainder(difference, 2.0 * math.pi)
        return abs(difference) <= self.tolerance * (1.0 + 1e-9)


def _other_units(unit: Unit) -> list[tuple[str, float, str]]:
    """Name, how many make one SI unit, and words of the units that a number may have been meant in."""
    for family in ((RADIANS, DEGREES), tuple(reversed(LENGTH_UNITS.values()))):
        if unit.name in [one.name for one in family]:
            return [(one.name, one.scale, one.words) for one in family if one.name != unit.name]
    if unit == PLAIN:
        return [("%", 100.0, "per cent")]
    others = [(name, 1.0 / size, name) for name, size in units_like(unit).items()]
    return [row for row in others if not math.isclose(row[1], unit.scale)]


def _words(unit: Unit) -> str:
    known = {**ANGLES, **LENGTH_UNITS}
    return known[unit.name].words if unit.name in known else unit.name


WHOLE = 0.1  # accepted error of a count


def count(prompt: str, answer: int, method: str, mistakes: Sequence[tuple[int, str]] = ()) -> Number:
    """A question whose answer is a whole number; mistakes that give the right one are left out."""
    wrong = tuple(Mistake(value, reason) for value, reason in mistakes if value != answer)
    return Number(prompt, answer, PLAIN, WHOLE, method, wrong, whole=True)


LEAST = 2e-4  # the finest error that is asked for, in metres and radians: values are shown with 0.1 mm
_SHARE = 0.45  # of the distance to the nearest wrong value


def apart(question: Number, least: float = LEAST) -> Number:
    """The question with a tolerance that tells its right values from its known mistakes and from zero.

    Mistakes within twice `least` of a right value are left out: for this arm they give the right value.
    """
    wrong = tuple(m for m in question.mistakes if m.beyond or _gap(question, m.value) > 2.0 * least)
    values = (0.0, *(m.value for m in wrong if not m.beyond))
    gaps = [gap for value in values if (gap := _gap(question, value)) > 2.0 * least]
    tolerance = max(question.tolerance, least)
    if gaps and tolerance > _SHARE * min(gaps):
        tolerance = _rounded_down(_SHARE * min(gaps))
    return replace(question, tolerance=tolerance, mistakes=wrong)


def share(answer: float, part: float) -> float:
    """A tolerance that is a part of the answer, rounded down to two digits, as people write it."""
    return _rounded_down(part * abs(answer))


def two_percent(answer: float) -> float:
    """The usual tolerance of a measured value."""
    return share(answer, 0.02)


def _rounded_down(size: float) -> float:
    if size == 0.0:
        return 0.0
    digit = math.floor(math.log10(size)) - 1
    return float(f"{math.floor(size * 10.0**-digit)}e{digit}")


def _gap(question: Number, value: float) -> float:
    """The distance to the nearest right value."""
    gaps = [value - right for right in (question.answer, *(way.value for way in question.ways))]
    return min(abs(math.remainder(gap, 2.0 * math.pi) if question.whole_turns else gap) for gap in gaps)


def one_right(prompt: str, right: tuple[str, str], wrong: Sequence[tuple[str, str]], place: int) -> Choice:
    """A choice with one right option, at this place among the wrong ones; each option is a text and a reason.

    Wrong options with the text of one before are left out: for some arms two of them agree.
    """
    options: list[Option] = []
    for text, reason in wrong:
        if text != right[0] and all(option.text != text for option in options):
            options.append(Option(text, reason))
    options.insert(min(place, len(options)), Option(*right, right=True))
    return Choice(prompt, tuple(options))


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
