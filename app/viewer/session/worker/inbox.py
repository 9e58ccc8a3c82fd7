"""An inbox that keeps only the newest value of each key: callbacks post, one worker takes.

A browser sends up to twenty drag events a second, and a solve may take longer than the gap between two of them.
With a queue the arm would fall further and further behind the pointer. Here, posting a key again replaces its
value and moves the key to the end. So the worker always sees the newest value of each key, in the order of the
last posts.
"""

from __future__ import annotations

import threading
from collections.abc import Hashable


class Inbox:
    """Any thread may post; one thread takes. Waiting blocks, so an idle visitor costs no processor time."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._values: dict[Hashable, object] = {}
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    def post(self, key: Hashable, value: object = None) -> None:
        """Make `value` the newest one of `key`. Ignored once the inbox is closed."""
        with self._changed:
            if self._closed:
                return
            self._values.pop(key, None)
            self._values[key] = value
            self._changed.notify()

    def take(self, timeout: float | None = None) -> list[tuple[Hashable, object]] | None:
        """All values posted since the last call, ordered by their last post.

        Waits until there is one. Returns an empty list after `timeout` seconds, and None once the inbox is closed,
        even if values are left: a disconnected visitor needs no answer.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._values or self._closed, timeout)
            if self._closed:
                return None
            taken, self._values = self._values, {}
        return list(taken.items())

    def close(self) -> None:
        """Discard all values and wake the worker for the last time."""
        with self._changed:
            self._closed = True
            self._values.clear()
            self._changed.notify_all()
