"""How often a client may try codes, of rooms and of pages for programs, and open rooms.

A class comes through one address, so right codes always count, and wrong ones have a generous limit. Above it, and
while wrong codes come in from everywhere, each try takes a second and only a few are made at a time: a class can
still join, and a program that guesses needs centuries. Codes that are tried at the same time count as if one came
after the other: where as many are under way as may still be wrong, others wait until one of them is decided.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from app.service.web.rate_limit import SlowTries, TokenBucket, too_many

WRONG, WRONG_EVERY = 30, 6.0  # wrong codes of one client at once, then one in this many seconds
WRONG_ALL, WRONG_ALL_EVERY = 300, 0.5  # of all clients of this process
SLOW, SLOW_AT_ONCE = 1.0, 8  # seconds of a slow try, and how many of one client are under way
ROOMS, ROOMS_EVERY = 10, 60.0
SEATS, SEATS_EVERY = 300, 1.0
_ALL = "all"
TOO_MANY = "Too many wrong codes from your address: each try takes a second for a while. A right code still works."


class Limits:
    """Counts by client; one per process. For one event loop."""

    def __init__(self) -> None:
        self._wrong = TokenBucket(1.0 / WRONG_EVERY, WRONG)
        self._wrong_all = TokenBucket(1.0 / WRONG_ALL_EVERY, WRONG_ALL)
        self._rooms = TokenBucket(1.0 / ROOMS_EVERY, ROOMS)
        self._seats = TokenBucket(1.0 / SEATS_EVERY, SEATS)
        self._slow = SlowTries(SLOW_AT_ONCE)
        self._under_way: Counter[str] = Counter()  # tries without a pause, by client
        self._decided = asyncio.Event()  # the next of them

    @asynccontextmanager
    async def trying(self, client: str) -> AsyncIterator[None]:
        """The time of one try, after a pause if many were wrong; raises 429. `wrong` is called within."""
        while (wait := self._wait(client)) == 0.0 and self._may_all_be_wrong(client):
            await self._decided.wait()
        if wait > 0.0:
            await self._slow.pause(client, SLOW, too_many(TOO_MANY, wait))
            yield
            return
        self._under_way[client] += 1
        try:
            yield
        finally:
            self._under_way[client] -= 1
            if not self._under_way[client]:
                del self._under_way[client]
            self._decided.set()
            self._decided = asyncio.Event()

    def wrong(self, client: str) -> None:
        """A code was wrong; raises 429 if there were too many."""
        wait = self._wait(client)
        if wait > 0.0:
            raise too_many(TOO_MANY, wait)
        self._wrong.take(client)
        self._wrong_all.take(_ALL)

    def opening(self, client: str) -> None:
        """A room is opened; raises 429."""
        self._ask(self._rooms, client, "Too many rooms were opened from your address.")
        self._rooms.take(client)

    def sitting(self, client: str) -> None:
        """Somebody asks for a seat; raises 429."""
        self._ask(self._seats, client, "Too many students joined from your address.")

    def sat(self, client: str) -> None:
        """A seat was taken. Wrong codes take none: who guesses must not keep the class at the same address out."""
        self._seats.take(client)

    def _wait(self, client: str) -> float:
        """Seconds until another code may be wrong."""
        return max(self._wrong.wait(client), self._wrong_all.wait(_ALL))

    def _may_all_be_wrong(self, client: str) -> bool:
        """Whether the tries under way use all that may be wrong."""
        mine, all_of = self._under_way[client], self._under_way.total()
        return max(self._wrong.wait(client, 1 + mine), self._wrong_all.wait(_ALL, 1 + all_of)) > 0.0

    def _ask(self, bucket: TokenBucket, client: str, detail: str) -> None:
        wait = bucket.wait(client)
        if wait > 0.0:
            raise too_many(detail, wait)
