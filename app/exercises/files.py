"""Exercise files: TOML → `Exercise`; the built-in exercises, and those of a folder."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from app.exercises import cell
from app.exercises.cell import Declared
from app.exercises.exercise import TOPICS, Computed, Drawn, Exercise, Target
from app.exercises.expressions import Expression
from app.exercises.fields import ExerciseFileError, Fields, text_of, toml_of
from app.exercises.kinds import KINDS
from app.exercises.lessons import LESSONS
from app.exercises.variant import Facts
from kin import KinematicsError, Robot, get_robot

BUILTIN = Path(__file__).parent / "library"
MOST_HINTS = 5
MOST_BYTES = 4000  # of an exercise that is written in a page
LAST = 999  # place of an exercise without one
_ID = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,19}")

Find = Callable[[str], Robot]


@dataclass(frozen=True)
class Head(Declared):
    """What lists and the page show of an exercise."""

    title: str = cell.line("Title", "Shown in the list.")
    id: str = cell.line("Id", "Lower-case letters, digits and hyphens; different from all others.")
    topic: str = cell.choice("Topic", "", TOPICS)
    level: int = cell.whole("Level", "1 is easy, 3 is hard; empty: 1.", 1, 3, 1)
    place: int = cell.whole(
        "Place", f"Orders the exercises of one level, 1 to {LAST}; empty: at the end.", 1, LAST, LAST
    )
    lesson: str = cell.choice(
        "Lesson", "The lesson that it belongs to. The checks of later lessons may ask it.", LESSONS, ""
    )
    robot: str = cell.special("Arm", "An arm of this service.", "choice", Fields.text)

    def check(self, table: Fields) -> None:
        if not _ID.fullmatch(self.id):
            raise table.refuse("id", self.id, "lower-case letters, digits and hyphens, at most 40")


@dataclass(frozen=True)
class Task(Declared):
    """Its texts."""

    text: str = cell.text("Text", "What is asked.")
    hints: tuple[str, ...] = cell.lines(
        "Hints", f"One in each line, at most {MOST_HINTS}; shown one after the other."
    )
    shown: str = cell.text("Why", "Why the answer is right; shown at the end.", "")

    def check(self, table: Fields) -> None:
        if len(self.hints) > MOST_HINTS:
            raise table.refuse("hints", len(self.hints), f"at most {MOST_HINTS} hints")


def parse_exercise(text: str, file: str = "exercise", find: Find = get_robot, builtin: bool = False) -> Exercise:
    """The exercise described by TOML text; `find` gives the arm of an id, `file` is the name in messages.

    Raises:
        ExerciseFileError: naming the file, the field, the value and what would be valid.
    """
    data = toml_of(text, file)
    vary = _vary(Fields(file, data.get("vary", {}), "vary."))
    computed = Fields(file, data.get("let", {}), "let.")
    let = _let(computed, frozenset(vary))
    names = frozenset((*vary, *let))
    fields = Fields(file, data, names=names, found=computed.found)
    for table in ("vary", "let"):
        fields.get(table)
    head, task = Head.read(fields), Task.read(fields)
    robot = _robot(fields, head.robot, find)
    kind = KINDS[fields.choice("kind", KINDS)]
    q = fields.expressions("q")
    if q and len(q) != robot.n:
        raise fields.refuse("q", len(q), f"{robot.n} values, one per joint")
    answer = fields.sub("answer")
    question = kind.read(answer)
    answer.done()
    require, target = fields.expressions("require"), _target(fields, robot)
    fields.done()
    known = names | frozenset(Facts(robot, robot.q_home))
    for expression in fields.found:
        if unknown := sorted(expression.names - known):
            valid = f"a name from [vary] or [let], or of the arm: {', '.join(sorted(known))}"
            raise ExerciseFileError(file, expression.field, unknown[0], valid)
    described: dict[str, Any] = {**vars(head), **vars(task), "robot": robot}
    return Exercise(
        **described,
        vary=vary,
        let=let,
        require=require,
        q=q,
        target=target,
        kind=question,
        expressions=tuple(fields.found),
        file=file,
        source=text,
        builtin=builtin,
    )


def load_exercise(path: Path | str, find: Find = get_robot, builtin: bool = False) -> Exercise:
    """The exercise of a file; raises `ExerciseFileError`."""
    return parse_exercise(text_of(path), str(path), find, builtin)


def load_folder(folder: Path, find: Find = get_robot, builtin: bool = False) -> tuple[Exercise, ...]:
    """The exercises of every ``*.toml`` file of a folder, by topic and level.

    Raises:
        ExerciseFileError: a file is invalid, two files have the same id, or the folder cannot be read.
    """
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix == ".toml")
    except OSError as error:
        raise ExerciseFileError(str(folder), "folder", str(error), "a folder that can be read") from error
    found: dict[str, Exercise] = {}
    for path in paths:
        exercise = load_exercise(path, find, builtin)
        if exercise.id in found:
            raise ExerciseFileError(str(path), "id", exercise.id, "an id that no other file of the folder uses")
        found[exercise.id] = exercise
    return tuple(sorted(found.values(), key=lambda one: (*one.rank, one.id)))


@cache
def builtin_exercises() -> tuple[Exercise, ...]:
    """The exercises of the package."""
    return load_folder(BUILTIN, builtin=True)


def _robot(fields: Fields, robot_id: str, find: Find) -> Robot:
    try:
        return find(robot_id)
    except KinematicsError as error:
        raise fields.refuse("robot", robot_id, f"the id of a robot ({error})") from None


def _vary(fields: Fields) -> dict[str, Drawn]:
    found: dict[str, Drawn] = {}
    for name in fields.table:
        _check_name(fields, name)
        rule = fields.sub(name)
        found[name] = Drawn.read(rule)
        rule.done()
    return found


def _let(fields: Fields, drawn: frozenset[str]) -> dict[str, tuple[Expression, str]]:
    found: dict[str, tuple[Expression, str]] = {}
    for name, value in fields.table.items():
        _check_name(fields, name)
        if name in drawn:
            raise fields.refuse(name, value, "a name that is not in [vary]")
        if isinstance(value, dict):
            rule = fields.sub(name)
            made = Computed.read(rule)
            found[name] = made.value, made.measure
            rule.done()
        else:
            found[name] = fields.expression(name), ""
    return found


def _check_name(fields: Fields, name: str) -> None:
    if not _NAME.fullmatch(name):
        raise fields.refuse(name, name, "a name of lower-case letters, digits and _, at most 20")


def _target(fields: Fields, robot: Robot) -> Target | None:
    if not fields.has("target"):
        return None
    table = fields.sub("target")
    q, position = table.expressions("q"), table.expressions("position")
    if bool(q) == bool(position):
        raise table.refuse("q", table.get("q"), "either q, a configuration, or position, a point")
    if q and len(q) != robot.n:
        raise table.refuse("q", len(q), f"{robot.n} values, one per joint")
    if position and len(position) != 3:
        raise table.refuse("position", len(position), "three values x, y, z")
    table.done()
    return Target(q, position)
