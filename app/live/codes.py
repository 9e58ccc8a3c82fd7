"""The code of a page, with which a program is connected to it: as hard to guess as that of a room."""

from __future__ import annotations

from collections.abc import Container

from app.classroom.tokens import CODE_LENGTH, LETTERS, new_code

PATH = "/api/v1/live/"
LONGEST = 40  # characters of what is taken for a typed code


def unused_code(taken: Container[str]) -> str:
    """A random code of a page."""
    while (code := new_code()) in taken:
        pass
    return code


def is_code(text: str) -> bool:
    """Whether a text, as `read_code` returns it, may be a code."""
    return len(text) == CODE_LENGTH and all(letter in LETTERS for letter in text)
