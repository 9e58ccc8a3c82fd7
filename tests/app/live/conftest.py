"""A viewer with the websocket of its programs, and one page in it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

from app.api import ComputeSlots, api_routes
from app.live import Lines
from app.service.web.rooms.limits import Limits
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.server import ViewerServer
from kin.notebook import driving


@pytest.fixture(scope="module")
def viewer() -> Iterator[int]:
    """Where a viewer and the websocket of its programs are served."""
    settings, store, lines = Settings(), Store(), Lines()
    state = {
        "settings": settings,
        "store": store,
        "compute": ComputeSlots(2, 5.0),
        "lines": lines,
        "tries": Limits(),
    }
    with serve_viewer(ViewerServer(store, settings, Clouds(), lines=lines), api_routes(), **state) as port:
        yield port


@pytest.fixture
def page(viewer) -> Iterator[FakeBrowser]:
    with FakeBrowser(viewer) as page:
        page.choose("UR5")
        yield page


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs that drive an arm wait long for page and arm: a busy machine is no reason to stop."""
    monkeypatch.setattr(driving, "PAGE_LOST", 20.0)
    monkeypatch.setattr(driving, "ARM_LOST", 20.0)
