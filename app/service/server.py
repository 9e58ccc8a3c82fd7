"""The uvicorn server: its configuration, its sockets, and the greeting on standard output."""

from __future__ import annotations

import asyncio
import ipaddress
import socket
import sys
import threading
import webbrowser

import uvicorn
from fastapi import FastAPI

from app.service.web.inspection import MAX_MESSAGE
from app.service.web.prefix import clean_prefix
from app.shared.settings import Settings
from kin import __version__


def server_config(app: FastAPI, drain: float = 5.0) -> uvicorn.Config:
    """Configuration of uvicorn that makes the viewer's websockets fast and robust.

    Args:
        drain: seconds that running requests may take after SIGTERM.
    """
    return uvicorn.Config(
        app,
        lifespan="on",
        log_level="warning",
        access_log=False,
        server_header=False,
        ws="websockets-sansio",
        # Compressing a 12 MB point cloud would take half a second; viser compresses what is worth it.
        ws_per_message_deflate=False,
        ws_max_size=MAX_MESSAGE + 1024,
        ws_ping_interval=20.0,
        # On a slow line a large scene may take this long before a ping is answered.
        ws_ping_timeout=120.0,
        timeout_graceful_shutdown=max(1, round(drain)),
    )


class Server(uvicorn.Server):
    """Prints the greeting once it accepts connections; on shutdown ends requests that would be cut off."""

    def __init__(self, app: FastAPI, drain: float, greeting: Greeting | None) -> None:
        super().__init__(server_config(app, drain))
        self._end_work = app.state.compute.close
        self._drain = drain
        self._greeting = greeting

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets=sockets)
        if self._greeting is not None:
            self._greeting.show()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        asyncio.get_running_loop().call_later(self._drain - min(1.0, 0.5 * self._drain), self._end_work)
        await super().shutdown(sockets=sockets)


class Greeting:
    """Prints the address, and opens it in the browser if requested."""

    def __init__(self, url: str, open_browser: bool) -> None:
        self._url = url
        self._open_browser = open_browser
        self._out = sys.stdout  # now, because starting viser redirects sys.stdout for a moment in another thread

    def show(self) -> None:
        print(f"Kinboard {__version__} is at {self._url}  (Ctrl-C to stop)", file=self._out, flush=True)
        if self._open_browser:
            # A browser in a terminal returns only when it is closed.
            threading.Thread(target=self._open, name="kinboard-browser", daemon=True).start()

    def _open(self) -> None:
        if not webbrowser.open(self._url):
            print("No browser could be opened; open the address yourself.", file=self._out, flush=True)


def listen(settings: Settings) -> list[socket.socket]:
    """One socket per worker, all on one address; raises `OSError` if the address is in use."""
    family, *_, address = socket.getaddrinfo(
        settings.host or None, settings.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    dual = family == socket.AF_INET6 and address[0] == "::" and socket.has_dualstack_ipv6()

    def bind(port: object, shared: bool) -> socket.socket:
        return socket.create_server(
            (address[0], port), family=family, backlog=2048, dualstack_ipv6=dual, reuse_port=shared
        )

    alone = bind(address[1], False)
    if settings.workers == 1:
        return [alone]
    # Sockets with SO_REUSEPORT would share the port with any other service of this user. Binding without it first
    # has shown that the port is free.
    port = alone.getsockname()[1]
    alone.close()
    return [bind(port, True) for _ in range(settings.workers)]


def is_loopback(listener: socket.socket) -> bool:
    """Whether only this machine can connect."""
    return ipaddress.ip_address(listener.getsockname()[0].partition("%")[0]).is_loopback


def url_of(settings: Settings, port: int) -> str:
    """A URL that works on this machine, also when the service listens on all addresses."""
    host = "localhost" if settings.host in ("", "0.0.0.0", "::") else settings.host
    return f"http://{f'[{host}]' if ':' in host else host}:{port}{clean_prefix(settings.root_path)}/"
