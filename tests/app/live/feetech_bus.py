"""A bus of Feetech's STS servos, for tests: the published packets, and what can spoil them.

`FeetechBus` is on a pseudo-terminal and moves in real time; `Line` is in memory, and its servos move when the test
says so.

An instruction packet is ``FF FF id length instruction parameters checksum``. A status packet has an error byte in
place of the instruction. The length counts what follows it, and the checksum is the complement of the sum from the
id on (Feetech's *communication protocol user manual*, *memory table of the magnetic encoder STS servos*).
"""

from __future__ import annotations

import contextlib
import os
import pty
import threading
import time
import tty
from collections.abc import Mapping
from dataclasses import dataclass, field

PING, READ, WRITE, SYNC_WRITE, SYNC_READ, EVERYBODY = 0x01, 0x02, 0x03, 0x83, 0x82, 0xFE
MODEL, LEAST, MOST, OFFSET, TORQUE, GOAL, PRESENT = 3, 9, 11, 31, 40, 42, 56
SPEED = 3000.0  # ticks/s of a servo on its way
TURN = 4096  # ticks; the encoder begins again after them


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

    def put(self, address: int, values: bytes) -> None:
        self.memory[address : address + len(values)] = values

    def word(self, address: int) -> int:
        return int.from_bytes(self.memory[address : address + 2], "little")

    def advance(self, seconds: float) -> None:
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
    """Servos by their ids, and the packets between them and the program.

    Attributes:
        broken: how many of the next answers are spoiled, each in the next of three ways.
        missing: ids of servos that do not answer.
        written: instructions that change something: when, of which servo, at which address, which bytes.
        refused: packets that no servo could read.
        gone: whether a line in memory has been unplugged.
    """

    def __init__(self, positions: dict[int, float]) -> None:
        self.servos = {number: Servo(position) for number, position in positions.items()}
        self.broken, self._spoiled = 0, 0
        self.missing: set[int] = set()
        self.written: list[tuple[float, int, int, bytes]] = []
        self.refused: list[bytes] = []
        self.answers = b""
        self.gone = False
        self.monotonic = time.monotonic

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
                self.refused.append(whole)
            else:
                self._do(whole[2], whole[4], whole[5:-1])
        return buffer

    def _do(self, number: int, instruction: int, given: bytes) -> None:
        servo = self.servos.get(number)
        if number == EVERYBODY and instruction == SYNC_WRITE:
            address, length = given[0], given[1]
            for k in range(2, len(given), length + 1):
                self._write(given[k], address, given[k + 1 : k + 1 + length])
        elif servo is None or number in self.missing:
            return
        elif instruction == PING:
            self._answer(number)
        elif instruction == READ:
            self._answer(number, *servo.memory[given[0] : given[0] + given[1]])
        elif instruction == WRITE:
            self._write(number, given[0], given[1:])
            self._answer(number)
        else:
            self.refused.append(bytes([number, instruction, *given]))

    def _write(self, number: int, address: int, values: bytes) -> None:
        if number in self.servos and number not in self.missing:
            self.servos[number].put(address, values)
            self.written.append((self.monotonic(), number, address, values))

    def _answer(self, number: int, *values: int) -> None:
        answer = packet(number, self.servos[number].error, *values)
        if self.broken:
            self.broken -= 1
            self._spoiled += 1
            kind = self._spoiled % 3
            if kind == 0:
                answer = answer[:-1] + bytes([answer[-1] ^ 0x10])  # a wrong checksum
            elif kind == 1:
                answer = answer[:-2]  # cut
            else:
                answer = packet(number, self.servos[number].error)  # complete, without the values
        else:
            answer = b"\x00\xff" + answer if self._spoiled % 2 else answer  # noise of the line before it
        self.answers += answer


class FeetechBus(Line):
    """Servos on a pseudo-terminal.

    Attributes:
        port: its name.
    """

    def __init__(self, positions: dict[int, float]) -> None:
        super().__init__(positions)
        self._master, slave = pty.openpty()
        tty.setraw(slave)
        self.port = os.ttyname(slave)
        self._slave: int | None = slave
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def __enter__(self) -> FeetechBus:
        return self

    def __exit__(self, *_: object) -> None:
        self.unplug()

    def unplug(self) -> None:
        """Take the adapter out of the machine."""
        if self._over.is_set():
            return
        self._over.set()
        if self._slave is not None:
            os.write(self._slave, b"\0")  # wakes the thread
        self._thread.join()
        os.close(self._master)
        if self._slave is not None:
            os.close(self._slave)

    def _run(self) -> None:
        buffer, before = b"", time.monotonic()
        while not self._over.is_set():
            with contextlib.suppress(OSError):
                buffer += os.read(self._master, 256)
            now = time.monotonic()
            self.advance(now - before)
            before = now
            buffer = self.take(buffer)
            answers, self.answers = self.answers, b""
            if answers:
                os.write(self._master, answers)
