"""Turns of threads that compute: few run at a time, those that have run least, or waited longest, first.

Only one thread at a time runs Python. With sixteen requests that compute, the event loop and the threads of
visitors would get a seventeenth of the interpreter: a drag would take half a second instead of some milliseconds.
So a thread has a turn while it computes, and offers it to others between two steps. A short request is next soon,
however many long ones there are. Computations wait while a visitor's event is answered and while the event loop is
busy, as each of its calls to the system would have to wait for the interpreter again. A thread inside the compiler
of kernels has no turn, nor has one that waits for a compiling process (`paused`), perhaps for a minute.
"""

from __future__ import annotations

import heapq
import itertools
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from app.shared.threads import background_threads
from kin.kernels.compiler import observe_compiler

SLICE = 0.01  # seconds of a turn before it is offered to others
AGING = 0.2  # seconds of computing that one second of waiting makes up for
STUCK = 0.1  # seconds without an offer, after which another thread runs too: kernels run without the interpreter
LEAST, PATIENCE = 0.0005, 0.2  # seconds between two waits for what is urgent, and of each at most
MOST = min(4, background_threads())  # turns at a time


class Turns:
    """The turns of one process. Any thread may use them.

    Args:
        most: how many threads have a turn at a time.
    """

    def __init__(self, most: int = MOST) -> None:
        self._most = self._free = most
        self._extra = 0  # turns beyond `most`, as many at most
        self._changed = 0.0  # when a thread got a turn
        self._lock = threading.Lock()
        self._order = itertools.count()  # among threads that have run as long
        self._waiting: list[tuple[float, int, threading.Event]] = []

    def take(self, used: float) -> None:
        """Wait for a turn, behind threads that have run for less than `used` seconds or have waited long."""
        with self._lock:
            if self._free:
                self._free -= 1
                self._changed = time.monotonic()
                return
            mine = self._queue(used)
        self._wait(mine)

    def give(self) -> None:
        """End a turn: the next thread has it."""
        with self._lock:
            if self._extra:
                self._extra -= 1
            elif self._waiting:
                self._start_next()
            else:
                self._free += 1

    def swap(self, used: float, slice_: float = 0.0) -> None:
        """Let a thread that waits and has run no longer than `used` seconds have a turn, and wait for another.

        After a slice in which another thread was started, because this one offered nothing, its turn just ends.
        """
        with self._lock:
            replaced = self._extra > 0 and slice_ >= STUCK
            if not replaced and (not self._waiting or self._waiting[0][0] > _rank(used)):
                return
            mine = self._queue(used)
            if replaced:
                self._extra -= 1
            else:
                self._start_next()
        self._wait(mine)

    def _queue(self, used: float) -> threading.Event:
        mine = threading.Event()
        heapq.heappush(self._waiting, (_rank(used), next(self._order), mine))
        return mine

    def _wait(self, mine: threading.Event) -> None:
        while not mine.wait(STUCK):
            self._add_turn()

    def _add_turn(self) -> None:
        with self._lock:
            stuck = time.monotonic() - self._changed >= STUCK
            if stuck and self._waiting and self._extra < self._most:
                self._extra += 1
                self._start_next()

    def _start_next(self) -> None:
        heapq.heappop(self._waiting)[2].set()
        self._changed = time.monotonic()


def _rank(used: float) -> float:
    """The place of a thread that joins the queue now: newcomers overtake those who wait for a time only."""
    return used + AGING * time.monotonic()


class Turn:
    """What one request computes: it has a turn within the context that this is. One thread at a time uses it."""

    def __init__(self, turns: Turns) -> None:
        self._turns = turns
        self._used = 0.0
        self._since = 0.0
        self._waited = 0.0  # when it last waited for what is urgent
        self._pause = LEAST  # until it does so again
        self._breaks = 0  # begun and not ended

    def __enter__(self) -> Turn:
        self._turns.take(self._used)
        self._since = self._waited = time.monotonic()
        self._pause = LEAST
        _current.turn = self
        return self

    def __exit__(self, *_: object) -> None:
        _current.turn = None
        self._used += time.monotonic() - self._since
        self._turns.give()

    def enter(self) -> None:
        """The thread asks for the compiler: others have its turn."""
        self._breaks += 1
        if self._breaks == 1:
            self._used += time.monotonic() - self._since
            self._turns.give()

    def leave(self) -> None:
        """The thread has left the compiler: it waits for a turn."""
        self._breaks -= 1
        if not self._breaks:
            self._turns.take(self._used)
            self._since = time.monotonic()

    def offer(self) -> None:
        """Let what is urgent go first, and others run if it is their turn."""
        now = time.monotonic()
        if urgent.active and now - self._waited >= self._pause:
            # Beside a long urgent step, computations go on with whole slices.
            self._pause = LEAST if urgent.wait() else SLICE
            self._waited = time.monotonic()
            self._since += self._waited - now
            now = self._waited
        if now - self._since < SLICE:
            return
        self._used += now - self._since
        self._turns.swap(self._used, now - self._since)
        self._since = time.monotonic()


class Urgent:
    """What goes first: threads of visitors while they answer an event, within the context that this is, and the
    event loop while it does not sleep.
    """

    def __init__(self) -> None:
        self.active = 0
        self._lock = threading.Lock()
        self._none = threading.Event()
        self._none.set()

    def __enter__(self) -> None:
        self.enter()

    def __exit__(self, *_: object) -> None:
        self.leave()

    def enter(self) -> None:
        """Computations wait, until as many have left as have entered."""
        with self._lock:
            self.active += 1
            self._none.clear()

    def leave(self) -> None:
        """The end of what began with `enter`."""
        with self._lock:
            self.active -= 1
            if not self.active:
                self._none.set()

    def wait(self) -> bool:
        """Wait until there is nothing, but not for long: computations go on beside many visitors.

        Returns whether there is nothing.
        """
        return self._none.wait(PATIENCE)


urgent = Urgent()
_current = threading.local()


class _Breaks:
    """Hears of the compiler in each thread."""

    def enter(self) -> None:
        if (turn := _turn_of_thread()) is not None:
            turn.enter()

    def leave(self) -> None:
        if (turn := _turn_of_thread()) is not None:
            turn.leave()


observe_compiler(_Breaks())


def _turn_of_thread() -> Turn | None:
    turn: Turn | None = getattr(_current, "turn", None)
    return turn


@contextmanager
def paused() -> Iterator[None]:
    """Within the context others have the turn of this thread, if it has one; it must not call `offer`."""
    turn = _turn_of_thread()
    if turn is not None:
        turn.enter()
    try:
        yield
    finally:
        if turn is not None:
            turn.leave()


def offer() -> None:
    """A point between two steps of a computation: let others run. Does nothing in a thread without a turn."""
    if (turn := _turn_of_thread()) is not None:
        turn.offer()
