"""The service: joins REST, the viewer and the pages on one port.

``app.api`` answers programs, ``app.viewer`` draws for people; both use the same core and do not know each other.
Here they get their addresses: ``/`` the landing page, ``/viewer/`` the viewer, ``/api/v1`` REST, ``/docs`` its
documentation, ``/livez``, ``/readyz`` and ``/metrics`` for operators.
"""

from __future__ import annotations

import gc
import signal
import socket
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, nullcontext
from functools import cache, partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from fastapi import FastAPI
from starlette.concurrency import run_in_threadpool
from starlette.middleware.cors import CORSMiddleware

from app.api import (
    ComputeSlots,
    StreamLimit,
    UploadMemory,
    api_routes,
    complete_document,
    install_problem_handlers,
)
from app.classroom import Hub, clock
from app.classroom.courses import Courses
from app.exercises import ExerciseFileError, Exercises, Lessons
from app.live import Lines
from app.service import status
from app.service.compute.pool import Pool
from app.service.gauges import show_in_gauges
from app.service.log import guard_log
from app.service.restarts import can_restart, restarted
from app.service.server import STOP_TIMEOUT, Greeting, Server, is_loopback, listen, url_of
from app.service.startup import Startup
from app.service.web.access import Access
from app.service.web.embedding import embedding_routes
from app.service.web.failures import Failures
from app.service.web.hosts import LOCAL_NAMES, Hosts, Preflights
from app.service.web.lti import PlatformsRefused, check_platforms, lti_routes
from app.service.web.observe import Observe, write_to_stderr
from app.service.web.pages import page_routes
from app.service.web.prefix import PathPrefix, clean_prefix
from app.service.web.rooms import room_routes, sweeping
from app.service.web.rooms.guests import Guests
from app.service.web.rooms.limits import Limits
from app.service.web.rooms.network import url_for_others
from app.service.web.viewer_proxy import ViewerBridge
from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.memory.answers import AnswerMemory
from app.shared.memory.process import MemoryKeeper
from app.shared.security import SecurityHeaders
from app.shared.settings import Settings, static_folder
from app.shared.slots import Slots
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.shared.threads import end_process
from kin import InputError, RobotFileError, __version__, fk

if TYPE_CHECKING:
    from app.service.web.agents import Agents
    from app.viewer.server import ViewerServer

# Full collections are rare, besides those when the process is idle or has grown (`app.shared.memory.process`): one
# among requests with many thousand targets stops all visitors for 80 ms, one of young objects for a millisecond.
COLLECTIONS = (700, 10, 100)

DESCRIPTION = (
    "Metres and radians everywhere; quaternions are `wxyz`. "
    "A target out of reach is an answer with a `status` and a `reason`, not an error."
)

NO_PORT = "kinboard: cannot listen on {}:{}: {}.\nChoose another port with --port (0 takes any free one)."
NEWER_DATABASE = """\
kinboard: the database of classrooms in {} was written by a newer version of Kinboard. Rooms cannot be used:
install that version, or set KINBOARD_DATA to another folder. Everything else works."""

OPEN_TO_ALL = """\
**************************************************************************
  Kinboard is open to everybody who can reach this machine, without a token.
  Set KINBOARD_TOKEN to require one, or KINBOARD_READ_ONLY=1.
**************************************************************************"""


