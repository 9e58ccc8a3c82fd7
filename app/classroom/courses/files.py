"""Course files: TOML ↔ `Course`, and the same fields as JSON in links.

What is read is checked the same way wherever it comes from. Every error names the file, the field, the value and
what is valid.
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Callable
from dataclasses import replace
from difflib import get_close_matches
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from app.classroom.courses.course import LONGEST, MOST_OWN, MOST_PAIRS, Course, Item, Own
from app.classroom.courses.sealing import TAG, Seal
from app.exercises import (
    Exercise,
    ExerciseFileError,
    Exercises,
    Lessons,
    Shelf,
    VariantError,
    form,
    parse_exercise,
)
from app.exercises.fields import Fields, text_of, toml_of
from app.exercises.lessons import LESSONS
from kin import InputError, KinematicsError, Robot, get_robot
from kin.parsing import to_toml

BUILTIN = Path(__file__).parent / "library"
MOST_BYTES = 8000  # of a course as JSON: links and pages keep it
MOST_IN_FILE = 16_000  # bytes of a file that a page opens

Find = Callable[[str], Robot]


class _CourseFields(Fields):
    """Texts of a course: braces mean nothing, and each has its own limit."""

    def checked(self, field: str, text: str) -> str:
        longest = LONGEST.get(field, 80)
        if len(text) > longest:
            raise self.refuse(field, text, f"a text of 1 to {longest} characters")
        if not all(char.isprintable() or char == "\n" for char in text.replace("\u00a0", " ")):
            raise self.refuse(field, text, "a text without control characters")
        return text


def course_of(
    data: object, exercises: Exercises, file: str = "course", find: Find = get_robot, seal: Seal | None = None
) -> Course:
    """The course of a file's or a link's fields.

    Args:
        exercises: those of the service; the course may name no others.
        file: the name in messages.
        find: gives the arm of an id.
        seal: opens the exercises that the course brings along sealed; None: it brings none of these.

    Raises:
        ExerciseFileError: naming the file, the field, the value and what would be valid.
    """
    fields = _CourseFields(file, data)
    title, about = fields.text("title"), fields.text("about", "")
    answers = fields.flag("answers", True)
    own = _own(fields, exercises, find, seal)
    known = Shelf(exercises)
    known.put(one.exercise for one in own)
    items = tuple(_item(each, known, find) for each in fields.tables("item"))
    before, after = _pairs(fields, items)
    fields.done()
    course = Course(title, about, items, answers, own, before, after)
    plain = json.dumps(to_data(replace(course, own=())), ensure_ascii=False, separators=(",", ":"))
    size = len(plain.encode()) + sum(_sealed_size(one.text) for one in own)
    if size > MOST_BYTES:
        raise fields.refuse("item", f"{size} bytes", f"at most {MOST_BYTES} bytes in all: shorten the texts")
    return course


def parse_course(text: str, exercises: Exercises, file: str = "course", find: Find = get_robot) -> Course:
    """The course described by TOML text; raises `ExerciseFileError`.

    It has an item at least, and the exercises that it brings along can be solved.
    """
    data = toml_of(text, file)
    course = course_of(data, exercises, file, find)
    for i, one in enumerate(course.own):
        try:
            one.exercise.verify()
        except VariantError as error:
            field = f"own[{i}].{error.field or 'answer'}"
            raise ExerciseFileError(file, field, str(error), "an exercise that can be solved") from None
    if not course.items:
        raise ExerciseFileError(file, "item", data.get("item"), "at least one [[item]]: a lesson or an exercise")
    return course


def load_course(path: Path | str, exercises: Exercises, find: Find = get_robot) -> Course:
    """The course of a file; raises `ExerciseFileError`."""
    return parse_course(text_of(path), exercises, str(path), find)


def to_data(course: Course, seal: Seal | None = None) -> dict[str, Any]:
    """A course as JSON, with the fields of a file.

    Args:
        seal: closes the exercises that the course brings along, for what a browser keeps; None: they are plain. It
            raises `KinematicsError` without a secret.
    """
    items = []
    for item in course.items:
        row: dict[str, str] = {item.kind: item.key}
        row |= {name: text for name in ("title", "note", "robot") if (text := getattr(item, name))}
        items.append(row)
    data: dict[str, Any] = {"title": course.title}
    if course.about:
        data["about"] = course.about
    if not course.answers:
        data["answers"] = False
    if course.before:
        data |= {"before": list(course.before), "after": list(course.after)}
    data["item"] = items
    if course.own:
        data["own"] = [form.read(one.text) if seal is None else seal.close(one.text) for one in course.own]
    return data


class Courses:
    """The built-in courses, and those of the operator's folder. Read-only, so any thread may use it.

    The files are read when they are first asked for.

    Attributes:
        exercises, lessons: what they name.
    """

    def __init__(
        self,
        exercises: Exercises,
        folder: Path | None = None,
        find: Find = get_robot,
        lessons: Lessons | None = None,
    ) -> None:
        self.exercises, self.lessons = exercises, lessons or Lessons()
        self.find = find
        self._folders = [BUILTIN] if folder is None else [BUILTIN, folder]

    @cached_property
    def all(self) -> tuple[Course, ...]:
        """In the order of the files' names; raises `ExerciseFileError`."""
        return tuple(course for _, course in self._files)

    @cached_property
    def named(self) -> dict[str, Course]:
        """By the file's name without its ending and a number before it: ``1-first-steps.toml`` is *first-steps*.

        Of two files with the same name, the operator's counts. Raises `ExerciseFileError`.
        """
        return {re.sub(r"^\d+-", "", path.stem): course for path, course in self._files}

    @cached_property
    def _files(self) -> list[tuple[Path, Course]]:
        found: list[tuple[Path, Course]] = []
        for folder in self._folders:
            try:
                paths = sorted(path for path in folder.iterdir() if path.suffix == ".toml")
            except OSError as error:
                raise ExerciseFileError(str(folder), "folder", str(error), "a folder that can be read") from error
            found += [(path, load_course(path, self.exercises, self.find)) for path in paths]
        return found


