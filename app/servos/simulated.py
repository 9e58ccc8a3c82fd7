"""A simulated bus of Feetech's STS servos, to try `kinboard so101` without an arm.

An instruction packet is ``FF FF id length instruction parameters checksum``. A status packet has an error byte in
place of the instruction. The length counts what follows it, and the checksum is the complement of the sum from the
id on (Feetech, *communication protocol user manual*).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from app.servos.registers import BAUD, GOAL, HOTTEST, LEAST, MODEL, MOST, OFFSET, PRESENT, TORQUE, TURN, VOLTAGE
from kin.errors import InputError

PING, READ, WRITE, SYNC_WRITE, EVERYBODY = 0x01, 0x02, 0x03, 0x83, 0xFE
SPEED = 3000.0  # ticks/s of a servo on its way

# A calibration as LeRobot writes it, and where this arm stands at first.
_RANGES: Final = {
    "shoulder_pan": (748, 3452),
    "shoulder_lift": (842, 3218),
    "elbow_flex": (893, 3102),
    "wrist_flex": (861, 3187),
    "wrist_roll": (0, 4095),
    "gripper": (2021, 3487),
}
CALIBRATION: Final = {
    name: {"id": i, "drive_mode": 0, "homing_offset": 0, "range_min": low, "range_max": high}
    for i, (name, (low, high)) in enumerate(_RANGES.items(), 1)
}
START: Final = {1: 2000.0, 2: 1700.0, 3: 2500.0, 4: 2200.0, 5: 2075.0, 6: 2500.0}


def packet(number: int, *body: int) -> bytes:
    """A packet of instruction or error and parameters."""
    inside = bytes([number, len(body) + 1, *body])
    return b"\xff\xff" + inside + bytes([~sum(inside) & 0xFF])


@dataclass
class Servo:
    """Registers of a servo, which moves to its goal while its torque is on.

    The goal is a tick of the turn that it reads, and it takes the way of their difference: from 4090 to 5 it goes
    back nearly a whole turn.

    Attributes:
        position: ticks; beyond a turn, what it reads begins again.
        error: of its status packets.
        stuck: whether something holds it.
        reversed: whether its motor turns it away from its goal.
    """

    position: float
    memory: bytearray = field(default_factory=lambda: bytearray(128))
    error: int = 0
    stuck: bool = False
    reversed: bool = False

    def __post_init__(self) -> None:
        self.put(MODEL, (777).to_bytes(2, "little"))
        self.put(HOTTEST, bytes([70, 80, 40]))  # °C; 0.1 V: at most and at least
        self.put(VOLTAGE, bytes([74, 28]))
        self.advance(0.0)

    def put(self, address: int, values: bytes) -> None:
        """Set registers."""
        self.memory[address : address + len(values)] = values

    def word(self, address: int) -> int:
        """Two registers as a number."""
        return int.from_bytes(self.memory[address : address + 2], "little")

    def advance(self, seconds: float) -> None:
        """Let it move."""
        if self.memory[TORQUE] and not self.stuck:
            goal = self.word(GOAL)
            if self.word(MOST):
                goal = max(self.word(LEAST), min(self.word(MOST), goal))
            way = goal - self.position % TURN
            step = max(-SPEED * seconds, min(SPEED * seconds, way))
            self.position += -step if self.reversed else step
        self.put(PRESENT, (round(self.position) % TURN).to_bytes(2, "little"))

    def calibrate(self, entry: Mapping[str, int]) -> None:
        """Write what LeRobot's ``write_calibration`` writes to a servo."""
        offset = entry["homing_offset"]
        self.put(OFFSET, (abs(offset) | (offset < 0) << 11).to_bytes(2, "little"))  # sign and magnitude
        self.put(LEAST, entry["range_min"].to_bytes(2, "little"))
        self.put(MOST, entry["range_max"].to_bytes(2, "little"))


