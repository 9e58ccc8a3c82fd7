"""Property tests draw new examples at every run at home, the same ones in CI: there, red must mean a change."""

from __future__ import annotations

import os

import pytest
from hypothesis import settings

settings.register_profile("home", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "home")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--snapshot-update", action="store_true", help="write the answers of test_snapshot.py to its files anew"
    )
