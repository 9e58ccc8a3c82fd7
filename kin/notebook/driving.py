"""What programs that move a real arm share: limits on its motion, and reasons to stop.

An arm stays where it was measured until the page commands it. Then each joint moves towards its command and never
away from it, no faster than allowed, and no farther than the limits of the page's arm and of the real one.

None of it is a safety function: keep an emergency stop within reach.
"""

from __future__ import annotations

import threading
import time
from typing import Any, Final

import numpy as np

from kin.errors import KinematicsError
from kin.motion import motion_limits
from kin.robot import Robot
from kin.transforms import Array

BEAT: Final = 0.2  # s between two signs of life that the page is asked for
PAGE_LOST: Final = 1.5  # s without one
ARM_LOST: Final = 0.5  # s without a word of the arm
BEHIND, PATIENCE = (
    np.radians(25.0),
    0.5,
)  # rad (for slides: m / 10), s: an arm so far behind for so long is blocked
AWAY: Final = np.radians(10.0)  # rad (for slides: m / 10) that a joint may move away from where it is asked to be
LATEST: Final = 0.1  # s that count at most between two steps: nothing is caught up after a pause
LONGEST: Final = 60  # characters of the name of what is driven
SAME: Final = 1e-3  # rad (m)
SLOW, SLOW_SLIDE = 20.0, 0.05  # deg/s, m/s: unless the owner gives another


class StoppedError(KinematicsError):
    """The arm was not moved, or not any further; the message says why."""


class PageLostError(StoppedError):
    """The page does not answer: nobody can say in it why the arm was stopped."""


