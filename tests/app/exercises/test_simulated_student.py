"""A simulated student makes each mistake in each question of library and lessons, and hears which it was."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from lesson_arms import ASKED

from app.exercises import builtin_exercises
from app.exercises.contract import Posed
from app.exercises.kinds.number import COUNTED, NumberKind
from app.exercises.mistakes import ROWS, Models
from app.exercises.questions import Number, Question, Verdict
from kin.units import Units

UNITS = Units()
SEEDS = 10
RANDOM = 20  # wrong numbers for each seed of each question
Mistake = tuple[str, int]  # a code, and which of its row
Questions = Iterator[tuple[str, Question]]


def of_library() -> Questions:
    for exercise in builtin_exercises():
        if isinstance(exercise.kind, NumberKind) and exercise.kind.unit not in COUNTED:
            for seed in range(SEEDS):
                yield exercise.id, exercise.kind.ask("?", exercise.variant(seed), UNITS)


def of_lessons() -> Questions:
    for lesson, robot in ASKED:
        for key, question in lesson.outline(robot, UNITS).questions():
            if isinstance(question, Number) and question.models is not None and question.answer:
                yield f"{lesson.key} {key}", question


def parts(question: Question) -> tuple[Models, list[Number]]:
    """What mistakes can be made in a question, and its numbers."""
    if isinstance(question, Number):
        assert question.models is not None
        return question.models, [question]
    assert isinstance(question, Posed)
    assert isinstance(question.kind, NumberKind)
    numbers = question.kind.questions(question.variant, UNITS)
    return question.kind.models(question.variant, UNITS, numbers), numbers


def verdict_on(question: Question, numbers: list[Number], values: list[float]) -> Verdict:
    """The verdict on values as students type them: one digit more than the tolerance asks for."""
    texts = [
        f"{value * number.unit.scale:.{number.decimals + 1}f}"
        for value, number in zip(values, numbers, strict=True)
    ]
    return question.judge(question.read(texts))


def mistakes_in(models: Models) -> dict[Mistake, tuple[str, np.ndarray]]:
    """Each mistake that changes the answer: its clause, and what it leads to."""
    known = {one.clauses: one.values for one in models.single}
    found = {}
    for code, row in ROWS.items():
        for place, (clause, _) in enumerate(row.mistaken(models.case)):
            if (clause,) in known:
                found[code, place] = clause, known[clause,]
    return found


def indistinct(several: list[dict[Mistake, tuple[str, np.ndarray]]]) -> set[Mistake]:
    """The mistakes that lead to the numbers of another one whatever the seed is: nobody can tell them apart."""
    together, equal = Counter[tuple[Mistake, Mistake]](), Counter[tuple[Mistake, Mistake]]()
    for mistakes in several:
        for one, (_, values) in mistakes.items():
            for other, (_, others) in mistakes.items():
                if one < other:
                    together[one, other] += 1
                    equal[one, other] += np.allclose(values, others, rtol=1e-6, atol=1e-9)
    return {one for pair, count in equal.items() if count and count == together[pair] for one in pair}


def tried(asked: list[Question]) -> Counter[str]:
    """What a student hears about each mistake in a question, and about random numbers."""
    counted = Counter[str]()
    known = [(question, *parts(question)) for question in asked]
    made = [mistakes_in(models) for _, models, _ in known]
    same = indistinct(made)
    for place, ((question, _, numbers), mistakes) in enumerate(zip(known, made, strict=True)):
        for mistake, (clause, values) in mistakes.items():
            verdict = verdict_on(question, numbers, values.tolist())
            if mistake in same:
                counted["same"] += 1
            elif verdict.right or verdict.cause in ("written", "unit", "related"):
                counted["known otherwise"] += 1
            else:
                named = verdict.cause == mistake[0] and clause in verdict.reason
                counted["named" if named else "wrongly" if verdict.cause else "silent"] += 1
        rng = random.Random(place)
        for _ in range(RANDOM):
            verdict = verdict_on(question, numbers, [number.answer * rng.uniform(0.5, 1.5) for number in numbers])
            if not verdict.right:
                counted["random"] += 1
                counted["random, named"] += bool(verdict.mistaken)
    return counted


def by_question(questions: Questions) -> dict[str, Counter[str]]:
    several: dict[str, list[Question]] = {}
    for name, question in questions:
        several.setdefault(name, []).append(question)
    return {name: tried(asked) for name, asked in several.items()}


@pytest.mark.full
@pytest.mark.parametrize("questions", [of_library, of_lessons], ids=["library", "lessons"])
def test_a_student_hears_which_mistake_was_made(questions: Callable[[], Questions]) -> None:
    table = by_question(questions())
    everything = sum(table.values(), Counter[str]())
    made = everything["named"] + everything["wrongly"] + everything["silent"]
    assert made > 50
    assert everything["named"] >= 0.95 * made, table
    assert everything["wrongly"] <= 0.01 * made, table
    assert everything["random, named"] <= 0.03 * everything["random"], table
