"""What processes do in tests of their supervision: a module that is imported quickly, by each of them."""

from __future__ import annotations

import os
import signal
import socket
import time
from pathlib import Path


def answer(line: socket.socket, status: str = "200 OK") -> None:
    """Answer one question of the supervisor."""
    assert b"/livez" in line.recv(4096)
    line.sendall(f"HTTP/1.1 {status}\r\ncontent-length: 0\r\n\r\n".encode())


def note(noted: Path) -> int:
    """Write down the id of this process; returns how many there were before."""
    with noted.open("a+") as file:
        print(os.getpid(), file=file)
        file.seek(0)
        return len(file.readlines()) - 1


def fails(part: object, line: socket.socket) -> int:
    """Ends at once."""
    return 3


def stops_once(noted: Path, part: object, line: socket.socket) -> int:
    """The first time it stops after its first answer; the second time it ends the service."""
    first = note(noted) == 0
    answer(line)
    os.kill(*((os.getpid(), signal.SIGSTOP) if first else (os.getppid(), signal.SIGTERM)))
    time.sleep(60)
    return 0


def is_broken_once(noted: Path, part: object, line: socket.socket) -> int:
    """The first one turns, but answers with an error after its first answer; the second one ends the service."""
    if note(noted):
        os.kill(os.getppid(), signal.SIGTERM)
        time.sleep(60)
    answer(line)
    while True:
        answer(line, "500 Internal Server Error")


def fails_later(noted: Path, part: object, line: socket.socket) -> int:
    """The first four exit with an error after they have answered, the fifth ends the service."""
    if note(noted) == 4:
        os.kill(os.getppid(), signal.SIGTERM)
        time.sleep(60)
    answer(line)
    time.sleep(0.5)  # until the answer has been read
    return 1


def ignores(code: int, part: object, line: socket.socket) -> int:
    """Ignores the signal to stop."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    os.kill(os.getppid(), signal.SIGTERM)
    time.sleep(60)
    return code
