"""A session with a page and an arm: a mirror that writes nothing, until the owner says *enable*; then it follows.

The owner types `COMMANDS`, or presses the buttons of the page, which are the same words. What stops the arm is
said in both; then the session goes on, and the arm waits for the next *enable*, unless page or bus are lost. The
gripper moves no joint of the model: it follows the page's slider of the gripper.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from queue import Empty, SimpleQueue
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import kin
from app.servos.bus import Bus
from app.servos.calibration import gripper_of, moving
from app.servos.ports import BusError, PortGoneError
from app.servos.scale import Scale
from kin.notebook.driving import Guide, PageLostError

CYCLE: Final = 0.02  # s
RESTING: Final = 0.5  # s between two tries of a bus whose servos do not answer
COMMANDS: Final = """Type and press Enter:
  enable      the arm follows the page, from where it is
  gripper 40  the gripper, as its slider in the page: 0 is closed, 100 is open (after enable)
  stop        hold the arm where it is
  release     switch the motors off: hold the arm with your hand
  quit        end"""
MIRROR: Final = "The ghost is where the arm is. Nothing moves before you press Enable."
FOLLOWS: Final = "The arm follows this page at up to {:g} deg/s"
HELD: Final = "The arm holds its place: its motors are on."
OFF: Final = "The motors are off."
Button = Mapping[str, str | bool]
RELEASE: Final[Button] = {
    "name": "release",
    "label": "Release",
    "confirm": "The motors are switched off. Hold the arm with your hand, or it falls.",
}
LONGEST: Final = 300  # characters that the page shows of what is announced
GRIPPER_SPEED: Final = 50.0  # of 100, a second
SQUEEZE: Final = 150  # ticks (13°) that the goal of the gripper is ahead at most: how hard it grips

Array = NDArray[np.float64]


class Gripper:
    """The gripper of an arm, which is switched on when it first gets a goal.

    Args:
        bus: of its servo.
        motor: with its calibrated range.
    """

    def __init__(self, bus: Bus, motor: kin.motors.Motor) -> None:
        self._bus, self.motor = bus, motor
        low, high = motor.range or (0, motor.ticks - 1)
        self._low, self._high = float(low), float(high)
        first, last = kin.motors.readings_from_ticks([motor], np.array([[low], [high]]))[:, 0]
        self._closed, self._open = (low, high) if first < last else (high, low)
        self._asked = self._wanted = np.nan

    @property
    def on(self) -> bool:
        """Whether it has a goal."""
        return not np.isnan(self._wanted)

    @property
    def opening(self) -> float:
        """How far it is open, from 0 (closed) to 1 (open)."""
        return self._opening_at(float(self._bus.positions([self.motor])[0]))

    def _opening_at(self, here: float) -> float:
        return float(np.clip((here - self._closed) / (self._open - self._closed), 0.0, 1.0))

    def go(self, opening: float) -> None:
        """From now on it goes there: 0 is closed, 1 open."""
        if not self.on:
            self._asked = float(self._bus.positions([self.motor])[0])
            self._bus.hold([self.motor])  # the goal first: a servo that is switched on goes to its last one
            self._bus.switch([self.motor], True)
        self._wanted = self._closed + opening * (self._open - self._closed)

    def step(self, seconds: float) -> float:
        """Go on, at a limited speed and not far ahead of where it is: what it holds, it squeezes no harder.

        Returns how far it was open before this step.
        """
        here = float(self._bus.positions([self.motor])[0])
        if self.on:
            self._lead(here, seconds)
        return self._opening_at(here)

    def _lead(self, here: float, seconds: float) -> None:
        most = GRIPPER_SPEED / 100.0 * (self._high - self._low) * seconds
        before = self._asked
        self._asked += float(np.clip(self._wanted - self._asked, -most, most))
        self._asked = float(np.clip(self._asked, here - SQUEEZE, here + SQUEEZE))
        if self._asked != before:
            self._bus.move({self.motor.id: round(float(np.clip(self._asked, self._low, self._high)))})

    def forget(self) -> None:
        """It is held where it is, or switched off; `go` begins anew."""
        self._asked = self._wanted = np.nan


class Session:
    """One arm, the page that shows it, and what its owner types.

    Args:
        page: a `kin.connect`-ed page, with the arm.
        bus: of the servos.
        calibrated: gives an arm motors whose ticks are understood.
        typed: what the owner types, a line each.
        speed: of each joint when driven, deg/s, at most.
        seconds: when it ends; None: when the owner or the page ends it.

    Raises:
        KinematicsError: there is no such arm.
    """

    def __init__(
        self,
        page: Any,
        bus: Bus,
        calibrated: Callable[[kin.Robot], kin.Robot],
        typed: SimpleQueue[str],
        speed: float,
        seconds: float | None = None,
    ) -> None:
        self._page, self._bus, self._calibrated, self._typed = page, bus, calibrated, typed
        self._speed, self._end = speed, np.inf if seconds is None else time.monotonic() + seconds
        self._arm = self._shown = page.robot
        self._robot = calibrated(self._arm)
        self._motors = moving(self._robot)
        motor = gripper_of(self._robot)
        self._gripper = None if motor is None else Gripper(bus, motor)
        self._opening: float | None = None  # that the page's gripper had last, while the arm follows
        self._enabled = False
        say = FOLLOWS.format(speed).replace("follows", "will follow")
        enable: Button = {
            "name": "enable",
            "label": "Enable",
            "confirm": f"{say}. Keep its power switch within reach.",
        }
        stop: Button = {"name": "stop", "label": "Stop", "stops": True}
        self._offered: Mapping[str, list[Button]] = {
            "ready": [enable, RELEASE],
            "enabled": [stop, RELEASE],
            "stopped": [enable, RELEASE],
        }

    def run(self, release: bool = False) -> None:
        """Check the bus, then show and drive until the end; `release`: switch the motors off then.

        Raises:
            KinematicsError: why the arm was not moved, or not any further.
        """
        print(self._bus.check(self._all), flush=True)
        print(COMMANDS, flush=True)
        threading.Thread(target=self._hear, args=(self._page.events(),), daemon=True).start()
        self._announce("ready", MIRROR)
        while self._mirror() == "enable":
            self._enabled = True
            if self._follow(release) == "quit":
                return
        if release and self._enabled:
            self._release()

    def _hear(self, events: Iterable[Any]) -> None:
        """Take what is pressed in the page as if it were typed."""
        for event in events:
            if event.kind == "pressed":
                self._typed.put(event.value)

    def _announce(self, state: str, words: str) -> None:
        """Say in the page how the arm does, with the buttons of this state; in a fault it can only be released."""
        self._page.announce(words[:LONGEST], self._offered.get(state, [RELEASE]), state)

    def _follow(self, release: bool) -> str:
        """Drive the arm until its owner ends that, or something stops it; returns the word that ends it."""
        try:
            word, state, words = self._drive(release), "stopped", HELD
        except kin.KinematicsError as error:
            if isinstance(error, PageLostError) or not self._page.connected:
                raise
            word, state, words = "stop", "stopped", f"{error}."
            print(words, file=sys.stderr, flush=True)
            if isinstance(error, PortGoneError):
                self._announce("fault", words)
                raise
        if word != "quit":
            self._page.drives = None
            if word == "release" and self._enabled:
                self._release_or_refuse(word)  # once more: not all were reached, which the page is to say
            else:
                self._announce(*(("ready", OFF) if word == "release" else (state, words)))
        return word

    @property
    def _all(self) -> list[kin.motors.Motor]:
        return self._motors if self._gripper is None else [*self._motors, self._gripper.motor]

    @property
    def _on(self) -> list[kin.motors.Motor]:
        """The motors that `enable` and `gripper` have switched on."""
        return self._all if self._gripper is not None and self._gripper.on else self._motors

    def _next(self) -> str:
        """What was typed; empty: nothing."""
        if time.monotonic() >= self._end:
            return "quit"
        try:
            return self._typed.get_nowait().strip().lower()
        except Empty:
            return ""

    def _mirror(self) -> str:
        """Read the servos again and again, and nothing else; returns the word that ends it."""
        lost = ""
        while True:
            word = self._next()
            if word in ("enable", "quit"):
                return word
            try:
                self._release_or_refuse(word)
                self._show()
            except PortGoneError as error:
                self._announce("fault", f"{error}.")
                raise
            except BusError as error:
                if str(error) != lost:
                    lost = str(error)
                    self._say("fault", f"{lost}. The ghost is hidden meanwhile.")
                self._hide()
                time.sleep(RESTING)
            else:
                if lost:
                    self._say("stopped" if self._enabled else "ready", "All servos answer again.")
                lost = ""
            time.sleep(CYCLE)

    def _say(self, state: str, words: str) -> None:
        """Say something in the terminal and in the page."""
        print(words, flush=True)
        self._announce(state, words)

    def _release(self) -> None:
        """Switch the motors off; raises `BusError` for those that cannot be reached, when the others are off."""
        try:
            self._bus.switch(self._all, False)
        except PortGoneError:
            raise
        except BusError as error:
            raise BusError(f"{error}. The other motors are off") from None
        self._enabled = False
        print(OFF, flush=True)

    def _release_or_refuse(self, word: str) -> None:
        """Do what may be asked of an arm that does not follow."""
        if word == "release":
            try:
                self._release()
            except PortGoneError:
                raise
            except BusError as error:
                self._say("fault", f"{error}.")
            else:
                self._announce("ready", OFF)
        elif word.startswith("gripper"):
            print("The gripper moves after enable only.", flush=True)
        elif word and word != "stop":
            print(f"Got {word[:40]!a}. {COMMANDS}", flush=True)

    def _show(self) -> None:
        """Send where the arm is: as readings, for *Match motors*, where the page's arm has these motors."""
        if (now := self._page.robot) != self._shown:  # the page may change the signs and zeros of its motors
            if [joint.name for joint in now.joints] != [joint.name for joint in self._arm.joints]:
                raise kin.KinematicsError(f"the page shows {now.name} now: start again for this arm")
            self._robot, self._shown = self._calibrated(now), now
            self._motors = moving(self._robot)
        readings = kin.motors.readings_from_ticks(self._motors, self._bus.positions(self._motors))
        own = {
            (motor.id, motor.joint, motor.unit): value for motor, value in zip(self._motors, readings, strict=True)
        }
        theirs = [(motor.id, motor.joint, motor.unit) for motor in moving(self._shown)]
        try:
            if theirs and set(theirs) == set(own):
                self._page.readings = [own[motor] for motor in theirs]
            else:
                self._page.measured = kin.motors.q_from_readings(self._robot, readings)
            if self._gripper is not None:
                self._show_measured(self._gripper.opening)
        except kin.InputError:
            if self._page.robot == self._shown:
                raise  # else the page has just changed its arm

    def _hide(self) -> None:
        """Remove the ghost: nobody knows where the arm is."""
        if moving(self._shown):
            self._page.readings = None
        self._page.measured = self._page.measured_gripper = None

    def _show_measured(self, opening: float) -> None:
        """Say how far the gripper is open, if the page's arm has one."""
        if self._page.gripper is not None:
            self._page.measured_gripper = round(opening, 3)

    def _drive(self, release: bool) -> str:
        """Let the arm follow the page, from where it is; returns the word that ends it."""
        bus, page, motors = self._bus, self._page, self._motors
        print(f"{FOLLOWS.format(self._speed)}. Keep its power switch within reach.", flush=True)
        scale = Scale(self._robot, motors, bus.positions(motors))
        if lost := bus.hold(motors):  # the goal first: a servo that is switched on goes to its last one
            raise BusError("; ".join(lost))
        guide: Guide | None = None
        released = False
        try:
            bus.switch(motors, True)
            q = scale.q(bus.positions(motors))
            guide = Guide(page, f"{self._arm.name} at {bus.port}", self._speed, q, scale.limits)
            self._show_gripper()
            print("The arm follows the page.", flush=True)
            self._announce("enabled", f"{FOLLOWS.format(self._speed)}.")
            while (word := self._next()) not in ("stop", "release", "quit"):
                self._command(word)
                q, heard = scale.q(bus.positions(motors)), time.monotonic()
                page.measured = q
                before = guide.asked
                if not np.array_equal(guide.step(q, heard), before):
                    self._write(scale, guide.asked, guide.commanded)
                self._follow_gripper()
                time.sleep(CYCLE)
            released = word == "release" or (release and word == "quit")
            return word
        except KeyboardInterrupt:
            released = release
            raise
        finally:
            if guide is not None:
                guide.end()
            self._stop(released)

    def _command(self, word: str) -> None:
        """Do what may be asked of an arm that follows."""
        name, _, value = word.partition(" ")
        if name != "gripper":
            if word:
                print("The arm follows the page." if word == "enable" else f"Got {word[:40]!a}. {COMMANDS}")
            return
        try:
            percent = float(value)
        except ValueError:
            percent = np.nan
        if self._gripper is None:
            print("The calibration has no gripper.", flush=True)
        elif not 0.0 <= percent <= 100.0:
            print(f"gripper: got {value[:40]!a}, expected a number from 0 (closed) to 100 (open).", flush=True)
        else:
            self._gripper.go(percent / 100.0)
            self._show_opening(percent / 100.0)

    def _show_opening(self, opening: float) -> None:
        """Have the page's gripper open so far, if its arm has one; `_follow_gripper` waits for other values."""
        if self._page.gripper is not None:
            self._page.gripper = self._opening = opening

    def _show_gripper(self) -> None:
        """Have the page take over how far the gripper is open, so that it does not move at first."""
        self._opening = None
        if self._gripper is not None:
            self._show_opening(round(self._gripper.opening, 3))

    def _follow_gripper(self) -> None:
        """Lead the gripper on, to where the page's gripper has been moved since it was taken over."""
        if self._gripper is None:
            return
        before, self._opening = self._opening, self._page.gripper
        if before is not None and self._opening is not None and self._opening != before:
            self._gripper.go(self._opening)
        self._show_measured(self._gripper.step(CYCLE))

    def _write(self, scale: Scale, q: Array, joints: NDArray[np.bool_]) -> None:
        """Lead the servos of these joints ``(n,)`` to a configuration ``(n,)``, within their calibrated ranges."""
        moved = {joint.name for joint, moves in zip(self._robot.joints, joints, strict=True) if moves}
        goals = zip(self._motors, scale.ticks(q).tolist(), strict=True)
        self._bus.move({motor.id: goal for motor, goal in goals if motor.joint in moved})

    def _stop(self, release: bool) -> None:
        """Hold the arm where it is, or release it."""
        on = self._on
        if self._gripper is not None:
            self._gripper.forget()
        try:
            if release:
                self._release()
                return
            lost = self._bus.hold(on)
        except BusError as error:
            if release:
                print(f"{error}.", file=sys.stderr)
                return
            lost = [str(error)]
        for why in lost:
            print(f"{why}. It goes on to its last goal, which is close by.", file=sys.stderr)
        print("The arm holds its place: its motors stay on until its power is off.", flush=True)
