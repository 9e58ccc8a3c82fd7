"""viser's server without its port: connections are given to it, and end in the way they should."""

from __future__ import annotations

import asyncio
import hashlib
import inspect
import logging
import threading
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import psutil
import pytest
import viser
from viser import _messages as messages
from viser import infra
from viser.infra import _infra

from app.shared.connection import ConnectionEnded
from app.shared.security import Rights
from app.viewer.viser_patches import keep_private, uuid_of
from app.viewer.viser_server import PROTOCOL, PortlessServer, start_viser

# The text of the method that `PortlessServer` replaces. If viser changes it, read what has changed, and whether
# `PortlessServer` must follow; then write the new digest here.
REPLACED = "59b19aac01fb31a3"
CAMERA = {
    "wxyz": (1, 0, 0, 0),
    "position": (3, 3, 3),
    "image_height": 720,
    "image_width": 1280,
    "fov": 1.3,
    "near": 0.01,
    "far": 1000,
    "look_at": (0, 0, 0),
    "up_direction": (0, 0, 1),
}


class Visit:
    """A connection whose messages come from a list; it ends with the list."""

    def __init__(
        self,
        *messages: dict[str, Any],
        subprotocol: str | None = PROTOCOL,
        stays: bool = False,
        rights: Rights = Rights.FULL,
    ) -> None:
        self.subprotocol = subprotocol
        self.rights = rights
        self.client = "10.0.0.1"
        self.room_token = ""
        self.sent = 0
        self._messages = list(messages)
        self._stays = stays

    async def receive(self) -> bytes:
        await asyncio.sleep(0.02)  # so that what the last message has caused is there
        if self._messages:
            return msgspec.msgpack.encode(self._messages.pop(0))
        if self._stays:
            await asyncio.Event().wait()
        raise ConnectionEnded(1001, "left")

    async def send(self, data: bytes) -> None:
        self.sent += 1


@pytest.fixture
def loop() -> Iterator[asyncio.AbstractEventLoop]:
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    yield loop
    loop.call_soon_threadsafe(loop.stop)
    thread.join(10)
    loop.close()


@pytest.fixture
def server(loop: asyncio.AbstractEventLoop) -> Iterator[tuple[viser.ViserServer, PortlessServer]]:
    started = start_viser(loop, "test")
    yield started
    started[0].stop()


@pytest.fixture
def serve(
    loop: asyncio.AbstractEventLoop, server: tuple[viser.ViserServer, PortlessServer]
) -> Callable[[Visit], tuple[int, str]]:
    def until_the_end(visit: Visit) -> tuple[int, str]:
        end = asyncio.run_coroutine_threadsafe(server[1].serve(visit), loop).result(10)
        return end.code, end.reason

    return until_the_end


def listening() -> set[tuple[str, int]]:
    """Addresses at which this process listens."""
    found = psutil.Process().net_connections("inet")
    return {tuple(each.laddr) for each in found if each.status == psutil.CONN_LISTEN}


@pytest.fixture
def listening_before():
    return listening()  # plugins of pytest may


def test_nothing_listens(listening_before, server):
    assert listening() == listening_before
    assert infra.WebsockServer is _infra.WebsockServer, "viser's class is back in its place"


def test_a_visitor_comes_and_goes(server, serve):
    seen: list[tuple[str, int]] = []

    @server[0].on_client_connect
    async def _(client: viser.ClientHandle) -> None:
        seen.append(("comes", client.client_id))
        client.scene.add_frame("/a")

    @server[0].on_client_disconnect
    async def _(client: viser.ClientHandle) -> None:
        seen.append(("goes", client.client_id))

    for number in range(2):
        visit = Visit({"type": "ViewerCameraMessage"} | CAMERA, *[{"type": "ViewerCameraMessage"} | CAMERA] * 3)
        assert serve(visit) == (1001, "left")
        assert visit.sent >= 2, "what all see, and what this one sees"
        assert seen == [("comes", number), ("goes", number)]
        seen.clear()
    assert server[0].get_clients() == {}
    assert server[1]._client_state_from_id == {}
    assert server[1]._broadcast_buffer.generator_cursors == {}


