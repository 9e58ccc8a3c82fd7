"""Requests that would wait long for the compiler, which happens on a new machine: 503 in words instead.

The thread of such a request cannot be interrupted. It keeps its place until the kernel is compiled, and the next
request finds the kernel.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from typing import Any, TypeVar

from starlette.concurrency import run_in_threadpool
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.api.problems import ProblemError, respond
from app.shared.solver_names import known_names
from app.shared.threads.compiling import Hold, current_hold
from kin import Robot, UnknownRobotError
from kin.warmup import all_of
from kin.warmup.preparation import Preparation

PATIENCE = 4.0  # s in the compiler, after which a request is answered
LOOK = 0.25  # s between two looks
COUNTING = 0.5  # s that it may take to find out what is prepared
RETRY_AFTER = 5  # s

T = TypeVar("T")
_API = "/api/"
_counting: set[asyncio.Task[Any]] = set()  # tasks that nobody awaits: the event loop alone keeps none alive
_ROBOT = re.compile(r"/api/v\d+/robots/([^/]+)/")


class Compiling:
    """ASGI middleware, innermost: what it refuses has been admitted and is counted."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        path = scope.get("path", "").removeprefix(scope.get("root_path", ""))
        if scope["type"] != "http" or not path.startswith(_API):
            await self.app(scope, receive, send)
            return
        loop = asyncio.get_running_loop()
        hold = Hold()
        started = False
        refusal: asyncio.Task[None] | None = None
        timer: asyncio.TimerHandle

        async def send_once(message: Message) -> None:
            nonlocal started
            if refusal is None:
                started = True
                await send(message)

        async def refuse() -> None:
            await respond(await _problem(scope, path))(scope, receive, send)

        def look() -> None:
            nonlocal refusal, timer
            if started:
                return
            if hold.seconds >= PATIENCE:
                refusal = loop.create_task(refuse())
            else:
                timer = loop.call_later(LOOK, look)

        timer = loop.call_later(PATIENCE, look)
        token = current_hold.set(hold)
        try:
            await self.app(scope, receive, send_once)
        except asyncio.CancelledError:  # the service is being stopped
            if refusal is None:
                raise
        finally:
            current_hold.reset(token)
            timer.cancel()
            if refusal is not None:
                await refusal


async def known_soon(answer: Callable[[], T]) -> T | None:
    """What `answer` says of the preparation, called in a thread; None if that takes long.

    The first call in a process looks at all families of arms, for which it may have to wait for the compiler too.
    """
    waiting = asyncio.create_task(run_in_threadpool(answer))
    _counting.add(waiting)
    waiting.add_done_callback(_counting.discard)
    await asyncio.wait((waiting,), timeout=COUNTING)
    return waiting.result() if waiting.done() else None


async def _problem(scope: Scope, path: str) -> ProblemError:
    state = scope["app"].state
    robot: Robot | None = None
    if found := _ROBOT.match(path):
        try:
            robot = state.store.get(found[1])
        except UnknownRobotError:  # it is one of another address
            robot = None
    what = "What this request needs" if robot is None else f"The {robot.name}"
    step = await _step(robot, state.startup.preparation)
    detail = f"{what} is being prepared for the first time on this machine{step}."
    hint = f"This continues by itself. Try again in {RETRY_AFTER} s."
    return ProblemError(503, "preparing", detail, hint, headers={"Retry-After": str(RETRY_AFTER)})


async def _step(robot: Robot | None, preparation: Preparation) -> str:
    """How far the parts of this arm are, which are compiled before those of others from now on."""
    known = None if robot is None else known_names(robot)
    if known is None or preparation.complete:
        return ""
    family = known.solver

    def count() -> str:
        names = (family, all_of(family))
        preparation.want(names)
        done, of = preparation.steps(names)
        return f": step {min(done + 1, of)} of {of}" if of else ""

    return await known_soon(count) or ""
