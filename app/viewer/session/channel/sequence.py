"""The order of messages that a page sends by its channel and, beside viser's controls, in viser's connection."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

EARLY: Final = 64  # messages that wait for one before them
PATIENCE: Final = 2.0  # s that they wait


class Sequence:
    """Puts messages that come in two ways into the order of their numbers, from 1. The event loop uses it.

    A message waits up to `PATIENCE` for those before it. What comes later than that is passed on all the same.

    Args:
        deliver: takes number, name and argument of each message, once.
    """

    def __init__(self, deliver: Callable[[int, str, object], None]) -> None:
        self._deliver = deliver
        self._last = 0  # the number up to which nothing is awaited
        self._early: dict[int, tuple[str, object] | None] = {}  # None: it is left out
        self._missing: set[int] = set()  # up to `last`
        self._timer: asyncio.TimerHandle | None = None

    def take(self, number: int, name: str, argument: object) -> bool:
        """Pass a message on, now or in its turn; what has come before is ignored. False: too many are missing."""
        return self._put(number, (name, argument))

    def leave_out(self, number: int) -> None:
        """Wait for this number no longer: nothing is passed on for it."""
        self._put(number, None)

    def _put(self, number: int, message: tuple[str, object] | None) -> bool:
        if number in self._missing:
            self._missing.discard(number)
            self._give(number, message)
        elif number > self._last + EARLY:
            return False
        elif number > self._last:
            self._early.setdefault(number, message)
            self._go_on()
        return True

    def _give(self, number: int, message: tuple[str, object] | None) -> None:
        if message is not None:
            self._deliver(number, *message)

    def _go_on(self) -> None:
        while self._last + 1 in self._early:
            self._last += 1
            self._give(self._last, self._early.pop(self._last))
        if not self._early and self._timer is not None:
            self._timer.cancel()
            self._timer = None
        elif self._early and self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(PATIENCE, self._skip)

    def _skip(self) -> None:
        """Wait no longer for what is missing before the first message that has come."""
        self._timer = None
        first = min(self._early)
        self._missing.update(range(self._last + 1, first))
        self._missing = set(sorted(self._missing)[-EARLY:])
        self._last = first - 1
        self._go_on()
