"""How long a request has been held up by the compiler of kernels.

A kernel that is in no cache is compiled by the thread that calls it first. This takes seconds, and nothing can
interrupt it. A request is found by its context variable. The threads that work for it inherit that.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar

from kin.kernels.compiler import observe_compiler


class Hold:
    """Of one request: how long its thread has been in the compiler, or has waited for a place or a turn."""

    def __init__(self) -> None:
        self._depth = 0
        self._since = 0.0
        self._before = 0.0  # seconds, earlier
        self._queued: float | None = None

    @property
    def seconds(self) -> float:
        """Seconds so far; 0 while nothing compiles that this request waits for."""
        now = time.monotonic()
        if self._depth:
            return self._before + now - self._since
        return now - self._queued if self._queued is not None and _users.count else 0.0

    @contextmanager
    def queued(self) -> Iterator[None]:
        """Within the context the request waits for what others may hold while they compile."""
        self._queued = time.monotonic()
        try:
            yield
        finally:
            self._queued = None

    def enter(self) -> None:
        """A thread of the request asks for the compiler."""
        if not self._depth:
            self._since = time.monotonic()
        self._depth += 1

    def leave(self) -> None:
        """It has left the compiler."""
        self._depth -= 1
        if not self._depth:
            self._before += time.monotonic() - self._since


class _Users:
    """Counts how often threads have entered the compiler and have not left, and tells the request of each."""

    def __init__(self) -> None:
        self.count = 0
        self._lock = threading.Lock()

    def enter(self) -> None:
        with self._lock:
            self.count += 1
        if (hold := current_hold.get()) is not None:
            hold.enter()

    def leave(self) -> None:
        with self._lock:
            self.count -= 1
        if (hold := current_hold.get()) is not None:
            hold.leave()


current_hold: ContextVar[Hold | None] = ContextVar("current_hold", default=None)
_users = _Users()
observe_compiler(_users)


@contextmanager
def queued() -> Iterator[None]:
    """Within the context the request of this thread or task, if there is one, waits for a place or a turn."""
    hold = current_hold.get()
    with nullcontext() if hold is None else hold.queued():
        yield
