"""The time of rooms: seconds since 1970 that only go forward, whatever happens to the machine's clock.

A clock that is set while a class is on must not end the class. So the clock is read once, when the process first
asks, and from then on time is counted. On Linux, it is also counted while the machine sleeps.
"""

from __future__ import annotations

import time
from functools import cache


def steady() -> float:
    """Seconds that pass, from an arbitrary beginning."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot is None else time.clock_gettime(boot)


@cache
def _start() -> float:
    return time.time() - steady()


def now() -> float:
    """Seconds since 1970."""
    return _start() + steady()
