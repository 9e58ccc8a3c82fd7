"""The three turns of a convention, one after another, as the frame beside the arm shows them on request."""

from __future__ import annotations

from dataclasses import dataclass

from app.viewer.lessons.rotations.conventions import Angles

TIME, REST = 1.4, 0.6  # s for a turn, and for the rest after it
FRAME = 1 / 30  # s between two frames


@dataclass(frozen=True)
class Turning:
    """Some of the turns, shown from a moment on. Time is `time.perf_counter`'s.

    Attributes:
        first, last: indices of the turns.
        begun: when it began.
    """

    first: int
    last: int
    begun: float

    def turn(self, now: float) -> int:
        """The index of the turn that is shown; `last` + 1 when all are over."""
        return min(self.first + int(max(now - self.begun, 0.0) // (TIME + REST)), self.last + 1)

    def angles(self, angles: Angles, now: float) -> Angles:
        """The angles of the convention as far as the turns have come; those that come later are zero."""
        at = self.turn(now)
        passed = max(now - self.begun, 0.0) - (at - self.first) * (TIME + REST)
        share = min(passed / TIME, 1.0)
        share = share * share * (3.0 - 2.0 * share)
        found = [angle if k < at else share * angle if k == at else 0.0 for k, angle in enumerate(angles)]
        return found[0], found[1], found[2]
