"""viser without a port: its message server, driven by function calls in the service's own event loop.

viser would listen on a TCP port and run an event loop in a thread of its own. Every local user could connect to
that port without a token, and each message would pass through a second websocket. Here viser's server gets the
connections that the service has already accepted and inspected; nothing listens.

`PortlessServer` replaces the part of `viser.infra.WebsockServer` that listens and accepts (its
``_background_worker``). It relies on the private names of viser in `app.viewer.viser_names.SERVER`; `start_viser`
refuses a version that lacks one. A test fails when viser changes the method that is replaced. Upstream offers
no such entry point yet; https://github.com/viser-project/viser/issues is the place to ask for one.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import io
import itertools
import logging
import threading
import warnings
from collections.abc import Callable, Coroutine, Iterator, Sequence
from pathlib import Path
from typing import Any

import viser
from viser import _messages as messages
from viser import infra
from viser.infra import _infra
from viser.infra._async_message_buffer import AsyncMessageBuffer

from app.shared.connection import Connection, ConnectionEnded
from app.viewer import viser_names
from app.viewer.viser_outbox import LoopWaker, Outbox, Packer
from app.viewer.viser_patches import note_heard

log = logging.getLogger(__name__)

PROTOCOL = f"viser-v{viser.__version__}"
IN_A_ROW = 8  # messages of a burst, after which others come
STOP_TIMEOUT = 2.0  # s for all connections to end

_Callbacks = Sequence[Callable[[infra.WebsockClientConnection], Coroutine[Any, Any, None] | None]]


class PortlessServer(infra.WebsockServer):
    """viser's message server without a port and without a thread.

    Args:
        loop: the running event loop of the service.
        options: those of `viser.infra.WebsockServer`; host and port are not used.

    Attributes:
        visitors: who are connected, by client id.
        lets_change: whether a visitor with this client id, who may only look, may change the control with this id.
    """

    def __init__(self, *, loop: asyncio.AbstractEventLoop, **options: Any) -> None:
        super().__init__(**options)
        self._background_event_loop = loop
        self._loop = loop
        self._ids = itertools.count()
        self.visitors: dict[int, Connection] = {}
        self.lets_change: Callable[[int, str], bool] = lambda number, uuid: False
        self._open = 0  # connections
        self.waker, self._packer = LoopWaker(loop), Packer()
        self._stopping: asyncio.Future[None]
        self._all_ended: asyncio.Event

    def start(self) -> None:
        """Prepare for `serve`; call it from another thread than the loop's."""
        asyncio.run_coroutine_threadsafe(self._prepare(), self._loop).result()

    async def _prepare(self) -> None:
        self._broadcast_buffer = AsyncMessageBuffer(self._loop, persistent_messages=True)
        self._stopping = self._loop.create_future()
        self._all_ended = asyncio.Event()
        self._all_ended.set()

    def stop(self) -> None:
        """End all connections; returns when their pages have ended, or after `STOP_TIMEOUT`."""
        self._broadcast_buffer.set_done()
        if self._loop.is_running():  # otherwise there are no connections
            with contextlib.suppress(TimeoutError):
                asyncio.run_coroutine_threadsafe(self._end_all(), self._loop).result(STOP_TIMEOUT)

    async def _end_all(self) -> None:
        if not self._stopping.done():
            self._stopping.set_result(None)
        await self._all_ended.wait()

    async def serve(self, connection: Connection) -> ConnectionEnded:
        """Serve one visitor until the connection ends; returns why."""
        if connection.subprotocol != PROTOCOL:
            return ConnectionEnded(1002, f"the page must speak {PROTOCOL}; reload it")
        self._open += 1
        self._all_ended.clear()
        try:
            return await self._visit(connection)
        finally:
            self._open -= 1
            if self._open == 0:
                self._all_ended.set()

    async def _visit(self, connection: Connection) -> ConnectionEnded:
        number = infra.ClientId(next(self._ids))
        visitor: Any = connection  # viser only calls its `send`
        buffer, sends = self._outgoing(number, visitor)
        client = infra.WebsockClientConnection(number, _infra._ClientHandleState(buffer, self._loop))
        self._client_state_from_id[number] = client._state
        self.visitors[number] = connection
        flows: list[asyncio.Task[Any]] = []
        try:
            await _call(self._client_connect_cb, client)
            flows = [
                self._loop.create_task(flow)
                for flow in (
                    sends(),
                    _infra._message_producer(visitor, self._broadcast_buffer, number, self._backlog_done_message),
                    self._consume(connection, client),
                )
            ]
            await asyncio.wait([*flows, self._stopping], return_when=asyncio.FIRST_COMPLETED)
            return _why(flows)
        finally:
            for flow in flows:
                flow.cancel()
            await asyncio.gather(*flows, return_exceptions=True)
            buffer.set_done()
            self._client_state_from_id.pop(number, None)
            self.visitors.pop(number, None)
            self._broadcast_buffer.generator_cursors.pop(number, None)
            await _call(self._client_disconnect_cb, client)

    def _outgoing(
        self, number: infra.ClientId, visitor: Any
    ) -> tuple[AsyncMessageBuffer, Callable[[], Coroutine[Any, Any, None]]]:
        """The buffer of a visitor's messages, and what sends them until the connection ends."""
        if viser_names.IMPROVEMENTS.is_there:
            outbox = Outbox(number, self.waker, self._packer)
            return outbox, functools.partial(outbox.send_to, visitor)
        buffer = AsyncMessageBuffer(self._loop, persistent_messages=False)
        return buffer, functools.partial(_infra._message_producer, visitor, buffer, number)

    async def _consume(self, connection: Connection, client: infra.WebsockClientConnection) -> None:
        number = infra.ClientId(client.client_id)
        for count in itertools.count(1):
            data = await connection.receive()
            try:
                message = self._message_class.deserialize(data)
            except Exception as error:  # fields are converted without checks
                raise ConnectionEnded(1007, f"not a message of the viewer: {error!r:.80}") from error
            allowed = self._is_allowed(connection, number, message)
            for handler in (self, client):
                if allowed and type(message) in handler._incoming_handlers:
                    await self._handle(handler, number, message)
            if count % IN_A_ROW == 0:
                await asyncio.sleep(0)  # others come between the messages of a burst

    def _is_allowed(self, connection: Connection, number: int, message: infra.Message) -> bool:
        """Whether a message is handled: visitors who may only look may change some controls, not all."""
        if connection.rights.compute or not isinstance(message, messages.GuiUpdateMessage):
            return True
        return self.lets_change(number, message.uuid)

    async def _handle(
        self, handler: infra.WebsockMessageHandler, number: infra.ClientId, message: infra.Message
    ) -> None:
        """At once: as a task of its own, as in viser, a drag would wait for more rounds of the event loop.

        No handler waits for a later message of this connection: callbacks that may wait run in threads, or post to
        the inbox.
        """
        note_heard(message)
        try:
            await handler._handle_incoming_message(number, message)
        except Exception as error:  # noqa: BLE001 - fields are converted without checks
            _note(error)


