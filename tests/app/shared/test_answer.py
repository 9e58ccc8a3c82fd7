"""Answers: how fields are filled from objects, written as JSON, and published."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Annotated, NamedTuple

import numpy as np
import pytest
from msgspec import UNSET, UnsetType
from pydantic import TypeAdapter
from pydantic_core import to_json

from app.shared.answers.answer import Answer, From, as_json, as_plain


class Point(NamedTuple):
    x: float
    name: str


@dataclass
class Found:
    points: tuple[Point, ...]
    best: Point | None
    q: np.ndarray
    intervals: tuple[tuple[float, float], ...]
    frames: tuple[np.ndarray, ...]
    touching: int = 0


class PointAnswer(Answer):
    """A point."""

    x: float
    """In metres, from the base
    of the arm."""
    title: Annotated[str, From("name")]
    """Its name."""


class FoundAnswer(Answer):
    """What was found."""

    points: list[PointAnswer]
    """All points."""
    best: PointAnswer | None
    """The best one; null if there is none."""
    q: list[float]
    """Joint values."""
    intervals: list[list[float]]
    """Ranges."""
    frames: list[list[list[float]]]
    """Frames."""
    first: Annotated[str, From(lambda found: found.points[0].name)]
    """Name of the first point."""
    again: Annotated[PointAnswer, From(lambda found: found.points[0])]
    """The first point."""
    given: int
    """From elsewhere."""
    touching: Annotated[int | UnsetType, From("touching", unless_empty=True)] = UNSET
    """How many touch; absent if none do."""
    gap: Annotated[float | UnsetType | None, From("obstacle.gap")] = UNSET
    """By how much it does not fit; absent if that is not the cause."""


def found(**others):
    points = (Point(1.0, "a"), Point(2.0, "b"))
    frames = (np.eye(2), np.zeros((2, 2)))
    return Found(points, None, np.array([0.1, 0.2]), ((0.0, 1.0), (2.0, 3.0)), frames, **others)


PLAIN = {
    "points": [{"x": 1.0, "title": "a"}, {"x": 2.0, "title": "b"}],
    "best": None,
    "q": [0.1, 0.2],
    "intervals": [[0.0, 1.0], [2.0, 3.0]],
    "frames": [[[1.0, 0.0], [0.0, 1.0]], [[0.0, 0.0], [0.0, 0.0]]],
    "first": "a",
    "again": {"x": 1.0, "title": "a"},
    "given": 7,
}


def test_fields_are_filled_from_an_object_and_absent_ones_left_out():
    for _ in range(2):  # the second time with the function that the first one has made
        answer = FoundAnswer.of(found(), given=7)
        assert as_plain(answer) == PLAIN
        assert as_json(answer) == to_json(PLAIN)
    assert type(answer.intervals[0]) is list
    assert as_plain(FoundAnswer.of(found(touching=3), given=7)) == {**PLAIN, "touching": 3}


def test_an_object_of_another_type_is_looked_at_anew():
    fields = {**vars(found()), "best": Point(3.0, "c")}
    for gap in (0.5, None):
        other = SimpleNamespace(**fields, obstacle=SimpleNamespace(gap=gap))
        expected = {**PLAIN, "best": {"x": 3.0, "title": "c"}, "gap": gap}
        assert as_plain(FoundAnswer.of(other, given=7)) == expected
    assert as_plain(FoundAnswer.of(found(), given=7)) == PLAIN


def test_a_field_that_is_nowhere_is_an_error():
    with pytest.raises(AttributeError, match="name"):
        PointAnswer.of(SimpleNamespace(x=1.0))
    with pytest.raises(TypeError, match="given"):
        FoundAnswer.of(found())


def test_numbers_that_json_does_not_have_are_null():
    assert as_json([float("nan"), float("inf"), -0.0, 0.1]) == b"[null,null,-0.0,0.1]"


def test_the_schema_has_the_types_and_the_strings_under_the_fields():
    schema = TypeAdapter(FoundAnswer).json_schema()
    point = schema["$defs"]["PointAnswer"]
    assert point["description"] == "A point."
    assert point["properties"] == {
        "x": {"type": "number", "title": "X", "description": "In metres, from the base\nof the arm."},
        "title": {"type": "string", "title": "Title", "description": "Its name."},
    }
    assert sorted(set(schema["properties"]) - set(schema["required"])) == ["gap", "touching"]
    assert schema["properties"]["gap"]["anyOf"] == [{"type": "number"}, {"type": "null"}]
    assert TypeAdapter(FoundAnswer).validate_python(PLAIN, strict=True) == PLAIN
