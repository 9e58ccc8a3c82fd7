"""The uvicorn server: its configuration, its sockets, and the greeting on standard output."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import faulthandler
import ipaddress
import logging
import os
import signal
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable
from types import FrameType
from typing import Any

import uvicorn
from fastapi import FastAPI

from app.service import uvicorn_names
from app.service.guard import Guard, GuardedConfig
from app.service.restarts import end_after, is_orphan
from app.service.web.inspection import MAX_MESSAGE
from app.service.web.prefix import clean_prefix
from app.shared.settings import Settings
from app.shared.threads import end_process
from kin import __version__

if sys.platform != "win32":
    import resource

logger = logging.getLogger("kinboard.server")

QUEUE = 2048  # connections that may wait to be accepted
# Connections accepted in one round of the event loop (asyncio takes uvicorn's backlog for it). Each holds a file
# for two more rounds, even if it is refused, so this must be a quarter of `guard.SPARE_FILES`.
ACCEPTED = 4
STOP_TIMEOUT = 3.0  # s for the end of the service itself, after requests have ended
PING_INTERVAL = 20.0  # seconds between two pings of a websocket
# For an answer to one, in times of `send_timeout`: it may wait behind a large scene on a slow line.
PING_PATIENCE = 3.0


def server_config(app: FastAPI, settings: Settings, files: int | None = None) -> GuardedConfig:
    """Configuration of uvicorn: websockets that are fast, and bounds on what clients can make it hold.

    Args:
        files: how many files this process may have open; None: not limited.
    """
    http, ws = protocols()
    config = GuardedConfig(
        app,
        lifespan="on",
        backlog=ACCEPTED,
        loop="asyncio",  # uvloop is no faster here
        log_level="warning",
        log_config=None,  # see `app.service.log`
        access_log=False,
        server_header=False,
        http=http,
        ws=ws,
        # Compressing a 12 MB point cloud would take half a second; viser compresses what is worth it.
        ws_per_message_deflate=False,
        ws_max_size=MAX_MESSAGE + 1024,
        ws_ping_interval=min(PING_INTERVAL, settings.send_timeout / 3),
        ws_ping_timeout=PING_PATIENCE * settings.send_timeout,
        timeout_graceful_shutdown=max(1, round(settings.drain)),
        proxy_headers=bool(settings.trusted_proxies),
        forwarded_allow_ips=list(settings.trusted_proxies),
    )
    config.guard = Guard(settings, files)
    return config


def protocols() -> tuple[Any, Any]:
    """What speaks HTTP and websockets: ours, or uvicorn's own where it lacks what ours are made of."""
    if not uvicorn_names.PROTOCOLS.is_there:
        return "auto", "auto"
    from app.service.http_protocol import HttpProtocol
    from app.service.websocket_protocol import WebSocketProtocol

    return HttpProtocol, WebSocketProtocol


class Server(uvicorn.Server):
    """Says when it accepts connections, and that its loop turns; on shutdown ends requests that would be cut off.

    Args:
        on_start: called once it accepts connections.
        alone: whether no other process would start it again.
    """

    def __init__(
        self, app: FastAPI, settings: Settings, on_start: Callable[[], None] = lambda: None, alone: bool = True
    ) -> None:
        config = server_config(app, settings, open_files())
        super().__init__(config)
        self._note = config.guard.note
        self._end_work = app.state.compute.close
        self._drain = settings.drain
        self._on_start = on_start
        self._alone, self._silence = alone, settings.worker_timeout
        self._deadline: threading.Timer | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        asyncio.get_running_loop().set_exception_handler(self._on_loop_error)
        await super().startup(sockets=sockets)
        for listener in sockets or ():
            listener.listen(QUEUE)  # asyncio has just made the queue as short as `ACCEPTED`
        if self.started:
            self._on_start()

    def _on_loop_error(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """One line instead of a traceback where the loop accepts more connections at once than there are files."""
        error = context.get("exception")
        if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
            self._note("no file", "no file is free for a new connection (ulimit -n); it waits for a second")
        else:
            loop.default_exception_handler(context)

    async def on_tick(self, counter: int) -> bool:
        """Called ten times a second."""
        if not self._alone and counter % 10 == 0:
            end_after(self._silence)
            if is_orphan():
                os.kill(os.getpid(), signal.SIGTERM)
        return await super().on_tick(counter)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Stop, at most `STOP_TIMEOUT` after running requests have had their time."""
        super().handle_exit(sig, frame)
        if self._deadline is None:
            self._deadline = threading.Timer(self._drain + STOP_TIMEOUT, self._give_up)
            self._deadline.daemon = True
            self._deadline.start()

    def _give_up(self) -> None:
        logger.error("the service did not stop within %s s of the signal and ends now", self._drain + STOP_TIMEOUT)
        end_process(0)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        asyncio.get_running_loop().call_later(self._drain - min(1.0, 0.5 * self._drain), self._end_work)
        if not self._alone:
            faulthandler.cancel_dump_traceback_later()
        await super().shutdown(sockets=sockets)


class Greeting:
    """Prints the address, and that for other machines if there is one; opens a page in the browser if requested.

    Args:
        page: its path below the address.
        words: printed after the address; ``{url}`` in them stands for it.
    """

    def __init__(
        self, url: str, open_browser: bool, others: str | None = None, page: str = "", words: str = ""
    ) -> None:
        self._url = url
        self._others = others
        self._open_browser = open_browser
        self._page, self._words = url + page, words.replace("{url}", url)
        self._out = sys.stdout  # now, because starting viser redirects sys.stdout for a moment in another thread

    def show(self) -> None:
        print(f"Kinboard {__version__} is at {self._url}  (Ctrl-C to stop)", file=self._out, flush=True)
        if self._others is not None:
            print(f"Other machines on this network open {self._others}", file=self._out, flush=True)
        if self._words:
            print(self._words, file=self._out, flush=True)
        if self._open_browser:
            # A browser in a terminal returns only when it is closed.
            threading.Thread(target=self._open, name="kinboard-browser", daemon=True).start()

    def _open(self) -> None:
        if not webbrowser.open(self._page):
            print(f"No browser could be opened; open {self._page} yourself.", file=self._out, flush=True)


def listen(settings: Settings) -> socket.socket:
    """The listening socket; raises `OSError` if the address is in use."""
    family, *_, address = socket.getaddrinfo(
        settings.host or None, settings.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    dual = family == socket.AF_INET6 and address[0] == "::" and socket.has_dualstack_ipv6()
    return socket.create_server(address[:2], family=family, backlog=QUEUE, dualstack_ipv6=dual)


def open_files() -> int | None:
    """How many files this process may have open, after raising the limit as far as allowed; None: not limited."""
    if sys.platform == "win32":
        return None
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != hard:
        with contextlib.suppress(ValueError, OSError):  # more than the system can do
            resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
            soft = hard
    return None if soft == resource.RLIM_INFINITY else soft


def is_loopback(listener: socket.socket) -> bool:
    """Whether only this machine can connect."""
    return ipaddress.ip_address(listener.getsockname()[0].partition("%")[0]).is_loopback


def url_of(settings: Settings, port: int) -> str:
    """A URL that works on this machine, also when the service listens on all addresses."""
    host = "localhost" if settings.host in ("", "0.0.0.0", "::") else settings.host
    return f"http://{f'[{host}]' if ':' in host else host}:{port}{clean_prefix(settings.root_path)}/"