def _own(fields: Fields, exercises: Exercises, find: Find, seal: Seal | None) -> tuple[Own, ...]:
    """The exercises that a course brings along: tables, or sealed texts."""
    found: dict[str, Own] = {}
    for i, given in enumerate(fields.items("own")):
        name = f"own[{i}]"
        if len(found) >= MOST_OWN:
            raise fields.refuse(name, "one more exercise", f"at most {MOST_OWN} in a course")
        if isinstance(given, dict):
            text = to_toml(given)
        elif isinstance(given, str) and seal is not None:
            try:
                text = seal.open(given)
            except InputError as error:
                raise fields.refuse(name, given, error.expected) from None
        else:
            raise fields.refuse(name, given, "a table with the fields of an exercise")
        try:
            exercise = parsed(text, find)
        except ExerciseFileError as error:
            made = fields.refuse(f"{name}.{error.field}", None, error.expected)
            made.value, made.args = (
                error.value,
                (f"{fields.file}: {name}.{error.field}: got {error.value}, expected {error.expected}",),
            )
            raise made from None
        taken = exercises.get(exercise.id)  # in the operator's folder, it may be newer than the course
        if exercise.id in found or (taken is not None and taken.builtin):
            raise fields.refuse(f"{name}.id", exercise.id, "an id that no other exercise has")
        found[exercise.id] = Own(text, exercise)
    return tuple(found.values())


@lru_cache(maxsize=256)  # a course is read with each change of it, and its exercises stay the same objects
def parsed(text: str, find: Find) -> Exercise:
    """The exercise of a text that a course or a room brings along; raises `ExerciseFileError`."""
    return parse_exercise(text, "course", find)


def _sealed_size(text: str) -> int:
    """How many characters a sealed text has."""
    return 4 * (TAG + len(zlib.compress(text.encode(), 9)) + 2) // 3


def _item(fields: Fields, exercises: Exercises, find: Find) -> Item:
    given = [kind for kind in ("lesson", "exercise") if fields.has(kind)]
    if len(given) != 1:
        valid = "either lesson, the key of a lesson, or exercise, the id of an exercise"
        raise fields.refuse("lesson", fields.get("lesson"), valid)
    title, note = fields.text("title", ""), fields.text("note", "")
    if given == ["lesson"]:
        robot = fields.text("robot", "")
        try:
            if robot:
                find(robot)
        except KinematicsError as error:
            raise fields.refuse("robot", robot, f"the id of a robot ({error})") from None
        item = Item("lesson", fields.choice("lesson", LESSONS), title, note, robot)
    else:
        item = Item("exercise", _exercise(fields, exercises), title, note)
    fields.done()
    return item


def _exercise(fields: Fields, exercises: Exercises) -> str:
    key = fields.get("exercise")
    if isinstance(key, str) and exercises.get(key) is not None:
        return key
    near = get_close_matches(key, [one.id for one in exercises.all], 2) if isinstance(key, str) else []
    hint = f", such as {' or '.join(near)}" if near else ""
    raise fields.refuse("exercise", key, f"the id of an exercise of this service{hint}")


def _pairs(fields: Fields, items: tuple[Item, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The exercises before and after: of the course, each once, and each pair in the order of the course."""
    before, after = fields.texts("before"), fields.texts("after")
    places = {item.key: i for i, item in reversed([*enumerate(items)]) if item.kind == "exercise"}
    if len(before) > MOST_PAIRS:
        raise fields.refuse("before", f"{len(before)} exercises", f"at most {MOST_PAIRS}")
    if len(before) != len(after):
        valid = f"as many exercises as before has ({len(before)}): they are compared pair by pair"
        raise fields.refuse("after", f"{len(after)} exercises", valid)
    for name, keys in (("before", before), ("after", after)):
        for i, key in enumerate(keys):
            if key not in places:
                raise fields.refuse(f"{name}[{i}]", key, "the id of an exercise that is an item of this course")
            if (*before, *after).count(key) > 1:
                raise fields.refuse(f"{name}[{i}]", key, "an exercise that is in before or after once")
    for i, (first, second) in enumerate(zip(before, after, strict=True)):
        if places[first] > places[second]:
            raise fields.refuse(f"after[{i}]", second, f"an item that comes after {first} in the course")
    return before, after
