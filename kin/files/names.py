"""Names that occur once: those of rows and joints may be chosen by anybody."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection
from itertools import count
from xml.sax.saxutils import quoteattr

_LONGEST = 180  # characters of a name, without its number; the reader takes 200
_UNFIT = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def unused(name: str, taken: Collection[str], number: int = 2) -> str:
    """The name; if it is taken, with the first number from `number` on with which it is not."""
    found, numbers = name, count(number)
    while found in taken:
        found = f"{name} {next(numbers)}"
    return found


def distinct(names: list[str]) -> list[str]:
    """The names as XML can hold them, those that occur more than once with the number of their row."""
    fit = [_UNFIT.sub("_", name).strip()[:_LONGEST].strip() or "joint" for name in names]
    counts, taken = Counter(fit), set(fit)
    found = []
    for k, name in enumerate(fit):
        found.append(unused(name, taken, k + 1) if counts[name] > 1 else name)
        taken.add(found[-1])
    return found


def quoted(text: str) -> str:
    """A text as the value of an attribute."""
    return quoteattr(_UNFIT.sub("_", text))
