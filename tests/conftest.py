"""Profiles of hypothesis: new random examples in every local run, always the same ones in CI.

A test that fails in CI then fails because of a change, not by chance.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

settings.register_profile("local", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that renews ``tests/data/snapshots``."""
    parser.addoption(
        "--snapshot-update", action="store_true", help="rewrite tests/data/snapshots with today's answers"
    )


@pytest.fixture(autouse=True)
def environment_unchanged() -> Iterator[None]:
    """Processes that later tests start inherit the environment."""
    before = dict(os.environ)
    yield
    del before["PYTEST_CURRENT_TEST"]
    after = {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}
    assert after == before, "the test changed environment variables and did not restore them"