class Line:
    """Servos by their ids, and the packets between them and a program.

    Attributes:
        missing: ids of servos that do not answer.
        refused: how many packets no servo could read.
        answers: what the servos have sent and nobody has read yet.
        baud: the rate of the servos.
    """

    def __init__(self, positions: Mapping[int, float]) -> None:
        self.servos = {number: Servo(position) for number, position in positions.items()}
        self.missing: set[int] = set()
        self.refused = 0
        self.answers = b""
        self.baud = BAUD

    def advance(self, seconds: float) -> None:
        """Let the servos move."""
        for servo in self.servos.values():
            servo.advance(seconds)

    def take(self, buffer: bytes) -> bytes:
        """Do what complete packets say; returns the rest."""
        while (start := buffer.find(b"\xff\xff")) >= 0 and len(buffer) >= start + 4:
            end = start + 4 + buffer[start + 3]
            if len(buffer) < end:
                return buffer[start:]
            whole, buffer = buffer[start:end], buffer[end:]
            if ~sum(whole[2:-1]) & 0xFF != whole[-1]:
                self.refused += 1
            else:
                self._do(whole[2], whole[4], whole[5:-1])
        return buffer

    def _do(self, number: int, instruction: int, given: bytes) -> None:
        servo = self.servos.get(number)
        if number == EVERYBODY and instruction == SYNC_WRITE:
            address, length = given[0], given[1]
            for k in range(2, len(given), length + 1):
                self.write(given[k], address, given[k + 1 : k + 1 + length])
        elif servo is None or number in self.missing:
            return
        elif instruction == PING:
            self.answer(number)
        elif instruction == READ:
            self.answer(number, *servo.memory[given[0] : given[0] + given[1]])
        elif instruction == WRITE:
            self.write(number, given[0], given[1:])
            self.answer(number)
        else:
            self.refused += 1

    def write(self, number: int, address: int, values: bytes) -> None:
        """Set registers of a servo, if it is there."""
        if number in self.servos and number not in self.missing:
            self.servos[number].put(address, values)

    def answer(self, number: int, *values: int) -> None:
        """Send the status packet of a servo."""
        self.answers += packet(number, self.servos[number].error, *values)


class SimulatedPort:
    """The serial port of a line in memory, as pyserial has it.

    Args:
        line: with its servos.
        monotonic: the clock by which they move, s; None: they move when `Line.advance` is called.
    """

    def __init__(self, line: Line, monotonic: Callable[[], float] | None = time.monotonic) -> None:
        self._line, self._monotonic = line, monotonic
        self._before = 0.0 if monotonic is None else monotonic()
        self.baudrate = BAUD

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read."""
        return len(self._line.answers)

    def read(self, count: int) -> bytes:
        """Up to so many bytes."""
        found, self._line.answers = self._line.answers[:count], self._line.answers[count:]
        return found

    def write(self, data: Any) -> int:
        """Send bytes, which servos of another rate do not understand."""
        if self._monotonic is not None:
            now = self._monotonic()
            self._line.advance(now - self._before)
            self._before = now
        if self.baudrate == self._line.baud:
            self._line.take(bytes(data))
        return len(data)

    def reset_input_buffer(self) -> None:
        """Forget what was not read."""
        self._line.answers = b""

    def flush(self) -> None:
        """Everything was sent at once."""

    def close(self) -> None:
        """Nothing is to be closed."""


def _each(line: Line, address: int, *values: int) -> None:
    for servo in line.servos.values():
        servo.put(address, bytes(values))


# What `--port sim:…` can have go wrong, by name: what its number may be, and what it does to the line.
FAULTS: Final[dict[str, tuple[str, range, Callable[[Line, int], object]]]] = {
    "missing": ("a servo", range(1, 7), lambda line, number: line.missing.add(number)),
    "kind": ("a servo", range(1, 7), lambda line, number: line.servos[number].put(MODEL, b"\x04\x05")),
    "overload": ("a servo", range(1, 7), lambda line, number: setattr(line.servos[number], "error", 1 << 5)),
    "stuck": ("a servo", range(1, 7), lambda line, number: setattr(line.servos[number], "stuck", True)),
    "baud": ("its rate", range(38_400, 1_000_001), lambda line, number: setattr(line, "baud", number)),
    "volts": ("of its supply", range(26), lambda line, number: _each(line, VOLTAGE, 10 * number)),
    "celsius": ("of its servos", range(101), lambda line, number: _each(line, VOLTAGE + 1, number)),
}


def simulated_arm(faults: str = "") -> Line:
    """An SO-101 with `CALIBRATION`, at `START`, switched off, with faults such as ``missing=3,stuck=1``.

    Raises:
        InputError: there is no such fault.
    """
    line = Line(START)
    for entry in CALIBRATION.values():
        line.servos[entry["id"]].calibrate(entry)
    for fault in faults.split(",") if faults else ():
        name, _, text = fault.partition("=")
        what, numbers, spoil = FAULTS.get(name, ("", range(0), None))
        if spoil is None:
            raise InputError("--port", f"sim:{faults[:80]}", f"sim, or sim: and faults of {', '.join(FAULTS)}")
        if not (text.isascii() and text.isdecimal() and len(text) < 8 and int(text) in numbers):
            known = f"{name}=N, {what}: {numbers[0]} to {numbers[-1]}"
            raise InputError("--port", f"sim:{faults[:80]}", known)
        spoil(line, int(text))
    return line
