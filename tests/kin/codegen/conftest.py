"""Tests of generated code take long for all built-in arms: with ``--all`` some stand for the others."""

from __future__ import annotations

import pytest
from emitted import FIRST

import kin


@pytest.hookimpl(tryfirst=True)  # before -m is applied
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as `slow` what repeats a test of this folder for an arm that another one stands for."""
    others = kin.builtin_robots().keys() - set(FIRST)
    for item in items:
        if (
            item.path.parent.name == "codegen"
            and isinstance(item, pytest.Function)
            and hasattr(item, "callspec")
            and item.callspec.params.get("robot_id") in others
        ):
            item.add_marker(pytest.mark.slow)
