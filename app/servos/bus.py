"""The servos of an arm on their serial bus: read, checked, moved."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, Final

import numpy as np
import scservo_sdk
from numpy.typing import NDArray

import kin
from app.servos.ports import BusError, PortGoneError, is_simulated, port_problem
from app.servos.registers import BAUD, GOAL, HOTTEST, PRESENT, TORQUE, TURN, VOLTAGE
from app.servos.simulated import SimulatedPort, simulated_arm

GONE: tuple[type[Exception], ...] = (OSError,)  # what is raised once a port is gone
with suppress(ImportError):  # Windows has no such module
    import termios

    GONE += (termios.error,)

OTHER_RATES: Final = (500_000, 250_000, 128_000, 115_200, 57_600, 38_400)
TRIES: Final = 3  # of a packet, before its servo counts as lost

MODELS: Final = {777: "STS3215", 2825: "STS3250"}
# Bits of a status packet, in the order of their values, and what to do.
ERRORS: Final = (
    "voltage: is this the arm's own power supply, and its plug all the way in?",
    "encoder: switch the arm's power off and on; if it stays, replace the servo",
    "temperature: switch the arm's power off, and let it cool down",
    "current: something holds it; switch the arm's power off and on",
    "",
    "overload: take the load off, and switch the arm's power off and on",
)

Array = NDArray[np.float64]
Motors = Sequence[kin.motors.Motor]


class Bus:
    """Servos on a serial port; ``sim`` is a simulated arm, ``sim:missing=3`` one with a fault.

    Raises:
        BusError: the port cannot be opened.
        InputError: there is no such fault.
    """

    def __init__(self, port: str) -> None:
        self.port = port
        self._handler = scservo_sdk.PortHandler(port)
        self._packets = scservo_sdk.PacketHandler(0)  # little-endian
        self._handler.baudrate = BAUD
        if is_simulated(port):
            self._handler.ser = SimulatedPort(simulated_arm(port.partition(":")[2]))
            return
        try:
            self._handler.openPort()
            self._handler.ser.exclusive = True
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
                raise PortGoneError(f"the bus at {self.port} is gone: {gone}") from None
            finally:
                self._handler.is_using = False
            if result == scservo_sdk.COMM_SUCCESS:
                if error and not tolerant:
                    said = [words for i, words in enumerate(ERRORS) if error >> i & 1 and words]
                    raise BusError(f"{named(motor)} reports an error: {'; '.join(said) or f'bits {error:#x}'}")
                return value
        why = "does not answer" if result == scservo_sdk.COMM_RX_TIMEOUT else "answers with broken packets only"
        raise BusError(f"{named(motor)} {why}")

    def check(self, motors: Motors) -> str:
        """Ask all servos what they are and how they are; returns a sentence.

        Raises:
            BusError: every one that is missing, of another kind or not fit to be moved, and what to do.
        """
        missing, found = [], []
        for motor in motors:
            try:
                model = self._ask(motor, lambda: self._packets.ping(self._handler, motor.id))  # noqa: B023
            except BusError as error:
                if "does not answer" not in str(error):
                    raise
                missing.append(str(error))
            else:
                found.append(named(motor))
                if model not in MODELS:
                    known = " or ".join(f"{name} ({number})" for number, name in MODELS.items())
                    raise BusError(f"{named(motor)} is of model {model}, expected {known}: its registers differ")
        if missing and not found:
            raise BusError(f"No servo answered at {self.port}: {self._why_silent(motors)}")
        if missing:
            raise BusError(
                f"{'; '.join(missing)}. {', '.join(found)} answered: check the cable from the servo before it. "
                "Servos that were never set up have the id 1: lerobot-setup-motors gives each its own"
            )
        volts, hottest = zip(*(self._health(motor) for motor in motors), strict=True)
        return f"{len(motors)} servos answer at {self.port}: {min(volts):.1f} V, {max(hottest)} °C at most."

    def _why_silent(self, motors: Motors) -> str:
        """What to do about a bus on which nobody answers; tries other baud rates."""
        try:
            for rate in OTHER_RATES:
                self._set_rate(rate)
                for motor in motors:
                    if self._packets.ping(self._handler, motor.id)[1] == scservo_sdk.COMM_SUCCESS:
                        return (
                            f"{named(motor)} talks at {rate} baud, expected {BAUD}. lerobot-setup-motors sets the "
                            "rate of each servo"
                        )
        except GONE as gone:
            return f"the port is gone: {gone}"
        finally:
            self._handler.is_using = False
            with suppress(*GONE):
                self._set_rate(BAUD)
        return "is the arm's power on, the cable in the first servo, and this the arm's port?"

    def _set_rate(self, rate: int) -> None:
        self._handler.ser.baudrate = self._handler.baudrate = rate
        self._handler.tx_time_per_byte = 10_000.0 / rate

    def _health(self, motor: kin.motors.Motor) -> tuple[float, int]:
        """The supply (V) and the temperature (°C) of a servo; raises `BusError` outside its own limits."""

        def read(address: int, length: int) -> Any:
            return self._ask(motor, lambda: self._packets.readTxRx(self._handler, motor.id, address, length))

        hottest, highest, lowest = read(HOTTEST, 3)
        volts, celsius = read(VOLTAGE, 2)
        if not lowest <= volts <= highest:
            raise BusError(
                f"{named(motor)} gets {volts / 10:.1f} V, expected {lowest / 10:.1f} to {highest / 10:.1f} V: is "
                "this the arm's own power supply? Arms of 7.4 V and of 12 V have different ones"
            )
        if celsius >= hottest:
            raise BusError(
                f"{named(motor)} is at {celsius} °C, expected less than {hottest} °C: switch the arm's power off, "
                "and let it cool down"
            )
        return volts / 10, celsius

    def positions(self, motors: Motors) -> Array:
        """Where servos are ``(m,)``, ticks."""
        return np.array([self._read(motor) for motor in motors], dtype=float)

    def _read(self, motor: kin.motors.Motor, tolerant: bool = False) -> int:
        read = self._packets.read2ByteTxRx
        value = int(self._ask(motor, lambda: read(self._handler, motor.id, PRESENT), tolerant))
        if value >= TURN:
            raise BusError(f"{named(motor)} says {value}, expected a position from 0 to {TURN - 1}")
        return value

    def hold(self, motors: Motors) -> list[str]:
        """Let servos hold where they are now; returns why each of those that cannot be reached cannot."""
        goals, lost = {}, []
        for motor in motors:
            try:
                goals[motor.id] = self._read(motor, tolerant=True)
            except BusError as error:
                lost.append(str(error))
        if goals:
            self.move(goals)
        return lost

    def move(self, goals: Mapping[int, float]) -> None:
        """Set goals by the ids of their servos, ticks, in one packet, which none of them answers."""
        group = scservo_sdk.GroupSyncWrite(self._handler, self._packets, GOAL, 2)
        for number, goal in goals.items():
            group.addParam(number, list(int(goal).to_bytes(2, "little")))
        try:
            if group.txPacket() != scservo_sdk.COMM_SUCCESS:
                raise BusError(f"the bus at {self.port} took no goals")
        except GONE as gone:
            raise PortGoneError(f"the bus at {self.port} is gone: {gone}") from None
        finally:
            self._handler.is_using = False

    def switch(self, motors: Motors, on: bool) -> None:
        """Switch the torque of servos; off: of all that answer, before it raises for those that do not."""
        write, lost = self._packets.write1ByteTxRx, []
        for motor in motors:
            try:
                self._ask(motor, lambda: (None, *write(self._handler, motor.id, TORQUE, int(on))), not on)  # noqa: B023
            except BusError as error:
                if on or isinstance(error, PortGoneError):
                    raise
                lost.append(str(error))
        if lost:
            raise BusError("; ".join(lost))

    def close(self) -> None:
        """Close the port; the servos stay as they are."""
        self._handler.closePort()


def named(motor: kin.motors.Motor) -> str:
    """A motor in words."""
    return f"motor {motor.id} ({motor.name or motor.joint})"
