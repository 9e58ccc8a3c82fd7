"""Golden data: vectors computed with 50 digits, one file per arm in ``tests/data``.

Keys: ``random`` and ``edge`` (q, T, frames; edge also name and in_limits), ``ik`` (T, the generating q, all
branches, all in-limit images, and theta1 or psi where the arm has a family). Radians and metres, row major.
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

import pytest

DATA = Path(__file__).parent.parent / "data"


@lru_cache
def _load(robot_id):
    return json.loads((DATA / f"golden-{robot_id}.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def golden():
    """``golden(robot_id)`` is that arm's golden data."""
    return _load
