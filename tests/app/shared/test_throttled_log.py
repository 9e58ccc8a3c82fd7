"""Log lines about what clients do."""

from __future__ import annotations

import asyncio
import logging

from app.shared import throttled_log
from app.shared.throttled_log import ThrottledLog


def test_each_kind_is_logged_at_once_and_then_counted(monkeypatch, caplog):
    monkeypatch.setattr(throttled_log, "LOG_EVERY", 0.1)

    async def noted() -> None:
        some = ThrottledLog(logging.getLogger("some"))
        for k in range(5):
            some.note("a", f"a {k}")
        some.note("b", "b")
        while some._latest:
            await asyncio.sleep(0.01)
        some.note("a", "again")

    asyncio.run(noted())
    assert caplog.messages == ["a 0", "b", "a 4 (4 more times in 0.1 s)", "again"]
