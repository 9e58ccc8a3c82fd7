"""An SO-100 or SO-101 beside the arm of a page, over the bus of its Feetech servos.

    pip install -e '.[so101]'
    python examples/so101_arm.py K7QF-2M4A --port /dev/ttyACM0 --calibration my_arm.json

The ghost of the page is where the encoders say that the arm is; nothing is written to the bus. With `--drive` the
arm follows the page.
"""

from __future__ import annotations

import errno
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import connecting
import driving
import numpy as np
from numpy.typing import NDArray

import kin

try:
    import scservo_sdk
    from serial.tools.list_ports import comports
except ImportError:
    raise SystemExit(
        "so101_arm.py needs feetech-servo-sdk: pip install -e '.[so101]' in the folder of Kinboard"
    ) from None

GONE: tuple[type[Exception], ...] = (OSError,)  # what is raised once a port is gone
with suppress(ImportError):  # Windows has no such module
    import termios

    GONE += (termios.error,)

NAME: Final = "so101_arm.py"
BAUD: Final = 1_000_000
CYCLE: Final = 0.02  # s
TRIES: Final = 3  # of a packet, before its servo counts as lost
RESTING: Final = 0.5  # s between two tries of a bus whose servos do not answer
MARGIN: Final = (
    23  # ticks (2°) outside its range at which a servo may be switched on: it moves to the range itself
)

# Registers of the STS series, two bytes little-endian but for the first.
TORQUE_ENABLE, GOAL_POSITION, PRESENT_POSITION = 40, 42, 56
MODELS: Final = {777: "STS3215", 2825: "STS3250"}
TURN: Final = 4096  # ticks
TAU: Final = 2.0 * np.pi
# Bits of a status packet, in the order of their values.
ERRORS: Final = ("voltage", "encoder", "temperature", "current", "", "load")

Array = NDArray[np.float64]


class BusError(kin.KinematicsError):
    """A servo does not answer, or the port is gone."""


class Bus:
    """Servos on a serial port.

    Args:
        port: its name, such as ``/dev/ttyACM0``.
        motors: the servos, by their ids.

    Raises:
        BusError: the port cannot be opened.
    """

    def __init__(self, port: str, motors: Sequence[kin.motors.Motor]) -> None:
        self.port, self._motors = port, motors
        self._handler = scservo_sdk.PortHandler(port)
        self._packets = scservo_sdk.PacketHandler(0)  # little-endian
        self._handler.baudrate = BAUD
        try:
            self._handler.openPort()
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise BusError(port_problem(port, error)) from None

    def _ask(
        self, motor: kin.motors.Motor, work: Callable[[], tuple[Any, int, int]], tolerant: bool = False
    ) -> Any:
        """Do something to which a servo answers, again if its answer is broken; `tolerant` of its errors."""
        result = 0
        for _ in range(TRIES):
            try:
                self._handler.ser.reset_input_buffer()  # what is left of a broken answer
                value, result, error = work()
            except IndexError:  # an answer that is shorter than what was asked for
                result = scservo_sdk.COMM_RX_CORRUPT
                continue
            except GONE as gone:
                raise BusError(f"the bus at {self.port} is gone: {gone}") from None
            finally:
                self._handler.is_using = False
            if result == scservo_sdk.COMM_SUCCESS:
                if error and not tolerant:
                    bits = [name for i, name in enumerate(ERRORS) if error >> i & 1 and name]
                    raise BusError(f"{named(motor)} reports an error: {', '.join(bits) or f'bits {error:#x}'}")
                return value
        why = "does not answer" if result == scservo_sdk.COMM_RX_TIMEOUT else "answers with broken packets only"
        raise BusError(f"{named(motor)} {why}")

    def check(self) -> None:
        """Ask all servos what they are; raises `BusError` with every one that is missing or of another kind."""
        missing, found = [], []
        for motor in self._motors:
            try:
                model = self._ask(motor, lambda: self._packets.ping(self._handler, motor.id))  # noqa: B023
            except BusError as error:
                if "gone" in str(error):
                    raise
                missing.append(str(error))
            else:
                found.append(named(motor))
                if model not in MODELS:
                    known = " or ".join(f"{name} ({number})" for number, name in MODELS.items())
                    raise BusError(f"{named(motor)} is of model {model}, expected {known}: its registers differ")
        if missing:
            raise BusError(
                f"{'; '.join(missing)}. "
                + (f"{', '.join(found)} answered" if found else "No servo answered: is the arm's power on?")
            )

    def positions(self) -> Array:
        """Where the servos are ``(m,)``, ticks."""
        return np.array([self._read(motor, PRESENT_POSITION) for motor in self._motors], dtype=float)

    def _read(self, motor: kin.motors.Motor, address: int, tolerant: bool = False) -> int:
        read = self._packets.read2ByteTxRx
        value = int(self._ask(motor, lambda: read(self._handler, motor.id, address), tolerant))
        if value >= TURN:
            raise BusError(f"{named(motor)} says {value}, expected a position from 0 to {TURN - 1}")
        return value

    def hold(self) -> list[str]:
        """Let the servos hold where they are now; returns why each of those that cannot be reached cannot."""
        goals, lost = {}, []
        for motor in self._motors:
            try:
                goals[motor.id] = self._read(motor, PRESENT_POSITION, tolerant=True)
            except BusError as error:
                lost.append(str(error))
        if goals:
            self.move(goals)
        return lost

    def move(self, goals: Mapping[int, float]) -> None:
        """Set goals by the ids of their servos, ticks, in one packet, which none of them answers."""
        group = scservo_sdk.GroupSyncWrite(self._handler, self._packets, GOAL_POSITION, 2)
        for number, goal in goals.items():
            group.addParam(number, list(int(goal).to_bytes(2, "little")))
        try:
            if group.txPacket() != scservo_sdk.COMM_SUCCESS:
                raise BusError(f"the bus at {self.port} took no goals")
        except GONE as gone:
            raise BusError(f"the bus at {self.port} is gone: {gone}") from None
        finally:
            self._handler.is_using = False

    def switch(self, on: bool) -> None:
        """Switch the torque of all servos."""
        write = self._packets.write1ByteTxRx
        for motor in self._motors:
            self._ask(motor, lambda: (None, *write(self._handler, motor.id, TORQUE_ENABLE, int(on))))  # noqa: B023

    def close(self) -> None:
        """Close the port; the servos stay as they are."""
        self._handler.closePort()


