"""Reads the fields of exercises and courses; errors name the file, the field, the value and what is valid."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from app.exercises.expressions import VALID, Expression, ExpressionError
from app.exercises.typed import is_number
from kin.errors import KinematicsError, shorten
from kin.parsing import Limits, TextError, read_toml

LONGEST_TEXT = 2000  # characters
LIMITS = Limits(200_000, 10_000, 16)  # of a file
MOST_ITEMS = 40
_PLACE = re.compile(r"\{([^{}]*)\}")
ALWAYS = Expression("1")


class ExerciseFileError(KinematicsError):
    """A file of an exercise or course is invalid; the message names file, field, value and what is valid."""

    def __init__(self, file: str, field: str, value: object, expected: str) -> None:
        self.file, self.field, self.expected = file, field, expected
        self.value = shorten(value)
        said = f"{file}: {field}: got {self.value}, expected {expected}"
        super().__init__(said if said.isprintable() else "".join(map(_visible, said)))


def _visible(char: str) -> str:
    """A character of a message: names of fields may be the file's own."""
    return char if char.isprintable() else char.encode("unicode_escape").decode()


def text_of(path: Path | str) -> str:
    """The text of a file; raises `ExerciseFileError`."""
    try:
        with Path(path).open("rb") as file:
            given = file.read(LIMITS.size + 1)
        if len(given) > LIMITS.size:
            raise ExerciseFileError(str(path), "file", "a longer one", f"at most {LIMITS.size} bytes")
        return given.decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ExerciseFileError(str(path), "file", str(error), "a readable UTF-8 text file") from error


def toml_of(text: str, file: str) -> dict[str, Any]:
    """The data of a TOML text; raises `ExerciseFileError`, naming `file`."""
    try:
        return read_toml(text, LIMITS)
    except TextError as error:
        raise ExerciseFileError(file, "file", error.value, error.expected) from None


@dataclass(frozen=True)
class Words:
    """A text, or alternatives of which the first whose condition holds is taken; the last one always holds."""

    alternatives: tuple[tuple[Expression, str], ...]


