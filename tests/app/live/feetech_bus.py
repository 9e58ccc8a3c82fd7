"""A bus of Feetech's STS servos, for tests: the simulated one with a record, and with what can spoil it.

`FeetechBus` is on a pseudo-terminal and moves in real time; `RecordedLine` is in memory, and its servos move when
the test says so.
"""

from __future__ import annotations

import contextlib
import os
import pty
import threading
import time
import tty

from app.servos.simulated import Line, packet


class RecordedLine(Line):
    """A simulated bus that says what was done to it.

    Attributes:
        broken: how many of the next answers are spoiled, each in the next of three ways.
        written: instructions that change something: when, of which servo, at which address, which bytes.
        monotonic: the clock of `written`.
    """

    def __init__(self, positions: dict[int, float]) -> None:
        super().__init__(positions)
        self.broken, self._spoiled = 0, 0
        self.written: list[tuple[float, int, int, bytes]] = []
        self.monotonic = time.monotonic

    def write(self, number: int, address: int, values: bytes) -> None:
        super().write(number, address, values)
        if number in self.servos and number not in self.missing:
            self.written.append((self.monotonic(), number, address, values))

    def answer(self, number: int, *values: int) -> None:
        before = self.answers
        super().answer(number, *values)
        answer = self.answers[len(before) :]
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
        elif self._spoiled % 2:
            answer = b"\x00\xff" + answer  # noise of the line before it
        self.answers = before + answer


class FeetechBus(RecordedLine):
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
