"""Questions that follow what was sent to a page: one at a time, and none is lost."""

from __future__ import annotations

import threading
from unittest.mock import Mock

import pytest

from app.viewer.panel.fence import Fence


def test_a_question_for_which_no_thread_starts_is_asked_at_a_later_step(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[str] = []
    full = True

    class Thread:
        def __init__(self, name: str, **_: object) -> None:
            self.name = name

        def start(self) -> None:
            if full:
                raise RuntimeError("can't start new thread")
            started.append(self.name)

    monkeypatch.setattr(threading, "Thread", Thread)
    fence = Fence(Mock(), lambda: None)
    assert fence.next == 1
    fence.ask()
    assert (fence.asked, fence.last, started) == (0, 0, [])
    full = False
    for _ in range(2):
        fence.ask()
    assert (fence.asked, started) == (1, ["fence"])
    assert fence.next == 2
    fence.ask()
    assert started == ["fence"], "the first one is not answered"
    fence.passed()
    fence.ask()
    assert (fence.asked, fence.last, started) == (2, 1, ["fence", "fence"])
