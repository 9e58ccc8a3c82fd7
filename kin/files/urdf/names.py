"""Names that occur once: those of rows and joints may be chosen by anybody."""

from __future__ import annotations

from collections.abc import Collection
from itertools import count


def unused(name: str, taken: Collection[str], number: int = 2) -> str:
    """The name; if it is taken, with the first number from `number` on with which it is not."""
    found, numbers = name, count(number)
    while found in taken:
        found = f"{name} {next(numbers)}"
    return found
