"""Takes a name of a library away, as a later version of it may."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import pytest

from app.shared.private_names import PrivateUse


def take_away(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """Let the library lack a name of a `PrivateUse`."""
    module, path = name.partition("(")[0].split(":")
    found: Any = importlib.import_module(module)
    *owners, last = path.split(".")
    for owner in owners:
        found = getattr(found, owner)
    for kind in found.__mro__ if isinstance(found, type) else [found]:
        if last in vars(kind):
            monkeypatch.delattr(kind, last)
        if last in vars(kind).get("__dataclass_fields__", ()):
            monkeypatch.delitem(kind.__dataclass_fields__, last)
        made = vars(kind).get("__init__")
        if last in getattr(getattr(made, "__code__", None), "co_names", ()):
            monkeypatch.setattr(kind, "__init__", _set_nothing)


def _set_nothing(self: object) -> None:
    """In the place of an `__init__`."""


def leave_out(monkeypatch: pytest.MonkeyPatch, use: PrivateUse) -> None:
    """Leave an improvement out, as where a name is missing."""
    monkeypatch.setitem(use.__dict__, "is_there", False)


def asked_again(monkeypatch: pytest.MonkeyPatch, use: PrivateUse) -> Callable[[], bool]:
    """Whether an improvement is there, found out anew at the first call."""
    monkeypatch.setitem(use.__dict__, "is_there", None)
    del use.__dict__["is_there"]
    return lambda: use.is_there
