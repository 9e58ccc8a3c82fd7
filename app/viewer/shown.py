"""Arms that this process moves from outside of their pages: those of a notebook (:mod:`app.notebook`)."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable, Sequence
from weakref import WeakMethod

import numpy as np

from app.viewer.panel.status import Notice
from kin.transforms import Array

Post = Callable[[Hashable, object], None]
Path = Sequence[Sequence[float]]
MOVED = Notice("hand", "Joints moved by the notebook")
PATIENCE = 60.0  # s that a path waits for its first page


class ShownArms:
    """What each arm shows now, and the pages that show it. Thread-safe; keeps no page alive."""

    def __init__(self) -> None:
        self._lock = threading.Condition()
        self._now: dict[str, Sequence[float]] = {}
        self._turn: dict[str, int] = {}  # number of the path that an arm is on
        self._pages: dict[str, list[WeakMethod[Post]]] = {}

    def join(self, key: str, post: Post) -> None:
        """From now on a page shows this arm: it gets ``"shown"`` with each configuration and a notice."""
        with self._lock:
            if key not in self._turn:
                return  # nobody moves such an arm
            self._pages.setdefault(key, []).append(WeakMethod(post))
            if key in self._now:
                post("shown", _moved(self._now[key]))
            self._lock.notify_all()

    def play(self, key: str, path: Path, seconds: float) -> None:
        """Move an arm along a path, instead of the one that it is on."""
        with self._lock:
            turn = self._turn[key] = self._turn.get(key, 0) + 1
        if seconds <= 0.0:
            self._move(key, turn, path[-1])
            return
        threading.Thread(target=self._run, args=(key, turn, path, seconds), daemon=True).start()

    def _run(self, key: str, turn: int, path: Path, seconds: float) -> None:
        with self._lock:  # a notebook shows the page after the cell that starts the path
            self._lock.wait_for(lambda: bool(self._pages.get(key)) or self._turn[key] != turn, PATIENCE)
        start = time.monotonic()
        for i, q in enumerate(path):
            time.sleep(max(0.0, start + seconds * i / (len(path) - 1) - time.monotonic()))
            if not self._move(key, turn, q):
                return

    def _move(self, key: str, turn: int, q: Sequence[float]) -> bool:
        with self._lock:
            if self._turn[key] != turn:
                return False
            self._now[key] = q
            pages = self._pages.get(key, [])
            alive = [page for page in pages if page() is not None]
            if len(alive) < len(pages):
                self._pages[key] = alive
        for page in alive:
            if (post := page()) is not None:
                post("shown", _moved(q))
        return True


def _moved(q: Sequence[float]) -> tuple[Array, Notice]:
    return np.array(q), MOVED


SHOWN = ShownArms()
