"""Questions with options or with a number: their answers, known mistakes and tolerances.

Values are in radians, metres and SI units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from kin.units import PLAIN, Unit


@dataclass(frozen=True)
class Option:
    """One answer to choose, and the reason why it is right or wrong."""

    text: str
    reason: str
    right: bool = False


@dataclass(frozen=True)
class Choice:
    """A question with answers to choose from; more than one may be right."""

    prompt: str
    options: tuple[Option, ...]

    def __post_init__(self) -> None:
        """Check that it can be answered."""
        texts = {option.text for option in self.options}
        if len(texts) < max(2, len(self.options)) or not any(option.right for option in self.options):
            raise ValueError(
                f"{self.prompt}: two or more different options are needed, at least one of them right"
            )


@dataclass(frozen=True)
class Mistake:
    """A value that a usual mistake gives, and the reason why it is wrong."""

    value: float
    reason: str


@dataclass(frozen=True)
class Way:
    """Another value that is right, and a sentence that names it."""

    value: float
    reason: str


@dataclass(frozen=True)
class Number:
    """A question whose answer is typed.

    Attributes:
        answer: the right value, in radians, metres or SI units.
        unit: of typed numbers, unless another unit follows them.
        tolerance: the largest accepted error, as `answer`.
        method: how to find the answer; the reason given for a wrong one that is no known mistake.
        mistakes: known wrong values.
        whole_turns: whether values that differ by whole turns are equal.
        ways: further right values.
        named: a sentence that tells `answer` from the other ways.
        ordered: whether it helps to know that an answer is too large: not if it is the number of a joint.
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


WHOLE = 0.1  # accepted error of a count


def count(prompt: str, answer: int, method: str, mistakes: Sequence[tuple[int, str]] = ()) -> Number:
    """A question whose answer is a whole number; mistakes that give the right one are left out."""
    wrong = tuple(Mistake(value, reason) for value, reason in mistakes if value != answer)
    return Number(prompt, answer, PLAIN, WHOLE, method, wrong)


LEAST = 2e-4  # the finest error that is asked for, in metres and radians: values are shown with 0.1 mm
_SHARE = 0.45  # of the distance to the nearest wrong value


def apart(question: Number, least: float = LEAST) -> Number:
    """The question with a tolerance that tells its right values from its known mistakes and from zero.

    Mistakes within twice `least` of a right value are left out: for this arm they give the right value.
    """
    wrong = tuple(m for m in question.mistakes if _gap(question, m.value) > 2.0 * least)
    gaps = [gap for value in (0.0, *(m.value for m in wrong)) if (gap := _gap(question, value)) > 2.0 * least]
    tolerance = max(question.tolerance, least)
    if gaps and tolerance > _SHARE * min(gaps):
        tolerance = _rounded_down(_SHARE * min(gaps))
    return replace(question, tolerance=tolerance, mistakes=wrong)


def two_percent(answer: float) -> float:
    """The usual tolerance of a measured value."""
    return _rounded_down(0.02 * abs(answer))


def _rounded_down(size: float) -> float:
    """To two digits, as people write a tolerance."""
    if size == 0.0:
        return 0.0
    digit = math.floor(math.log10(size)) - 1
    return float(f"{math.floor(size * 10.0**-digit)}e{digit}")


def _gap(question: Number, value: float) -> float:
    """The distance to the nearest right value."""
    gaps = [value - right for right in (question.answer, *(way.value for way in question.ways))]
    return min(abs(math.remainder(gap, 2.0 * math.pi) if question.whole_turns else gap) for gap in gaps)


Question = Choice | Number


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