def named(motor: kin.motors.Motor) -> str:
    """A motor in words."""
    return f"motor {motor.id} ({motor.name or motor.joint})"


def port_problem(port: str, error: Exception) -> str:
    """Why a port cannot be opened, and what to do about it."""
    number = getattr(error, "errno", None)
    if number in (errno.EACCES, errno.EPERM):
        return f"no permission to use {port}: sudo usermod -aG dialout $USER, then log in again"
    if number == errno.ENOENT or "could not open" in str(error):
        ports = ", ".join(sorted(each.device for each in comports())) or "none"
        return f"there is no port {port}. Ports of this machine: {ports}"
    return f"{port} cannot be opened: {error}"


def moving(robot: kin.Robot) -> list[kin.motors.Motor]:
    """The motors that move a joint."""
    return [motor for motor in robot.motors if motor.joint]


def motors_of(robot: kin.Robot, options: Namespace) -> kin.Robot:
    """The arm with motors whose ticks are understood; raises `kin.KinematicsError`."""
    if options.calibration is not None:
        text = Path(options.calibration).read_text(encoding="utf-8")
        if not robot.motors:
            print("The page's arm states no motors: signs + and zeros in the middle of the ranges are assumed.")
        robot = replace(robot, motors=kin.motors.motors_from_lerobot(robot, text))
    bare = [motor for motor in moving(robot) if motor.range is None and motor.unit != "ticks"]
    if bare or {motor.joint for motor in moving(robot)} != {joint.name for joint in robot.joints}:
        lacking = f"no calibrated range of {', '.join(map(named, bare))}" if bare else "not a motor for each joint"
        raise kin.KinematicsError(
            f"{robot.name} has {lacking}: --calibration FILE.json gives those of LeRobot, which keeps them in "
            "~/.cache/huggingface/lerobot/calibration/robots"
        )
    return robot


