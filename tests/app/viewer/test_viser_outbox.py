"""The way out of a visitor's messages: viser's own bytes, in one frame, with one wake-up of the event loop."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
import zstandard
from hypothesis import example, given
from hypothesis import strategies as st
from viser import _messages as messages
from viser.infra import Message, _infra
from viser.infra._async_message_buffer import AsyncMessageBuffer

from app.shared.connection import ConnectionEnded
from app.viewer import viser_outbox
from app.viewer.viser_outbox import PATIENCE, LoopWaker, Outbox, Packer, in_one_frame

WAIT = 5.0  # s for what takes milliseconds


class Line:
    """A connection that keeps what is sent, and may be slow or broken."""

    def __init__(self) -> None:
        self.frames: list[bytes] = []
        self.open = asyncio.Event()
        self.open.set()
        self.broken = False

    async def send(self, data: bytes) -> None:
        await self.open.wait()
        if self.broken:
            raise ConnectionEnded(1001)
        self.frames.append(data)

    @property
    def names(self) -> list[list[str]]:
        """Names of nodes, one list for each frame."""
        return [[message["name"] for message in content(frame)["messages"]] for frame in self.frames]


def content(frame: bytes) -> dict[str, Any]:
    size = int.from_bytes(frame[8:16], "little")
    return msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(frame[16 : 16 + size]))


def turn(name: str, w: float = 1.0) -> messages.SetOrientationMessage:
    message = messages.SetOrientationMessage(name, (w, 0.0, 0.0, 0.0))
    message.owner = "3"
    return message


class Sending:
    """An outbox that is read in a running event loop."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.loop, self.line = loop, Line()
        self.wakes = 0
        self.waker = LoopWaker(loop)
        wake: Any = loop.call_soon_threadsafe

        def counted(*args: Any) -> Any:
            self.wakes += 1
            return wake(*args)

        loop.call_soon_threadsafe = counted  # type: ignore[method-assign]
        self.box = Outbox(7, self.waker, Packer())
        connection: Any = self.line
        self.sent = asyncio.run_coroutine_threadsafe(self.box.send_to(connection), loop)
        self.on_loop(lambda: None)

    def on_loop(self, call: Callable[[], Any]) -> Any:
        async def run() -> Any:
            return call()

        return asyncio.run_coroutine_threadsafe(run(), self.loop).result(WAIT)

    def wait(self, names: list[list[str]]) -> None:
        end = time.monotonic() + WAIT
        while self.line.names != names:
            assert time.monotonic() < end, self.line.names
            time.sleep(0.005)


@pytest.fixture
def sending() -> Iterator[Sending]:
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    made = Sending(loop)
    yield made
    made.box.set_done()
    made.line.broken = False
    made.on_loop(made.line.open.set)
    if not made.sent.done():
        made.sent.result(WAIT)
    loop.call_soon_threadsafe(loop.stop)
    thread.join(WAIT)
    loop.close()


def every_kind() -> list[Message]:
    """Messages of a drag and of a page that is built, with arrays, tuples and numbers of NumPy."""
    place = messages.SetPositionMessage("/arm/target", (0.25, -1.5, 1e-12))
    place.owner = "3"
    points = messages.LineSegmentsMessage(
        "/gap",
        messages.LineSegmentsProps(
            points=np.arange(6, dtype=np.float32).reshape(1, 2, 3),
            colors=np.array([[[1, 2, 3], [4, 5, 6]]], np.uint8),
            thickness=3.0,
            thickness_units="screen",
            scale=1.0,
        ),
    )
    return [
        turn("/arm/1", 0.125),
        place,
        messages.GuiUpdateMessage("a-b", {"value": 12.5}),
        messages.GuiUpdateMessage("c-d", {"content": "<b>θ₁ = 1°</b>"}),
        messages.GuiUpdateMessage("e-f", {"value": np.float32(0.5), "marks": ((1, "a"),)}),
        messages.SceneNodeUpdateMessage("/travel", {"text": "Δ 12 mm", "font_screen_scale": 1.3}),
        messages.SceneNodeUpdateMessage("/gap", {"points": np.zeros((1, 2, 3), np.float32)}),
        messages.SetSceneNodeVisibilityMessage("/arm", np.bool_(False)),  # type: ignore[arg-type]
        points,
        messages.RemoveSceneNodeMessage("/old"),
    ]


