"""Several worker processes behind one port, and their supervisor.

A worker is a complete service: REST, a viewer, and the visitors connected to it, in one process or in several that
hand connections to one another (:mod:`app.service.handover`). Workers share nothing, so any of them can answer any
request, and a visitor stays with the worker that accepted the connection. Each has its own listening socket on the
same port, and the kernel distributes new connections evenly (``SO_REUSEPORT``); with one shared socket, the first
process to wake up could take all connections of a burst.

On Linux processes begin as copies of this one, which has only one thread: they start at once and share the memory
of what it has imported.

A process that ends is replaced. But if one exits with an error before all have answered for the first time, others
would do so too, and the service ends. Once a second the supervisor asks each process for ``/livez``, over a
connection that only these two have. One that does not answer for too long, because it is stopped, hangs or is
broken, is killed and replaced. The supervisor keeps the sockets open, so that connections to a dead process wait
instead of being refused.
"""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import os
import signal
import socket
import sys
import threading
import time
import warnings
from collections.abc import Callable, Sequence
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

from app.shared.threads import forget_exit_handlers

logger = logging.getLogger("kinboard.workers")

Part = TypeVar("Part")
Serve = Callable[[Part, socket.socket], int]

STEP = 0.2  # s between two looks at the processes
QUESTION = b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
ASK_EVERY = 5  # looks
ANSWER = b"HTTP/1.1 200 "  # how the answer of a process that is well begins
_SIGNALS = (signal.SIGTERM, signal.SIGINT)  # that stop the service
START_TIMEOUT = 120.0  # s from the start of a process until it first answers
SHORT_LIFE = 5.0  # s: what ends sooner, the third time in a row, is started again later and later
LONGEST_PAUSE = 3.0  # s


def supervise(
    serve: Serve[Part],
    parts: Sequence[Part],
    grace: float,
    silence: float,
    on_start: Callable[[], None] = lambda: None,
    on_end: Callable[[Part, int], None] = lambda part, pid: None,
) -> int:
    """Run `serve` in one process per part until SIGTERM or Ctrl-C; returns the exit code.

    Args:
        serve: called with its part and a connection on which it answers HTTP; serves until SIGTERM and returns 0,
            or another code on failure. Picklable.
        grace: seconds from SIGTERM until a process that has not ended is killed.
        silence: seconds without an answer after which a process is replaced.
        on_start: called when all processes have been started.
        on_end: called with the part and the id of a process that has ended and is replaced.
    """
    stopping = threading.Event()
    before = {number: signal.signal(number, lambda *_: stopping.set()) for number in _SIGNALS}
    workers = [Worker(serve, part) for part in parts]
    try:
        on_start()
        code = _watch(workers, silence, stopping, on_end)
    finally:
        _end([worker.process for worker in workers], grace)
        for worker in workers:
            worker.line.close()
        for number, handler in before.items():
            signal.signal(number, handler)
    return code


class Worker(Generic[Part]):
    """One server process, and the one that replaces it."""

    def __init__(self, serve: Serve[Part], part: Part) -> None:
        self._serve = serve
        self.part = part
        self.answered = False  # whether it has ever been well
        self.pause: float | None = None  # s until the next process starts; None: there is one
        self._short = 0  # lives in a row that were short
        self.start()

    def start(self) -> None:
        """Start a process."""
        # A copy has only the thread that made it: locks of others would stay locked.
        alone = sys.platform == "linux" and threading.active_count() == 1
        context: Any = multiprocessing.get_context("fork" if alone else "spawn")
        self.pause = None
        self.line, its = socket.socketpair()
        self.line.setblocking(False)
        self._looks = 0
        self._asked = False
        self._unwell = 0.0  # s
        self._patience = START_TIMEOUT
        self.process: BaseProcess = context.Process(
            target=_run, args=(self._serve, self.part, its, alone), name="kinboard-worker"
        )
        with its, warnings.catch_warnings():
            # Python cannot know that the threads of numpy's linear algebra are made for this.
            warnings.simplefilter("ignore", DeprecationWarning)
            if alone:  # a copy that got a signal before `_run` would run the supervisor's handler, and go on
                signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
            try:
                self.process.start()
            finally:
                if alone:
                    signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)

    def silent(self, silence: float) -> bool:
        """Ask the process, and read what it answers; returns whether it has been silent for too long.

        Called once per `STEP`: a clock would go on while the whole service is suspended.
        """
        answer = b""
        with contextlib.suppress(OSError):  # nothing has arrived, or nothing ever will
            answer = self.line.recv(1 << 16)
        if ANSWER in answer:
            self.answered = True
            self._unwell, self._patience = 0.0, 0.0
        else:
            self._unwell += STEP
        self._asked &= not answer
        if not self._asked and self._looks % ASK_EVERY == 0:
            with contextlib.suppress(OSError):
                self.line.send(QUESTION)
                self._asked = True
        self._looks += 1
        return self._unwell >= max(silence, self._patience)

    def bury(self) -> float:
        """Forget the process, which has ended; returns the seconds until the next one starts.

        At once, unless several in a row did not live long.
        """
        self.line.close()
        self._short = self._short + 1 if self._looks * STEP < SHORT_LIFE else 0
        self.pause = 0.0 if self._short < 3 else min(2.0 ** (self._short - 3), LONGEST_PAUSE)
        return self.pause


def _run(serve: Serve[Part], part: Part, line: socket.socket, copied: bool) -> None:
    if copied:
        forget_exit_handlers()
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
    raise SystemExit(serve(part, line))


def is_orphan() -> bool:
    """Whether this process has a supervisor that has ended: nobody else would stop it."""
    supervisor = multiprocessing.parent_process()
    return supervisor is not None and os.getppid() != supervisor.pid


def _watch(
    workers: list[Worker[Part]], silence: float, stopping: threading.Event, on_end: Callable[[Part, int], None]
) -> int:
    while not stopping.is_set():
        ended = wait([worker.process.sentinel for worker in workers if worker.pause is None], timeout=STEP)
        for worker in workers:
            process = worker.process
            if stopping.is_set():
                break
            if worker.pause is not None:
                worker.pause -= 0.0 if ended else STEP  # where `wait` has returned early, no step has passed
            else:
                if process.sentinel not in ended and process.is_alive():
                    if ended or not worker.silent(silence):
                        continue
                    logger.error("worker %s has not answered for %s s and is killed", process.pid, silence)
                    process.kill()
                process.join()  # its exit code comes a moment after its sentinel
                if (process.exitcode or 0) > 0 and not all(each.answered for each in workers):
                    return 1
                when = f"in {pause:g} s" if (pause := worker.bury()) else "now"
                logger.error(
                    "worker %s ended with code %s and is restarted %s", process.pid, process.exitcode, when
                )
                on_end(worker.part, process.pid or 0)
            if worker.pause is not None and worker.pause <= 0.0:
                worker.start()
    return 0


def _end(processes: list[BaseProcess], grace: float) -> None:
    for process in processes:
        process.terminate()
    deadline = time.monotonic() + grace
    for process in processes:
        process.join(max(0.0, deadline - time.monotonic()))
        if process.is_alive():
            logger.error("worker %s did not end within %s s and is killed", process.pid, grace)
            process.kill()
            process.join()
