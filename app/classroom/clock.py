"""The time of rooms: seconds since 1970 that only go forward, whatever happens to the machine's clock.

A clock that is set while a class is on must not end the class. So the clock is read once, when the process first
asks, and from then on time is counted. On Linux, it is also counted while the machine sleeps.

A process that starts later goes on from a `Mark` that another one has stored. As long as the machine has not been
started anew, that is exact. After that, the machine's clock counts, but not if it is behind the mark.
"""

from __future__ import annotations

import time
from functools import cache
from pathlib import Path
from typing import NamedTuple


class Mark(NamedTuple):
    """What the time was: `at` (seconds since 1970) when `steady` was so much, since the machine's start `boot`."""

    at: float
    steady: float
    boot: str


class _Count:
    """The time when `steady` was 0; None: not read yet."""

    start: float | None = None


def steady() -> float:
    """Seconds that pass, from an arbitrary beginning."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot is None else time.clock_gettime(boot)


def now() -> float:
    """Seconds since 1970."""
    if _Count.start is None:
        _Count.start = time.time() - steady()
    return _Count.start + steady()


def mark() -> Mark:
    """The present, for processes that start later."""
    passed = steady()
    return Mark(now(), passed, _boot())


def is_of_this_start(mark: Mark) -> bool:
    """Whether the machine has run since a mark, so that the time since then is known."""
    return mark.boot != "" and mark.boot == _boot()


def resume(mark: Mark) -> None:
    """Go on from a mark of another process."""
    latest = mark.at - steady()  # it is not earlier than the mark, also if the machine was set back to a snapshot
    _Count.start = max(latest, mark.at - mark.steady if is_of_this_start(mark) else now() - steady())


@cache
def _boot() -> str:
    """Names the machine's present start, and the container's count of time, if it has its own; "" if unknown."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        return f"{boot} {Path('/proc/self/ns/time').readlink()}"
    except OSError:  # not Linux, or not shown to this process
        return ""
