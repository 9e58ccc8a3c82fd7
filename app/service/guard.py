"""Connections of the service: how many there may be, how long they may wait, and what the log says about it.

uvicorn accepts any number of connections and waits without end for their requests and for clients that read
nothing. :mod:`app.service.http_protocol` reports each connection here. From then on it is looked at once a second,
also when it has become a websocket: what the system has not yet taken of an answer waits in our memory, and must
shrink in time.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import uvicorn

from app.service.log import KIND
from app.shared.clients import Proxies, network_of, share_of
from app.shared.metrics import CONNECTIONS, REFUSED
from app.shared.settings import Settings

logger = logging.getLogger("kinboard.connections")

SPARE_FILES = 16  # left for robot files, kernels and accepting connections to refuse them
TICK = 1.0  # seconds between two looks at the connections


@dataclass
class _Open:
    host: str
    check: Callable[[float], None]
    since: float  # when its client last took something of what waits for it
    waiting: int = 0  # bytes


class Guard:
    """Counts connections, refuses those beyond the limits, and looks at them regularly.

    Args:
        settings: the limits.
        files: how many files this process may have open; None: not limited.
    """

    def __init__(self, settings: Settings, files: int | None = None) -> None:
        self.receive_timeout = settings.receive_timeout
        self.send_timeout = settings.send_timeout
        self._most = settings.max_connections
        self._most_of_one = share_of(settings.max_connections, settings.client_share)
        self._files = files
        self._proxies = Proxies(settings.trusted_proxies)
        self._clients: Counter[str] = Counter()
        self._open: dict[asyncio.Transport, _Open] = {}
        self._timer: asyncio.TimerHandle | None = None
        if files is not None and files - SPARE_FILES < settings.max_connections:
            logger.warning(
                "this process may have only %d files open (ulimit -n), too few for %d connections "
                "(KINBOARD_MAX_CONNECTIONS)",
                files,
                settings.max_connections,
            )

    def accept(self, transport: asyncio.Transport, check: Callable[[float], None]) -> str | None:
        """Count a new connection, or say why it must be refused.

        Args:
            transport: of the connection.
            check: called regularly with the time of the event loop.
        """
        connection: socket.socket = transport.get_extra_info("socket")
        host = (transport.get_extra_info("peername") or ("unknown",))[0]
        if reason := self.refusal(host, connection.fileno()):
            return reason
        # Otherwise the body of a small answer waits for the client to acknowledge its head: 40 ms.
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._open[transport] = _Open(host, check, asyncio.get_running_loop().time())
        self._clients[network_of(host)] += 1
        CONNECTIONS.inc()
        if self._timer is None:
            self._schedule()
        return None

    def refusal(self, host: str, file: int) -> str | None:
        """Why a new connection is not accepted; None if it is.

        Args:
            host: address of the client.
            file: number of the connection's file: the lowest that was free, so it tells how many are open.
        """
        client = network_of(host)
        if self._files is not None and file >= self._files - SPARE_FILES:
            why = "too many open files"
            line = f"only {self._files} files may be open (ulimit -n); new connections are refused"
        elif len(self._open) >= self._most:
            why = "full"
            line = f"{self._most} connections are open (KINBOARD_MAX_CONNECTIONS); new ones are refused"
        elif self._clients[client] >= self._most_of_one and host not in self._proxies:
            why = "client"
            line = (
                f"{client} has {self._most_of_one} connections open, the share of one client "
                "(KINBOARD_CLIENT_SHARE); its new ones are refused"
            )
        else:
            return None
        self.note(why, line)
        return line.partition(";")[0]

    def forget(self, transport: asyncio.Transport) -> None:
        """A connection is closed; nothing happens if it was refused."""
        if (known := self._open.pop(transport, None)) is not None:
            client = network_of(known.host)
            self._clients[client] -= 1
            if self._clients[client] <= 0:
                del self._clients[client]
            CONNECTIONS.dec()

    def note(self, why: str, line: str) -> None:
        """Count a refusal and log it."""
        REFUSED.labels(why).inc()
        logger.warning("%s", line, extra={KIND: why})

    def _schedule(self) -> None:
        tick = min(TICK, self.receive_timeout / 4, self.send_timeout / 16)
        self._timer = asyncio.get_running_loop().call_later(tick, self._look)

    def _look(self) -> None:
        now = asyncio.get_running_loop().time()
        for transport, known in tuple(self._open.items()):
            waiting = transport.get_write_buffer_size()
            if not waiting or waiting < known.waiting:
                known.since = now
            known.waiting = waiting
            if now - known.since > self.send_timeout:
                self.note(
                    "unread",
                    f"{known.host} read nothing of what it was sent for {self.send_timeout:g} s "
                    "(KINBOARD_SEND_TIMEOUT); the connection is closed",
                )
                transport.abort()
            elif not waiting and transport.is_closing():  # it was a websocket
                self.forget(transport)
            else:
                known.check(now)
        self._timer = None
        if self._open:
            self._schedule()


class GuardedConfig(uvicorn.Config):
    """uvicorn's configuration, and the guard of its connections."""

    guard: Guard