def create_app(
    settings: Settings,
    store: Store | None = None,
    on_ready: Callable[[], None] | None = None,
    courses: Courses | None = None,
    pool: Pool | None = None,
) -> FastAPI:
    """The whole service as one ASGI application; `on_ready` is called when it is ready.

    Args:
        courses: those of the operator, and exercises; None: they are read when needed.
        pool: processes that compute, with these settings and this store; None: threads do.

    Raises:
        RobotFileError: a file in the operator's folder of robots is invalid.
    """
    store = store or Store(settings.robots)
    bridge = ViewerBridge(settings.allowed_origins, Slots(settings.max_visitors, settings.client_share))
    clouds, summaries = Clouds(settings.cloud_memory), Summaries()
    maps = Maps(settings.map_memory, seconds=settings.map_time)
    memory = AnswerMemory(settings.max_answer, settings.answer_memory)
    work = ComputeSlots(settings.max_requests, settings.time_budget, settings.client_share, memory, pool)
    classroom = Hub.of(settings)
    known = cache(lambda: courses or _courses(settings, store))
    lines = Lines()
    begin = store, settings, clouds, maps, summaries, classroom
    startup = Startup(lambda: _viewer(*begin, known(), lines), bridge, pool, on_ready)

    def idle() -> bool:
        return not (bridge.slots.taken or work.used or state.streams.open or summaries.pending or maps.pending)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        startup.start()
        (keeper := MemoryKeeper(idle)).start()
        async with sweeping(classroom), agents.running() if agents else nullcontext():
            yield
        keeper.stop()
        work.close()  # computations still running have had their time to finish
        for step in (startup.stop, clouds.close, maps.close, summaries.close):
            await run_in_threadpool(step)

    state = (app := _described(lifespan)).state
    state.store, state.settings, state.clouds, state.maps, state.summaries, state.classroom = begin
    state.lines, state.tries, state.startup = lines, Limits(), startup
    state.streams, state.compute = StreamLimit(settings.max_streams, settings.client_share), work
    state.uploads = UploadMemory(max(settings.upload_memory, settings.max_body), settings.client_share)
    show_in_gauges(state, bridge, pool)
    install_problem_handlers(app)
    complete_document(app, settings)
    app.router.routes.extend([*api_routes(), *page_routes(store), *embedding_routes(), *bridge.routes()])
    app.router.routes.extend(room_routes(classroom, settings, known, state.tries))
    app.router.routes.extend(lti_routes(classroom, settings, known))
    app.include_router(status.router)
    state.agents = agents = _agents(app, settings) if settings.mcp else None
    _add_middleware(app, settings, Guests(classroom))
    return app


def _viewer(*arguments: Any) -> ViewerServer:
    # Importing viser takes half a second, for which the landing page and REST need not wait.
    from app.viewer.server import ViewerServer

    return ViewerServer(*arguments)


def _agents(app: FastAPI, settings: Settings) -> Agents:
    # The SDK takes a second to import, and is an extra.
    from app.service.web.agents import Agents

    return Agents(app, settings)


def _check_extras(settings: Settings) -> None:
    """Raises `InputError` or `PlatformsRefused` if a setting needs what is not installed or invalid."""
    if settings.mcp and find_spec("mcp") is None:
        raise InputError("KINBOARD_MCP", True, "the extra mcp installed: pip install 'kinboard[mcp]'")
    check_platforms(settings)


def _courses(settings: Settings, store: Store) -> Courses:
    """The courses, exercises and lessons, read; raises `ExerciseFileError` and `InputError`."""
    lessons = Lessons(settings.lessons, settings.language)
    return Courses(Exercises(settings.exercises, store.get), settings.courses, store.get, lessons)


def _described(lifespan: Callable[[FastAPI], AbstractAsyncContextManager[None]]) -> FastAPI:
    """An application with what its documentation says of it."""
    return FastAPI(
        title="Kinboard",
        version=__version__,
        summary="Kinematics of robot arms: forward, inverse, Jacobian.",
        description=DESCRIPTION,
        license_info={"name": "MIT", "identifier": "MIT"},
        docs_url=None,  # our own page, with its files: it works without internet
        redoc_url=None,
        redirect_slashes=False,  # the redirect would name our own host instead of the proxy's
        lifespan=lifespan,
    )