def test_frames_are_viser_s_own_byte_for_byte(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(perf_counter=lambda: 1234.5)
    monkeypatch.setattr(_infra, "time", clock)
    monkeypatch.setattr(viser_outbox, "time", clock)

    async def viser_s_own() -> bytes:
        buffer = AsyncMessageBuffer(asyncio.get_running_loop(), persistent_messages=False)
        for message in every_kind():
            buffer.push(message)
        line: Any = Line()
        flow = asyncio.ensure_future(_infra._message_producer(line, buffer, 7))
        while not line.frames:
            await asyncio.sleep(0.005)
        buffer.set_done()
        await flow
        return line.frames[0]

    theirs = asyncio.run(viser_s_own())
    assert Packer().pack(every_kind()) == theirs
    assert len(content(theirs)["messages"]) == len(every_kind())


def test_a_step_is_one_frame_and_one_wake_up(sending: Sending) -> None:
    before = sending.wakes
    with sending.box.hold():
        for k in range(5):
            sending.box.atomic_start()
            sending.box.push(turn(f"/{k}"))
            sending.box.atomic_end()
            sending.box.flush()
        time.sleep(0.05)
        assert not sending.line.frames
    sending.wait([["/0", "/1", "/2", "/3", "/4"]])
    assert sending.wakes == before + 1


def test_a_step_ends_when_its_frame_has_left(sending: Sending) -> None:
    for k in range(50):
        with sending.waker.together():
            sending.box.push(turn(f"/{k}"))
            sending.box.flush()
        assert len(sending.line.frames) == k + 1


def test_a_step_waits_for_a_loop_that_is_held_up_for_a_moment_only(sending: Sending) -> None:
    going_on = threading.Event()
    sending.loop.call_soon_threadsafe(going_on.wait, WAIT)
    with sending.waker.together():
        sending.box.push(turn("/a"))
        sending.box.flush()
    assert not sending.line.frames
    going_on.set()
    sending.wait([["/a"]])


def test_a_step_ends_without_a_loop() -> None:
    loop = asyncio.new_event_loop()
    loop.close()
    waker = LoopWaker(loop)
    began = time.perf_counter()
    for _ in range(100):
        with waker.together():
            waker.call(lambda: None)
    assert time.perf_counter() - began < 50 * PATIENCE, "none waits"


def test_the_newest_pose_of_a_node_replaces_one_that_waits(sending: Sending) -> None:
    with sending.box.hold():
        for w in (0.1, 0.2, 0.3):
            sending.box.push(turn("/a", w))
        sending.box.flush()
    sending.wait([["/a"]])
    assert content(sending.line.frames[0])["messages"][0]["wxyz"] == [0.3, 0.0, 0.0, 0.0]


def test_messages_that_are_not_flushed_leave_together_soon(sending: Sending) -> None:
    sending.box.window_duration_sec = 0.1
    for k in range(3):
        sending.box.push(turn(f"/{k}"))
    assert not sending.line.frames
    sending.wait([["/0", "/1", "/2"]])


def test_nothing_leaves_within_an_atomic_block_of_another_thread(sending: Sending) -> None:
    sending.box.atomic_start()
    sending.box.push(turn("/a"))
    sending.box.flush()
    time.sleep(0.05)
    assert not sending.line.frames
    sending.box.push(turn("/b"))
    sending.box.atomic_end()
    sending.wait([["/a", "/b"]])


def test_a_hold_that_an_error_ends_still_sends(sending: Sending) -> None:
    def step() -> None:
        with sending.box.hold():
            sending.box.push(turn("/a"))
            raise ValueError("step")

    with pytest.raises(ValueError, match="step"):
        step()
    sending.wait([["/a"]])


def made(uuid: str) -> messages.GuiHtmlMessage:
    return messages.GuiHtmlMessage(uuid, "root", messages.GuiHtmlProps(order=0.0, content="", visible=True))


def test_a_control_that_is_removed_before_it_leaves_is_never_spoken_of(sending: Sending) -> None:
    def sent(frames: int) -> list[tuple[str, str]]:
        sending.box.flush()
        end = time.monotonic() + WAIT
        while len(sending.line.frames) < frames:
            assert time.monotonic() < end, sending.line.frames
            time.sleep(0.005)
        return [(each["type"], each["uuid"]) for each in content(sending.line.frames[-1])["messages"]]

    with sending.box.hold():
        sending.box.push(made("known"))
        sending.box.push(made("stays"))
    assert sent(1) == [("GuiHtmlMessage", "known"), ("GuiHtmlMessage", "stays")]
    with sending.box.hold():
        sending.box.push(made("unseen"))
        sending.box.push(messages.GuiUpdateMessage("unseen", {"content": "1"}))
        sending.box.push(messages.GuiUpdateMessage("unseen", {"visible": False}))
        sending.box.push(messages.GuiUpdateMessage("stays", {"content": "2"}))
        sending.box.push(messages.GuiUpdateMessage("known", {"content": "3"}))
        sending.box.push(messages.GuiRemoveMessage("unseen"))
        sending.box.push(messages.GuiRemoveMessage("known"))
    assert sent(2) == [("GuiUpdateMessage", "stays"), ("GuiRemoveMessage", "known")]
    assert sending.box.ids_from_entity_state_key == sending.box.id_from_redundancy_key == {}


def test_an_error_while_packing_ends_the_sender(sending: Sending) -> None:
    def broken(_: object) -> bytes:
        raise ZeroDivisionError("while packing")

    sending.box._packer.pack = broken  # type: ignore[method-assign]
    sending.box.push(turn("/a"))
    with pytest.raises(ZeroDivisionError):
        sending.sent.result(WAIT)


def test_a_message_that_its_own_visitor_caused_is_not_sent_back(sending: Sending) -> None:
    mine, theirs = turn("/mine"), turn("/theirs")
    mine.excluded_self_client, theirs.excluded_self_client = 7, 8  # type: ignore[assignment]
    sending.box.push(mine)
    sending.box.push(theirs)
    sending.wait([["/theirs"]])


def test_a_frame_is_not_larger_than_viser_s(sending: Sending) -> None:
    names = [f"/{k}" for k in range(300)]
    with sending.box.hold():
        for name in names:
            sending.box.push(turn(name))
    sending.wait([names[:128], names[128:256], names[256:]])


def test_behind_a_slow_line_the_newest_poses_wait_and_older_ones_are_dropped(sending: Sending) -> None:
    sending.on_loop(sending.line.open.clear)
    sending.box.push(turn("/a", 0.0))
    sending.box.flush()
    end = time.monotonic() + WAIT
    while sending.box.message_from_id:
        assert time.monotonic() < end
        time.sleep(0.005)
    for k in range(1, 1000):
        sending.box.push(turn("/a", k / 1000))
        sending.box.flush()
    assert len(sending.box.message_from_id) == 1
    sending.on_loop(sending.line.open.set)
    sending.wait([["/a"], ["/a"]])
    assert content(sending.line.frames[1])["messages"][0]["wxyz"][0] == 0.999


def test_many_threads_lose_no_message(sending: Sending) -> None:
    def push(thread: int) -> None:
        for k in range(200):
            with sending.box.hold():
                sending.box.push(turn(f"/{thread}/{k}"))
                if k % 3:
                    sending.box.flush()

    threads = [threading.Thread(target=push, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(WAIT)
    wanted = {f"/{thread}/{k}" for thread in range(4) for k in range(200)}
    end = time.monotonic() + WAIT
    while {name for frame in sending.line.names for name in frame} != wanted:
        assert time.monotonic() < end
        time.sleep(0.02)


def test_the_end_of_the_connection_is_raised(sending: Sending) -> None:
    sending.line.broken = True
    sending.box.push(turn("/a"))
    with pytest.raises(ConnectionEnded):
        sending.sent.result(WAIT)


def test_a_buffer_that_is_done_ends_its_sender_even_while_it_is_held(sending: Sending) -> None:
    with sending.box.hold():
        sending.box.set_done()
        sending.sent.result(WAIT)


def test_a_closed_loop_takes_messages_and_sends_nothing() -> None:
    loop = asyncio.new_event_loop()
    box = Outbox(7, LoopWaker(loop), Packer())
    loop.close()
    box.push(turn("/a"))
    box.flush()
    assert list(box.message_from_id) == [0]


def test_a_visitor_of_a_viser_server_with_a_port_is_served_as_before() -> None:
    buffer = object()
    client: Any = SimpleNamespace(_websock_connection=SimpleNamespace(get_message_buffer=lambda: buffer))
    with in_one_frame(client):
        pass


TEXTS = st.text(st.characters(codec=None))  # half letters too
JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**30), 10**30) | st.floats() | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=8,
)


