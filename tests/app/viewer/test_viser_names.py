"""viser's private names: all that are used are listed, and without each group of them Kinboard works on."""

from __future__ import annotations

import ast
import asyncio
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import viser
from private_names import asked_again, leave_out, take_away
from test_viser_server import CAMERA, Visit, loop, serve, server  # noqa: F401 - fixtures

from app.viewer import viser_names, viser_server
from app.viewer.viser_outbox import in_one_frame
from app.viewer.viser_patches import (
    SceneFilter,
    assign,
    cache_type_hints,
    show_value,
    uuid_of,
)

ROOT = Path(__file__).parents[3]
VIEWER = ROOT / "app" / "viewer"
USERS = {VIEWER / f"viser_{name}.py" for name in ("patches", "outbox", "server")}
LISTED = {re.split(r"[:.]", name.partition("(")[0])[-1] for use in viser_names.ALL for name in use.names}
VIEW = CAMERA | {"type": "ViewerCameraMessage"}


def uses(path: Path) -> Iterator[str]:
    """What a module uses of others' private names: attributes of what is not `self`, and imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute) and re.match("_[^_]", node.attr):
            if ast.unparse(node.value) not in ("self", "cls"):
                yield node.attr
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "viser":
            yield from (each for each in (node.module or "").split(".") if re.match("_[^_]", each))
            yield from (alias.name for alias in node.names if re.match("_[^_]", alias.name))


def test_the_installed_version_has_all_names() -> None:
    assert [use.missing() for use in viser_names.ALL] == [[]] * len(viser_names.ALL)


def test_all_that_is_used_is_listed_and_used_nowhere_else() -> None:
    modules = {"_messages", "_infra", "_async_message_buffer", "_assignable_props_api", "_threadpool_exceptions"}
    for path in USERS:
        assert set(uses(path)) <= LISTED | modules, path.name
    private = {name for name in LISTED if name.startswith("_")} | modules
    for path in (ROOT / "app").rglob("*.py"):
        if path not in USERS and any(name in path.read_text(encoding="utf-8") for name in private):
            assert not private & set(uses(path)), path


@pytest.mark.parametrize("name", sorted({name for use in viser_names.ALL for name in use.names}))
def test_each_name_is_missed(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    concerned = [use for use in viser_names.ALL if name in use.names]
    take_away(monkeypatch, name)
    for use in concerned:
        assert name in use.missing()
        assert not asked_again(monkeypatch, use)()


@pytest.fixture
def visited(server, serve):  # noqa: F811
    """Lets a visitor come, for whom a function is called; returns the visit when it has ended."""

    def visit(act: Callable[[viser.ClientHandle], None], made: Visit) -> Visit:
        failed: list[Exception] = []

        async def connected(client: viser.ClientHandle) -> None:
            try:
                await asyncio.to_thread(act, client)
            except Exception as error:  # noqa: BLE001 - raised below
                failed.append(error)

        server[0].on_client_connect(connected)
        assert serve(made) == (1001, "left")
        for error in failed:
            raise error
        return made

    return visit


def test_without_the_outbox_viser_s_own_buffer_sends(
    monkeypatch: pytest.MonkeyPatch, visited: Callable[..., Visit]
) -> None:
    leave_out(monkeypatch, viser_names.IMPROVEMENTS)
    monkeypatch.setattr(viser_server, "Outbox", None)

    def act(client: viser.ClientHandle) -> None:
        with in_one_frame(client):
            client.scene.add_frame("/a")

    assert visited(act, Visit(VIEW)).sent >= 2, "what all see, and what this one sees"


def test_without_the_private_names_of_nodes_viser_s_setters_pose_them(
    monkeypatch: pytest.MonkeyPatch, visited: Callable[..., Visit]
) -> None:
    leave_out(monkeypatch, viser_names.IMPROVEMENTS)

    def act(client: viser.ClientHandle) -> None:
        node = client.scene.add_frame("/a")
        assign(node, np.array([1.0, 2.0, 3.0]), (0.0, 1.0, 0.0, 0.0))
        assert (node.position.tolist(), node.wxyz.tolist()) == ([1.0, 2.0, 3.0], [0.0, 1.0, 0.0, 0.0])
        assign(node, (1.0, 2.0, 3.0 + 1e-7))
        assert node.position.tolist() == [1.0, 2.0, 3.0], "viser's own setter takes it for the same"
        everything = SceneFilter(client.scene, "/b")
        assert "_queue_scene_message" not in vars(client.scene)
        everything.open()
        assert node.visible

    visited(act, Visit(VIEW))


def test_without_the_private_names_of_controls_viser_s_setters_show_values(
    monkeypatch: pytest.MonkeyPatch, visited: Callable[..., Visit]
) -> None:
    leave_out(monkeypatch, viser_names.IMPROVEMENTS)

    def act(client: viser.ClientHandle) -> None:
        number = client.gui.add_number("a", 1.0)
        called: list[Any] = []
        number.on_update(called.append)
        show_value(number, 2.0)
        assert [event.client for event in called] == [None], "viser's own setter calls callbacks"
        assert (number.value, uuid_of(number)) == (2.0, "")

    visited(act, Visit(VIEW))


def test_without_the_function_that_is_cached_nothing_is_patched(monkeypatch: pytest.MonkeyPatch) -> None:
    take_away(monkeypatch, "viser._assignable_props_api:get_type_hints")
    asked_again(monkeypatch, viser_names.IMPROVEMENTS)
    cache_type_hints()
    assert "get_type_hints" not in vars(sys.modules["viser._assignable_props_api"])
