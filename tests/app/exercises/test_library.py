"""Every built-in exercise against a solution that does not use the code under test, and against wrong answers."""

from __future__ import annotations

import json
import re

import pytest
from numpy_solutions import SOLVERS

from app.exercises import TOPICS, Exercise, Exercises, Variant, builtin_exercises
from app.exercises.kinds import KINDS
from app.exercises.questions import Asked
from kin import Robot
from kin.units import Units

EXERCISES = builtin_exercises()
DEGREES, RADIANS = Units(), Units(degrees=False, length="m")
SEEDS = (0, 1, 7, 1234)
# By planning a motion; a seed is enough of each.
SLOW = {"program"}


def each(exercise: Exercise) -> str:
    return exercise.id


def seeds(exercise: Exercise) -> tuple[int, ...]:
    return SEEDS[:2] if exercise.kind.name in SLOW else SEEDS


def numbers(variant: Variant) -> dict[str, float]:
    """The numbers in the text, and the target in the scene."""
    found = {name: quantity.value for name, quantity in variant.values.items()}
    if variant.target is not None:
        found |= {f"target_{axis}": float(x) for axis, x in zip("xyz", variant.target[:3, 3], strict=True)}
    return found


def test_there_are_at_least_thirty_in_all_topics_and_kinds() -> None:
    assert len(EXERCISES) >= 30
    assert {exercise.topic for exercise in EXERCISES} == set(TOPICS)
    assert {exercise.kind.name for exercise in EXERCISES} == set(KINDS)
    assert set(SOLVERS) == {exercise.id for exercise in EXERCISES}


@pytest.mark.parametrize("exercise", EXERCISES, ids=each)
def test_an_independent_solution_is_right(exercise: Exercise) -> None:
    for seed in seeds(exercise):
        variant = exercise.variant(seed)
        asked = exercise.asked(variant, DEGREES)
        given = SOLVERS[exercise.id](numbers(variant), list(asked.labels))
        verdict = exercise.judge(variant, given, DEGREES)
        assert verdict.right, (seed, given, verdict)
        assert verdict.credit == 1.0


@pytest.mark.parametrize("exercise", EXERCISES, ids=each)
@pytest.mark.parametrize("units", [DEGREES, RADIANS], ids=["degrees", "radians"])
def test_a_right_answer_on_show_is_rounded_and_right(exercise: Exercise, units: Units) -> None:
    for seed in seeds(exercise):
        question = exercise.kind.ask("?", exercise.variant(seed), units)
        cells, form = question.right_cells(), question.asked().form
        if form in ("fields", "table", "postures"):
            assert question.judge(question.read(cells[0] if form == "fields" else cells)).right, (seed, cells)
            assert all(len(re.sub(r"^\D*0+\.0*|\D", "", text)) <= 5 for row in cells for text in row), (
                seed,
                cells,
            )
            assert not any(text.endswith(unit) for row in cells for text in row for unit in ("°", "m", "s"))


@pytest.mark.parametrize("exercise", EXERCISES, ids=each)
def test_a_wrong_answer_is_wrong_and_gets_a_reason(exercise: Exercise) -> None:
    variant = exercise.variant(3)
    asked = exercise.asked(variant, DEGREES)
    for given in wrong_answers(exercise, variant, asked):
        verdict = exercise.judge(variant, given, DEGREES)
        assert not verdict.right, given
        assert verdict.credit < 1.0
        assert len(verdict.reason) > 12, "never just wrong"


def wrong_answers(exercise: Exercise, variant: Variant, asked: Asked) -> list[object]:
    """Answers that are near the right one, but not it."""
    right = exercise.kind.answer(variant)
    match asked.form:
        case "options":
            judged = [exercise.judge(variant, i, DEGREES).right for i in range(len(asked.labels))]
            assert sum(judged) == 1
            return [i for i, fine in enumerate(judged) if not fine]
        case "fields":
            assert isinstance(right, list)
            return [[repr(float(text) * 1.3 + 3.7) for text in right], [repr(-float(t) - 0.9) for t in right]]
        case "order":
            return [list(range(len(asked.labels)))]
        case "posture":
            assert isinstance(right, list)
            return [
                [right[0] + 0.2, *right[1:]],
                variant.robot.home if exercise.id == "x" else [right[0] - 0.2, *right[1:]],
            ]
        case "frame":
            assert isinstance(right, list)
            return [[right[0] + 0.1, *right[1:]], [*right[:3], 0.5, 0.5, 0.5, -0.5]]
        case "table":
            assert isinstance(right, list)
            return [[["17", "33", "44", "31"]] * len(right)]
        case "postures":
            assert isinstance(right, list)
            extra = ["1"] * len(asked.labels)
            return [right[:-1], [*right, right[0]]] if right else [[extra]]
    return [asked.start]  # a program that goes nowhere


@pytest.mark.parametrize("exercise", EXERCISES, ids=each)
def test_what_is_asked_does_not_hold_the_answer(exercise: Exercise) -> None:
    """Neither the text nor the question shows the right numbers; other seeds give other answers."""
    variant = exercise.variant(2)
    asked = exercise.asked(variant, DEGREES)
    shown = " ".join([variant.text(exercise.text, DEGREES), asked.note, *asked.labels, asked.start])
    assert "{" not in variant.text(exercise.text, DEGREES)
    if asked.form == "fields" and exercise.kind.name == "number":
        solution = exercise.kind.solution(variant, DEGREES)
        values = re.findall(r"= (−?[\d.]+)", solution)
        assert not [value for value in values if len(value) > 3 and f" {value} " in shown]


@pytest.mark.parametrize("exercise", EXERCISES, ids=each)
def test_texts_are_in_the_readers_units(exercise: Exercise) -> None:
    variant = exercise.variant(1)
    for units in (DEGREES, RADIANS):
        for text in (exercise.text, *exercise.hints, exercise.shown):
            assert "{" not in variant.text(text, units)
        assert exercise.solution(variant, units)
        exercise.asked(variant, units)


def test_a_seed_always_draws_the_same() -> None:
    """These numbers are kept by students' pages and, later, in results: they must not change with a version."""
    exercise = next(one for one in EXERCISES if one.id == "planar-tool-point")
    drawn = [{k: round(q.value, 6) for k, q in exercise.variant(seed).values.items()} for seed in range(3)]
    assert json.dumps(drawn) == json.dumps(EXPECTED)
    assert len({json.dumps(numbers(exercise.variant(seed))) for seed in range(20)}) > 10


EXPECTED = [
    {"t1": 0.087266, "t2": -0.698132},
    {"t1": -0.436332, "t2": -1.22173},
    {"t1": -0.523599, "t2": -0.698132},
]


def test_the_catalogue_finds_by_id_and_lists_by_topic() -> None:
    catalogue = Exercises()
    assert catalogue.get("two-elbows") is next(one for one in EXERCISES if one.id == "two-elbows")
    assert catalogue.get("no-such") is None
    assert catalogue.get(7) is None
    topics = catalogue.topics()
    assert [topic for topic, _ in topics] == list(TOPICS)
    assert sum(len(found) for _, found in topics) == len(EXERCISES)
    assert all(isinstance(exercise.robot, Robot) for exercise in catalogue.all)
