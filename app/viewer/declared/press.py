"""The steps of one button that is pressed or held."""

from __future__ import annotations

import math


class Press:
    """Derives the steps of one button from the events that the browser sends.

    A button held by mouse or finger sends repeated reports and, on release, a click; with the keyboard only the
    click comes. A tap is one step, because repeats count only after `DELAY`.
    """

    DELAY = 0.5  # s
    GAP = 2.0  # s without a report, after which the click that ended the press is considered lost

    def __init__(self) -> None:
        self._since: float | None = None
        self._last = -math.inf
        self.number = 0

    def held(self, now: float) -> bool:
        """Process a report that the button is down; returns whether it is a step."""
        if self._since is None or now - self._last > self.GAP:
            self._since = now
            self.number += 1
        self._last = now
        return now == self._since or now - self._since >= self.DELAY

    def clicked(self, now: float) -> bool:
        """Process a click; returns whether it is a step."""
        alone = self._since is None or now - self._last > self.GAP
        self._since = None
        self.number += alone
        return alone