def test_a_message_for_a_visitor_who_has_left_is_no_warning(loop):
    started, connections = start_viser(loop, "test")
    visitors: list[viser.ClientHandle] = []

    @started.on_client_connect
    async def _(client: viser.ClientHandle) -> None:
        visitors.append(client)

    visit = Visit(*[{"type": "ViewerCameraMessage"} | CAMERA] * 3)
    asyncio.run_coroutine_threadsafe(connections.serve(visit), loop).result(10)
    (client,) = visitors
    with warnings.catch_warnings(record=True) as shown:
        client.local_storage.set_item("key", "value")
    started.stop()
    assert shown == []


def test_a_page_of_another_version_is_refused_with_a_reason(serve):
    code, reason = serve(Visit(subprotocol="viser-v0.0.1"))
    assert code == 1002
    assert PROTOCOL in reason
    assert serve(Visit(subprotocol=None))[0] == 1002


@pytest.mark.parametrize("kind", ["ShareUrlRequest", "ShareUrlDisconnect"])
def test_nobody_can_ask_for_a_public_tunnel(server, serve, monkeypatch, kind):
    asked: list[str] = []
    monkeypatch.setattr(viser.ViserServer, "request_share_url", lambda self: asked.append("request"))
    monkeypatch.setattr(viser.ViserServer, "disconnect_share_url", lambda self: asked.append("disconnect"))
    assert serve(Visit({"type": kind}, {"type": "ViewerCameraMessage"} | CAMERA)) == (1001, "left")
    server[0]._thread_executor.shutdown(wait=True)
    assert asked == []


@pytest.mark.parametrize(
    "message",
    [{"type": "NoSuchMessage"}, {"type": "GuiUpdateMessage"}, {"type": "ViewerCameraMessage", "fov": "wide"}, {}],
    ids=str,
)
def test_a_message_that_viser_cannot_read_ends_the_connection(serve, message):
    code, reason = serve(Visit(message, stays=True))
    assert code == 1007
    assert len(reason.encode()) <= 123, "what fits into a close frame"


def test_handlers_that_fail_are_logged_without_a_traceback_and_the_visitor_stays(server, serve, caplog):
    def fails(client_id: int, message: Any) -> None:
        raise ValueError("cannot be handled")

    server[1].register_handler(messages.GuiFormDirtyMessage, fails)
    dirty = {"type": "GuiFormDirtyMessage", "uuid": "a"}
    with caplog.at_level(logging.WARNING):
        assert serve(Visit(dirty, dirty)) == (1001, "left")
    assert [record.getMessage() for record in caplog.records] == [
        "a message of a visitor could not be handled: ValueError('cannot be handled')"
    ] * 2
    assert all(record.exc_info is None for record in caplog.records)


def test_a_broken_connection_ends_with_an_internal_error(serve, caplog):
    visit = Visit(stays=True)

    async def fails(data: bytes) -> None:
        raise OSError("broken")

    visit.send = fails
    assert serve(visit) == (1011, "internal error")
    assert "broken" in caplog.text


def test_stopping_ends_every_connection_and_returns_when_they_have_ended(loop, server):
    async def comes(visit: Visit) -> ConnectionEnded:
        return await server[1].serve(visit)

    async def never(data: bytes) -> None:
        await asyncio.Event().wait()

    stuck = Visit(stays=True)
    stuck.send = never
    ends = [asyncio.run_coroutine_threadsafe(comes(visit), loop) for visit in (stuck, Visit(stays=True))]
    while len(server[1]._client_state_from_id) < 2:
        threading.Event().wait(0.01)
    server[0].stop()
    assert [(end.done(), end.result(1).code) for end in ends] == 2 * [(True, 1001)]
    late = asyncio.run_coroutine_threadsafe(comes(Visit(stays=True)), loop).result(10)
    assert late.code == 1001


def test_a_stop_after_the_loop_has_ended_returns(loop):
    started, _ = start_viser(loop, "test")
    loop.call_soon_threadsafe(loop.stop)
    while loop.is_running():
        threading.Event().wait(0.01)
    started.stop()


