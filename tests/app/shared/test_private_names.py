"""Private names of libraries: which are found to be missing, and that the log says so once."""

from __future__ import annotations

import dataclasses
import logging
import sys
from types import ModuleType

import pytest
from private_names import asked_again

from app.shared.private_names import PrivateUse


class Base:
    def __init__(self) -> None:
        self.of_base = self._make()

    def _make(self) -> int:
        return 1


class Kind(Base):
    _of_class = 1

    def __init__(self, size: int) -> None:
        super().__init__()
        self._own = size

    def send(self, data: bytes, now: bool) -> None:
        """As a library has it."""


@dataclasses.dataclass
class Fields:
    name: str
    owner: str = dataclasses.field(default="", init=False)


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> None:
    made = ModuleType("made_up_library")
    made.Kind, made.Fields, made.send = Kind, Fields, Kind.send  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "made_up_library", made)


NAMES = (
    "Kind",
    "Kind._of_class",
    "Kind._own",
    "Kind.of_base",
    "Kind._make",
    "Kind(size)",
    "send(self, data, now)",
)
FIELDS = ("Fields.name", "Fields.owner", "Fields(name, owner)")
MISSING = (
    "Other",
    "Kind._other",
    "Other._own",
    "Kind(length)",
    "Kind.send(self, data)",
    "other()",
    "Fields(name)",
)


def use(*names: str) -> PrivateUse:
    return PrivateUse("numpy", "Tests.", "Nothing is lost.", tuple(f"made_up_library:{name}" for name in names))


def test_names_that_are_there_are_found(library: None) -> None:
    assert use(*NAMES, *FIELDS).missing() == []
    assert use(*NAMES, *FIELDS).is_there


@pytest.mark.parametrize("name", MISSING)
def test_a_name_that_is_not_there_is_found_to_be_missing(library: None, name: str) -> None:
    assert use("Kind", name, "Fields").missing() == [f"made_up_library:{name}"]


def test_a_method_that_only_the_constructor_mentions_is_missing(
    library: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(Base, "_make")
    assert use("Kind._make").missing() == ["made_up_library:Kind._make"]


def test_a_module_that_is_not_there_has_no_names() -> None:
    assert use("Kind").missing() == ["made_up_library:Kind"]


def test_what_is_left_out_is_logged_once(
    library: None, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    lacking = use("Kind._other", "Kind")
    with caplog.at_level(logging.WARNING, "kinboard.libraries"):
        assert [lacking.is_there for _ in range(3)] == [False] * 3
    (line,) = caplog.messages
    assert line.startswith("numpy ")
    assert line.endswith(" lacks made_up_library:Kind._other. Nothing is lost.")
    assert asked_again(monkeypatch, lacking)() is False
