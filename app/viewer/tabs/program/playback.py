"""Playing a motion: its time, and the arm of a visitor that follows it frame by frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from app.viewer.feature import Stage
from app.viewer.panel.status import Notice
from app.viewer.tabs.program.plan import Plan
from kin.motion import Dwell, Motion
from kin.transforms import Array

RATES = (0.1, 0.25, 0.5, 1.0, 2.0)  # of the real speed
CLOCK = 0.05  # s between two reports of the time


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


class Playback:
    """Moves the arm of one visitor; the visitor's worker calls it.

    Args:
        report: shows the time.

    Attributes:
        player: the time.
        plan: what is played; None: nothing can be.
    """

    def __init__(self, stage: Stage, report: Callable[[], None]) -> None:
        self._stage = stage
        self._report = report
        self.player = Player()
        self.plan: Plan | None = None
        self._sent: Array | None = None  # the configuration that was requested last
        self._leading = False  # whether the arm is on its way to where playing begins
        self._stepped = self._reported = 0.0

    @property
    def motion(self) -> Motion | None:
        """The motion that is played: of a program that is refused, the part that can be driven."""
        return None if self.plan is None else self.plan.driven

    @property
    def duration(self) -> float:
        """Seconds of the motion."""
        return 0.0 if self.motion is None else self.motion.duration

    @property
    def here(self) -> int | None:
        """Index of the row that is driven at the present time; that of the way back is the number of rows."""
        return None if self.plan is None else self.plan.row_at(self.player.time)

    def use(self, plan: Plan | None) -> None:
        """Take another motion, at the same time if it lasts as long."""
        self.plan = plan
        self.player.go_to(self.player.time, self.duration)

    def play(self) -> None:
        """Go on from the present time, or begin again at the end; the arm first comes to where the motion is."""
        player = self.player
        if player.time >= self.duration:
            player.time = 0.0
        player.playing = self._leading = True
        self._go(self._notice(), ease=True)
        self._stage.play(True)
        self._report()

    def stop(self) -> None:
        """Leave the arm where it is."""
        if self.player.playing:
            self.player.playing = False
            self._stage.play(False)
            self._report()

    def go_to(self, time: float) -> None:
        """Move the arm to where it is at a time."""
        self.stop()
        self.player.go_to(time, self.duration)
        self._go(Notice("hand", f"The program at {self.player.time:.2f} s"))
        self._report()

    def note(self, time: float) -> None:
        """The arm is moved to where it is at this time."""
        self.stop()
        self.player.go_to(time, self.duration)
        self._report()

    def tick(self, now: float) -> float | None:
        """Show the next frame if it is due; seconds until the one after it."""
        if not self.player.playing:
            return None
        if self._sent is None or not np.array_equal(self._sent, self._stage.now.goal):
            self.stop()  # the visitor has moved the arm
            return None
        if self._leading:
            self._leading = not np.array_equal(self._stage.now.q, self._stage.now.goal)
            self._stepped = now
            return self._stage.frame
        wait = self._stage.frame - (now - self._stepped)
        if wait <= 0.0:
            self._step(now)
            wait = self._stage.frame
        return wait if self.player.playing else None

    def _step(self, now: float) -> None:
        player = self.player
        player.advance(now - self._stepped, self.duration)
        self._stepped = now
        if player.playing:
            self._go(self._notice())
        else:
            self._go(self._ended())
            self._stage.play(False)
        if now - self._reported >= max(CLOCK, self._stage.frame) or not player.playing:
            self._reported = now
            self._report()

    def _notice(self) -> Notice:
        here, rows = self.here, () if self.plan is None else self.plan.segments
        if here is None or here >= len(rows):
            return Notice("hand", "Playing", "" if here is None else "Back to the start")
        row = rows[here]
        words = f"Waits {row.seconds:g} s" if isinstance(row, Dwell) else f"To waypoint {here + 1}"
        return Notice("hand", "Playing", f"{words}: {row.name}" if row.name else words)

    def _ended(self) -> Notice:
        assert self.plan is not None
        refusal = self.plan.motion.refusal
        if refusal is None:
            words = f"{self.duration:.2f} s, as planned." if self.player.rate == 1.0 else ""
            return Notice("hand", "The program has ended", words)
        where = f"The program ends on the way to {refusal.segment + 1}"
        return Notice("error", where, self.plan.explain(self._stage.units))

    def _go(self, notice: Notice, ease: bool = False) -> None:
        """Move the arm to where it is at the present time."""
        assert self.motion is not None
        self._sent = self._stage.now.robot.clip(self.motion.derivatives(self.player.time)[0])
        self._stage.move_to(self._sent, notice, at_once=not ease)
