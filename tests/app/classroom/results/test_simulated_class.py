"""A simulated class whose abilities and mistakes are known: the figures of its results come out as put in.

A student of ability θ is right with the probability 1/(1 + exp(−a(θ − b))), where b is the difficulty of a
question (Rasch, 1960) and a tells how much it depends on the ability: 1 in Rasch’s model, 0 for one of luck.
"""

from __future__ import annotations

import math
import random
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import pytest

from app.classroom.results.gains import gains
from app.classroom.results.items import items
from app.classroom.results.table import Member
from app.classroom.work import ANSWER_SHOWN, Attempt

SIZE = 40
SIGMAS = 4.0  # how many standard errors a figure may be off
SPREAD = 0.6  # of the logarithm of times


@dataclass(frozen=True)
class Asked:
    """A question: difficulty, slope, chances of mistakes and of a look at the answer after one, time (s)."""

    difficulty: float
    slope: float = 1.0
    mistakes: dict[str, float] = field(default_factory=lambda: {"sign": 0.5, "degrees": 0.3, "": 0.2})
    looks: float = 0.25
    seconds: float = 90.0

    def chance(self, ability: float) -> float:
        """That a student is right."""
        return 1.0 / (1.0 + math.exp(-self.slope * (ability - self.difficulty)))


class Class:
    """Students with normal abilities, and their answers."""

    def __init__(self, seed: int, size: int = SIZE) -> None:
        self.chance, self._time = random.Random(seed), 0.0
        self.abilities = [self.chance.gauss(0.0, 1.0) for _ in range(size)]
        self.members = [Member(f"s{i}", f"Student {i}", i) for i in range(1, size + 1)]
        self.attempts: list[Attempt] = []
        self.made: Counter[tuple[str, str]] = Counter()  # exercise and code of each student's first mistake

    def _answer(
        self, number: int, exercise: str, right: bool, seconds: float, verdict: str, cause: str = ""
    ) -> None:
        self._time += 1.0
        seat, score = self.members[number].seat, float(right)
        self.attempts.append(
            Attempt(seat, "", exercise, 0, None, verdict, score, self._time - seconds, self._time, number, cause)
        )

    def ask(self, exercise: str, asked: Asked, gained: float = 0.0, only: int | None = None) -> None:
        """All answer, or every second one: `only` 0 or 1. After a mistake there is another try, or a look."""
        for number, ability in enumerate(self.abilities):
            if only is not None and number % 2 != only:
                continue
            seconds = asked.seconds * math.exp(self.chance.gauss(0.0, SPREAD))
            if self.chance.random() < asked.chance(ability + gained):
                self._answer(number, exercise, True, seconds, "Right.")
                continue
            (cause,) = self.chance.choices([*asked.mistakes], [*asked.mistakes.values()])
            self.made[exercise, cause] += 1
            self._answer(number, exercise, False, seconds, f"What was done: {cause or 'who knows'}.", cause)
            looks = self.chance.random() < asked.looks
            self._answer(number, exercise, not looks, 20.0, ANSWER_SHOWN if looks else "Right.")


TEST = {
    "trivial": Asked(-6.0),
    "easy": Asked(-1.5),
    "middle": Asked(0.0, looks=0.5, seconds=240.0),
    "hard": Asked(1.5, mistakes={"sign": 0.9, "": 0.1}),
    "hopeless": Asked(5.0),
    "luck": Asked(0.0, slope=0.0),
    **{f"sharp {b}": Asked(b, slope=2.0) for b in (-1.0, -0.5, 0.0, 0.5, 1.0)},
}


def examined(seed: int, size: int = SIZE) -> Class:
    """A class that has taken the test."""
    found = Class(seed, size)
    for exercise, asked in TEST.items():
        found.ask(exercise, asked)
    return found


def within(found: float, true: float, error: float) -> bool:
    """Whether a figure is as put in, but for chance."""
    return abs(found - true) <= SIGMAS * error + 1e-12