class Scale:
    """Joint values of a driven arm by the ticks of its servos, in a straight line over their calibrated ranges.

    A reading tells a joint value only up to whole turns, and `q_from_readings` chooses the one that fits the
    limits best. Two ticks side by side may then be a turn apart, and the ends of a full turn, 0 and 4095, may
    both become 180°. To a servo its goals are numbers on one line: it goes from 4095 to 0 all the way back. So
    the turn is chosen once here, for all readings, goals and limits.

    Args:
        robot: the arm with its motors.
        motors: those that move a joint.
        ticks: where they are ``(m,)``. If that is inside the limits on some turn, that turn is chosen; otherwise
            the one on which the middle of the range is.

    Attributes:
        limits: the configurations ``(n,)`` at the ends of the calibrated ranges: lower and upper ones.

    Raises:
        KinematicsError: a servo is outside its calibrated range.
    """

    def __init__(self, robot: kin.Robot, motors: Sequence[kin.motors.Motor], ticks: Array) -> None:
        self._low, self._high = np.array([motor.range or (0, motor.ticks - 1) for motor in motors], dtype=float).T
        for motor, tick, low, high in zip(motors, ticks, self._low, self._high, strict=True):
            if not low - MARGIN <= tick <= high + MARGIN:
                raise kin.KinematicsError(
                    f"{named(motor)} is at {tick:.0f} ticks, outside its calibrated range from {low:.0f} to "
                    f"{high:.0f}: is the calibration of another arm, or older? Nothing was moved"
                )
        self._ends = np.minimum(self._low, ticks), np.maximum(self._high, ticks)
        self._middle = 0.5 * (self._low + self._high)
        first, last = kin.motors.readings_from_ticks(motors, np.array([self._low, self._high]))
        scale = [motor.sign * motor.scale for motor in motors]
        self._slope = scale * (self._high - self._low) / (last - first)  # ticks of a radian (metre)
        names = [joint.name for joint in robot.joints]
        self._joints = np.array([names.index(motor.joint) for motor in motors])
        self._n = robot.n
        self._zero = kin.motors.q_from_readings(robot, 0.5 * (first + last))
        q = kin.motors.q_from_readings(robot, kin.motors.readings_from_ticks(motors, ticks))
        turns = np.round((q - self.q(ticks)) / TAU)
        self._zero += TAU * np.where(robot.revolute & (q >= robot.lower) & (q <= robot.upper), turns, 0.0)
        ends = [self._each(end) for end in (self._low, self._high)]
        self.limits = (
            np.array([np.minimum(*ends)[self._joints == j].max() for j in range(self._n)]),
            np.array([np.maximum(*ends)[self._joints == j].min() for j in range(self._n)]),
        )

    def _each(self, ticks: Array) -> Array:
        """What each motor says of its joint ``(m,)``."""
        found: Array = self._zero[self._joints] + (ticks - self._middle) / self._slope
        return found

    def q(self, ticks: Array) -> Array:
        """The configuration ``(n,)`` at these ticks ``(m,)``; a joint with two motors has the mean of both."""
        each = self._each(ticks)
        return np.array([each[self._joints == j].mean() for j in range(self._n)])

    def ticks(self, q: Array) -> Array:
        """The goals of the servos ``(m,)`` for a configuration ``(n,)``, whole numbers within their ranges."""
        goals = self._middle + self._slope * (q - self._zero)[self._joints]
        found: Array = np.rint(np.clip(goals, *self._ends))
        return found


class Servos:
    """The servos of an arm, in joint values.

    Args:
        bus: with the motors that move a joint.
        robot: the arm with these motors.
    """

    def __init__(self, bus: Bus, robot: kin.Robot) -> None:
        self._bus, self._robot = bus, robot
        self._motors = moving(robot)

    def scale(self) -> Scale:
        """The scale on which they are driven from where they are now."""
        return Scale(self._robot, self._motors, self._bus.positions())

    def read(self, scale: Scale) -> Array:
        """The configuration of the arm ``(n,)``, radians."""
        return scale.q(self._bus.positions())

    def show(self, page: Any, shown: kin.Robot) -> None:
        """Send where the arm is: as readings, for *Match motors*, where the page's arm has these motors."""
        readings = kin.motors.readings_from_ticks(self._motors, self._bus.positions())
        own = {
            (motor.id, motor.joint, motor.unit): value for motor, value in zip(self._motors, readings, strict=True)
        }
        theirs = [(motor.id, motor.joint, motor.unit) for motor in moving(shown)]
        if theirs and set(theirs) == set(own):
            page.readings = [own[motor] for motor in theirs]
        else:
            page.measured = kin.motors.q_from_readings(self._robot, readings)

    def write(self, scale: Scale, q: Array, joints: NDArray[np.bool_]) -> None:
        """Lead the servos of these joints ``(n,)`` to a configuration ``(n,)``, within their calibrated ranges."""
        moved = {joint.name for joint, moves in zip(self._robot.joints, joints, strict=True) if moves}
        goals = zip(self._motors, scale.ticks(q).tolist(), strict=True)
        self._bus.move({motor.id: goal for motor, goal in goals if motor.joint in moved})


