"""An inbox that keeps only the newest value of each key: callbacks post, the visitor's worker takes.

A browser sends up to twenty drag events a second, and a solve may take longer than the gap between two of them.
With a queue the arm would fall further and further behind the pointer. Here, posting a key again replaces its
value and moves the key to the end. So the worker always sees the newest value of each key, in the order of the
last posts.

A message of the page's own scripts stays where it is among the changes of controls: it separates the values of
before from those of after it. Otherwise *Undo* would pass a slider that was moved before it, and once more since.
"""

from __future__ import annotations

import threading
from collections.abc import Hashable


class Inbox:
    """Any thread may post; one thread at a time takes. Nothing here waits."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._values: dict[Hashable, object] = {}
        self._before: list[tuple[Hashable, object]] = []  # up to the last message
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    @property
    def waits(self) -> bool:
        """Whether the worker has something to do: values, or the end."""
        return bool(self._values or self._before) or self._closed

    def post(self, key: Hashable, value: object = None) -> None:
        """Make `value` the newest one of `key`. Ignored once the inbox is closed."""
        with self._lock:
            if self._closed:
                return
            self._values.pop(key, None)
            self._values[key] = value
            if isinstance(key, tuple) and key[0] == "message":
                self._before += self._values.items()
                self._values.clear()

    def take(self) -> list[tuple[Hashable, object]] | None:
        """All values posted since the last call, ordered by their last post.

        None once the inbox is closed, even if values are left: a disconnected visitor needs no answer.
        """
        with self._lock:
            if self._closed:
                return None
            taken = [*self._before, *self._values.items()]
            self._values.clear()
            self._before.clear()
        return taken

    def close(self) -> None:
        """Discard all values; no further ones are taken."""
        with self._lock:
            self._closed = True
            self._values.clear()
            self._before.clear()