@given(JSON)
@example("\ud800")
@example({"a\udfff": [2**64, -(2**63) - 1, 10**400, math.nan, "\x00"]})
def test_what_no_page_can_read_is_sent_as_it_can(value):
    async def packed() -> bytes:
        message = messages.GuiUpdateMessage("uuid", {"value": value})
        return Packer().pack([message, turn("/after")])

    first, second = content(asyncio.run(packed()))["messages"]
    assert second["name"] == "/after"
    _same(first["updates"]["value"], value)


def _same(sent: Any, value: Any) -> None:
    """Texts and numbers have arrived as they are wherever a message can hold them."""
    match value:
        case str():
            assert sent == value.encode("utf-8", "replace").decode()
        case bool() | None:
            assert sent is value
        case int():
            assert sent == value if -(2**63) <= value < 2**64 else math.isinf(sent) and (sent > 0) == (value > 0)
        case float():
            assert sent == value or (math.isnan(sent) and math.isnan(value))
        case list():
            for a, b in zip(sent, value, strict=True):
                _same(a, b)
        case dict():
            assert set(sent) == {key.encode("utf-8", "replace").decode() for key in value}


def test_what_no_page_can_read_is_logged(caplog):
    Packer().pack([messages.GuiUpdateMessage("uuid", {"value": "\ud800"})])
    (line,) = caplog.messages
    assert "surrogates not allowed" in line