class Fields:
    """One table of a file. Fields that are never read are refused by `done`.

    Args:
        names: the names that texts may contain in braces.
        found: the expressions read so far; tables of one file share it.

    Attributes:
        declared: the tables that declare these names, for messages.
    """

    declared: ClassVar[str] = "[vary] or [let]"

    def __init__(
        self,
        file: str,
        table: object,
        prefix: str = "",
        names: frozenset[str] = frozenset(),
        found: list[Expression] | None = None,
    ) -> None:
        self.file, self.prefix, self.names = file, prefix, names
        self.found = [] if found is None else found
        self._read: list[str] = []
        if not isinstance(table, dict):
            raise ExerciseFileError(file, prefix.rstrip(".") or "file", table, "a table")
        self.table: dict[str, Any] = table

    def refuse(self, field: str, value: object, expected: str) -> ExerciseFileError:
        """The error for one of the fields."""
        return ExerciseFileError(self.file, self.prefix + field, value, expected)

    def has(self, field: str) -> bool:
        """Whether the field is given."""
        return self.get(field) is not None

    def get(self, field: str) -> Any:
        """The field as it is; None if it is missing."""
        if field not in self._read:
            self._read.append(field)
        return self.table.get(field)

    def done(self) -> None:
        """Refuse fields that do not exist."""
        for field, value in self.table.items():
            if field not in self._read:
                raise self.refuse(field, value, "no such field; valid are " + ", ".join(self._read))

    def text(self, field: str, default: str | None = None) -> str:
        """A text; what stands in braces must be the name of a drawn number."""
        value = self.get(field)
        if value is None and default is not None:
            return default
        if not isinstance(value, str) or not value.strip() or len(value) > LONGEST_TEXT:
            raise self.refuse(field, value, f"a text of 1 to {LONGEST_TEXT} characters")
        return self.checked(field, value.strip())

    def checked(self, field: str, text: str) -> str:
        """A text whose braces hold known names."""
        for name in _PLACE.findall(text):
            if name not in self.names:
                known = ", ".join(sorted(self.names)) or "none, because nothing is drawn"
                raise self.refuse(field, f"{{{name}}}", f"a name from {self.declared}: {known}")
        return text

    def words(self, field: str, default: str | None = None) -> Words:
        """A text, or a list of ``{ when = "…", text = "…" }`` that ends with a text."""
        value = self.get(field)
        if not isinstance(value, list):
            return Words(((ALWAYS, self.text(field, default)),))
        if not value or len(value) > MOST_ITEMS or not isinstance(value[-1], str):
            raise self.refuse(field, value, f"a list of at most {MOST_ITEMS} alternatives, the last one a text")
        found = []
        for i, item in enumerate(value):
            one = type(self)(
                self.file,
                {"text": item} if i == len(value) - 1 else item,
                f"{self.prefix}{field}[{i}].",
                self.names,
                self.found,
            )
            found.append((one.expression("when", "1" if i == len(value) - 1 else None), one.text("text")))
            one.done()
        return Words(tuple(found))

    def texts(self, field: str, least: int = 0) -> tuple[str, ...]:
        """A list of texts."""
        values = self.items(field, least)
        for i, value in enumerate(values):
            if not isinstance(value, str) or not value.strip() or len(value) > LONGEST_TEXT:
                raise self.refuse(f"{field}[{i}]", value, f"a text of 1 to {LONGEST_TEXT} characters")
            self.checked(f"{field}[{i}]", value)
        return tuple(value.strip() for value in values)

    def items(self, field: str, least: int = 0) -> list[Any]:
        """A list."""
        value = self.get(field)
        if value is None and not least:
            return []
        if not isinstance(value, list) or not least <= len(value) <= MOST_ITEMS:
            raise self.refuse(field, value, f"a list of {least} to {MOST_ITEMS} items")
        return value

    def tables(self, field: str, least: int = 0) -> list[Fields]:
        """A list of tables."""
        return [
            type(self)(self.file, item, f"{self.prefix}{field}[{i}].", self.names, self.found)
            for i, item in enumerate(self.items(field, least))
        ]

    def sub(self, field: str) -> Fields:
        """A table inside this one; an empty one if it is missing."""
        value = self.get(field)
        return type(self)(
            self.file, {} if value is None else value, f"{self.prefix}{field}.", self.names, self.found
        )

    def choice(self, field: str, choices: Iterable[str], default: str | None = None) -> str:
        """One of these texts."""
        value, valid = self.get(field), tuple(choices)
        if value is None and default is not None:
            return default
        if not isinstance(value, str) or value not in valid:
            raise self.refuse(field, value, "one of " + ", ".join(f'"{choice}"' for choice in valid))
        return value

    def flag(self, field: str, default: bool = False) -> bool:
        """True or false."""
        value = self.get(field)
        if value is None:
            return default
        if not isinstance(value, bool):
            raise self.refuse(field, value, "true or false")
        return value

    def number(self, field: str, default: float | None = None, above: float = -math.inf) -> float:
        """A finite number, larger than `above`."""
        value = self.get(field)
        if value is None and default is not None:
            return default
        if not is_number(value) or not value > above:
            raise self.refuse(field, value, "a number" + (f" above {above:g}" if above > -math.inf else ""))
        return float(value)

    def whole(self, field: str, low: int, high: int, default: int | None = None) -> int:
        """A whole number in a range."""
        value = self.get(field)
        if value is None and default is not None:
            return default
        if type(value) is not int or not low <= value <= high:
            raise self.refuse(field, value, f"a whole number from {low} to {high}")
        return value

    def expression(self, field: str, default: str | None = None) -> Expression:
        """A number or an expression."""
        value = self.get(field)
        return self._expression(field, default if value is None else value)

    def expressions(self, field: str, least: int = 0) -> tuple[Expression, ...]:
        """A list of numbers and expressions; a single one is a list of one."""
        value = self.get(field)
        if isinstance(value, str | int | float) and not isinstance(value, bool):
            return (self._expression(field, value),)
        return tuple(self._expression(f"{field}[{i}]", item) for i, item in enumerate(self.items(field, least)))

    def check_function(self, field: str, name: str) -> None:
        """Refuse what cannot be the name of a function of one number."""
        self._expression(field, f"{name}(1)")

    def _expression(self, field: str, value: object) -> Expression:
        if type(value) in (int, float):
            value = repr(value)
        if not isinstance(value, str):
            raise self.refuse(field, value, "a number, or an expression as text")
        try:
            expression = Expression(value, self.prefix + field)
            if not expression.names:
                expression.value({})
        except ExpressionError as error:
            raise self.refuse(field, value, f"an expression of {VALID} ({error})") from None
        self.found.append(expression)
        return expression
