"""One processor for the threads that share Python's interpreter, all of them for those that compute without it.

Of a process's threads one at a time runs Python. A drag is handed from one to the next five times; where each of
them wakes up on another processor, many visitors wait two to ten times as long as where all keep to one. So a
process can be told to: each of several workers to another. Clouds, maps and whatever else computes outside the
interpreter for long goes wherever there is room.
"""

from __future__ import annotations

import os
import random

_pinned_from: set[int] = set()  # the processors there were


def keep_to_one(number: int | None = None) -> None:
    """Have this thread, and those it starts, run on one processor; where the system cannot, nothing happens.

    Args:
        number: which of the processors there are, counted on and round from any; None: any.
    """
    if not hasattr(os, "sched_setaffinity"):  # Linux only
        return
    allowed = sorted(os.sched_getaffinity(0))
    _pinned_from.update(allowed)
    chosen = random.randrange(len(allowed)) if number is None else number % len(allowed)
    os.sched_setaffinity(0, {allowed[chosen]})


def spread() -> None:
    """Have this thread run on any processor again."""
    if _pinned_from:
        os.sched_setaffinity(0, _pinned_from)
