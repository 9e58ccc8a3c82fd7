"""How much of a cloud may be on its way to the browser.

The server draws a million points in the time a slow line carries ten thousand. What is sent waits in line, and the
picture of a dragged arm waits behind it. So the page is asked now and then for an answer, which it gives once it
has taken in all that was sent before; until then only so many points may be under way, fewer while the arm moves.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable

import viser

WINDOW = 1 << 18  # points under way
WHILE_MOVING = 1 << 16
PATIENCE = 30.0  # s without an answer; a page in the background gives none
QUESTION = "kinboard-workspace"  # a key that nobody sets: any answer will do


class Flow:
    """Counts what was sent and what has arrived. `sent` and `open` belong to one thread.

    Args:
        arrived: called from another thread whenever there is room again.
    """

    def __init__(self, client: viser.ClientHandle, arrived: Callable[[], None]) -> None:
        self._client = client
        self._notify = arrived
        self._sent = 0
        self._arrived = 0
        self._asking = False
        self._lock = threading.Lock()

    def open(self, moving: bool) -> bool:
        """Whether more may be sent; `moving`: the arm is in motion and its pictures go first."""
        return self._sent - self._arrived < (WHILE_MOVING if moving else WINDOW)

    def sent(self, points: int) -> None:
        """So many points more are on their way."""
        with self._lock:
            self._sent += points
            if self._asking or self._sent == self._arrived:
                return
            self._asking = True
        threading.Thread(target=self._ask, name="workspace-flow", daemon=True).start()

    def _ask(self) -> None:
        """Ask until all has arrived."""
        while True:
            with self._lock:
                mark = self._sent
                if mark == self._arrived:
                    self._asking = False
                    return
            self._wait()
            self._arrived = mark
            self._notify()

    def _wait(self) -> None:
        # Gone, asleep, or without storage: no answer is one too, or nothing would ever be sent again.
        with contextlib.suppress(TimeoutError, RuntimeError):
            self._client.local_storage.get_item(QUESTION, timeout=PATIENCE)
