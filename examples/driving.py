"""What the programs that move a real arm share: a confirmation, a limit on its speed, and reasons to stop.

None of it is a safety function: keep an emergency stop within reach.
"""

from __future__ import annotations

import argparse
import threading
import time
from typing import Any, Final

import connecting
import numpy as np
from connecting import said
from numpy.typing import NDArray

import kin

BEAT: Final = 0.2  # s between two signs of life that the page is asked for
PAGE_LOST: Final = 1.5  # s without one
ARM_LOST: Final = 0.5  # s without a word of the arm
BEHIND, PATIENCE = (
    np.radians(25.0),
    0.5,
)  # rad (for slides: m / 10), s: an arm so far behind for so long is blocked
LONGEST: Final = 60  # characters of the name of what is driven
SAME: Final = 1e-3  # rad (m)
SLOW, SLOW_SLIDE = 20.0, 0.05  # deg/s, m/s

Array = NDArray[np.float64]


class StoppedError(kin.KinematicsError):
    """The arm was not moved, or not any further; the message says why."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of driving."""
    parser.add_argument(
        "--drive", action="store_true", help="move the arm as the page does; without it, it is only read"
    )
    parser.add_argument(
        "--speed",
        type=connecting.positive,
        default=SLOW,
        help=f"with --drive: deg/s of a joint, at most (default: {SLOW:g}); joints that slide: {SLOW_SLIDE:g} m/s",
    )
    parser.add_argument("--yes", action="store_true", help="do not ask before the arm is moved")


def confirm(what: str, options: argparse.Namespace) -> None:
    """Ask whether the arm may move; raises `StoppedError` for any answer but yes."""
    print(f"{what} will follow the page, at up to {options.speed:g} deg/s. Keep its power switch within reach.")
    if options.yes:
        return
    try:
        answer = input("Type yes to let it move: ")
    except EOFError:
        answer = ""
    if answer.strip().lower() != "yes":
        raise StoppedError("not confirmed: the arm was not moved")


class Guide:
    """Leads an arm to the configuration that its page shows, at a limited speed.

    Args:
        page: the page, which gets a red frame with the name of the arm.
        what: that name.
        speed: of each joint, deg/s.
        measured: where the arm is ``(n,)``; the page takes it over, so that nothing moves at first.
        limits: lower and upper configurations ``(n,)`` that the arm itself has, beside those of the page.

    Raises:
        StoppedError: the page did not take it over.
    """

    def __init__(
        self, page: Any, what: str, speed: float, measured: Array, limits: tuple[Array, Array] | None = None
    ) -> None:
        self._page, self._what, self._robot = page, what[:LONGEST], page.robot
        self._limits = limits or (self._robot.lower, self._robot.upper)
        self._speed = np.where(self._robot.revolute, np.radians(speed), SLOW_SLIDE)
        self._behind = np.where(self._robot.revolute, BEHIND, 0.1 * BEHIND)
        self.asked = measured.copy()
        page.drives = self._what
        page.q = self._robot.clip(measured)
        page.stop()  # a program that is played; answered when the page has taken q, too
        if np.abs(page.q - self._robot.clip(measured)).max() > SAME:
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
            except kin.KinematicsError:
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
        elapsed, self._before = now - self._before, now
        if not self._page.connected or now - self._alive > PAGE_LOST:
            raise StoppedError("the page does not answer: the arm is not moved any further")
        if now - heard > ARM_LOST:
            raise StoppedError(f"the arm has said nothing for {ARM_LOST:g} s: it is not moved any further")
        q = self._page.q
        if self._page.robot != self._robot or q.shape != self.asked.shape:
            raise StoppedError("the page shows another arm: this one is not moved any further")
        behind = np.abs(self.asked - measured)
        if (behind < self._behind).all():
            self._followed = now
        elif now - self._followed > PATIENCE:
            i = int(np.argmax(behind / self._behind))
            raise StoppedError(
                f"{self._robot.joints[i].name} is {said(self._robot, i, behind[i])} behind: something holds it, "
                "or its motor is too weak. The arm is not moved any further"
            )
        way = np.clip(q, *self._limits) - self.asked
        longest = float(np.max(np.abs(way) / (self._speed * max(elapsed, 1e-6)), initial=0.0))
        self.asked = self.asked + way / max(longest, 1.0)  # all joints arrive together
        return self.asked

    def end(self) -> None:
        """End the signs of life; the page's frame goes with the connection."""
        self._over.set()
        self._heart.join(PAGE_LOST)
