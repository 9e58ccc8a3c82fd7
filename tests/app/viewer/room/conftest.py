"""A viewer with rooms for the tests of this folder, and a room for each test."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from live_server import serve_viewer
from students import Room

from app.classroom import Hub
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.server import ViewerServer


@pytest.fixture(scope="module")
def rooms_served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[int, Hub]]:
    data: Path = tmp_path_factory.mktemp("rooms")
    hub = Hub(data)
    viewer = ViewerServer(Store(), Settings(data=data), Clouds(), classroom=hub)
    with serve_viewer(viewer) as port:
        yield port, hub
    hub.close()


@pytest.fixture
def students(rooms_served: tuple[int, Hub]) -> Iterator[Room]:
    found = Room(*rooms_served)
    yield found
    found.close()
