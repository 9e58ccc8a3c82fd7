"""The service: the only place that joins REST, the viewer and the pages, on one port.

Two doors lead to the same core and do not know each other: ``app.api`` answers programs, ``app.viewer`` draws for
people. Here they get their addresses: ``/`` the landing page, ``/viewer/`` the viewer, ``/api/v1`` REST,
``/docs`` its documentation, ``/livez`` and ``/readyz`` for whoever runs the service.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import ipaddress
import os
import signal
import socket
import sys
import tempfile
import threading
import webbrowser
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import Literal

import uvicorn
from fastapi import FastAPI, Response
from pydantic import BaseModel, Field
from starlette.concurrency import run_in_threadpool
from starlette.middleware.cors import CORSMiddleware
from starlette.responses import PlainTextResponse

from app.api import Gate, Work, api_routes, complete_document, install_problem_handlers
from app.service.startup import Startup
from app.service.startup import Status as StartupStatus
from app.service.web.access import Access
from app.service.web.inspection import MAX_MESSAGE
from app.service.web.observe import Observe, write_to_stderr
from app.service.web.pages import page_routes, static_folder
from app.service.web.prefix import PathPrefix, clean_prefix
from app.service.web.viewer_proxy import ViewerBridge
from app.service.workers import supervise
from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.metrics import CONTENT_TYPE, exposition
from app.shared.security import SecurityHeaders
from app.shared.settings import Settings
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.shared.threads import pin
from kin import RobotFileError, __version__

# Seconds that a thread may keep the interpreter while others wait. A drag goes through three threads: beside a
# batch of REST, Python's own 5 ms make one in twenty wait for 36 ms instead of 13.
SWITCH = 5e-4

OPEN_TO_ALL = """\
**************************************************************************
  Kinboard is open to everybody who can reach this machine, without a token.
  Set KINBOARD_TOKEN to ask for one, or KINBOARD_READ_ONLY=1.
