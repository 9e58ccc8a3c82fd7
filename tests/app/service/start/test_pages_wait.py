"""What pages find while the service starts."""

from __future__ import annotations

import asyncio

import pytest

from app.service import startup as module
from app.service.compiler import CompilerStoppedError
from app.service.startup import Startup
from app.service.web.viewer_proxy import ViewerBridge
from app.shared.preparation import Preparation
from app.shared.slots import Slots
from app.viewer.server import ViewerServer


@pytest.mark.parametrize(
    ("error", "status"), [(OSError("no viewer"), "failed"), (CompilerStoppedError(), "warming")], ids=str
)
def test_pages_wait_from_the_first_on_and_for_nothing_that_nobody_compiles(monkeypatch, error, status):
    monkeypatch.setattr(module, "rest_compiled", lambda: False)
    waits: list[bool] = []

    def make_viewer(preparation: Preparation) -> ViewerServer:
        waits.append(not preparation.complete)
        raise error

    startup = Startup(make_viewer, ViewerBridge((), Slots(2, 1.0)))

    async def run() -> None:
        startup.start()
        await asyncio.to_thread(startup._thread.join, 20)

    try:
        asyncio.run(run())
        assert waits == [True]
        assert startup.preparation.complete
        assert startup.status == status
    finally:
        startup.stop()
