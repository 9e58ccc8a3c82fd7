"""Worked examples: a few steps with words on an arm of their own, which a player shows one after another.

A lesson's file has one, beside its steps::

    [example]
    title = "an arm of two links"

    [[example.rows]]
    a = 0.4

    [example.lengths]
    reach = "hypot(x, y)"

    [[example.steps]]
    q = ["0*deg"]
    text = "Joint 1 stands at 0."
    then = "The tool is {reach} from the base."
    axes = [1]

`rows` are those of a DH table; a row with `slide` is that of a prismatic joint. What `lengths`, `angles` and
`numbers` declare is computed at the end of each step's motion; expressions use the arm as in exercises.

`text` must be true while the arm moves to `q`, and `then` when it is there. Without `q` the arm stays. It moves
evenly in all joints or, with ``way = "line"``, so that the tool point goes straight; between two configurations
with the same tool point, it stays there. `marks` are points with a name, of one step or, beside `rows`, of all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from app.exercises.expressions import Expression
from app.exercises.fields import ExerciseFileError, Fields, Words
from app.exercises.variant import Facts
from kin import InputError, Robot
from kin.transforms import Array

Way = Literal["joints", "line"]
MEASURES = {"lengths": "length", "angles": "angle", "numbers": ""}
LEAST, MOST = 3, 10  # steps


@dataclass(frozen=True)
class Ruler:
    """A distance that is drawn with its value: between the origins of two frames, under a name."""

    start: int
    end: int
    name: str


@dataclass(frozen=True)
class Mark:
    """A point ``(3,)`` that is drawn with a name."""

    at: tuple[Expression, ...]
    name: str


@dataclass(frozen=True)
class Drawn:
    """What the scene shows of the arm during a step. Joints count from 1, frames from 0, the base.

    Attributes:
        axes: joints whose axis is drawn.
        frames: frames that are drawn.
        angles: joints whose value is drawn as an angle.
        columns: joints whose column is drawn: the velocity of the tool point at unit speed.
        path: whether the way of the tool point during this step is drawn.
        rulers, marks: distances and points.
        ghosts: configurations ``(n,)`` of copies of the arm.
        walk: how many motions of the table's rows a large frame has completed from the base; None: there is none.
    """

    axes: tuple[int, ...] = ()
    frames: tuple[int, ...] = ()
    angles: tuple[int, ...] = ()
    columns: tuple[int, ...] = ()
    path: bool = False
    rulers: tuple[Ruler, ...] = ()
    marks: tuple[Mark, ...] = ()
    ghosts: tuple[tuple[Expression, ...], ...] = ()
    walk: int | None = None


@dataclass(frozen=True)
class WorkedStep:
    """One step.

    Attributes:
        q: the configuration ``(n,)`` at its end; empty: that of the step before.
    """

    text: Words
    then: Words
    q: tuple[Expression, ...]
    way: Way
    drawn: Drawn


@dataclass(frozen=True)
class WorkedText:
    """A worked example.

    Attributes:
        title: what it is about, in words that follow "Worked example:".
        upright: whether the plane of x and y is drawn upright, facing the camera, as on a blackboard.
        quantities: what texts may use, by name, and its measure as in `app.exercises.variant.Quantity`.
    """

    title: str
    robot: Robot
    upright: bool
    quantities: Mapping[str, tuple[Expression, str]]
    steps: tuple[WorkedStep, ...]


def read_worked(fields: Fields) -> WorkedText:
    """The worked example of a table of a file; raises `ExerciseFileError`."""
    found: list[Expression] = []
    fields = Fields(fields.file, fields.table, fields.prefix, found=found)
    title, robot, upright = fields.text("title"), _arm(fields), fields.flag("upright")
    quantities = {
        name: (table.expression(name), measure)
        for key, measure in MEASURES.items()
        for table in [fields.sub(key)]
        for name in table.table
    }
    steps = _Steps(fields.file, {"steps": fields.get("steps")}, fields.prefix, frozenset(quantities), found)
    marks = tuple(_mark(item) for item in fields.tables("marks"))
    read = tuple(_step(item, robot, marks) for item in steps.tables("steps", LEAST))
    fields.done()
    if len(read) > MOST:
        raise fields.refuse("steps", len(read), f"{LEAST} to {MOST} steps")
    if not read[0].q:
        raise fields.refuse("steps[0].q", None, f"{robot.n} values, one per joint")
    known = frozenset(Facts(robot, robot.q_home))
    for expression in found:
        if unknown := sorted(expression.names - known):
            valid = f"a name of the arm: {', '.join(sorted(known))}"
            raise ExerciseFileError(fields.file, expression.field, unknown[0], valid)
    return WorkedText(title, robot, upright, quantities, read)


class _Steps(Fields):
    declared = "[lengths], [angles] or [numbers]"


def _arm(fields: Fields) -> Robot:
    rows = []
    for item in fields.tables("rows", 1):
        row: dict[str, object] = {name: _constant(item, name) for name in ("theta", "d", "a", "alpha")}
        if item.flag("slide"):
            row |= {"kind": "prismatic", "limits": (0.0, item.number("most", above=0.0))}
        rows.append(row)
        item.done()
    try:
        return Robot.from_dh(rows, robot_id="worked-example", name="Worked example")
    except InputError as error:
        raise fields.refuse("rows", len(rows), f"rows of an arm ({error})") from None


def _constant(fields: Fields, name: str) -> float:
    expression = fields.expression(name, "0")
    if expression.names:
        raise fields.refuse(name, expression.text, "a number, or arithmetic with numbers")
    return expression.value({})


def _step(fields: Fields, robot: Robot, marks: tuple[Mark, ...]) -> WorkedStep:
    step = WorkedStep(
        fields.words("text"),
        fields.words("then", ""),
        _configuration(fields, "q", fields.expressions("q"), robot),
        fields.choice("way", get_args(Way), "joints"),  # type: ignore[arg-type]  # one of them
        Drawn(
            _numbers(fields, "axes", 1, robot.n),
            _numbers(fields, "frames", 0, len(robot.rows)),
            _numbers(fields, "angles", 1, robot.n),
            _numbers(fields, "columns", 1, robot.n),
            fields.flag("path"),
            tuple(_ruler(item, len(robot.rows)) for item in fields.tables("rulers")),
            (*marks, *(_mark(item) for item in fields.tables("marks"))),
            tuple(_configuration(item, "q", item.expressions("q", 1), robot) for item in fields.tables("ghosts")),
            fields.whole("walk", 0, 4 * len(robot.rows)) if fields.has("walk") else None,
        ),
    )
    fields.done()
    return step


def _configuration(
    fields: Fields, name: str, given: tuple[Expression, ...], robot: Robot
) -> tuple[Expression, ...]:
    if given and len(given) != robot.n:
        raise fields.refuse(name, len(given), f"{robot.n} values, one per joint")
    for expression in given:
        if expression.names:
            raise fields.refuse(name, expression.text, "numbers, or arithmetic with numbers")
    if given and not robot.in_limits(configuration(given), 1e-9):
        raise fields.refuse(name, [each.text for each in given], "values within the limits of the joints")
    return given


def configuration(given: tuple[Expression, ...]) -> Array:
    """The configuration ``(n,)`` of a step or a copy."""
    return np.array([each.value({}) for each in given])


def _numbers(fields: Fields, name: str, low: int, high: int) -> tuple[int, ...]:
    values = fields.items(name)
    for i, value in enumerate(values):
        if type(value) is not int or not low <= value <= high:
            raise fields.refuse(f"{name}[{i}]", value, f"a whole number from {low} to {high}")
    return tuple(values)


def _ruler(fields: Fields, last: int) -> Ruler:
    found = Ruler(fields.whole("from", 0, last), fields.whole("to", 0, last), fields.text("name"))
    fields.done()
    return found


def _mark(fields: Fields) -> Mark:
    at, name = fields.expressions("at", 3), fields.text("name")
    if len(at) != 3 or any(each.names for each in at):
        raise fields.refuse("at", [each.text for each in at], "x, y and z as numbers")
    fields.done()
    return Mark(at, name)
