"""Answers in words."""

from __future__ import annotations

import json

import pytest

from app.exercises import Exercises, builtin_exercises
from app.exercises.contract import PLAIN_UNITS
from app.exercises.said import LONGEST, answer_in_words

ALL = Exercises()


@pytest.mark.parametrize("exercise", builtin_exercises(), ids=lambda one: one.id)
def test_right_answers_of_all_exercises_have_words(exercise) -> None:
    variant = exercise.variant(7)
    asked, answer = exercise.asked(variant, PLAIN_UNITS), exercise.kind.answer(variant)
    words = answer_in_words(exercise, 7, json.dumps(answer))
    assert 0 < len(words) <= LONGEST
    assert asked.form == "program" or not words.startswith(("[", "{")), words
    if asked.form == "options":
        assert words.rstrip("…") in " ".join(asked.labels[answer].split())


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("2", None),
        ("99", "99"),
        ("true", "True"),
        ('"\\ud800"', "?"),
        ('["3', '["3'),
        ("", ""),
        ('{"a": 1}', "{'a': 1}"),
        ("[[1.23456, 2], 3]", "1.235, 2"),
        ("[-0.5, 2.5e-7]", "−0.5, 2.5·10⁻⁷"),
        ("9" * 400, None),
        ("-1", "-1"),
        ("null", "None"),
        ("[" * 5000, "[" * (LONGEST - 1) + "…"),
        ("[" * 20 + "]" * 20, "[" * 20 + "]" * 20),
    ],
)
def test_anything_that_is_stored_has_words(answer: str, words: str | None) -> None:
    for exercise in ALL.all:
        found = answer_in_words(exercise, 3, answer)
        found.encode()
        assert len(found) <= LONGEST
        if words is not None and exercise.id == "which-joint-goes-down":
            assert found == words
