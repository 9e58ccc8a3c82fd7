"""Course files: what is read, what is refused and why, and changes of a course."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.classroom.courses import (
    Course,
    Courses,
    Item,
    course_of,
    load_course,
    parse_course,
    parse_item,
    to_data,
)
from app.classroom.courses.course import LONGEST
from app.classroom.courses.files import MOST_BYTES
from app.cli.parser import main
from app.exercises import ExerciseFileError, Exercises
from app.exercises.lessons import LESSONS
from kin.parsing import to_toml

ALL = Exercises()
FILE = """
title = "Week 1"
about = "Two links."
answers = false

[[item]]
lesson = "dh"
robot = "scara"
note = "Read the first step."

[[item]]
exercise = "two-elbows"
title = "Both of them"
"""


def test_a_file_is_read() -> None:
    course = parse_course(FILE, ALL)
    items = (
        Item("lesson", "dh", "", "Read the first step.", "scara"),
        Item("exercise", "two-elbows", "Both of them"),
    )
    assert course == Course("Week 1", "Two links.", items, answers=False)
    assert course.exercises == ("two-elbows",)


def test_the_built_in_courses_are_valid() -> None:
    courses = Courses(ALL).all
    assert len(courses) >= 3
    assert (
        len({course.title for course in courses})
        == len({course.fingerprint for course in courses})
        == len(courses)
    )
    assert all(course.exercises and course.about for course in courses)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('exercise = "two-elbows"', 'exercise = "two-elbow"'), r"item\[1\]\.exercise: got 'two-elbow', .* two-"),
        (('lesson = "dh"', 'lesson = "hd"'), r"item\[0\]\.lesson: got 'hd', expected one of .rotations., .dh"),
        (('lesson = "dh"', 'lesson = "dh"\nexercise = "two-elbows"'), r"item\[0\]\.lesson: .* either lesson"),
        (('lesson = "dh"\n', ""), r"item\[0\]\.lesson: got None, expected either lesson"),
        (('robot = "scara"', 'robot = "scarab"'), r"item\[0\]\.robot: got 'scarab', expected the id of a robot"),
        (('title = "Both', 'titel = "Both'), r"item\[1\]\.titel: .* no such field; valid are"),
        (('robot = "scara"', "q = 1"), r"item\[0\]\.q: got 1, expected no such field"),
        (("answers = false", 'answers = "no"'), "answers: got 'no', expected true or false"),
        (('title = "Week 1"', 'title = ""'), "title: got '', expected a text of 1 to"),
        (('title = "Week 1"', f'title = "{"x" * 81}"'), "title: .* a text of 1 to 80 characters"),
        (('about = "Two links."', 'about = "a\\u0007b"'), "about: .* without control characters"),
        (("[[item]]", "[[items]]"), "items: .* no such field; valid are title, about, answers, own, item"),
        (("[[item]]", "[[item]"), "file: .* expected valid TOML"),
    ],
)
def test_a_wrong_file_is_refused_by_field_value_and_what_is_valid(change: tuple[str, str], message: str) -> None:
    with pytest.raises(ExerciseFileError, match=message):
        parse_course(FILE.replace(*change), ALL, "week1.toml")


def test_a_course_too_long_for_a_link_is_refused() -> None:
    long = "ä" * LONGEST["note"]
    data = {"title": "Long", "item": [{"lesson": "dh", "note": long}] * 12}
    with pytest.raises(ExerciseFileError, match=f"at most {MOST_BYTES} bytes"):
        course_of(data, ALL)
    with pytest.raises(ExerciseFileError, match="0 to 40 items"):
        course_of({"title": "Long", "item": [{"lesson": "dh"}] * 41}, ALL)


TEXTS = st.text(st.characters(exclude_categories=("C", "Z")) | st.sampled_from(' {}"\\#\n'), max_size=40).map(
    str.strip
)
ITEMS = st.builds(
    Item, st.just("exercise"), st.sampled_from([one.id for one in ALL.all]), TEXTS, TEXTS
) | st.builds(Item, st.just("lesson"), st.sampled_from(LESSONS), TEXTS, TEXTS, st.sampled_from(["", "scara"]))
COURSES = st.builds(
    Course, TEXTS.filter(bool), TEXTS, st.lists(ITEMS, min_size=1, max_size=6).map(tuple), st.booleans()
)


@given(COURSES)
def test_a_course_is_the_same_after_a_file_or_a_link(course: Course) -> None:
    assert parse_course(to_toml(to_data(course)), ALL) == course
    assert course_of(json.loads(json.dumps(to_data(course))), ALL) == course


@given(COURSES, st.data())
def test_changes_keep_the_other_items(course: Course, data: st.DataObject) -> None:
    count = len(course.items)
    index, to = data.draw(st.integers(0, count - 1)), data.draw(st.integers(0, count - 1))
    moved = course.moved(index, to)
    assert moved.items[to] == course.items[index]
    assert moved.moved(to, index) == course
    assert course.moved(index, count) == course.moved(index, -1) == course
    extra = Item("lesson", "dh")
    assert course.added(extra).removed(count) == course
    changed = course.changed(index, note="x")
    assert changed.items[index].note == "x"
    assert changed.changed(index, note=course.items[index].note) == course
    assert changed.fingerprint == course.fingerprint


def test_a_course_has_an_item() -> None:
    with pytest.raises(ExerciseFileError, match="item: got None, expected at least one"):
        parse_course('title = "Empty"', ALL)


def test_names_of_items() -> None:
    assert parse_item("lesson:dh") == Item("lesson", "dh")
    assert parse_item("exercise:two-elbows") == Item("exercise", "two-elbows")
    assert parse_item("robot:scara") is None


def test_the_operators_folder_comes_last(tmp_path: Path) -> None:
    (tmp_path / "week1.toml").write_text(FILE, encoding="utf-8")
    assert [course.title for course in Courses(ALL, tmp_path).all][-1] == "Week 1"
    named = Courses(ALL, tmp_path).named
    assert {"first-steps", "joint-angles", "speeds-and-motions"} < set(named)
    (tmp_path / "07-first-steps.toml").write_text(FILE)
    assert Courses(ALL, tmp_path).named["first-steps"].title == "Week 1", "the operator's counts"
    assert load_course(tmp_path / "week1.toml", ALL) == parse_course(FILE, ALL)
    with pytest.raises(ExerciseFileError, match="a folder that can be read"):
        _ = Courses(ALL, tmp_path / "none").all


def test_check_describes_a_course(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "week1.toml"
    path.write_text(FILE, encoding="utf-8")
    assert main(["check", str(path)]) == 0
    shown = capsys.readouterr().out
    assert "Week 1" in shown
    assert "Both of them" in shown
    assert "1 lesson and 1 exercise; answers are hidden" in shown
    assert main(["check", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["item"][1] == {"exercise": "two-elbows", "title": "Both of them"}
    path.write_text(FILE.replace("two-elbows", "to-elbows"), encoding="utf-8")
    assert main(["check", str(path)]) == 2
    assert f"{path}: item[1].exercise: got 'to-elbows'" in capsys.readouterr().err
