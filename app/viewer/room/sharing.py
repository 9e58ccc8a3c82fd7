"""When a page sends its state to the room: at once after a rest, at most so often, and only if it has changed."""

from __future__ import annotations

import math
from collections.abc import Callable

from app.viewer.session.state import PageState, encode

LEADER_EVERY = 0.05  # s between two states of a teacher, as a browser's events come
STUDENT_EVERY = 0.2
LED_EVERY = 1.0  # while another page moves the arm, which the teacher then sees there
REST = 0.4  # s until the last look: a camera reports its end a little later


class Sharing:
    """Sends one page's packed state. Not thread-safe: the page's worker calls it.

    Args:
        state: the state to send; None: nothing is sent now.
        tell: takes the packed state.
        every: seconds between two states, now.
    """

    def __init__(
        self, state: Callable[[], PageState | None], tell: Callable[[str], None], every: Callable[[], float]
    ) -> None:
        self._state, self._tell, self._every = state, tell, every
        self._text = ""
        self._last = -math.inf  # when a state was sent
        self._rested = True

    def tick(self, now: float) -> float | None:
        """Something may have changed: send it if it is time; returns in how many seconds to look again, if so."""
        every = self._every()
        if now < self._last + every:
            return self._last + every - now
        state = self._state()
        text = self._text if state is None else encode(state)
        if text == self._text:
            self._rested = not self._rested
            return None if self._rested else REST
        self._rested = True
        self._text, self._last = text, now
        self._tell(text)
        return every
