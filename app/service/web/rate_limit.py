"""Rate limits per client: token buckets, and pauses before tries of those who have been wrong too often."""

from __future__ import annotations

import asyncio
import time
from collections import Counter, OrderedDict
from collections.abc import Callable

from app.api.problems import ProblemError


class TokenBucket:
    """One token bucket per client: refilled at `rate` tokens a second, up to `burst`. Memory is bounded.

    Args:
        clock: seconds of a monotonic clock.
    """

    MAX_CLIENTS = 20_000  # the client seen longest ago is dropped first

    def __init__(self, rate: float, burst: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._rate = rate
        self._burst = burst
        self._clock = clock
        self._tokens: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def wait(self, client: str, number: int = 1) -> float:
        """Seconds until this client has so many tokens; 0 if it has them now."""
        tokens, _ = self._now(client)
        return max(0.0, (number - tokens) / self._rate)

    def take(self, client: str) -> None:
        """Use one token."""
        tokens, now = self._now(client)
        self._tokens[client] = (tokens - 1.0, now)
        self._tokens.move_to_end(client)
        if len(self._tokens) > self.MAX_CLIENTS:
            self._tokens.popitem(last=False)

    def _now(self, client: str) -> tuple[float, float]:
        now = self._clock()
        tokens, since = self._tokens.get(client, (self._burst, now))
        return min(self._burst, tokens + self._rate * (now - since)), now


class SlowTries:
    """Pauses before tries, of which a client may have so many at once. For one event loop."""

    def __init__(self, at_once: int) -> None:
        self._at_once = at_once
        self._pausing: Counter[str] = Counter()

    async def pause(self, client: str, seconds: float, refused: ProblemError) -> None:
        """Wait for these seconds; raises the problem if too many tries of the client do."""
        if self._pausing[client] >= self._at_once:
            raise refused
        self._pausing[client] += 1
        try:
            await asyncio.sleep(seconds)
        finally:
            self._pausing[client] -= 1
            if not self._pausing[client]:
                del self._pausing[client]


def too_many(detail: str, wait: float) -> ProblemError:
    """429, with the time to wait."""
    seconds = max(1, int(wait + 0.999))
    return ProblemError(
        429, "too-many-requests", detail, f"Try again in {seconds} s.", headers={"Retry-After": str(seconds)}
    )
