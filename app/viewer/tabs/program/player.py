"""The time of a motion that is played. Pure."""

from __future__ import annotations

from dataclasses import dataclass

RATES = (0.1, 0.25, 0.5, 1.0, 2.0)  # of the real speed


@dataclass
class Player:
    """Where in a motion the arm is, and how the time goes on.

    Attributes:
        time: seconds since the beginning of the motion.
        rate: seconds of the motion for each second.
        loop: whether it begins again at its end.
        playing: whether the time goes on.
    """

    time: float = 0.0
    rate: float = 1.0
    loop: bool = False
    playing: bool = False

    def advance(self, seconds: float, duration: float) -> None:
        """Let `seconds` pass; at the end of the motion begin again or stop."""
        self.time += seconds * self.rate
        if self.time < duration:
            return
        if self.loop and duration > 0.0:
            self.time %= duration
        else:
            self.time, self.playing = duration, False

    def go_to(self, time: float, duration: float) -> None:
        """Go to a time of the motion."""
        self.time = min(max(time, 0.0), duration)
