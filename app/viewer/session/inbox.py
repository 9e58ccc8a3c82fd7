"""A newest-value-wins inbox: what callbacks post into and one worker takes from.

A browser sends up to twenty drag events a second, and a solve may take longer than the gap between two of them.
A queue would make the arm lag further and further behind the hand. Here a key holds one value only: posting
again replaces the value and moves the key to the end, so the worker always sees the newest value of each thing,
in the order in which they were last touched.
"""

from __future__ import annotations

import threading
from collections.abc import Hashable


class Inbox:
    """Any thread may post; one thread takes. Waiting is blocking: an idle visitor costs no processor time."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._values: dict[Hashable, object] = {}
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    def post(self, key: Hashable, value: object = None) -> None:
        """Make `value` the newest one of `key`. Never blocks for long; ignored once closed."""
        with self._changed:
            if self._closed:
                return
            self._values.pop(key, None)
            self._values[key] = value
            self._changed.notify()

    def take(self, timeout: float | None = None) -> list[tuple[Hashable, object]] | None:
        """Everything posted since the last call, oldest touch first.

        Waits until something is there. An empty list means that `timeout` seconds passed first; None means
        closed, whatever is left inside: a visitor who is gone wants no answer.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._values or self._closed, timeout)
            if self._closed:
                return None
            taken, self._values = self._values, {}
        return list(taken.items())

    def close(self) -> None:
        """Wake the worker for the last time."""
        with self._changed:
            self._closed = True
            self._values.clear()
            self._changed.notify_all()
