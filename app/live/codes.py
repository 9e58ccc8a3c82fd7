"""The code of a page. It tells which process of the service has the page, where the program is to be connected.

A process draws codes until one belongs to it. This helps nobody to guess: all codes together are as many as
those of rooms.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Container

from app.classroom.tokens import CODE_LENGTH, LETTERS, new_code, read_code

PATH = "/api/v1/live/"
LONGEST = 40  # characters of what is taken for a typed code


def home_of(code: str, places: int) -> int:
    """Which of so many processes with pages a code belongs to; any text belongs to one."""
    return zlib.crc32(read_code(code[:LONGEST]).encode()) % places


def unused_code(taken: Container[str], place: int = 0, places: int = 1) -> str:
    """A random code of a page in the process `place`."""
    while True:
        code = new_code()
        if home_of(code, places) == place and code not in taken:
            return code


def is_code(text: str) -> bool:
    """Whether a text, as `read_code` returns it, may be a code."""
    return len(text) == CODE_LENGTH and all(letter in LETTERS for letter in text)


def code_in(path: str) -> str | None:
    """The code in the address of a page's websocket, below the prefix of the service; None: another address."""
    found = re.fullmatch(re.escape(PATH) + r"([^/]+)/?", path)
    return None if found is None else read_code(found[1][:LONGEST])