def work(page: Any, options: Namespace) -> None:
    """Show where the arm is, and let it follow, until the connection to the page ends."""
    arm = page.robot
    robot = motors_of(arm, options)
    bus = Bus(options.port, moving(robot))
    try:
        bus.check()
        servos = Servos(bus, robot)
        print(f"{robot.n} servos answer at {options.port}.", flush=True)
        if options.drive:
            drive(page, arm, bus, servos, options)
        else:
            mirror(page, arm, bus, options)
    finally:
        bus.close()


def mirror(page: Any, arm: kin.Robot, bus: Bus, options: Namespace) -> None:
    """Read the servos again and again, and nothing else; the page may change the signs and zeros of its motors."""
    began, lost = time.monotonic(), ""
    servos, shown = Servos(bus, motors_of(arm, options)), arm
    while options.seconds is None or time.monotonic() - began < options.seconds:
        if (now := page.robot) != shown:
            if [joint.name for joint in now.joints] != [joint.name for joint in arm.joints]:
                raise kin.KinematicsError(f"the page shows {now.name} now: start again for this arm")
            servos, shown = Servos(bus, motors_of(now, options)), now
        try:
            servos.show(page, shown)
        except kin.InputError:
            if page.robot == shown:
                raise  # else the page has just changed its arm
        except BusError as error:
            if "gone" in str(error):
                raise
            if str(error) != lost:
                lost = str(error)
                print(f"{lost}. The ghost is hidden meanwhile.", flush=True)
            hide(page, shown)
            time.sleep(RESTING)
        else:
            if lost:
                print("All servos answer again.", flush=True)
            lost = ""
        time.sleep(CYCLE)


def hide(page: Any, shown: kin.Robot) -> None:
    """Remove the ghost: nobody knows where the arm is."""
    if moving(shown):
        page.readings = None
    page.measured = None


def drive(page: Any, arm: kin.Robot, bus: Bus, servos: Servos, options: Namespace) -> None:
    """Let the arm follow the page, from where it is."""
    driving.confirm(f"The arm at {options.port}", options)
    scale = servos.scale()
    if lost := bus.hold():  # the goal first: a servo that is switched on goes to its last one
        raise BusError("; ".join(lost))
    bus.switch(True)
    guide: driving.Guide | None = None
    began = time.monotonic()
    try:
        q = servos.read(scale)
        guide = driving.Guide(page, f"{arm.name} at {options.port}", options.speed, q, scale.limits)
        print("The arm follows the page.", flush=True)
        while options.seconds is None or time.monotonic() - began < options.seconds:
            q, heard = servos.read(scale), time.monotonic()
            page.measured = q
            before = guide.asked
            if not np.array_equal(guide.step(q, heard), before):
                servos.write(scale, guide.asked, guide.commanded)
            time.sleep(CYCLE)
    finally:
        if guide is not None:
            guide.end()
        stop(bus, options)


def stop(bus: Bus, options: Namespace) -> None:
    """Hold the arm where it is, or release it."""
    try:
        if options.release:
            bus.switch(False)
            print("The motors are off.", flush=True)
            return
        lost = bus.hold()
    except BusError as error:
        lost = [str(error)]
    for why in lost:
        print(f"{why}. It goes on to its last goal, which is close by.", file=sys.stderr)
    print("The arm holds its place: its motors stay on until its power is off.", flush=True)


def main(words: Sequence[str] | None = None) -> int:
    """Run the program; returns its exit code."""
    parser = connecting.parser("Show where an SO-100 or SO-101 is; with --drive it follows the page.")
    parser.add_argument("--port", required=True, help="serial port of the arm, such as /dev/ttyACM0 or COM3")
    parser.add_argument("--calibration", metavar="FILE.json", help="of this arm, as LeRobot writes it")
    driving.add_options(parser)
    parser.add_argument("--release", action="store_true", help="with --drive: switch the motors off at the end")
    return connecting.main(parser, work, NAME, words)


if __name__ == "__main__":
    sys.exit(main())
