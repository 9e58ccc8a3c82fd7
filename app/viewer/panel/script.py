"""What a page's own scripts send and are sent: texts of JSON."""

from __future__ import annotations

import json
from typing import Any, NamedTuple

from kin.parsing import Limits, read_json

MAX_NUMBER = 2**53
LIMITS = Limits(64 * 1024, 20_000, 32)  # of a message, and of a link when it is unpacked


def read_page_json(text: str, finite: bool = False) -> Any:
    """The value of a JSON text from a page or a link; raises `ValueError` for what is none or no page could show.

    JSON can escape half a letter (``"\\ud800"``), which UTF-8 cannot hold.
    """
    value = read_json(text, LIMITS, finite)
    json.dumps(value, ensure_ascii=False).encode()
    return value


class Reply(NamedTuple):
    """The answer to a message.

    Attributes:
        number: of the message.
        error: what is wrong with it; "" if nothing is.
        readings: labels and texts that may have been meant by a typed one; the page offers them.
    """

    number: int
    error: str
    readings: tuple[tuple[str, str], ...] = ()
