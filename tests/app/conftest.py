"""One REST client for the whole of tests/app: the real application, without starting the viewer beside it."""

import pytest
from fastapi.testclient import TestClient

from app.main import create_app
from app.settings import Settings


@pytest.fixture(scope="session")
def app():
    return create_app(Settings(max_batch=2000, max_body=1_000_000))


@pytest.fixture(scope="session")
def client(app):
    # Not as a context manager: that would run the lifespan, which starts viser.
    return TestClient(app, raise_server_exceptions=False)
