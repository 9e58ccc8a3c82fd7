"""Tables of numbers: which cells of a row are meant, by the names in the heading."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from kin import InputError


@dataclass(frozen=True)
class Columns:
    """Where the named numbers are in the rows of a table.

    Attributes:
        names: in the order in which they are returned.
        places: of their cells.
        has_heading: whether the first row names the columns; if not, the rows have these numbers and no others.
        decimal: the decimal sign besides the point: "," in a table whose cells are not separated by it.
    """

    names: tuple[str, ...]
    places: tuple[int, ...]
    has_heading: bool
    decimal: str = "."

    @classmethod
    def of(cls, first: Sequence[str], names: Sequence[str], field: str, decimal: str = ".") -> Columns:
        """The columns of a table with this first row; raises `InputError` if one is missing."""
        head = [cell.strip().lower() for cell in first]
        if all(name in head for name in names):
            return cls(tuple(names), tuple(map(head.index, names)), True, decimal)
        if len(head) != len(names) or not all(_is_number(cell, decimal) for cell in head):
            expected = f"a heading with the columns {', '.join(names)}, or rows of {len(names)} numbers"
            expected += "; --form reads other columns, such as x, y, z, roll, pitch, yaw" if "x" in names else ""
            if decimal == "." and len(head) == 2 * len(names) and all(map(_is_number, head)):
                expected += "; where commas are decimal points, semicolons separate the numbers"
            raise InputError(field, list(first), expected)
        return cls(tuple(names), tuple(range(len(names))), False, decimal)

    @staticmethod
    def separator(line: str) -> str:
        """What separates the cells of a line; where it is no comma, commas are decimal points."""
        return next((mark for mark in (";", "\t", ",", " ") if mark in line.strip()), ",")

    @staticmethod
    def is_preface(line: str) -> bool:
        """Whether a line before the heading is none: a comment, or what tells a spreadsheet the separator."""
        return line.startswith(("#", "sep="))

    def numbers(self, row: Sequence[str], field: str) -> list[float]:
        """The numbers of a row; not-a-number if all cells are empty. Raises `InputError` with the row."""
        try:
            cells = [row[place] for place in self.places]
            if not any(map(str.strip, cells)):
                return [math.nan] * len(cells)
            return [_number(cell, self.decimal) for cell in cells]
        except (ValueError, IndexError):
            expected = f"{len(self.names)} numbers: " + ", ".join(self.names)
            raise InputError(field, ",".join(row), expected) from None


def _number(cell: str, decimal: str = ".") -> float:
    if not cell.isascii():  # `float` takes the digits of every script
        raise ValueError
    return float(cell if "." in cell else cell.replace(decimal, "."))


def _is_number(cell: str, decimal: str = ".") -> bool:
    try:
        _number(cell, decimal)
    except ValueError:
        return not cell  # an empty row stands for what was not solved
    return True