def _note(error: Exception) -> None:
    log.warning("a message of a visitor could not be handled: %.200r", error)


async def _call(callbacks: _Callbacks, client: infra.WebsockClientConnection) -> None:
    for callback in callbacks:
        result = callback(client)
        if result is not None:
            await result


def _why(flows: Sequence[asyncio.Task[Any]]) -> ConnectionEnded:
    """Why the first of these tasks has ended; if none has failed, the service stops."""
    errors = [error for flow in flows if flow.done() and (error := flow.exception()) is not None]
    for error in errors:
        if isinstance(error, ConnectionEnded):
            return error
    for error in errors:
        log.error("a visitor's connection failed", exc_info=error)
        return ConnectionEnded(1011, "internal error")
    return ConnectionEnded(1001, "the service stops")


def start_viser(loop: asyncio.AbstractEventLoop, label: str) -> tuple[viser.ViserServer, PortlessServer]:
    """viser's server, and what serves its connections in the running event loop `loop`.

    Call it from another thread than the loop's.

    Raises:
        RuntimeError: the installed version of viser cannot be driven in this way.
    """
    if missing := viser_names.SERVER.missing():
        raise RuntimeError(f"viser {viser.__version__} lacks {', '.join(missing)}. {viser_names.SERVER.without}")
    # viser prints its own address, which does not exist.
    with contextlib.redirect_stdout(io.StringIO()), _replaced(functools.partial(PortlessServer, loop=loop)):
        server = viser.ViserServer(host="127.0.0.1", port=0, label=label, verbose=False)
    portless = server._websock_server
    if not isinstance(portless, PortlessServer):
        server.stop()
        raise RuntimeError(f"viser {viser.__version__} listens on a port; install viser==1.1.*")
    # Visitors leave while something is drawn for them or asked of their page.
    warnings.filterwarnings("ignore", r"Queued a \w+ on a closed connection", UserWarning)
    # A visitor could ask viser for a public tunnel to this service.
    for kind in (messages.ShareUrlRequest, messages.ShareUrlDisconnect):
        portless.unregister_handler(kind)
    return server, portless


_replacing = threading.Lock()


@contextlib.contextmanager
def _replaced(make: Callable[..., PortlessServer]) -> Iterator[None]:
    with _replacing:
        original = infra.WebsockServer
        infra.WebsockServer = make  # type: ignore[misc, assignment]
        try:
            yield
        finally:
            infra.WebsockServer = original  # type: ignore[misc]


@functools.cache
def client_page() -> bytes:
    """The HTML of viser's client, one file."""
    return (Path(viser.__file__).parent / "client" / "build" / "index.html").read_bytes()