@pytest.mark.parametrize("seed", range(3))
def test_shares_times_and_mistakes_are_those_of_the_class(seed: int) -> None:
    taken = examined(seed)
    found = items(taken.members, taken.attempts)
    assert [one.exercise for one in found] == [*TEST]
    for one in found:
        asked = TEST[one.exercise]
        chances = [asked.chance(ability) for ability in taken.abilities]
        variance = sum(p * (1.0 - p) for p in chances)
        assert within(one.first / SIZE, sum(chances) / SIZE, math.sqrt(variance) / SIZE), one
        wrong = SIZE - one.first
        assert within(one.looked, wrong * asked.looks, math.sqrt(wrong * asked.looks * (1.0 - asked.looks))), one
        assert one.seconds is not None
        # The logarithms are normal: the standard error of their median is √(π/2) that of their mean.
        assert within(math.log(one.seconds / asked.seconds), 0.0, math.sqrt(0.5 * math.pi / SIZE) * SPREAD), one
        made = {code: count for (exercise, code), count in taken.made.items() if exercise == one.exercise}
        assert {cause.code: cause.students for cause in one.causes} == made
        for code, share in asked.mistakes.items():
            assert within(made.get(code, 0), wrong * share, math.sqrt(wrong * share * (1.0 - share))), one


def test_discriminations_are_those_of_a_large_class() -> None:
    large = examined(100, 2000)
    true = {one.exercise: one.discrimination for one in items(large.members, large.attempts)}
    for seed in range(5):
        taken = examined(seed)
        for one in items(taken.members, taken.attempts):
            rho = true[one.exercise]
            if rho is not None and one.discrimination is not None and 4 <= one.first <= SIZE - 4:
                assert within(one.discrimination, rho, (1.0 - rho**2) / math.sqrt(SIZE - 1)), (seed, one.exercise)
    assert true["luck"] == pytest.approx(0.0, abs=SIGMAS / math.sqrt(2000))


def test_questions_that_tell_nothing_are_marked_and_others_are_not() -> None:
    marks: Counter[tuple[str, str]] = Counter()
    classes = 30
    for seed in range(classes):
        taken = examined(seed)
        for one in items(taken.members, taken.attempts):
            marks[one.exercise, one.remark[:8]] += 1
    assert marks["trivial", "Too easy"] == marks["hopeless", "Too hard"] == classes
    assert marks["luck", "Does not"] >= classes / 2
    sound = [exercise for exercise in TEST if exercise.startswith("sharp") or exercise == "middle"]
    assert sum(marks[exercise, "Does not"] for exercise in sound) <= 0.03 * classes * len(sound)


# Before and after

PAIRS = [(f"before {i}", f"after {i}") for i in range(4)]
FORMS = (Asked(-0.5), Asked(0.7))  # the second exercise of each pair is the harder one
GAINED = 0.8  # of ability
NORMAL = np.random.default_rng(1).standard_normal(20_000)


def score(asked: Asked, gained: float = 0.0) -> float:
    """What a very large class scores."""
    return float(np.mean(1.0 / (1.0 + np.exp(-(NORMAL + gained - asked.difficulty)))))


TRUE = sum(score(form, GAINED) - score(form) for form in FORMS) / 2.0


def compared(seed: int, exchanged: bool) -> tuple[float, tuple[float, float]]:
    """The gain of a class, with its interval."""
    taken = Class(seed)
    for gained in (0.0, GAINED):
        for pair in PAIRS:
            for order in (0, 1):
                form = (order * exchanged + (gained > 0.0)) % 2
                taken.ask(pair[form], FORMS[form], gained, only=order)
    whole = gains(taken.members, taken.attempts, PAIRS)[0].whole
    assert whole.difference is not None
    assert whole.interval is not None
    return whole.difference, whole.interval


def test_the_interval_of_the_gain_contains_the_true_one_in_95_of_100_classes() -> None:
    classes = 200
    found = [compared(seed, exchanged=True) for seed in range(classes)]
    covered = sum(low <= TRUE <= high for _, (low, high) in found)
    assert within(covered / classes, 0.95, math.sqrt(0.95 * 0.05 / classes)), covered
    middle = [difference for difference, _ in found]
    assert within(float(np.mean(middle)), TRUE, float(np.std(middle)) / math.sqrt(classes))


def test_in_one_order_a_harder_exercise_hides_the_gain() -> None:
    middle = [compared(seed, exchanged=False)[0] for seed in range(20)]
    harder = score(FORMS[0], GAINED) - score(FORMS[1], GAINED)
    assert float(np.mean(middle)) < TRUE - 0.5 * harder
