"""Whether an answer is right, and the reason: never only "wrong"."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from app.exercises.questions import WHOLE, Choice, Number, Question
from app.exercises.typed import read_number
from kin.units import PLAIN


@dataclass(frozen=True)
class Verdict:
    """Whether an answer is right, and why.

    Attributes:
        credit: the part of the answer that is right, 0 to 1.
        parts: what was asked in parts: whether each is right, and why.
    """

    right: bool
    reason: str
    credit: float = 0.0
    parts: tuple[tuple[bool, str], ...] = ()

    def __post_init__(self) -> None:
        """What is right has full credit."""
        if self.right:
            object.__setattr__(self, "credit", 1.0)

    @classmethod
    def of(cls, parts: Sequence[tuple[bool, str]], right: str = "") -> Verdict:
        """The verdict on an answer in parts: right if all are; the reason is that of the first wrong one."""
        wrong = [reason for fine, reason in parts if not fine]
        share = 1.0 - len(wrong) / len(parts)
        return cls(not wrong, wrong[0] if wrong else right or parts[-1][1], share, tuple(parts))


def judge(question: Question, given: float) -> Verdict:
    """Judge an answer: the index of an option, or a value in radians, metres or SI units."""
    if isinstance(question, Choice):
        option = question.options[int(given)]
        return Verdict(option.right, option.reason)
    if _near(question, given, question.answer):
        return Verdict(True, " ".join(filter(None, (_confirmed(question), question.named))))
    for way in question.ways:
        if _near(question, given, way.value):
            return Verdict(True, way.reason)
    for mistake in question.mistakes:
        if _near(question, given, mistake.value):
            return Verdict(False, mistake.reason)
    if (_is_count(question) or not question.ordered) and (given < 0.0 or abs(given - round(given)) > WHOLE):
        return Verdict(False, f"The answer is a whole number, and not negative. {question.method}")
    if _near(question, -given, question.answer):
        return Verdict(False, f"The size is right, the sign is not. {question.method}")
    if question.whole_turns or not question.ordered:
        return Verdict(False, question.method)
    return Verdict(False, f"Too {'large' if given > question.answer else 'small'}. {question.method}")


def is_answer(question: Question, given: object) -> bool:
    """Whether `given` can be an answer at all."""
    if isinstance(question, Choice):
        return type(given) is int and 0 <= given < len(question.options)
    return type(given) in (int, float) and math.isfinite(given)  # type: ignore[arg-type]


def read(question: Number, text: str) -> float:
    """A typed answer in radians, metres or SI units; raises `EntryError` with what is valid."""
    return read_number(text, question.unit)


def way_of(question: Number, given: float) -> int:
    """Which right value is given: 0 for the answer, 1 for the first of the other ways, −1 for none."""
    rights = (question.answer, *(way.value for way in question.ways))
    return next((i for i, right in enumerate(rights) if _near(question, given, right)), -1)


def solution_text(question: Question) -> str:
    """The right answer with its reason, as it is shown on request."""
    if isinstance(question, Number):
        return f"{value_text(question)}. {question.method}"
    return " ".join(f"{option.text.rstrip('.')}. {option.reason}" for option in question.options if option.right)


def value_text(question: Number) -> str:
    """The right value, in decimals that the tolerance leaves meaningful."""
    return number_text(question.answer, question)


def number_text(value: float, question: Number) -> str:
    """A value in the question's unit."""
    if _is_count(question):
        return f"{value:.0f}"
    return question.unit.text(value, _decimals(question) - question.unit.finer).rstrip()


def _decimals(question: Number) -> int:
    """Of the question's unit, as the tolerance leaves them meaningful."""
    return max(0, -math.floor(math.log10(question.tolerance * question.unit.scale)))


def _confirmed(question: Number) -> str:
    """The right value, and whether it is rounded."""
    if _is_count(question):
        return f"The value is {value_text(question)}."
    shown = question.answer * question.unit.scale
    exact = math.isclose(shown, round(shown, _decimals(question)), rel_tol=1e-9, abs_tol=1e-9)
    return f"The exact value is {value_text(question)}." if exact else f"Rounded, it is {value_text(question)}."


def tolerance_text(question: Number) -> str:
    """The accepted error, such as ± 1°."""
    if _is_count(question):
        return "a whole number"
    return f"± {question.unit.brief(question.tolerance)}".rstrip()


def _is_count(question: Number) -> bool:
    return question.unit == PLAIN and question.tolerance == WHOLE


def _near(question: Number, given: float, value: float) -> bool:
    difference = given - value
    if question.whole_turns:
        difference = math.remainder(difference, 2.0 * math.pi)
    return abs(difference) <= question.tolerance * (1.0 + 1e-9)
