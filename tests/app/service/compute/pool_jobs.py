"""What processes compute in tests of the pool, and a process that starts at once: it does not import the core."""

from __future__ import annotations

import os
import pickle
import struct
import sys
import time
from pathlib import Path
from typing import Any

LENGTH = struct.Struct(">Q")
STAND_IN = (
    f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); from pool_jobs import stand_in; stand_in()"
)


def pid(_: Any) -> int:
    """The number of the process."""
    return os.getpid()


def ends(_: Any) -> None:
    """End the process, as a fault in compiled code would."""
    os.abort()


def hangs(_: Any) -> None:
    """Compute without a look at the client and the time."""
    time.sleep(60)


def begins_and_hangs(begun: str, _: Any) -> None:
    """The same, after making a file."""
    Path(begun).touch()
    time.sleep(60)


def is_late(_: Any) -> str:
    """End after a time limit of less than a tenth of a second."""
    time.sleep(0.1)
    return "found"


def goes_on(deadline: Any) -> None:
    """Compute until the deadline says that nobody waits, or that the time is over."""
    while True:
        deadline.check()
        time.sleep(0.005)


def fails(kind: type[Exception], arguments: tuple[Any, ...], named: dict[str, Any], _: Any) -> None:
    """Raise an error."""
    raise kind(*arguments, **named)


class StrangeError(Exception):
    """Cannot be made from its arguments again."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(first + second)


def fails_strangely(_: Any) -> None:
    """Raise an error that cannot be sent."""
    raise StrangeError("a fault ", "of the core")


def given(values: Any, _: Any) -> tuple[Any, ...]:
    """What was sent, as the process has it."""
    return values


def shared(values: tuple[Any, ...], _: Any) -> list[bool]:
    """Whether robots and settings are those that the process has had from the beginning."""
    from app.service.compute.child import robot_called, settings_given

    robot, settings = values
    return [robot is robot_called(robot.id), settings is settings_given()]


def body(size: int, status: int, _: Any) -> Any:
    """A response with so many bytes, which are held as those of a batch are."""
    from app.api.batches import response_of
    from app.shared.memory.answers import AnswerMemory

    reservation = AnswerMemory(1 << 40, 1 << 40).reserve(size)
    return response_of(
        status, [(b"x-size", str(size).encode())], [b"a" * (size // 2), b"b" * (size - size // 2)], reservation
    )


def stand_in() -> None:
    """Compute as `app.service.compute.child.main` does: values only, and nothing is cancelled."""
    requests, answers = sys.stdin.buffer, sys.stdout.buffer

    def read() -> bytes:
        head = requests.read(LENGTH.size)
        return requests.read(LENGTH.unpack(head)[0]) if head else sys.exit()

    read()
    answers.write(LENGTH.pack(0))
    answers.flush()
    while True:
        message = read()
        if message:
            answer, _ = pickle.loads(message)
            found = pickle.dumps(answer(None))
            answers.write(LENGTH.pack(len(found)) + found)
            answers.flush()
