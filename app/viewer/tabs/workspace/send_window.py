"""Flow control: limits how much of a cloud is on its way to the browser.

The server produces a million points in the time in which a slow connection carries ten thousand. Sent data waits
in a queue, and the frames of a dragged arm wait behind it. So the server sends the page a question now and then,
which the page answers after it has processed everything sent before. Until then, only a limited number of points
may be unconfirmed, fewer while the arm moves.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import viser

from app.viewer.panel.fence import wait_for_page

WINDOW = 1 << 18  # unconfirmed points
WHILE_MOVING = 1 << 16
MOVED = 0.3  # s after its last frame, the arm still counts as moving


class SendWindow:
    """Counts sent and confirmed points. One thread calls everything here.

    Args:
        arrived: called from another thread whenever points were confirmed.
    """

    def __init__(self, client: viser.ClientHandle, arrived: Callable[[], None]) -> None:
        self._client = client
        self._notify = arrived
        self._sent = 0
        self._arrived = 0
        self._moved = 0.0  # when the arm did last
        self._asking = False
        self._lock = threading.Lock()

    def arm_moved(self) -> None:
        """The scene shows the arm elsewhere."""
        self._moved = time.perf_counter()

    @property
    def arm_moves(self) -> bool:
        """Whether the arm is in motion: its frames have priority."""
        return time.perf_counter() - self._moved < MOVED

    @property
    def is_open(self) -> bool:
        """Whether more points may be sent."""
        return self._sent - self._arrived < (WHILE_MOVING if self.arm_moves else WINDOW)

    def sent(self, points: int) -> None:
        """Count points that were just sent."""
        with self._lock:
            self._sent += points
            if self._asking or self._sent == self._arrived:
                return
            self._asking = True
        threading.Thread(target=self._ask, name="workspace-window", daemon=True).start()

    def _ask(self) -> None:
        """Ask until all points are confirmed."""
        while True:
            with self._lock:
                mark = self._sent
                if mark == self._arrived:
                    self._asking = False
                    return
            wait_for_page(self._client)
            with self._lock:
                self._arrived = mark
            self._notify()
