"""Memory of this process: how much it takes, and giving free memory back to the system.

The C library keeps what is freed for later, in a pool per thread, and returns little of it by itself: after an
hour of visitors who have all gone, several hundred megabytes. Python's collector of cycles is asked by new objects
only, so an idle process also keeps what the last visitors left behind.
"""

from __future__ import annotations

import ctypes
import gc
import os
import sys
import threading
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

INTERVAL = 5.0  # s between two looks
IDLE_GROWTH, BUSY_GROWTH = 16 << 20, 256 << 20  # bytes since the last release that make the next one worthwhile
_PROCESSES = Path("/proc")


def resident_bytes(process: int | None = None) -> int:
    """Memory that a process, by default this one, takes at the moment; 0 where the system does not say."""
    statm = _PROCESSES / ("self" if process is None else str(process)) / "statm"
    try:
        return int(statm.read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0


def release_free_memory() -> None:
    """Give freed memory back to the system, where the C library can do so (glibc). Takes some milliseconds."""
    trim = _malloc_trim()
    if trim is not None:
        trim(0)


@lru_cache(maxsize=1)
def _malloc_trim() -> Callable[[int], int] | None:
    if sys.platform != "linux":
        return None
    try:
        trim: Callable[[int], int] = ctypes.CDLL("libc.so.6").malloc_trim
    except (OSError, AttributeError):  # another C library
        return None
    return trim


class MemoryKeeper:
    """A thread that gives free memory back after work, sooner when the service is idle.

    Args:
        idle: whether nobody would notice a pause of some ten milliseconds.
    """

    def __init__(self, idle: Callable[[], bool]) -> None:
        self._idle = idle
        self._least = 0  # bytes that were left after the last release
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="memory", daemon=True)

    def start(self) -> None:
        """Start looking; returns at once."""
        self._thread.start()

    def stop(self) -> None:
        """Stop looking; returns at once."""
        self._ended.set()

    def look(self) -> None:
        """Give memory back if it is worthwhile."""
        grown = resident_bytes() - self._least
        if grown < (IDLE_GROWTH if self._idle() else BUSY_GROWTH):
            return
        gc.collect()
        release_free_memory()
        self._least = resident_bytes()

    def _run(self) -> None:
        while not self._ended.wait(INTERVAL):
            self.look()
