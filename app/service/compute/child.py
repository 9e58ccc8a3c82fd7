"""A process that computes for the service: the other end of :mod:`app.service.compute.pool`.

Its first message has the settings and robots as the service has read them, so that both agree whatever happens to
the files. Then its main thread computes one answer after the other, while another thread listens: for a
cancellation, and for the end of the service, with which this process ends whatever it computes.

A message is its length in eight bytes and so many bytes. All but the bodies of responses are pickled.
"""

from __future__ import annotations

import contextlib
import gc
import os
import pickle
import queue
import signal
import struct
import threading
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from typing import IO, Final

from starlette.responses import Response

from app.api import api_routes
from app.api.batches import HeldResponse
from app.api.problems import ClientLeftError, ProblemError, as_problem
from app.api.work import ComputeSlots, Deadline
from app.service.log import guard_log
from app.shared.memory.answers import AnswerMemory
from app.shared.memory.process import MemoryKeeper
from app.shared.settings import Settings
from app.shared.threads import NICENESS
from kin import Robot, fk

CANCEL: Final = b""  # the message that nobody waits for the present answer any more
LOADED: Final = b""  # the first message of a process: it takes what it is asked
_LENGTH = struct.Struct(">Q")


@dataclass(frozen=True)
class Begin:
    """The first message to a process."""

    settings: Settings
    robots: tuple[Robot, ...]


@dataclass(frozen=True)
class Head:
    """The begin of a response, whose body follows in messages."""

    status: int
    headers: list[tuple[bytes, bytes]]
    size: int


@dataclass(frozen=True)
class Failure:
    """What a computation has raised."""

    error: Exception


def read(pipe: IO[bytes] | None) -> bytes:
    """The next message; raises `EOFError` if there is none any more."""
    if pipe is None:
        raise EOFError
    head = pipe.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        raise EOFError
    (size,) = _LENGTH.unpack(head)
    message = pipe.read(size)
    if len(message) < size:
        raise EOFError
    return message


def write(pipe: IO[bytes] | None, message: bytes) -> None:
    """Write a message; raises `OSError` if nobody reads it."""
    if pipe is None:
        raise BrokenPipeError
    pipe.write(_LENGTH.pack(len(message)))
    pipe.write(message)
    pipe.flush()


class _Process:
    """This process, once it computes."""

    settings: Settings
    robots: dict[str, Robot]

    def __init__(self) -> None:
        self.busy = False
        self.jobs: queue.SimpleQueue[tuple[bytes, Deadline]] = queue.SimpleQueue()

    def listen(self, requests: IO[bytes], work: ComputeSlots) -> None:
        """Take what the service sends, until it ends."""
        latest = Deadline(work)
        with contextlib.suppress(EOFError, OSError):
            while True:
                message = read(requests)
                if message == CANCEL:
                    latest.client_left()
                else:
                    latest = Deadline(work)
                    self.jobs.put((message, latest))
        os._exit(0)


_PROCESS = _Process()


def robot_called(name: str) -> Robot:
    """The robot of the service with this id."""
    return _PROCESS.robots[name]


def settings_given() -> Settings:
    """Those of the service."""
    return _PROCESS.settings


def main() -> None:
    """Compute until the service ends. Messages come on the standard input and go to the standard output."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # so that nothing else is written there
    try:
        begin: Begin = pickle.loads(read(requests))
    except EOFError:
        return  # the service has ended before it said anything
    settings = begin.settings
    _PROCESS.settings, _PROCESS.robots = settings, {robot.id: robot for robot in begin.robots}
    work = ComputeSlots(1, settings.time_budget, memory=AnswerMemory(settings.max_answer, settings.max_answer))
    threading.Thread(target=_PROCESS.listen, args=(requests, work), name="kinboard-requests", daemon=True).start()
    guard_log()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, signal.SIG_IGN)  # sent to the whole service: this process ends with it
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    api_routes()  # imports and builds what computations refer to
    fk(begin.robots[0], begin.robots[0].q_home)  # loads the kernels
    gc.freeze()
    MemoryKeeper(lambda: not _PROCESS.busy).start()
    write(answers, LOADED)
    while True:
        job, deadline = _PROCESS.jobs.get()
        _PROCESS.busy = True
        for message in _messages(_found(job, deadline)):
            write(answers, message)
        _PROCESS.busy = False


def _found(job: bytes, deadline: Deadline) -> object:
    """What a job returns or raises."""
    try:
        answer, seconds = pickle.loads(job)
        deadline.start(left=seconds)
        return answer(deadline)
    except Exception as error:  # noqa: BLE001 - the service raises it
        return Failure(_sendable(error))


def _sendable(error: Exception) -> Exception:
    """The error as one that can be sent."""
    if (problem := as_problem(error)) is not None:
        return problem
    if not isinstance(error, ProblemError | ClientLeftError):
        error.add_note("In a process that computes:\n" + "".join(traceback.format_exception(error)))
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001 - what a class makes of its arguments is not known
        plain = RuntimeError(str(error))
        plain.__notes__ = getattr(error, "__notes__", [])
        return plain
    return error


def _messages(found: object) -> Iterator[bytes]:
    if isinstance(found, HeldResponse):
        yield pickle.dumps(Head(found.status_code, found.raw_headers, found.size))
        yield from found.taken()
    elif isinstance(found, Response):
        yield pickle.dumps(Head(found.status_code, found.raw_headers, len(found.body)))
        if found.body:
            yield bytes(found.body)
    else:
        yield pickle.dumps(found, pickle.HIGHEST_PROTOCOL)