**************************************************************************"""


class Alive(BaseModel):
    """The process answers."""

    status: Literal["alive"] = "alive"
    pid: int = Field(description="Which process: with several workers each answers for itself.")


class Readiness(BaseModel):
    """Whether the kernels that move an arm are compiled and the viewer listens."""

    status: StartupStatus


def create_app(
    settings: Settings, store: Store | None = None, on_ready: Callable[[], None] | None = None
) -> FastAPI:
    """The whole service as one ASGI application; `on_ready` is called when everything is warm.

    Raises:
        RobotFileError: a file in the operator's folder of robots is wrong.
    """
    store = store or Store(settings.robots)
    bridge = ViewerBridge(settings.allowed_origins, settings.max_visitors)
    clouds, maps, summaries = Clouds(settings.cloud_memory), Maps(), Summaries()
    work = Work(settings.max_requests, settings.time_budget)
    startup = Startup(settings, store, clouds, maps, summaries, bridge, on_ready)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        startup.start()
        yield
        work.close()  # what is still being computed has had its time to drain
        await run_in_threadpool(startup.stop)
        clouds.close()
        maps.close()
        summaries.close()

    app = FastAPI(
        title="Kinboard",
        version=__version__,
        summary="Kinematics of robot arms: forward, inverse, Jacobian.",
        description="Metres and radians everywhere; quaternions are `wxyz`. "
        "A target out of reach is an answer with a `status` and a `reason`, not an error.",
        license_info={"name": "MIT", "identifier": "MIT"},
        docs_url=None,  # our own page, whose files are ours: it works without internet
        redoc_url=None,
        redirect_slashes=False,  # the redirect would name our own host instead of the proxy's
        lifespan=lifespan,
    )
    app.state.store, app.state.settings, app.state.startup = store, settings, startup
    app.state.clouds, app.state.gate, app.state.summaries = clouds, Gate(settings.max_streams), summaries
    app.state.work = work
    app.state.maps = maps
    install_problem_handlers(app)
    complete_document(app, store, settings)
    app.router.routes.extend([*api_routes(), *page_routes(), *bridge.routes()])

    @app.get("/metrics", tags=["service"], summary="Counters, for Prometheus", response_class=PlainTextResponse)
    async def metrics() -> Response:
        return Response(exposition(), media_type=CONTENT_TYPE)

    @app.get("/livez", tags=["service"], summary="Is the process alive?")
    async def livez() -> Alive:
        return Alive(pid=os.getpid())

    @app.get(
        "/readyz",
        tags=["service"],
        summary="Is everything warm?",
        responses={503: {"model": Readiness, "description": "Still warming up, or the viewer failed."}},
    )
    async def readyz(response: Response) -> Readiness:
        response.headers["cache-control"] = "no-store"
        response.status_code = 200 if startup.status == "ready" else 503
        return Readiness(status=startup.status)

    token = None if settings.token is None else settings.token.get_secret_value()
    login_page = static_folder() / "login.html"
    app.add_middleware(
        Access, token=token, read_only=settings.read_only, rate=settings.rate_limit, login_page=login_page
    )
    if settings.cors_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=settings.cors_origins,
            allow_methods=["*"],
            allow_headers=["*"],
            expose_headers=["*"],
        )
    app.add_middleware(SecurityHeaders)
    app.add_middleware(Observe, log=settings.access_log)
    app.add_middleware(PathPrefix, prefix=settings.root_path)
    return app


def run(settings: Settings, open_browser: bool = False) -> int:
    """Serve until Ctrl-C or SIGTERM; returns the exit code: 0, or 1 with a message if it could not start."""
    try:
        listeners = _listen(settings)
    except OSError as error:
        reason = error.strerror or str(error)
        print(
            f"kinboard: cannot listen on {settings.host}:{settings.port}: {reason}.\n"
            "Choose another port with --port (0 takes any free one).",
            file=sys.stderr,
        )
        return 1
    with contextlib.ExitStack() as stack:
        for listener in listeners:
            stack.enter_context(listener)
        try:
            store = Store(settings.robots)
        except RobotFileError as error:
            print(f"kinboard: {error}", file=sys.stderr)
            return 1
        if settings.token is None and not settings.read_only and not _is_loopback(listeners[0]):
            print(OPEN_TO_ALL, file=sys.stderr, flush=True)
        greeting = _Greeting(_url(settings, listeners[0].getsockname()[1]), open_browser)
        if len(listeners) == 1:
            return _serve(settings, listeners[0], None, store, greeting)
        os.environ["PROMETHEUS_MULTIPROC_DIR"] = stack.enter_context(
            tempfile.TemporaryDirectory(prefix="kinboard-")
        )
        greeting.say()
        return supervise(partial(_serve, settings), listeners, settings.drain + 5.0)


def _serve(
    settings: Settings,
    listener: socket.socket,
    number: int | None = None,
    store: Store | None = None,
    greeting: _Greeting | None = None,
) -> int:
    """Serve on one socket, in this process: of several the one of this number."""
    if settings.pin:
        pin(number)
    if settings.access_log:
        write_to_stderr()
    sys.setswitchinterval(SWITCH)
    # Kernels and routes stay: to look for garbage among them once more stops all visitors for 50 ms.
    server = _Server(create_app(settings, store, on_ready=gc.freeze), settings.drain, greeting)
    # uvicorn ends in good order and then raises the signal again: for us it is the expected end.
    before = signal.signal(signal.SIGTERM, lambda *_: None)
    try:
        server.run(sockets=[listener])
    except KeyboardInterrupt:
        pass
    finally:
        signal.signal(signal.SIGTERM, before)
    return 0 if server.started else 1


def server_config(app: FastAPI, drain: float = 5.0) -> uvicorn.Config:
    """How uvicorn must serve `app` for the viewer's websockets to be quick and robust.

    Args:
        drain: seconds that answers under way may take after SIGTERM.
    """
    return uvicorn.Config(
        app,
        lifespan="on",
        log_level="warning",
        access_log=False,
        server_header=False,
        ws="websockets-sansio",
        # Compressing a 12 MB point cloud would take half a second; what is worth it, viser compressed already.
        ws_per_message_deflate=False,
        ws_max_size=MAX_MESSAGE + 1024,
        ws_ping_interval=20.0,
        # A slow line may need this long to take a large scene before it gets to answer a ping.
        ws_ping_timeout=120.0,
        timeout_graceful_shutdown=max(1, round(drain)),
    )


class _Greeting:
    """Says where we are, once, and opens it."""

    def __init__(self, url: str, open_browser: bool) -> None:
        self._url = url
        self._open_browser = open_browser
        self._out = sys.stdout  # now: starting viser borrows sys.stdout for a moment, in another thread

    def say(self) -> None:
        print(f"Kinboard {__version__} is at {self._url}  (Ctrl-C to stop)", file=self._out, flush=True)
        if self._open_browser:
            # A terminal browser would not return before it is closed.
            threading.Thread(target=self._open, name="kinboard-browser", daemon=True).start()

    def _open(self) -> None:
        if not webbrowser.open(self._url):
            print("No browser could be opened here: visit the address yourself.", file=self._out, flush=True)


class _Server(uvicorn.Server):
    """Greets once connections are really accepted; at its end refuses what would be cut off."""

    def __init__(self, app: FastAPI, drain: float, greeting: _Greeting | None) -> None:
        super().__init__(server_config(app, drain))
        self._end_work = app.state.work.close
        self._drain = drain
        self._greeting = greeting

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets=sockets)
        if self._greeting is not None:
            self._greeting.say()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        asyncio.get_running_loop().call_later(self._drain - min(1.0, 0.5 * self._drain), self._end_work)
        await super().shutdown(sockets=sockets)


def _listen(settings: Settings) -> list[socket.socket]:
    """A socket for each worker, all on one address; raises `OSError` if somebody else has it."""
    family, *_, address = socket.getaddrinfo(
        settings.host or None, settings.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    dual = family == socket.AF_INET6 and address[0] == "::" and socket.has_dualstack_ipv6()

    def listen(port: object, shared: bool) -> socket.socket:
        return socket.create_server(
            (address[0], port), family=family, backlog=2048, dualstack_ipv6=dual, reuse_port=shared
        )

    alone = listen(address[1], False)
    if settings.workers == 1:
        return [alone]
    # Sockets that share a port share it with any other service of the same user: only now is it known to be free.
    port = alone.getsockname()[1]
    alone.close()
    return [listen(port, True) for _ in range(settings.workers)]


def _is_loopback(listener: socket.socket) -> bool:
    return ipaddress.ip_address(listener.getsockname()[0].partition("%")[0]).is_loopback


def _url(settings: Settings, port: int) -> str:
    """An address that works on this machine, also when listening on all of its addresses."""
    host = "localhost" if settings.host in ("", "0.0.0.0", "::") else settings.host
    return f"http://{f'[{host}]' if ':' in host else host}:{port}{clean_prefix(settings.root_path)}/"
