"""Exercises as a form: every field of every kind can be written, and drafts are tried as files are."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from app.exercises import Exercises, VariantError, parse_exercise, tried
from app.exercises.cell import Cell
from app.exercises.fields import ExerciseFileError
from app.exercises.form import (
    LONGEST_CELL,
    Draft,
    Entry,
    Rows,
    entries,
    groups,
    read,
    with_cell,
    with_row,
    without_row,
)
from kin import InputError
from kin.parsing import to_toml
from kin.units import Units

ALL = Exercises()
FILES = [Path(one.file) for one in ALL.all]
UNITS = Units()
REACH = tomllib.loads(next(path for path in FILES if path.stem == "elbow-angle").read_text())


@pytest.mark.parametrize("text", ["a" + ".a" * 500 + " = 1", "a = " + "[" * 20 + "]" * 20])
def test_a_draft_that_is_nested_deeply_is_none(text: str) -> None:
    assert read(text) == {}
    with pytest.raises(ExerciseFileError, match=r"file: got '.* more than 16 (parts|deep)', expected at most 16"):
        parse_exercise(text, "mine")


def cell(draft: Draft, path: str) -> Entry:
    return next(entry for entry in entries(draft) if entry.path == path)


def trial(draft: Draft):  # type: ignore[no-untyped-def]
    return tried(to_toml(draft), "exercise", kin.get_robot)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_exercise_passes_through_the_form_unchanged(path: Path) -> None:
    draft = tomllib.loads(path.read_text())
    assert tomllib.loads(to_toml(draft)) == draft
    typed = draft
    for entry in entries(draft):
        assert not entry.fixed, entry.path
        typed = with_cell(typed, entry.path, entry.text)
    mine, theirs = parse_exercise(to_toml(typed)), parse_exercise(path.read_text())
    for seed in range(3):
        assert mine.solution(mine.variant(seed), UNITS) == theirs.solution(theirs.variant(seed), UNITS)
        assert mine.variant(seed).text(mine.text, UNITS) == theirs.variant(seed).text(theirs.text, UNITS)


def test_values_stand_beside_expressions_in_the_readers_unit() -> None:
    text = """
id = "mine"
title = "Mine"
topic = "Forward kinematics"
robot = "planar2r"
kind = "number"
text = "At {t1}?"
q = ["t1", "90*deg"]
[vary]
t1 = { choose = [30], unit = "deg" }
[let]
r = { value = "hypot(x, y)", unit = "mm" }
[answer]
value = "r"
unit = "mm"
tolerance = 1
method = "Add them up."
"""
    arm = kin.get_robot("planar2r")
    x, y = kin.fk(arm, [math.radians(30), math.pi / 2])[:2, 3]
    found = tried(text, "exercise", kin.get_robot)
    assert found.error == ""
    values = found.values(UNITS)
    assert values["q[0]"] == ("30°",) * 3
    assert values["q[1]"] == ("90°",) * 3
    assert [float(value.removesuffix(" mm")) for value in values["answer.value"]] == pytest.approx(
        [1000 * math.hypot(x, y)] * 3, abs=0.05
    )
    assert [one.text for one in found.students(UNITS)] == ["At 30°?"] * 3
    assert found.values(Units(degrees=False))["q[1]"] == ("1.571 rad",) * 3


@pytest.mark.parametrize(
    ("path", "text", "field", "words"),
    [
        ("title", "", "title", "expected a text"),
        ("id", "Not valid!", "id", "lower-case"),
        ("level", "seven", "level", "a whole number from 1 to 3"),
        ("robot", "nobody", "robot", "the id of a robot"),
        ("text", "{nobody} is there", "text", "a name from"),
        ("q", "1\n2\n3", "q", "values, one per joint"),
        ("answer.value", "hypot(", "answer.value[0]", "an expression"),
        ("answer.value", "nobody + 1", "answer.value[0]", "a name from"),
        ("answer.value", "__import__('os')", "answer.value[0]", "an expression"),
        ("answer.value", "1e300", "answer.value[0]", "from -1e+12 to 1e+12"),
        ("answer.value", "1e999", "answer.value[0]", "from -1e+12 to 1e+12"),
        ("answer.tolerance", "-1", "answer.tolerance", "above 0"),
    ],
)
def test_a_refusal_names_field_value_and_what_is_valid(path: str, text: str, field: str, words: str) -> None:
    found = trial(with_cell(REACH, path, text))
    assert found.exercise is None
    assert found.field == field
    assert words in found.error


@pytest.mark.parametrize("path", ["answer.motions[1].by", "vary[1].choose"])
def test_numbers_of_motions_are_bounded(path: str) -> None:
    draft = tomllib.loads(next(path for path in FILES if path.stem == "dh-order").read_text())
    assert trial(with_cell(draft, path, "1e12")).error == "", "the largest one can be computed with"
    found = trial(with_cell(draft, path, "1e160"))
    assert found.field == "answer.motions[1].by"
    assert "expected a number from -1e+12 to 1e+12" in found.error
    found.students(UNITS)


def test_an_id_that_is_taken_is_refused_and_what_cannot_be_solved_is_said() -> None:
    taken = trial(REACH).with_taken_id()
    assert taken.field == "id"
    assert REACH["id"] in taken.error
    assert [one.failure for one in taken.students(UNITS)] == ["", "", ""], "what students get is said all the same"
    never = trial(with_cell(REACH, "require", "0 > 1"))
    assert never.exercise is not None
    assert "no numbers that meet the conditions" in never.error
    assert [one.failure for one in never.students(UNITS)] == [
        f"No numbers were drawn for seed {i}." for i in range(3)
    ]


def test_rows_are_added_named_and_removed() -> None:
    draft = with_row(REACH, "vary")
    names = list(draft["vary"])
    assert names[:-1] == list(REACH["vary"])
    new = f"vary[{len(names) - 1}]"
    assert cell(draft, f"{new}.step").text == "10"
    renamed = with_cell(draft, new, "beta")
    assert list(renamed["vary"]) == [*names[:-1], "beta"]
    with pytest.raises(InputError, match="a name that no other number has"):
        with_cell(renamed, new, names[0])
    assert without_row(renamed, "vary", len(names) - 1) == REACH
    mistakes = with_row(REACH, "answer.mistakes")
    count = len(REACH["answer"].get("mistakes", ()))
    assert len(mistakes["answer"]["mistakes"]) == count + 1
    assert without_row(mistakes, "answer.mistakes", count) == REACH
    for path, index in (("answer.mistakes", 99), ("answer.mistakes", -1), ("nobody", 0)):
        with pytest.raises(InputError):
            without_row(mistakes, path, index)
    assert trial(with_cell(renamed, new, "not a name")).field == "vary.not a name"


def test_what_the_form_cannot_show_stays_as_it_is() -> None:
    reasons = [{"when": "1 > 0", "text": "One way."}, "Another."]
    draft = {**REACH, "answer": {**REACH["answer"], "method": reasons}}
    assert cell(draft, "answer.method").fixed
    with pytest.raises(InputError):
        with_cell(draft, "answer.method", "Lost")
    changed = with_cell(draft, "title", "Other")
    assert tomllib.loads(to_toml(changed))["answer"]["method"] == reasons


def test_hostile_texts_are_kept_as_text_or_refused() -> None:
    with pytest.raises(InputError, match=f"at most {LONGEST_CELL}"):
        with_cell(REACH, "text", "x" * (LONGEST_CELL + 1))
    with pytest.raises(InputError):
        with_cell(REACH, "__class__", "x")
    nasty = '"""\\ \u0000\x7f\ud800 <script>alert(1)</script> \u202e\n[answer]\nvalue = 1'
    draft = with_cell(REACH, "shown", nasty)
    assert tomllib.loads(to_toml(draft)) == draft
    to_toml(draft).encode()
    assert "\u0000" not in draft["shown"]
    found = trial(with_cell(REACH, "answer.value", "postures()+" * 30 + "1"))
    assert found.exercise is not None, "each is computed once"