@pytest.mark.parametrize(
    ("owner", "name", "other"),
    [
        (_infra, "_message_producer", None),
        (_infra, "_message_producer", lambda websocket, buffer: None),
        (_infra, "_ClientHandleState", lambda event_loop, message_buffer: None),
        (infra.WebsockServer, "_background_worker", None),
    ],
)
def test_a_version_of_viser_that_lacks_something_is_refused_by_name(loop, monkeypatch, owner, name, other):
    monkeypatch.setattr(owner, name, other)
    with pytest.raises(RuntimeError, match=f"viser {viser.__version__} lacks .*{name}.*; install viser"):
        start_viser(loop, "test")


def test_a_version_of_viser_that_listens_all_the_same_is_refused(loop, monkeypatch):
    class Other:
        def __init__(self, **_: Any) -> None:
            self._websock_server = object()
            self.stopped = False

        def stop(self) -> None:
            Other.stops += 1

    Other.stops = 0
    monkeypatch.setattr(viser, "ViserServer", Other)
    with pytest.raises(RuntimeError, match="listens on a port"):
        start_viser(loop, "test")
    assert Other.stops == 1


def test_the_method_that_is_replaced_is_the_one_we_know():
    text = inspect.getsource(infra.WebsockServer._background_worker)
    assert hashlib.sha256(text.encode()).hexdigest()[:16] == REPLACED, "see REPLACED"


def gizmo(client: viser.ClientHandle, seen: list[Any], private: bool = True) -> viser.TransformControlsHandle:
    handle = client.scene.add_transform_controls("/target")
    if private:
        keep_private(handle)

    @handle.on_update
    async def _(event: viser.TransformControlsEvent) -> None:
        seen.append((event.phase, event.client is client, event.client_id, event.target.position.tolist()))
        seen.append(event.target.wxyz.tolist())

    return handle


def drag(owner: str, **fields: Any) -> dict[str, Any]:
    moved = {"name": "/target", "position": (1, 2.5, 3), "wxyz": (0, 1, 0, 0), "owner": owner}
    return {"type": "TransformControlsUpdateMessage"} | moved | fields


@pytest.mark.parametrize("private", [True, False])
def test_events_of_a_drag_reach_the_gizmo_of_their_visitor_in_order(server, serve, private):
    seen: list[Any] = []
    visits: list[Visit] = []

    @server[0].on_client_connect
    async def _(client: viser.ClientHandle) -> None:
        gizmo(client, seen, private)
        owner = client.scene._owner_id
        visits[0]._messages += [
            drag(owner),
            drag("another"),
            drag(owner, name="/other"),
            drag(owner, position=(4, 5, 6)),
        ]

    visits.append(Visit(CAMERA | {"type": "ViewerCameraMessage"}))
    assert serve(visits[0]) == (1001, "left")
    assert seen == [
        ("update", True, 0, [1.0, 2.5, 3.0]),
        [0.0, 1.0, 0.0, 0.0],
        ("update", True, 0, [4.0, 5.0, 6.0]),
        [0.0, 1.0, 0.0, 0.0],
    ]


def test_an_error_in_a_callback_of_a_drag_ends_nothing(server, serve):
    seen: list[Any] = []
    visits: list[Visit] = []

    @server[0].on_client_connect
    async def _(client: viser.ClientHandle) -> None:
        @gizmo(client, seen).on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            raise ValueError("in a callback")

        visits[0]._messages += 2 * [drag(client.scene._owner_id)]

    visits.append(Visit(CAMERA | {"type": "ViewerCameraMessage"}))
    assert serve(visits[0]) == (1001, "left")
    assert len(seen) == 4


@pytest.mark.parametrize(("rights", "free"), [("look", False), ("look", True), ("full", False)])
def test_who_may_only_look_changes_the_controls_that_are_free(server, serve, rights, free):
    box = server[0].gui.add_checkbox("Box", False)
    server[1].lets_change = lambda number, uuid: free and uuid == uuid_of(box)
    update = {"type": "GuiUpdateMessage", "uuid": uuid_of(box), "updates": {"value": True}}
    serve(Visit({"type": "ViewerCameraMessage"} | CAMERA, update, update, rights=Rights(rights)))
    assert box.value == (free or rights == "full")
