"""Connections of one process: how many there may be, how long they may wait, and what the log says about it.

uvicorn accepts any number of connections and waits without end for their requests and for clients that read
nothing. The protocols in :mod:`app.service.http_protocol` and :mod:`app.service.websocket_protocol` report here,
and are asked once a second whether they have waited too long.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from typing import Protocol

from app.service.log import KIND
from app.shared.clients import Proxies, network_of, share_of
from app.shared.metrics import CONNECTIONS, REFUSED
from app.shared.settings import Settings

logger = logging.getLogger("kinboard.connections")

SPARE_FILES = 16  # left for robot files, kernels and accepting connections to refuse them
TICK = 1.0  # seconds between two checks of the connections


class Watched(Protocol):
    """A connection that is asked whether it has waited too long."""

    def check(self, now: float) -> None:
        """Close the connection if its client has not sent, or not read, for too long."""


class Guard:
    """Counts connections, refuses those beyond the limits, and checks them regularly.

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
        self._watched: set[Watched] = set()
        self._timer: asyncio.TimerHandle | None = None
        if files is not None and files - SPARE_FILES < settings.max_connections:
            logger.warning(
                "this process may have only %d files open (ulimit -n), too few for %d connections "
                "(KINBOARD_MAX_CONNECTIONS)",
                files,
                settings.max_connections,
            )

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
        elif len(self._watched) >= self._most:
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

    def add(self, connection: Watched, host: str) -> None:
        """Count a connection and check it from now on."""
        self._watched.add(connection)
        self._clients[network_of(host)] += 1
        CONNECTIONS.inc()
        if self._timer is None:
            self._schedule()

    def remove(self, connection: Watched, host: str) -> None:
        """Forget a connection that is closed."""
        self._watched.discard(connection)
        client = network_of(host)
        self._clients[client] -= 1
        if self._clients[client] <= 0:
            del self._clients[client]
        CONNECTIONS.dec()

    def note(self, why: str, line: str, error: Exception | None = None) -> None:
        """Count a refusal and log it."""
        REFUSED.labels(why).inc()
        logger.warning("%s", line, exc_info=error, extra={KIND: why})

    def _schedule(self) -> None:
        tick = min(TICK, 0.25 * self.receive_timeout, 0.25 * self.send_timeout)
        self._timer = asyncio.get_running_loop().call_later(tick, self._check)

    def _check(self) -> None:
        now = asyncio.get_running_loop().time()
        for connection in tuple(self._watched):
            connection.check(now)
        if self._watched:
            self._schedule()
        else:
            self._timer = None


class Outflow:
    """Whether a client still takes what it is sent.

    What the system has not yet taken of an answer waits in our memory. It must shrink within `seconds`.
    """

    def __init__(self, transport: asyncio.Transport, seconds: float) -> None:
        self._transport = transport
        self._seconds = seconds
        self._waiting = 0
        self._since: float | None = None
        self.flowed = False  # set when the transport asks for more

    def stuck(self, now: float) -> bool:
        """Whether nothing has flowed for too long."""
        waiting = self._transport.get_write_buffer_size()
        if not waiting or waiting < self._waiting or self.flowed or self._since is None:
            self._since = now
        self._waiting = waiting
        self.flowed = False
        return now - self._since > self._seconds
