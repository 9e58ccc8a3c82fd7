"""How long one request may compute, and how many may at a time.

Requests that compute run in threads, of which there are few: so each needs a place, and who finds none waits for
one without a thread. From then on its time runs. Nothing can end a thread from outside: the work itself asks its
`Budget` between one question and the next, and stops when that raises.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from concurrent.futures import Future
from contextlib import asynccontextmanager
from typing import Annotated, TypeVar

from fastapi import Depends, Request
from starlette.concurrency import run_in_threadpool

from app.api.problems import ProblemError

T = TypeVar("T")
RETRY_AFTER = 2  # seconds
RETRY_SLOW = 30
LOOK = 0.2  # seconds between two looks whether the service is being stopped


def busy(detail: str, setting: str = "") -> ProblemError:
    """503, with when to come again and what the operator could raise."""
    hint = "Try again in a moment" + (f", or ask the operator to raise {setting}." if setting else ".")
    return ProblemError(503, "busy", detail, hint, headers={"Retry-After": str(RETRY_AFTER)})


def stopping() -> ProblemError:
    """503 for what was not done when the service had to end."""
    return busy("The service is being stopped.")


def too_slow(
    seconds: float, what: str = "Ask for less at a time, or try again when the service is less busy"
) -> ProblemError:
    """503 for what takes more than its time."""
    detail = f"It was not done after {seconds:g} s, the most one request may compute."
    hint = f"{what}; the operator can raise KINBOARD_TIME_BUDGET."
    return ProblemError(503, "too-slow", detail, hint, headers={"Retry-After": str(RETRY_SLOW)})


class Work:
    """The places of one process. All but `closed` belongs to the event loop, so nothing is locked.

    Args:
        most: how many requests compute at a time.
        seconds: how long each may, and how long one waits for its turn.
    """

    def __init__(self, most: int, seconds: float) -> None:
        self.seconds = seconds
        self.closed = False
        self._most = most
        self._places = asyncio.Semaphore(most)

    @asynccontextmanager
    async def place(self) -> AsyncIterator[Budget]:
        """A place and its time, as long as the context lasts; raises 503 if none becomes free in time."""
        try:
            async with asyncio.timeout(self.seconds):
                await self._places.acquire()
        except TimeoutError:
            raise busy(f"{self._most} requests are being computed, the most at a time.") from None
        try:
            yield Budget(self)
        finally:
            self._places.release()

    def close(self) -> None:
        """End all work that still asks for its budget, and all waiting."""
        self.closed = True

    async def wait(self, answer: Future[T], budget: Budget) -> T:
        """The result of another thread; raises 503 if that takes too long. The computation goes on."""
        # Waited for and not awaited: a visitor who leaves must not cancel it for the others.
        wrapped = asyncio.wrap_future(answer)
        while not self.closed and (left := budget.left) > 0.0:
            await asyncio.wait((wrapped,), timeout=min(left, LOOK))
            if wrapped.done():
                return wrapped.result()
        if self.closed:
            raise stopping()
        raise too_slow(self.seconds, "It goes on being computed: ask again in a while, or for less")


class Budget:
    """The time of one request."""

    def __init__(self, work: Work) -> None:
        self._work = work
        self._ends = time.monotonic() + work.seconds

    @property
    def left(self) -> float:
        """Seconds until the time is over."""
        return self._ends - time.monotonic()

    def check(self) -> None:
        """Raises 503 when the time is over or the service is being stopped; any thread may ask."""
        if self._work.closed:
            raise stopping()
        if self.left < 0.0:
            raise too_slow(self._work.seconds)


def work_of(request: Request) -> Work:
    """The places of this process."""
    work = request.app.state.work
    assert isinstance(work, Work)
    return work


async def computed(request: Request, answer: Callable[[Budget], T]) -> T:
    """What `answer` computes in a thread within its budget; raises 503 without a place, or when time is over."""
    async with work_of(request).place() as budget:
        return await run_in_threadpool(answer, budget)


async def _budget(request: Request) -> AsyncIterator[Budget]:
    async with work_of(request).place() as budget:
        yield budget


# For answers that are sent while they are computed: the place is kept until the last byte has left.
BudgetDep = Annotated[Budget, Depends(_budget)]
