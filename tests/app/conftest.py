"""One REST client for the whole of tests/app, and a viewer for each file: the real ones, beside each other."""

from collections.abc import Iterator

import pytest
from fastapi.testclient import TestClient

from app.service.compute.pool import Pool
from app.service.main import create_app
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store


@pytest.fixture(scope="session")
def app(request):
    settings, store = Settings(max_batch=2000, max_body=1_000_000, time_budget=300), Store()
    if not request.config.getoption("--compute"):
        yield create_app(settings, store)
        return
    pool = Pool(1, settings, store)
    yield create_app(settings, store, pool=pool)
    pool.stop()


@pytest.fixture
def computes_here(app, monkeypatch):
    """Answers are computed in this process, for tests that replace parts of it."""
    monkeypatch.setattr(app.state.compute, "pool", None)


@pytest.fixture(scope="session")
def client(app):
    # Not as a context manager: that would run the lifespan, which starts viser.
    return TestClient(app, raise_server_exceptions=False)


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """Where a viewer is served."""
    from live_server import serve_viewer

    from app.viewer.server import ViewerServer

    with serve_viewer(ViewerServer(Store(), Settings(), Clouds())) as port:
        yield port