class Guide:
    """Leads an arm to the configuration that its page shows, at a limited speed.

    A joint stays where it was measured until the page shows another value of it than the one it has taken over. If
    it was measured outside its limits, it may stay there and move inside.

    Args:
        page: the page, which gets a red frame with the name of the arm.
        what: that name.
        speed: of each joint, deg/s; less where the page's arm has a lower limit.
        measured: where the arm is ``(n,)``; the page takes it over, so that nothing moves at first.
        limits: lower and upper configurations ``(n,)`` of the arm itself; those of the page's arm count, too.

    Attributes:
        asked: where the arm is to be now ``(n,)``.
        commanded: which joints the page has moved since ``(n,)``.

    Raises:
        StoppedError: the page did not take it over, or the limits leave a joint no room.
    """

    def __init__(
        self, page: Any, what: str, speed: float, measured: Array, limits: tuple[Array, Array] | None = None
    ) -> None:
        self._page, self._what, self._robot = page, what[:LONGEST], page.robot
        self._limits = _common(self._robot, limits)
        wanted = np.where(self._robot.revolute, np.radians(speed), SLOW_SLIDE)
        self._speed = np.minimum(wanted, motion_limits(self._robot).velocity)
        self._size = np.where(self._robot.revolute, 1.0, 0.1)  # of what is far for a joint
        self.asked = measured.copy()
        self._moved, self._gap, self._away = (np.zeros(self._robot.n) for _ in range(3))
        self.commanded = np.zeros(self._robot.n, dtype=bool)
        page.drives = self._what
        page.q = self._robot.clip(measured)
        page.stop()  # a program that is played; answered when the page has taken q, too
        self._shown = page.q
        if np.abs(self._shown - self._robot.clip(measured)).max() > SAME:
            raise StoppedError(
                "the page has not taken over where the arm is: is its target held? Nothing was moved"
            )
        self._before = self._alive = self._followed = time.monotonic()
        self._over = threading.Event()
        self._heart = threading.Thread(target=self._beat, daemon=True)
        self._heart.start()

    def _beat(self) -> None:
        """Ask the page for a sign of life again and again; it answers when it has done what it was asked."""
        while not self._over.wait(BEAT):
            try:
                self._page.drives = self._what
            except KinematicsError:
                continue  # `step` notices the silence
            self._alive = time.monotonic()

    def step(self, measured: Array, heard: float) -> Array:
        """Where the arm is to be now ``(n,)``.

        Args:
            measured: where it is ``(n,)``.
            heard: when it has said so, as `time.monotonic` has it.

        Raises:
            StoppedError: a reason to move it no further.
        """
        now = time.monotonic()
        elapsed, self._before = min(now - self._before, LATEST), now
        if not self._page.connected or now - self._alive > PAGE_LOST:
            raise PageLostError("the page does not answer: the arm is not moved any further")
        if now - heard > ARM_LOST:
            raise StoppedError(f"the arm has said nothing for {ARM_LOST:g} s: it is not moved any further")
        q = self._page.q
        if self._page.robot != self._robot or q.shape != self.asked.shape:
            raise StoppedError("the page shows another arm: this one is not moved any further")
        self._compare(measured, now)
        commanded = self.commanded | (np.abs(q - self._shown) > SAME)
        if commanded.any() and not self.commanded.any():  # the arm may have given way a little until now
            self.asked, self._gap = measured.copy(), np.zeros(self._robot.n)
        self.commanded = commanded
        low, high = np.minimum(self._limits[0], self.asked), np.maximum(self._limits[1], self.asked)
        way = np.where(self.commanded, np.clip(q, low, high) - self.asked, 0.0)
        longest = float(np.max(np.abs(way) / (self._speed * max(elapsed, 1e-6)), initial=0.0))
        self._moved = way / max(longest, 1.0)  # all joints arrive together
        self.asked = self.asked + self._moved
        return self.asked

    def _compare(self, measured: Array, now: float) -> None:
        """Raise `StoppedError` where the arm is far behind, or goes elsewhere than it was asked to.

        What the difference grows by in a step beyond what was asked for in it, the arm has moved away by itself.
        """
        gap = np.abs(self.asked - measured)
        self._away = np.maximum(0.0, self._away + gap - self._gap - np.abs(self._moved))
        self._gap = gap
        i = int(np.argmax(self._away / self._size))
        if self._away[i] > AWAY * self._size[i]:
            raise StoppedError(
                f"{self._robot.joints[i].name} has moved {said(self._robot, i, self._away[i])} away from where it "
                "was asked to be: something pushes it, its motor is too weak, or its calibration is wrong. "
                "The arm is not moved any further"
            )
        if (gap < BEHIND * self._size).all():
            self._followed = now
        elif now - self._followed > PATIENCE:
            i = int(np.argmax(gap / self._size))
            raise StoppedError(
                f"{self._robot.joints[i].name} is {said(self._robot, i, gap[i])} behind: something holds it, "
                "or its motor is too weak. The arm is not moved any further"
            )

    def end(self) -> None:
        """End the signs of life; the page's frame goes with the connection."""
        self._over.set()
        self._heart.join(PAGE_LOST)


def _common(robot: Robot, limits: tuple[Array, Array] | None) -> tuple[Array, Array]:
    """The limits of the page's arm and of the real one; raises `StoppedError` where nothing is inside both."""
    low, high = (robot.lower, robot.upper) if limits is None else limits
    both = np.maximum(low, robot.lower), np.minimum(high, robot.upper)
    for i in np.flatnonzero(both[0] > both[1]).tolist():
        own, page = (
            f"{_value(robot, i, a[i])} to {_value(robot, i, b[i])}"
            for a, b in ((low, high), (robot.lower, robot.upper))
        )
        raise StoppedError(
            f"{robot.joints[i].name}: the arm's own limits are {own}, those of the page's arm {page}; no value is "
            "inside both. Is the sign or the zero of its motor wrong? Nothing was moved"
        )
    return both


def said(robot: Robot, joint: int, value: float) -> str:
    """The size of a joint's motion in words: degrees, or millimetres."""
    return f"{abs(value) * 57.29577951308232:.1f}°" if robot.revolute[joint] else f"{abs(value) * 1000.0:.1f} mm"


def _value(robot: Robot, joint: int, value: float) -> str:
    return f"{'−' if value < 0 else ''}{said(robot, joint, value)}"