@pytest.mark.parametrize("step", ["1e-320", "1e-12", "1e308"])
def test_a_step_gives_a_countable_number_of_values(step: str) -> None:
    rule = {
        "t": {
            "from": -1e308 if step == "1e308" else -60,
            "to": 1e308 if step == "1e308" else 60,
            "step": float(step),
        }
    }
    text = to_toml({**REACH, "vary": {**REACH["vary"], **rule}})
    with pytest.raises(ExerciseFileError, match="at most 1000000 values"):
        parse_exercise(text)


def test_numbers_that_take_too_long_to_draw_are_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.exercises.exercise.LONGEST", 0.0)
    one = parse_exercise(to_toml(with_cell(REACH, "require", "0 > 1")))
    with pytest.raises(VariantError, match="take longer"):
        one.variant(0)


HARD = (
    "1/0",
    "q9",
    "J(9, 9)",
    "sqrt(-1)",
    "a(1",
    "1" * 300,
    "theta",
    "postures",
    "nan",
    "1e999",
    "-1",
    "0",
    "1e30",
)
ANY = st.one_of(st.text(max_size=40), st.sampled_from(HARD))


@pytest.mark.full
@settings(max_examples=150, deadline=None)
@given(st.data(), ANY)
def test_whatever_is_typed_is_a_draft_that_is_tried(data: st.DataObject, text: str) -> None:
    draft = tomllib.loads(data.draw(st.sampled_from(FILES)).read_text())
    paths = [entry.path for entry in entries(draft)]
    path = data.draw(st.sampled_from(paths))
    try:
        changed = with_cell(draft, path, text)
    except InputError:
        return
    assert tomllib.loads(to_toml(changed)) == changed
    assert any(entry.path == path for entry in entries(changed))
    found = trial(changed)
    assert found.exercise is not None or found.error
    found.students(UNITS)
    found.values(UNITS)


def test_help_is_there_where_a_label_does_not_say_it_all() -> None:
    for group in groups(REACH, ("planar2r",)):
        for member in group.members:
            cells = member.table.columns if isinstance(member, Rows) else (member.cell,)
            assert all(isinstance(one, Cell) and one.label for one in cells)
    assert cell(REACH, "q").cell.help
