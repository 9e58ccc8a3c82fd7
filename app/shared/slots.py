"""Slots that are few, such as those for computing: shared fairly among clients, and used while data flows.

A client may take a share of the slots; of those waiting, the client with the fewest slots is next. A client that
does not read its answer keeps no slot: `Slot.lent` gives it back after `STILL` seconds, and takes one again
before anything more is computed.
"""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import Awaitable, Callable
from typing import ParamSpec

from app.shared.clients import share_of

P = ParamSpec("P")
STILL = 1.0  # seconds that sending may take before the slot is given back


class Slots:
    """A number of slots. Used by the event loop only, so it needs no lock.

    Args:
        most: how many there are.
        share: of one client.
    """

    def __init__(self, most: int, share: float = 1.0) -> None:
        self.most = most
        self.most_of_one = share_of(most, share)
        self.taken = 0
        self._taken_by: Counter[str] = Counter()
        self._waiting: dict[str, deque[asyncio.Future[None]]] = {}

    def free(self, client: str) -> bool:
        """Whether this client can have a slot now."""
        return self.taken < self.most and self._taken_by[client] < self.most_of_one

    def take(self, client: str) -> bool:
        """Take a slot if there is one."""
        if self.free(client):
            self._add(client, 1)
            return True
        return False

    async def wait(self, client: str) -> None:
        """Take a slot as soon as there is one."""
        if not self._waiting.get(client) and self.take(client):
            return
        slot = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(client, deque()).append(slot)
        try:
            await slot
        except asyncio.CancelledError:
            if slot.done() and not slot.cancelled():
                self.give_back(client)
            raise

    def give_back(self, client: str) -> None:
        """End the use of a slot; the next client waiting gets it."""
        self._add(client, -1)
        if client in self._waiting:
            self._waiting[client] = self._waiting.pop(client)  # it is the last of those with as few slots
        while self.taken < self.most and (following := self._next()) is not None:
            queue = self._waiting[following]
            slot = queue.popleft()
            if not queue:
                del self._waiting[following]
            if not slot.done():  # else: no longer waiting
                self._add(following, 1)
                slot.set_result(None)

    def _next(self) -> str | None:
        """Of the clients waiting the one with the fewest slots, and among those the one served longest ago."""
        able = [client for client in self._waiting if self._taken_by[client] < self.most_of_one]
        return min(able, key=self._taken_by.__getitem__, default=None)

    def _add(self, client: str, count: int) -> None:
        self.taken += count
        self._taken_by[client] += count
        if not self._taken_by[client]:
            del self._taken_by[client]


class Slot:
    """A slot that a client has taken, until the end of the context that it is; meanwhile it may be lent."""

    def __init__(self, slots: Slots, client: str) -> None:
        self._slots = slots
        self._client = client
        self._held = True

    def __enter__(self) -> Slot:
        return self

    def __exit__(self, *_: object) -> None:
        self.give_back()

    def give_back(self) -> None:
        """Let others have the slot."""
        if self._held:
            self._held = False
            self._slots.give_back(self._client)

    def lent(self, send: Callable[P, Awaitable[None]]) -> Callable[P, Awaitable[None]]:
        """`send`, during which others may have the slot if it takes long."""

        async def lending(*args: P.args, **kwargs: P.kwargs) -> None:
            timer = asyncio.get_running_loop().call_later(STILL, self.give_back)
            try:
                await send(*args, **kwargs)
            finally:
                timer.cancel()
            if not self._held:
                await self._slots.wait(self._client)
                self._held = True

        return lending
