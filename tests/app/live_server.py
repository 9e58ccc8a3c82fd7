"""Serve an app on a real port during a test, with uvicorn configured as in production."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
import urllib.error
import urllib.request
from collections.abc import AsyncIterator, Iterable, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager

import uvicorn
from fastapi import FastAPI
from starlette.routing import BaseRoute
from starlette.types import ASGIApp, Receive, Scope, Send

from app.service.server import server_config
from app.service.web.access import Access
from app.service.web.viewer_proxy import ViewerBridge
from app.shared.settings import Settings
from app.viewer.server import ViewerServer

# For `python -c`, before a program that shall end by Ctrl+C: what a shell starts in the background ignores it, and
# so do its children.
LISTENING = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"


@contextmanager
def serve(app: ASGIApp, settings: Settings | None = None) -> Iterator[int]:
    """Yields the port that `app` listens on, and stops the server's thread at the end."""
    listener = socket.create_server(("127.0.0.1", 0))
    server = uvicorn.Server(server_config(app, settings or Settings()))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        wait_for(lambda: server.started)
        yield listener.getsockname()[1]
    finally:
        server.should_exit = True
        thread.join(10)
        listener.close()
        assert not thread.is_alive()


def without_viewer(app: FastAPI) -> ASGIApp:
    """An application that tests share: its own lifespan would start viser, and end what other tests need."""

    async def served(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "lifespan":
            await app(scope, receive, send)
            return
        for done in ("startup", "shutdown"):
            await receive()
            await send({"type": f"lifespan.{done}.complete"})

    return served


@contextmanager
def serve_viewer(
    viewer: ViewerServer,
    routes: Iterable[BaseRoute] = (),
    access: Mapping[str, object] | None = None,
    **state: object,
) -> Iterator[int]:
    """Start a viewer and serve it under ``/viewer``, beside further routes that need such a `state` of the app.

    With arguments of `Access`, visitors have the rights that it gives them; otherwise those of a room's students.

    Yields the port, and stops the viewer at the end.
    """
    loops: list[asyncio.AbstractEventLoop] = []
    bridge = ViewerBridge()

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        loops.append(asyncio.get_running_loop())
        yield

    app = FastAPI(lifespan=lifespan)
    for name, value in state.items():
        setattr(app.state, name, value)
    app.router.routes.extend([*routes, *bridge.routes()])
    if access is not None:
        app.add_middleware(Access, **access)
    with serve(app) as port:
        viewer.start(loops[0])
        bridge.viewer = viewer
        try:
            yield port
        finally:
            viewer.stop()


def wait_for(condition, seconds: float = 30.0) -> None:
    """Wait until `condition()` is true; fails the test after `seconds`."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"the condition was not met within {seconds} s"
        time.sleep(0.01)


def ready(address: str) -> bool:
    """Whether the service at an address answers all it can."""
    try:
        with urllib.request.urlopen(f"{address}readyz", timeout=20) as answer:
            return bool(answer.status == 200)
    except urllib.error.HTTPError:  # it is still starting
        return False
