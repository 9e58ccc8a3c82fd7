"""Tables of exercise files as frozen dataclasses: each field declares how it is read, what is valid, and its cell.

    @dataclass(frozen=True)
    class Condition(Declared):
        text: Words = cell.words("Required", "As a part of a sentence.")
        holds: Expression = cell.expression("Holds if", "An expression about the arm at the answer.")

`Declared.read` makes one from a table of a file, and `app.exercises.form` the form in which a teacher fills it in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal, Self

from app.exercises.fields import MOST_ITEMS, Fields

Form = Literal["line", "text", "lines", "expression", "expressions", "number", "numbers", "choice", "flag"]
Read = Callable[[Fields, str], Any]


@dataclass(frozen=True)
class Cell:
    """One field.

    Attributes:
        name: in the file.
        label, help: what stands beside it.
        form: how it is typed. Of ``lines``, ``expressions`` and ``numbers`` there is one in each line.
        options: of a choice.
        default: of a flag.
        read: its value from a table; raises `ExerciseFileError`.
    """

    name: str
    label: str
    help: str = ""
    form: Form = "line"
    options: tuple[str, ...] = ()
    default: bool = False
    read: Read = Fields.get


@dataclass(frozen=True)
class Table:
    """Rows of cells: a list of tables in the file, or, if they are `named`, a table of tables.

    Attributes:
        one: what a row is called.
        fresh: what a new row holds.
        read: the rows; raises `ExerciseFileError`.
    """

    name: str
    label: str
    help: str
    one: str
    columns: tuple[Cell, ...]
    fresh: dict[str, Any]
    named: bool = False
    read: Read = Fields.get


class Declared:
    """A dataclass whose fields are made by the functions of this module."""

    @classmethod
    def cells(cls) -> tuple[Any, ...]:
        """Its cells and tables in order; their names are those of the fields unless they have others in files."""
        declared = ((each.name, each.metadata["cell"]) for each in fields(cls))  # type: ignore[arg-type]  # a dataclass
        return tuple(cell if cell.name else replace(cell, name=name) for name, cell in declared)

    @classmethod
    def read(cls, table: Fields) -> Self:
        """From a table of a file; raises `ExerciseFileError`. Unknown fields are left to `Fields.done`."""
        names = (each.name for each in fields(cls))  # type: ignore[arg-type]  # a dataclass
        values = {name: cell.read(table, cell.name) for name, cell in zip(names, cls.cells(), strict=True)}
        found = cls(**values)
        found.check(table)
        return found

    def check(self, table: Fields) -> None:
        """Refuse values that do not go together; raises `ExerciseFileError`."""


def special(
    label: str,
    about: str,
    form: Form,
    read: Read,
    name: str = "",
    options: Iterable[str] = (),
    default: bool = False,
) -> Any:
    """A field that a function reads."""
    return field(metadata={"cell": Cell(name, label, about, form, tuple(options), default, read)})


def line(label: str, about: str = "", default: str | None = None, name: str = "") -> Any:
    """A short text."""
    return special(label, about, "line", lambda table, name: table.text(name, default), name)


def text(label: str, about: str = "", default: str | None = None) -> Any:
    """A text of sentences."""
    return special(label, about, "text", lambda table, name: table.text(name, default))


def words(label: str, about: str = "") -> Any:
    """A text, or alternatives of which conditions choose one: `Words`."""
    return special(label, about, "text", Fields.words)


def lines(label: str, about: str = "") -> Any:
    """Texts."""
    return special(label, about, "lines", Fields.texts)


def expression(label: str, about: str = "", default: str | None = None, name: str = "") -> Any:
    """A number or an expression."""
    return special(label, about, "expression", lambda table, name: table.expression(name, default), name)


def optional_expression(label: str, about: str = "") -> Any:
    """A number or an expression; None if it is missing."""
    return special(
        label, about, "expression", lambda table, name: table.expression(name) if table.has(name) else None
    )


def expressions(label: str, about: str = "", least: int = 0) -> Any:
    """Numbers and expressions."""
    return special(label, about, "expressions", lambda table, name: table.expressions(name, least))


def number(
    label: str, about: str = "", default: float | None = None, scale: float = 1.0, above: float = 0.0
) -> Any:
    """A number larger than `above`; the value is `scale` times as large."""
    return special(label, about, "number", lambda table, name: scale * table.number(name, default, above))


def whole(label: str, about: str, low: int, high: int, default: int | None = None) -> Any:
    """A whole number from `low` to `high`."""
    return special(label, about, "number", lambda table, name: table.whole(name, low, high, default))


def choice(label: str, about: str, options: Iterable[str], default: str | None = None) -> Any:
    """One of these texts; without one, the default."""
    valid = tuple(options)
    return special(label, about, "choice", lambda table, name: table.choice(name, valid, default), options=valid)


def flag(label: str, about: str = "", default: bool = False) -> Any:
    """True or false."""
    return special(label, about, "flag", lambda table, name: table.flag(name, default), default=default)


def rows(
    row: type[Declared],
    label: str,
    about: str,
    one: str,
    fresh: dict[str, Any],
    least: int = 0,
    most: int = MOST_ITEMS,
) -> Any:
    """A list of tables."""

    def read(table: Fields, name: str) -> tuple[Declared, ...]:
        found = []
        for item in table.tables(name, least):
            found.append(row.read(item))
            item.done()
        if len(found) > most:
            raise table.refuse(name, len(found), f"{least} to {most} {name}")
        return tuple(found)

    return field(metadata={"cell": Table("", label, about, one, row.cells(), fresh, read=read)})


MILLIMETRE, DEGREE = 1e-3, math.pi / 180.0  # scales
ONLY_WHERE = "Only where this expression is true."
TO_WHOM = "Said to whom answers this."
