"""Several worker processes behind one port, and their supervisor.

Each process is a complete service: REST, a viewer, and the visitors connected to it. Processes share nothing, so
any of them can answer any request, and a visitor stays with the process that accepted the connection. Each has its
own listening socket on the same port, and the kernel distributes new connections evenly (``SO_REUSEPORT``); with
one shared socket, the first process to wake up could take all connections of a burst.

A process that is killed is restarted; one that exits with an error would do so again, and ends the service. Each
process reports once a second that its event loop runs; one that is silent for too long, because it is stopped or
hangs, is killed and restarted. The supervisor keeps the sockets open, so that connections to a dead process wait
instead of being refused.
"""

from __future__ import annotations

import logging
import multiprocessing
import signal
import socket
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import wait
from multiprocessing.context import SpawnProcess
from typing import Any

logger = logging.getLogger("kinboard.workers")

Serve = Callable[[socket.socket, int, Callable[[], None]], int]

STEP = 0.2  # s between two looks at the processes
START_TIMEOUT = 120.0  # s from the start of a process until it first reports


def supervise(
    serve: Serve,
    sockets: list[socket.socket],
    grace: float,
    silence: float,
    on_end: Callable[[int], None] = lambda pid: None,
) -> int:
    """Run `serve` in one process per socket until SIGTERM or Ctrl-C; returns the exit code.

    Args:
        serve: called with a socket, the number of the process, and a function that it calls once a second; serves
            until SIGTERM and returns 0, or another code on failure. Picklable.
        grace: seconds from SIGTERM until a process that has not ended is killed.
        silence: seconds without a report after which a process is replaced.
        on_end: called with the id of a process that has ended and is replaced.
    """
    stopping = threading.Event()
    before = {
        number: signal.signal(number, lambda *_: stopping.set()) for number in (signal.SIGTERM, signal.SIGINT)
    }
    workers = [Worker(serve, each, k) for k, each in enumerate(sockets)]
    try:
        code = _watch(workers, silence, stopping, on_end)
    finally:
        _end([worker.process for worker in workers], grace)
        for number, handler in before.items():
            signal.signal(number, handler)
    return code


class Worker:
    """One server process, and the one that replaces it."""

    def __init__(self, serve: Serve, listener: socket.socket, number: int) -> None:
        self._arguments = (serve, listener, number)
        self.start()

    def start(self) -> None:
        """Start a process."""
        context = multiprocessing.get_context("spawn")
        self._reports = context.RawValue("Q", 0)
        self._last = 0
        self._silent = 0.0
        self.process = context.Process(target=_run, args=(*self._arguments, self._reports), name="kinboard-worker")
        self.process.start()

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


def _run(serve: Serve, listener: socket.socket, number: int, reports: Any) -> None:
    def alive() -> None:
        reports.value += 1

    raise SystemExit(serve(listener, number, alive))


def _watch(workers: list[Worker], silence: float, stopping: threading.Event, on_end: Callable[[int], None]) -> int:
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
            on_end(process.pid or 0)
            worker.start()
    return 0


def _end(processes: list[SpawnProcess], grace: float) -> None:
    for process in processes:
        process.terminate()
    deadline = time.monotonic() + grace
    for process in processes:
        process.join(max(0.0, deadline - time.monotonic()))
        if process.is_alive():
            logger.error("worker %s did not end within %s s and is killed", process.pid, grace)
            process.kill()
            process.join()
