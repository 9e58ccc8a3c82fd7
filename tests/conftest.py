"""Profiles of hypothesis: new random examples in every local run, always the same ones in CI.

A test that fails in CI then fails because of a change, not by chance.
"""

from __future__ import annotations

import os

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
