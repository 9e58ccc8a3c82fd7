"""Limits of computation: how many requests compute at a time, and for how long.

Requests that compute run in threads, of which there are few. So each needs a slot, and waits for a free one
without occupying a thread. Its time starts when it has a slot. A thread cannot be ended from outside: the
computation calls `Deadline.check` between targets, and ends when that raises.
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
from app.shared.clients import client_of
from app.shared.places import Place, Places

T = TypeVar("T")
RETRY_AFTER = 2  # seconds
RETRY_SLOW = 30
POLL = 0.2  # seconds between two checks whether the service is being stopped


def busy(detail: str, setting: str = "", headers: dict[str, str] | None = None) -> ProblemError:
    """503, with the time to wait and the setting that an operator could raise."""
    hint = "Try again in a moment" + (f", or ask the operator to raise {setting}." if setting else ".")
    headers = {"Retry-After": str(RETRY_AFTER)} | (headers or {})
    return ProblemError(503, "busy", detail, hint, headers=headers)


def stopping() -> ProblemError:
    """503 for a request that was cut short because the service is stopping."""
    return busy("The service is being stopped.")


def too_slow(
    seconds: float, advice: str = "Request less at a time, or try again when the service is less busy"
) -> ProblemError:
    """503 for a request that has used up its time."""
    detail = f"The request was not finished after {seconds:g} s, the time limit of one request."
    hint = f"{advice}; the operator can raise KINBOARD_TIME_BUDGET."
    return ProblemError(503, "too-slow", detail, hint, headers={"Retry-After": str(RETRY_SLOW)})


class ComputeSlots:
    """The slots of one process. All but `closed` is used by the event loop only, so nothing is locked.

    Args:
        most: how many requests compute at a time.
        seconds: time limit of each, and the longest time to wait for a slot.
        share: of one client.
    """

    def __init__(self, most: int, seconds: float, share: float = 1.0) -> None:
        self.seconds = seconds
        self.closed = False
        self._places = Places(most, share)

    @asynccontextmanager
    async def slot(self, request: Request) -> AsyncIterator[Deadline]:
        """A slot for as long as the context lasts, and its deadline; raises 503 if none becomes free in time."""
        client = client_of(request.scope)
        try:
            async with asyncio.timeout(self.seconds):
                await self._places.wait(client)
        except TimeoutError:
            detail = f"{self._places.taken} requests are being computed, which is the maximum or your share of it."
            raise busy(detail) from None
        with Place.held(self._places, client) as place:
            yield Deadline(self, place)

    def close(self) -> None:
        """End all computations that check their deadline, and all waiting."""
        self.closed = True

    async def wait(self, answer: Future[T], deadline: Deadline) -> T:
        """The result of another thread; raises 503 if that takes too long. The computation goes on."""
        # Waited for instead of awaited: a client that leaves must not cancel it for the others.
        wrapped = asyncio.wrap_future(answer)
        while not self.closed and (left := deadline.left) > 0.0:
            await asyncio.wait((wrapped,), timeout=min(left, POLL))
            if wrapped.done():
                return wrapped.result()
        if self.closed:
            raise stopping()
        raise too_slow(self.seconds, "The computation goes on: repeat the request later, or request less")


class Deadline:
    """The time limit of one request, and its slot if it has one."""

    def __init__(self, work: ComputeSlots, place: Place | None = None) -> None:
        self.place = place
        self._work = work
        self._ends = time.monotonic() + work.seconds

    @property
    def left(self) -> float:
        """Seconds until the deadline."""
        return self._ends - time.monotonic()

    def check(self) -> None:
        """Raises 503 after the deadline, or when the service is being stopped. Any thread may call it."""
        if self._work.closed:
            raise stopping()
        if self.left < 0.0:
            raise too_slow(self._work.seconds)


def compute_slots(request: Request) -> ComputeSlots:
    """The slots of this process."""
    work = request.app.state.compute
    assert isinstance(work, ComputeSlots)
    return work


async def computed(request: Request, answer: Callable[[Deadline], T]) -> T:
    """Result of `answer`, computed in a thread; raises 503 if there is no slot, or after the deadline."""
    async with compute_slots(request).slot(request) as deadline:
        return await run_in_threadpool(answer, deadline)


async def _deadline(request: Request) -> AsyncIterator[Deadline]:
    async with compute_slots(request).slot(request) as deadline:
        yield deadline


# For responses that are sent while they are computed: the slot is kept while the client reads.
DeadlineDep = Annotated[Deadline, Depends(_deadline)]
