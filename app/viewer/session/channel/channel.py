"""The channel of a page: one websocket between its own scripts and its session, beside viser's connection.

viser reports changes of its own controls only. Keys, typed targets and the buttons of our own HTML come by the
channel, as texts of JSON (``static/channel.js``). The page opens it when it has read its name in hidden HTML. The
name cannot be guessed, so it proves which session a connection belongs to; it stands in no address, because
proxies log these.

The page sends ``[number, name, argument]``, first of all ``hello`` with what it remembers, or ``["heard", k]`` for
the notices that have arrived, up to the k-th, or ``["ask"]`` for a sign of life. The session sends ``{"heard": n,
"done": n, "set": {key: value}, "notices": [[k, name, value]]}``: the number of the last message that has come, and
of the last that the values follow; the newest value of each key, null for none, which may skip older ones; and
notices, each once and in order. What was lost with a connection is sent again over the next one, and counts once.
At least every `BEAT` seconds there is a text, which the page answers: so each side notices a line that is dead.

A message whose order with viser's own controls matters, such as *Undo* after a slider was moved, is sent as
``[number, name, argument, true]``, and a mark with its number goes the way of these controls, in viser's
connection. It takes effect when the mark has come. What was sent later, by either connection, waits for both.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import secrets
import threading
import time
from collections import deque
from collections.abc import Callable, Hashable, Iterator
from concurrent.futures import Future
from typing import Final

from app.shared.connection import ConnectionEnded, PageConnection
from app.shared.metrics import DROPPED
from app.shared.security import HELLO, Rights
from app.viewer.panel import Post
from app.viewer.panel.script import MAX_NUMBER, Reply, read_page_json
from app.viewer.session.events import MESSAGES

log = logging.getLogger(__name__)

BEAT: Final = 2.0  # s
WAITING: Final = 200  # messages that wait for a mark
KEPT: Final = 500  # notices that a page has not confirmed; the oldest are dropped
REPLACED: Final = 4000  # code of a connection that a newer one of the same page replaces
MAY_LOOK: Final = "You may look here, and change nothing."

Call = Callable[[Callable[[], None]], None]  # calls a function in the event loop


class Channel:
    """The channel of one session. `show`, `notify`, `reply`, `close` and `silence` are thread-safe.

    Args:
        post: takes ``("message", name, number)`` with the argument of each message.
        rights: of the page.
        marks: whether marks can be heard.

    Attributes:
        name: what a connection has to know.
    """

    def __init__(self, post: Post, rights: Rights = Rights.FULL, marks: bool = True) -> None:
        self.name = secrets.token_urlsafe(16)
        self._post, self._rights = post, rights
        self._received = 0  # the last number
        self._marked = 0 if marks else MAX_NUMBER  # the last mark
        self._news = asyncio.Event()  # is set for a moment when a message has come, or the connection has ended
        self._waiting: deque[tuple[int, str, object, bool]] = deque()  # and whether it is marked
        self._heard_at = time.monotonic()
        self._lock = threading.Lock()
        self._values: dict[str, str] = {}  # in JSON, by key
        self._held: set[str] | None = None  # keys that have changed within `step`
        self._due = False  # whether something is to be sent at its end
        self._done = 0  # see `step`
        self._notices: deque[tuple[int, str]] = deque(maxlen=KEPT)  # in JSON, with their numbers
        self._count = 0  # of notices
        self._line: _Line | None = None
        self._closed = False
        self._hello: Future[object] = Future()

    def hello(self, timeout: float) -> object:
        """What the page remembers, a value of JSON; waits. Raises `TimeoutError`, `CancelledError` if it ends."""
        return self._hello.result(timeout)

    def show(self, key: str, value: object) -> None:
        """The value of a key from now on; raises `ValueError` for one that JSON cannot hold, such as NaN."""
        text = json.dumps(value, allow_nan=False)
        with self._lock:
            if self._values.get(key) == text:
                return
            self._values[key] = text
            self._note(key)
        self._wake()

    def forget(self, key: str) -> None:
        """The key has no value any more."""
        with self._lock:
            if self._values.pop(key, None) is not None:
                self._note(key)
        self._wake()

    def _note(self, key: str) -> None:
        if self._held is not None:
            self._held.add(key)
        elif self._line is not None:
            self._line.changed.add(key)

    @contextlib.contextmanager
    def step(self, done: int) -> Iterator[None]:
        """Have the values that are shown within this context sent together.

        Args:
            done: the number of the last message that they follow; 0: of the step before.
        """
        with self._lock:
            self._held = set()
        try:
            yield
        finally:
            with self._lock:
                held, self._held = self._held or set(), None
                self._done = max(self._done, done)
                if self._line is not None:
                    self._line.changed |= held
                due, self._due = self._due or bool(done), False
            if due:
                self._wake()

    def notify(self, name: str, value: object) -> None:
        """Have the page do something once; raises `ValueError` as `show`."""
        text = json.dumps([name, value], allow_nan=False)
        with self._lock:
            self._count += 1
            self._notices.append((self._count, f"[{self._count}, {text[1:]}"))
        self._wake()

    def reply(self, reply: Reply) -> None:
        """Answer a message that the page waits for."""
        self.notify("reply", reply)

    def close(self) -> None:
        """The session has ended."""
        self._closed = True
        self._hello.cancel()
        self._wake()

    def silence(self) -> float:
        """For how many seconds nothing has come from the page."""
        return time.monotonic() - self._heard_at

    def _wake(self) -> None:
        with self._lock:
            held, line = self._held is not None, self._line
            self._due = self._due or held
        if line is not None and not held:
            line.wake()

    # The event loop

    async def serve(self, connection: PageConnection, call: Call) -> ConnectionEnded:
        """Serve a connection of the page until it ends or a newer one takes its place; returns why.

        Args:
            call: calls a function in the event loop, soon; any thread may use it.
        """
        line = _Line(call)
        with self._lock:
            line.changed.update(self._values)
            before, self._line = self._line, line
        if before is not None:
            before.end_with(ConnectionEnded(REPLACED, "another connection of this page took its place"))
        flows = [asyncio.create_task(flow(line, connection)) for flow in (self._speak, self._hear)]
        for flow in flows:
            flow.add_done_callback(line.note_end)
        try:
            return await line.ended
        finally:
            for flow in flows:
                flow.cancel()
            await asyncio.gather(*flows, return_exceptions=True)
            with self._lock:
                if self._line is line:
                    self._line = None
            self._tell()

    async def _speak(self, line: _Line, connection: PageConnection) -> None:
        while not self._closed:
            await connection.send(self._text(line))
            try:
                async with asyncio.timeout(BEAT):
                    await line.woken.wait()
            except TimeoutError:
                pass  # a beat
            line.woken.clear()
        raise ConnectionEnded(1001, "the page has ended")

    def _text(self, line: _Line) -> str:
        """What the page has not been sent over this line."""
        with self._lock:
            known = ((key, self._values.get(key, "null")) for key in sorted(line.changed))
            values = ", ".join(f"{json.dumps(key)}: {value}" for key, value in known)
            notices = ", ".join(text for number, text in self._notices if number > line.sent)
            line.changed.clear()
            line.sent = self._count
            news, line.done = self._done > line.done, self._done
        parts = [f'"heard": {self._received}']
        parts += [f'"done": {line.done}'] if news else []
        parts += [f'"set": {{{values}}}'] if values else []
        parts += [f'"notices": [{notices}]'] if notices else []
        return "{" + ", ".join(parts) + "}"

    async def _hear(self, line: _Line, connection: PageConnection) -> None:
        while True:
            text = await connection.receive()
            self._heard_at = time.monotonic()
            try:
                message = read_page_json(text, finite=True)
            except ValueError:
                raise ConnectionEnded(1007, "not a message of the page") from None
            match message:
                case ["heard", int(number)]:
                    self._confirm(number)
                case ["ask"]:
                    line.woken.set()
                case [int(number), str(name), argument, *marked] if marked in ([], [True]) and _is_number(number):
                    self._take((number, name, argument, bool(marked)), connection.rights)
                case _:
                    raise ConnectionEnded(1007, "not a message of the page")

    def _confirm(self, number: int) -> None:
        with self._lock:
            while self._notices and self._notices[0][0] <= number:
                self._notices.popleft()

    def _take(self, message: tuple[int, str, object, bool], rights: Rights) -> None:
        number, name, *_ = message
        if number <= self._received:
            return  # it has come over an earlier connection
        if name not in (HELLO, *MESSAGES):
            raise ConnectionEnded(1008, "the page has no message of this name")
        if not (rights.allow_message(name) and self._rights.allow_message(name)):
            DROPPED.labels("refused").inc()
            self.reply(Reply(number, MAY_LOOK))
        elif len(self._waiting) == WAITING:
            raise ConnectionEnded(1008, f"more than {WAITING} messages wait for a mark")
        else:
            self._waiting.append(message)
            self._go_on()
        self._received = number
        self._tell()

    async def mark(self, number: int) -> None:
        """What the page has sent by viser's connection before its message of this number has come.

        Returns when the message has come too, or the channel has no connection: nothing that was sent later by
        viser's connection must be heard before that.
        """
        self._marked = max(self._marked, number)
        self._go_on()
        while self._received < number and self._line is not None:
            await self._news.wait()

    def _tell(self) -> None:
        self._news.set()
        self._news.clear()

    def _go_on(self) -> None:
        while self._waiting and (not self._waiting[0][3] or self._waiting[0][0] <= self._marked):
            self._deliver(*self._waiting.popleft()[:3])

    def _deliver(self, number: int, name: str, argument: object) -> None:
        if name == HELLO:
            if not self._hello.done():
                self._hello.set_result(argument)
            return
        key: Hashable = ("message", name, number)
        self._post(key, argument)


def _is_number(number: object) -> bool:
    """Whether it can be that of a message; JSON's true is none."""
    return type(number) is int and 0 < number < MAX_NUMBER


class _Line:
    """One connection of a channel.

    Attributes:
        changed: keys whose values the page has not been sent over it.
        sent: the last notice that was.
        done: the number in the last text.
        woken: something is to be sent.
        ended: why it has ended.
    """

    def __init__(self, call: Call) -> None:
        self.changed: set[str] = set()
        self.sent = self.done = 0
        self.woken = asyncio.Event()
        self.ended: asyncio.Future[ConnectionEnded] = asyncio.get_running_loop().create_future()
        self._call = call

    def wake(self) -> None:
        """Have what is new sent. Any thread may call it."""
        self._call(self.woken.set)

    def end_with(self, end: ConnectionEnded) -> None:
        """End it, unless it has ended."""
        if not self.ended.done():
            self.ended.set_result(end)

    def note_end(self, flow: asyncio.Task[None]) -> None:
        """One of its two directions has ended."""
        if flow.cancelled():
            return
        error = flow.exception()
        if not isinstance(error, ConnectionEnded):
            log.error("a page's channel failed", exc_info=error)
            error = ConnectionEnded(1011, "internal error")
        self.end_with(error)
