"""Limits of computation: how many requests compute at a time, for how long, and only while the client is there.

Requests are computed by other processes (:mod:`app.service.compute`), or in threads where there are none. Of both
there are few. So each request needs a slot, and waits for a free one without occupying a thread. Its time starts
when it has a slot. A computation calls `Deadline.check` between targets, and ends when that raises. It also raises
once the client has left, which is watched for after a moment: most answers are there before.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import Future
from contextlib import asynccontextmanager, contextmanager
from typing import Protocol, TypeVar

from fastapi import Request
from starlette.concurrency import run_in_threadpool

from app.api.problems import ClientLeftError, ProblemError
from app.shared.clients import client_of
from app.shared.memory.answers import AnswerMemory
from app.shared.slots import Slot, Slots
from app.shared.threads import in_short_turns

T = TypeVar("T")
RETRY_AFTER = 2  # seconds
RETRY_SLOW = 30
POLL = 0.2  # seconds between two checks whether the service is being stopped
WATCH_AFTER = 0.2  # seconds of a request from which on its connection is watched
READERS = 2  # threads that validate large bodies: so a short one need not wait for a long one


def busy(detail: str, setting: str = "", headers: dict[str, str] | None = None) -> ProblemError:
    """503, with the time to wait and the setting that an operator could raise."""
    hint = "Try again in a moment" + (f", or ask the operator to raise {setting}." if setting else ".")
    headers = {"Retry-After": str(RETRY_AFTER)} | (headers or {})
    return ProblemError(503, "busy", detail, hint, headers=headers)


ADVICE = "Request less at a time, or try again when the service is less busy"


class TooSlowError(ProblemError):
    """503 for a request that has used up its time."""

    def __init__(self, seconds: float, advice: str) -> None:
        detail = f"The request was not finished after {seconds:g} s, the time limit of one request."
        hint = f"{advice}; the operator can raise KINBOARD_TIME_BUDGET."
        super().__init__(503, "too-slow", detail, hint, headers={"Retry-After": str(RETRY_SLOW)})


class ProcessPool(Protocol):
    """Processes that compute."""

    count: int

    async def run(
        self, answer: Callable[[Deadline], T], deadline: Deadline, took: Callable[[float], object] | None
    ) -> T:
        """What `answer` returns in another process, or raises there; it is called with a deadline of that process.

        Args:
            answer: can be pickled, and so can what it returns, unless that is a response.
            took: called with the seconds that the other process took.
        """

    def cancel(self) -> None:
        """End all computations soon."""


class ComputeSlots:
    """The slots of the service. All but `closed` is used by the event loop only, so nothing is locked.

    Args:
        most: how many requests compute at a time, in threads.
        seconds: time limit of each, and the longest time to wait for a slot.
        share: of one client.
        memory: room for their answers; by default without limits.
        pool: the processes that compute, of which each is a slot too; None: threads do.
    """

    def __init__(
        self,
        most: int,
        seconds: float,
        share: float = 1.0,
        memory: AnswerMemory | None = None,
        pool: ProcessPool | None = None,
    ) -> None:
        self.seconds = seconds
        self.memory = memory or AnswerMemory(1 << 62, 1 << 62)
        self.pool = pool
        self.closed = False
        self.waiting = 0  # requests that wait for a slot
        self._slots = Slots(most, share)
        self._processes = self._slots if pool is None else Slots(pool.count, share)
        self._reading = Slots(READERS)  # of threads that validate large bodies

    @asynccontextmanager
    async def slot(self, request: Request, process: bool = False) -> AsyncIterator[Deadline]:
        """A slot for as long as the context lasts, and its deadline; raises 503 if none becomes free in time.

        Args:
            process: whether it is that of a process, if there are any.
        """
        client, slots = client_of(request.scope), self._processes if process else self._slots
        with self.watched(request) as deadline:
            await self._acquire(slots, client, deadline, "computed")
            with Slot(slots, client):
                deadline.start()
                yield deadline

    async def read(self, request: Request, validated: Callable[[], T]) -> T:
        """What a thread makes of a large body; raises 503 if it cannot begin in time."""
        client = client_of(request.scope)
        with self.watched(request) as deadline:
            await self._acquire(self._reading, client, deadline, "read")
            with Slot(self._reading, client):
                return await run_in_threadpool(validated)

    @contextmanager
    def watched(self, request: Request) -> Iterator[Deadline]:
        """A deadline without a slot; within the context it also ends when the client leaves."""
        deadline = Deadline(self)
        watching: list[asyncio.Task[None]] = []
        loop = asyncio.get_running_loop()
        timer = loop.call_later(
            WATCH_AFTER, lambda: watching.append(loop.create_task(_until_left(request, deadline)))
        )
        try:
            yield deadline
        finally:
            timer.cancel()
            for task in watching:
                task.cancel()

    @property
    def used(self) -> int:
        """How many requests compute."""
        return self._slots.taken + (self._processes.taken if self.pool is not None else 0)

    def close(self) -> None:
        """End all computations that check their deadline, and all waiting."""
        self.closed = True
        if self.pool is not None:
            self.pool.cancel()

    async def wait(self, answer: Future[T], deadline: Deadline, advice: str = ADVICE) -> T:
        """The result of another thread; raises 503 with an advice if that takes too long."""
        # Waited for instead of awaited: a client that leaves must not cancel it for the others.
        wrapped = asyncio.wrap_future(answer)
        wrapped.add_done_callback(lambda done: done.cancelled() or done.exception())  # nobody may ask for it
        while not wrapped.done():
            deadline.check(advice)
            await asyncio.wait((wrapped,), timeout=max(0.0, min(deadline.left, POLL)))
        return wrapped.result()

    async def _acquire(self, slots: Slots, client: str, deadline: Deadline, act: str) -> None:
        if slots.take(client):
            return
        self.waiting += 1
        try:
            async with asyncio.timeout(self.seconds) as waiting:
                deadline.on_left = lambda: waiting.reschedule(0.0)
                await slots.wait(client)
        except TimeoutError:
            deadline.check_client()
            detail = f"{slots.taken} requests are being {act}, which is the maximum or your share of it."
            raise busy(detail) from None
        finally:
            self.waiting -= 1
            deadline.on_left = None


class Deadline:
    """The time limit of one request. Any thread may call `check`."""

    def __init__(self, work: ComputeSlots) -> None:
        self.on_left: Callable[[], None] | None = None  # called by the event loop when the client leaves
        self._work = work
        self._left = False
        self.start()

    def start(self, left: float | None = None) -> None:
        """The time of the request begins now, or ends in `left` seconds."""
        self._ends = time.monotonic() + (self._work.seconds if left is None else left)

    @property
    def memory(self) -> AnswerMemory:
        """Room for the answer."""
        return self._work.memory

    @property
    def seconds(self) -> float:
        """The time limit."""
        return self._work.seconds

    @property
    def left(self) -> float:
        """Seconds until the deadline."""
        return self._ends - time.monotonic()

    def check(self, advice: str = ADVICE) -> None:
        """Raises `ClientLeftError` once the client has left, 503 after the deadline or when the service stops."""
        self.check_client()
        if self._work.closed:
            raise busy("The service is being stopped.")
        if self.left < 0.0:
            raise TooSlowError(self._work.seconds, advice)

    def check_client(self) -> None:
        """Raises `ClientLeftError` once the client has left."""
        if self._left:
            raise ClientLeftError

    def client_left(self) -> None:
        """The client has left: the next `check` raises."""
        self._left = True
        if self.on_left is not None:
            self.on_left()


async def _until_left(request: Request, deadline: Deadline) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass
    deadline.client_left()


def compute_slots(request: Request) -> ComputeSlots:
    """The slots of this process."""
    work = request.app.state.compute
    assert isinstance(work, ComputeSlots)
    return work


async def computed(
    request: Request, answer: Callable[[Deadline], T], took: Callable[[float], object] | None = None
) -> T:
    """Result of `answer`, computed by another process, or in a thread if there are none.

    Args:
        answer: a function of a module, or `partial` of one, so that it can be sent to another process.
        took: called with the seconds of the computation.

    Raises:
        ProblemError: 503 if there is no slot, or after the deadline.
    """
    work = compute_slots(request)
    if work.pool is None:
        return await computed_here(request, answer, took)
    async with work.slot(request, process=True) as deadline:
        return await work.pool.run(answer, deadline, took)


async def computed_here(
    request: Request, answer: Callable[[Deadline], T], took: Callable[[float], object] | None = None
) -> T:
    """The same in a thread of this process."""

    def timed() -> T:
        began = time.perf_counter()
        try:
            with in_short_turns():
                return answer(deadline)
        finally:
            if took is not None:
                took(time.perf_counter() - began)

    async with compute_slots(request).slot(request) as deadline:
        return await run_in_threadpool(timed)
