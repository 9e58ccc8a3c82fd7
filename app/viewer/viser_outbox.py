"""The messages of one visitor on their way out: one wake-up of the event loop and one frame for each step.

viser wakes the event loop once for each message outside of an atomic block, at the end of each block and for each
flush. A generator, a timer and two tasks then wait for the next message. That cost more than posing the arm. An
`Outbox` keeps viser's buffer, its culling of superseded messages and its format, and replaces how it is read: all
that is pushed within `in_one_frame` leaves in one frame and wakes the loop once. A `LoopWaker` wakes it once for
all visitors who are waiting.

Of two threads that both have something to do, each takes the interpreter from the other with every read and write:
thirty visitors who drag then cost a third more. So a step waits, at its end, until the loop has sent what it made,
and has read what has come meanwhile (`LoopWaker.together`).

It relies on private names of viser, which `app.viewer.viser_names.IMPROVEMENTS` lists; where one is missing,
viser's buffer and its producer take its place. Tests compare the bytes with those of viser's own
`_message_producer`. Upstream offers no way to replace its producer yet;
https://github.com/viser-project/viser/issues is the place to ask for one.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import msgspec
import viser
import zstandard
from viser import _messages as messages
from viser.infra import Message, _infra
from viser.infra._async_message_buffer import AsyncMessageBuffer

from app.shared.connection import Connection
from app.viewer import viser_names

logger = logging.getLogger("kinboard.viewer")
_encode = msgspec.msgpack.Encoder().encode
_PLAIN = frozenset({str, bool, int, float})
PATIENCE = 0.005  # s that a step waits for the loop


class LoopWaker:
    """Calls functions in the thread of an event loop. One wake-up serves all calls that wait."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.loop = loop
        self._waiting: deque[Callable[[], None]] = deque()
        self._woken = False
        self._here = threading.local()  # `held`: whether the calls of this thread are held

    @contextlib.contextmanager
    def together(self) -> Iterator[None]:
        """Wake the loop once, at the end, for what this thread calls within this context.

        This returns when the loop has done it, or after `PATIENCE`; the loop's own thread must not use it.
        """
        self._here.held = True
        try:
            yield
        finally:
            self._here.held = False
            if self._waiting:
                self._wait_for_answer()

    def call(self, act: Callable[[], None]) -> None:
        """Have `act` called. Any thread may ask; nothing happens if the loop is closed."""
        # A call is appended before the flag is read, and the flag is cleared before calls are taken: none is lost.
        self._waiting.append(act)
        if not getattr(self._here, "held", False):
            self._wake()

    def _wait_for_answer(self) -> None:
        done = threading.Lock()
        done.acquire()

        def end() -> None:
            self.loop.call_soon(done.release)  # after the tasks that were woken

        self._waiting.append(end)
        if self._wake():
            done.acquire(timeout=PATIENCE)

    def _wake(self) -> bool:
        """Whether the loop will answer, or has done so: it does not if it is closed, and no visitor is left."""
        if not self._woken:
            self._woken = True
            try:
                self.loop.call_soon_threadsafe(self._answer)
            except RuntimeError:
                self._woken = False  # so that the next step does not wait either
                return False
        return True

    def _answer(self) -> None:
        self._woken = False
        while self._waiting:
            self._waiting.popleft()()


class _Signal:
    """Stands in for an `asyncio.Event` of viser's buffer: to set it is a call."""

    def __init__(self, call: Callable[[], None]) -> None:
        self.set = call


class _Direct:
    """Stands in for the event loop of viser's buffer, whose only use is to set events."""

    @staticmethod
    def call_soon_threadsafe(call: Callable[[], None]) -> None:
        call()


