"""Whole numbers in ASCII digits, as messages of a page and options of a command have them.

Python's `int`, `str.isdecimal` and ``\\d`` take the digits of every script, and `int` fails beyond 4300 of them.
Numbers that people type into fields are read by :mod:`kin.typed`, which translates other digits on purpose; those
of files and forms by :func:`kin.files.numbers.number_of`.
"""

from __future__ import annotations

import re

_DIGITS = re.compile(r"[0-9]{1,15}")


def index_of(text: object, count: int) -> int | None:
    """The number from 0 to `count` − 1 that a text is; None if it is none of them."""
    if not isinstance(text, str) or not _DIGITS.fullmatch(text):
        return None
    index = int(text)
    return index if index < count else None
