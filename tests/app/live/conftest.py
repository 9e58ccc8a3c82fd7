"""A viewer with the websocket of its programs, and one page in it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager

import pytest
from fake_browser import FakeBrowser
from fastapi import FastAPI
from live_server import serve

import kin
from app.api import ComputeSlots, api_routes
from app.live import Lines
from app.service.web.rooms.limits import Limits
from app.service.web.viewer_proxy import ViewerBridge
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.server import ViewerServer


@pytest.fixture(scope="module")
def viewer() -> Iterator[int]:
    """Where a viewer and the websocket of its programs are served."""
    kin.warm_up()
    bridge, lines, loops = ViewerBridge(), Lines(), list[asyncio.AbstractEventLoop]()

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        loops.append(asyncio.get_running_loop())
        yield

    app = FastAPI(lifespan=lifespan)
    app.state.settings, app.state.store, app.state.compute = Settings(), Store(), ComputeSlots(2, 5.0)
    app.state.lines, app.state.tries = lines, Limits()
    app.router.routes.extend([*api_routes(), *bridge.routes()])
    server = ViewerServer(app.state.store, app.state.settings, Clouds(), lines=lines)
    with serve(app) as port:
        server.start(loops[0])
        bridge.viewer = server
        try:
            yield port
        finally:
            server.stop()


@pytest.fixture
def page(viewer) -> Iterator[FakeBrowser]:
    with FakeBrowser(viewer) as page:
        page.choose("UR5")
        yield page