class Outbox(AsyncMessageBuffer):
    """viser's buffer of one connection, read by `send_to` instead of viser's producer.

    As in viser, messages that are not flushed wait for a sixtieth of a second, and a frame has at most
    `max_window_size` of them.

    Args:
        visitor: viser's number of the connection.
    """

    def __init__(self, visitor: int, waker: LoopWaker, packer: Packer) -> None:
        super().__init__(waker.loop, persistent_messages=False)
        # viser sets its events in the pushing thread, and asks the loop to set them: both are calls here.
        self.message_event: Any = _Signal(self._pushed)
        self.flush_event: Any = _Signal(self._flushed)
        self.event_loop: Any = _Direct()
        self._visitor = visitor
        self.waker = waker
        self._packer = packer
        self._holding = threading.Lock()
        self._holds = 0
        self._asked: Callable[[], None] | None = None  # while it is held: what to call at the end
        self._waiter: asyncio.Future[None] | None = None
        self._timer: asyncio.TimerHandle | None = None

    # Any thread

    def push(self, message: Message) -> None:
        """Put a message into the buffer; a control that no page has heard of yet is forgotten when it is removed.

        viser sends such a removal, and the page warns that it does not know the control.
        """
        if type(message) is messages.GuiRemoveMessage and self._forget(message):
            return
        super().push(message)

    def _forget(self, removal: messages.GuiRemoveMessage) -> bool:
        """Drop what waits for a control, if it is not made yet: each is made once, with its uuid."""
        with self.buffer_lock:
            number = self.id_from_redundancy_key.get(removal.redundancy_key())
            if number is None or self.message_from_id[number].lifecycle_phase != "create":
                return False
            for waiting in (number, *self.ids_from_entity_state_key.get(("gui", removal.uuid), ())):
                self.pop_message_locked(waiting)
        return True

    def _pushed(self) -> None:
        if self.done or (self.message_from_id and not self.atomic_counter):
            self._ask(self._send_soon)

    def _flushed(self) -> None:
        if self.done or self.message_from_id:
            self._ask(self._send)

    def _ask(self, call: Callable[[], None]) -> None:
        with self._holding:
            if self._holds and not self.done:
                if self._asked != self._send:
                    self._asked = call
                return
        self.waker.call(call)

    @contextlib.contextmanager
    def hold(self) -> Iterator[None]:
        """Wake the loop for all that is pushed and flushed within this context once, at its end."""
        with self._holding:
            self._holds += 1
        try:
            yield
        finally:
            with self._holding:
                self._holds -= 1
                call, self._asked = (None, self._asked) if self._holds else (self._asked, None)
            if call is not None:
                self.waker.call(call)

    # The event loop's thread

    def _send(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._waiter is None or self._waiter.done():
            return
        self._waiter.set_result(None)

    def _send_soon(self) -> None:
        if self.done:
            self._send()
        elif self._timer is None:
            self._timer = self.waker.loop.call_later(self.window_duration_sec, self._send)

    async def send_to(self, connection: Connection) -> None:
        """Send what is pushed, until the buffer is done or the connection ends; raises `ConnectionEnded`."""
        try:
            while not self.done:
                if window := self._take():
                    await connection.send(self._packer.pack(window))
                else:
                    self._waiter = self.waker.loop.create_future()
                    await self._waiter
        finally:
            if self._timer is not None:
                self._timer.cancel()

    def _take(self) -> list[Message]:
        """The oldest messages, removed from the buffer; none within an atomic block."""
        window: list[Message] = []
        if self.atomic_counter:
            return window
        with self.buffer_lock:
            for number in list(itertools.islice(self.message_from_id, self.max_window_size)):
                message = self.pop_message_locked(number)
                if message is not None and message.excluded_self_client != self._visitor:
                    window.append(message)
        return window


class Packer:
    """Messages as bytes on the wire, as viser's producer makes them. Only the event loop's thread uses it."""

    def __init__(self) -> None:
        self._compress = zstandard.ZstdCompressor(level=1).compress  # half a megabyte of memory

    def pack(self, window: Sequence[Message]) -> bytes:
        """One frame; viser's `_message_producer` describes its layout."""
        binary: list[memoryview] = []
        whole = {
            "messages": [fields_of(message, binary) for message in window],
            "timestampSec": time.perf_counter(),
            "binaryBufferLengths": [buffer.nbytes for buffer in binary],
        }
        try:
            inner = _encode(whole)
        except (ValueError, OverflowError, TypeError) as error:
            logger.warning("a message for a page cannot be sent as it is: %s", error)
            inner = _encode(whole | {"messages": _encodable(whole["messages"])})
        packed = self._compress(inner)
        parts: list[bytes | memoryview] = [
            len(inner).to_bytes(8, "little"),
            len(packed).to_bytes(8, "little"),
            packed,
        ]
        _infra._append_aligned_buffers(parts, binary, 16 + len(packed))
        return b"".join(parts)


def _encodable(value: Any) -> Any:
    """A value as the page can read it: U+FFFD for half a letter, infinity for a number of more than 64 bits.

    `app.viewer.panel.script.read_json` refuses half letters in links and from pages. This is for what comes in
    another way: a page whose first message cannot be sent would connect again and again.
    """
    match value:
        case str():
            return value.encode("utf-8", "replace").decode()
        case int() if not -(1 << 63) <= value < 1 << 64:
            return math.inf if value > 0 else -math.inf
        case dict():
            return {_encodable(key): _encodable(item) for key, item in value.items()}
        case list() | tuple():
            return [_encodable(item) for item in value]
    return value


def fields_of(message: Message, binary: list[memoryview]) -> dict[str, Any]:
    """A message as viser's `as_serializable_dict` has it; what most of a drag consists of without its type checks.

    These are poses, which `app.viewer.viser_patches.assign` makes of Python's own numbers, and updates with values
    of Python's own types.
    """
    if type(message) is messages.SetOrientationMessage:
        name, owner = message.name, message.owner
        return {"name": name, "wxyz": message.wxyz, "owner": owner, "type": "SetOrientationMessage"}
    if type(message) is messages.SetPositionMessage:
        name, owner = message.name, message.owner
        return {"name": name, "position": message.position, "owner": owner, "type": "SetPositionMessage"}
    if type(message) is messages.GuiUpdateMessage and _plain(message.updates):
        return {"uuid": message.uuid, "updates": message.updates, "type": "GuiUpdateMessage"}
    if type(message) is messages.SceneNodeUpdateMessage and _plain(message.updates):
        name, owner = message.name, message.owner
        return {"name": name, "updates": message.updates, "owner": owner, "type": "SceneNodeUpdateMessage"}
    return message.as_serializable_dict(binary)


def _plain(updates: dict[str, Any]) -> bool:
    """Whether viser would send these values as they are."""
    return all(type(value) in _PLAIN for value in updates.values())


@contextlib.contextmanager
def in_one_frame(client: viser.ClientHandle) -> Iterator[None]:
    """Send all that is pushed and flushed for a visitor within this context together, at its end."""
    buffer = client._websock_connection.get_message_buffer() if viser_names.IMPROVEMENTS.is_there else None
    if isinstance(buffer, Outbox):
        with buffer.waker.together(), buffer.hold():
            yield
    else:  # viser's own buffer
        yield
