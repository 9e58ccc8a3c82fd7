"""The three turns of a convention, one after another, as the frame beside the arm shows them on request."""

from __future__ import annotations

from dataclasses import dataclass

from app.viewer.lessons.rotations.conventions import Angles

TIME, REST = 1.4, 0.6  # s for a turn, and for the rest after it
FRAME = 1 / 30  # s between two frames


@dataclass(frozen=True)
class Turning:
    """Some of the turns, and for how long they have been shown.

    Attributes:
        first, last: indices of the turns.
        passed: seconds since it began.
    """

    first: int
    last: int
    passed: float = 0.0

    @property
    def turn(self) -> int:
        """The index of the turn that is shown; `last` + 1 when all are over."""
        return min(self.first + int(self.passed // (TIME + REST)), self.last + 1)

    def angles(self, angles: Angles) -> Angles:
        """The angles of the convention as far as the turns have come; those that come later are zero."""
        at = self.turn
        share = min((self.passed - (at - self.first) * (TIME + REST)) / TIME, 1.0)
        share = share * share * (3.0 - 2.0 * share)
        found = [angle if k < at else share * angle if k == at else 0.0 for k, angle in enumerate(angles)]
        return found[0], found[1], found[2]