def _add_middleware(app: FastAPI, settings: Settings, guests: Guests) -> None:
    """Access innermost, the path prefix outermost."""
    app.add_middleware(
        Access,
        token=None if settings.token is None else settings.token.get_secret_value(),
        read_only=settings.read_only,
        rate=settings.rate_limit,
        login_page=static_folder() / "login.html",
        framed=bool(settings.frame_ancestors),
        admits=guests.admits,
    )
    if settings.cors_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=settings.cors_origins,
            allow_methods=["*"],
            allow_headers=["*"],
            expose_headers=["*"],
        )
    app.add_middleware(Preflights, allowed=settings.cors_origins)
    app.add_middleware(Failures)
    app.add_middleware(Hosts, allowed=settings.allowed_hosts, proxies=bool(settings.trusted_proxies))
    app.add_middleware(SecurityHeaders, ancestors=settings.frame_ancestors)
    app.add_middleware(Observe, log=settings.access_log)
    app.add_middleware(PathPrefix, prefix=settings.root_path)


def run(settings: Settings, open_browser: bool = False, page: str = "", words: str = "") -> int:
    """Serve until Ctrl-C or SIGTERM, which ends this process; returns 1 with a message if it could not start.

    Args:
        open_browser, page, words: as for `Greeting`.
    """
    try:
        listener = listen(settings)
    except OSError as error:
        reason = error.strerror or str(error)
        print(NO_PORT.format(settings.host, settings.port, reason), file=sys.stderr)
        return 1
    with listener:
        try:
            store = Store(settings.robots)
            courses = _courses(settings, store)
            _ = courses.all  # now: a service that is started again must not depend on the files
            _check_extras(settings)
        except (InputError, RobotFileError, ExerciseFileError, PlatformsRefused) as error:
            print(f"kinboard: {error}", file=sys.stderr)
            return 1
        arm = store.robots[0]
        fk(arm, arm.q_home)  # loads the kernels, which all copies of this process then have
        if settings.token is None and not settings.read_only:
            if not is_loopback(listener):
                print(OPEN_TO_ALL, file=sys.stderr, flush=True)
            elif not settings.allowed_hosts:
                settings = settings.model_copy(update={"allowed_hosts": (*LOCAL_NAMES, settings.host)})
        if Hub.of(settings).state == "newer-database":
            print(NEWER_DATABASE.format(settings.data_folder), file=sys.stderr, flush=True)
        clock.now()  # a service that is started again, after the clock was set, counts from here too
        port = listener.getsockname()[1]
        others = url_for_others(settings.host, port, clean_prefix(settings.root_path))
        greeting = Greeting(url_of(settings, port), open_browser, others, page, words)
        serve = partial(_serve, settings, listener, store, courses)
        if not can_restart():
            return serve(greeting.show)

        def served(first: bool, say: Callable[[], None]) -> int:
            def begin() -> None:
                say()
                if first:
                    greeting.show()

            return serve(begin, alone=False)

        return restarted(served, grace=settings.drain + STOP_TIMEOUT + 1.0)


def _serve(
    settings: Settings,
    listener: socket.socket,
    store: Store,
    courses: Courses,
    on_start: Callable[[], None],
    alone: bool = True,
) -> int:
    """Serve until a signal ends this process; returns 1 if it could not start.

    Args:
        store, courses: of the operator.
        on_start: called once it accepts connections.
        alone: whether no other process would start it again.
    """
    guard_log()
    if settings.access_log:
        write_to_stderr()
    gc.set_threshold(*COLLECTIONS)
    pool = Pool(settings.processes, settings, store) if settings.processes else None
    # Kernels and routes live as long as the process: one collection among them would stop all visitors for 50 ms.
    app = create_app(settings, store, gc.freeze, courses, pool)
    server = Server(app, settings, on_start, alone)
    # uvicorn shuts down in order and then raises the signal again, which is the expected end here.
    before = signal.signal(signal.SIGTERM, server.handle_exit)
    try:
        server.run(sockets=[listener])
    except KeyboardInterrupt:
        pass
    finally:
        signal.signal(signal.SIGTERM, before)
    if server.started:
        end_process(0)  # threads may still compute
    return 1
