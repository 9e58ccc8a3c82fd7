"""Several worker processes behind one port, and their supervisor.

A worker is a complete service: REST, a viewer, and the visitors connected to it, in one process or in several that
hand connections to one another (:mod:`app.service.handover`). Workers share nothing, so any of them can answer any
request, and a visitor stays with the worker that accepted the connection. Each has its own listening socket on the
same port, and the kernel distributes new connections evenly (``SO_REUSEPORT``); with one shared socket, the first
process to wake up could take all connections of a burst.

On Linux processes begin as copies of this one, which has only one thread: they start at once and share the memory
of what it has imported.

A process that is killed is restarted; one that exits with an error would do so again, and ends the service. Each
process reports once a second that its event loop runs; one that is silent for too long, because it is stopped or
hangs, is killed and restarted. The supervisor keeps the sockets open, so that connections to a dead process wait
instead of being refused.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Sequence
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

logger = logging.getLogger("kinboard.workers")

Part = TypeVar("Part")
Serve = Callable[[Part, Callable[[], None]], int]

STEP = 0.2  # s between two looks at the processes
_SIGNALS = (signal.SIGTERM, signal.SIGINT)  # that stop the service
START_TIMEOUT = 120.0  # s from the start of a process until it first reports


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
        serve: called with its part and a function that it calls once a second; serves until SIGTERM and returns 0,
            or another code on failure. Picklable.
        grace: seconds from SIGTERM until a process that has not ended is killed.
        silence: seconds without a report after which a process is replaced.
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
        for number, handler in before.items():
            signal.signal(number, handler)
    return code


class Worker(Generic[Part]):
    """One server process, and the one that replaces it."""

    def __init__(self, serve: Serve[Part], part: Part) -> None:
        self._serve = serve
        self.part = part
        self.start()

    def start(self) -> None:
        """Start a process."""
        # A copy has only the thread that made it: locks of others would stay locked.
        alone = sys.platform == "linux" and threading.active_count() == 1
        context: Any = multiprocessing.get_context("fork" if alone else "spawn")
        self._reports = context.RawValue("Q", 0)
        self._last = 0
        self._silent = 0.0
        self.process: BaseProcess = context.Process(
            target=_run, args=(self._serve, self.part, self._reports), name="kinboard-worker"
        )
        with warnings.catch_warnings():
            # Python cannot know that the threads of numpy's linear algebra are made for this.
            warnings.simplefilter("ignore", DeprecationWarning)
            if alone:  # a copy that got a signal before `_run` would run the supervisor's handler, and go on
                signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
            try:
                self.process.start()
            finally:
                if alone:
                    signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)

    def silent(self) -> float:
        """Seconds without a report, by the number of calls of this method, one per `STEP`.

        The clock would go on while the whole service is suspended.
        """
        reports = self._reports.value
        self._silent = 0.0 if reports != self._last else self._silent + STEP
        self._last = reports
        return self._silent

    @property
    def reported(self) -> bool:
        """Whether the process has reported since its start."""
        return self._last > 0


def _run(serve: Serve[Part], part: Part, reports: Any) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a copy of the supervisor has its handlers
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if sys.platform == "linux":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
    supervisor = os.getppid()

    def alive() -> None:
        reports.value += 1
        if os.getppid() != supervisor:  # it was killed: nobody else would stop this process
            os.kill(os.getpid(), signal.SIGTERM)

    raise SystemExit(serve(part, alive))


def _watch(
    workers: list[Worker[Part]], silence: float, stopping: threading.Event, on_end: Callable[[Part, int], None]
) -> int:
    while not stopping.is_set():
        ended = wait([worker.process.sentinel for worker in workers], timeout=STEP)
        for worker in workers:
            process = worker.process
            if stopping.is_set():
                break
            if process.sentinel not in ended and process.is_alive():
                if ended or worker.silent() < (silence if worker.reported else max(silence, START_TIMEOUT)):
                    continue  # where `wait` has returned early, no step has passed
                logger.error("worker %s has not reported for %s s and is killed", process.pid, silence)
                process.kill()
            process.join()  # its exit code comes a moment after its sentinel
            if (process.exitcode or 0) > 0:
                return 1
            logger.error("worker %s ended with code %s and is restarted", process.pid, process.exitcode)
            on_end(worker.part, process.pid or 0)
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
