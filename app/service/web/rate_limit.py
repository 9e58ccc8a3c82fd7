"""Rate limits per client: token buckets."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable


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

    def wait(self, client: str) -> float:
        """Seconds until this client has a token; 0 if it has one now."""
        tokens, _ = self._now(client)
        return max(0.0, (1.0 - tokens) / self._rate)

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
