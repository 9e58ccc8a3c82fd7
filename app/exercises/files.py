"""Exercise files: TOML → `Exercise`; the built-in exercises, and those of a folder."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

from app.exercises.exercise import TOPICS, Drawn, Exercise, Target
from app.exercises.expressions import Expression
from app.exercises.fields import ExerciseFileError, Fields, text_of, toml_of
from app.exercises.kinds import KINDS
from app.exercises.lessons import LESSONS
from app.exercises.variant import Facts
from kin import KinematicsError, Robot, get_robot

BUILTIN = Path(__file__).parent / "library"
UNITS = {"deg": (math.pi / 180, "angle"), "rad": (1.0, "angle"), "mm": (1e-3, "length"), "m": (1.0, "length")}
MOST_HINTS = 5
MOST_BYTES = 4000  # of an exercise that is written in a page
MOST_VALUES = 1_000_000  # from which a number is drawn
LAST = 999  # place of an exercise without one
_ID = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,19}")

Find = Callable[[str], Robot]


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
    robot = _robot(fields, find)
    kind = KINDS[fields.choice("kind", KINDS)]
    exercise_id = fields.text("id")
    if not _ID.fullmatch(exercise_id):
        raise fields.refuse("id", exercise_id, "lower-case letters, digits and hyphens, at most 40")
    hints = fields.texts("hints")
    if len(hints) > MOST_HINTS:
        raise fields.refuse("hints", len(hints), f"at most {MOST_HINTS} hints")
    q = fields.expressions("q")
    if q and len(q) != robot.n:
        raise fields.refuse("q", len(q), f"{robot.n} values, one per joint")
    answer = fields.sub("answer")
    question = kind.read(answer)
    answer.done()
    require, target = fields.expressions("require"), _target(fields, robot)
    known = names | frozenset(Facts(robot, robot.q_home))
    for expression in fields.found:
        if unknown := sorted(expression.names - known):
            valid = f"a name from [vary] or [let], or of the arm: {', '.join(sorted(known))}"
            raise ExerciseFileError(file, expression.field, unknown[0], valid)
    exercise = Exercise(
        exercise_id,
        fields.text("title"),
        fields.choice("topic", TOPICS),
        fields.whole("level", 1, 3, 1),
        fields.whole("place", 1, LAST, LAST),
        fields.choice("lesson", LESSONS) if fields.has("lesson") else "",
        robot,
        fields.text("text"),
        hints,
        fields.text("shown", ""),
        vary,
        let,
        require,
        q,
        target,
        question,
        tuple(fields.found),
        file,
        text,
        builtin,
    )
    fields.done()
    return exercise


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


def _robot(fields: Fields, find: Find) -> Robot:
    robot_id = fields.text("robot")
    try:
        return find(robot_id)
    except KinematicsError as error:
        raise fields.refuse("robot", robot_id, f"the id of a robot ({error})") from None


def _vary(fields: Fields) -> dict[str, Drawn]:
    found: dict[str, Drawn] = {}
    for name in fields.table:
        _check_name(fields, name)
        rule = fields.sub(name)
        scale, measure = _unit(rule)
        chosen = rule.items("choose")
        if not all(type(value) in (int, float) and math.isfinite(value) for value in chosen):
            raise rule.refuse("choose", chosen, "numbers")
        if chosen:
            found[name] = Drawn(0.0, 0.0, 0.0, tuple(scale * value for value in chosen), measure)
        else:
            low = rule.number("from")
            high, step = rule.number("to", above=low), rule.number("step", above=0.0)
            if not (high - low) / step <= MOST_VALUES:
                raise rule.refuse("step", step, f"a step that gives at most {MOST_VALUES} values")
            found[name] = Drawn(scale * low, scale * high, scale * step, (), measure)
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
            found[name] = rule.expression("value"), _unit(rule)[1]
            rule.done()
        else:
            found[name] = fields.expression(name), ""
    return found


def _check_name(fields: Fields, name: str) -> None:
    if not _NAME.fullmatch(name):
        raise fields.refuse(name, name, "a name of lower-case letters, digits and _, at most 20")


def _unit(rule: Fields) -> tuple[float, str]:
    if not rule.has("unit"):
        return 1.0, ""
    return UNITS[rule.choice("unit", UNITS)]


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
