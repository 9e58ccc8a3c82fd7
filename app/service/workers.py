"""Several worker processes behind one port, and their supervisor.

Each process is a complete service: REST, a viewer, and the visitors connected to it. Processes share nothing, so
any of them can answer any request, and a visitor stays with the process that accepted the connection. Each has its
own listening socket on the same port, and the kernel distributes new connections evenly (``SO_REUSEPORT``); with
one shared socket, the first process to wake up could take all connections of a burst.

A process that is killed is restarted; one that exits with an error would do so again, and ends the service. The
supervisor keeps the sockets open, so that connections to a dead process wait instead of being refused.
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

logger = logging.getLogger("kinboard.workers")

Serve = Callable[[socket.socket, int], int]


def supervise(serve: Serve, sockets: list[socket.socket], grace: float) -> int:
    """Run `serve` in one process per socket until SIGTERM or Ctrl-C; returns the exit code.

    Args:
        serve: called with a socket and the number of the process; serves until SIGTERM and returns 0, or another
            code on failure. Picklable.
        grace: seconds from SIGTERM until a process that has not ended is killed.
    """
    stopping = threading.Event()
    before = {
        number: signal.signal(number, lambda *_: stopping.set()) for number in (signal.SIGTERM, signal.SIGINT)
    }
    running = [_start(serve, each, k) for k, each in enumerate(sockets)]
    try:
        code = _watch(serve, sockets, running, stopping)
    finally:
        _end(running, grace)
        for number, handler in before.items():
            signal.signal(number, handler)
    return code


def _start(serve: Serve, listener: socket.socket, number: int) -> SpawnProcess:
    process = multiprocessing.get_context("spawn").Process(
        target=_run, args=(serve, listener, number), name="kinboard-worker"
    )
    process.start()
    return process


def _run(serve: Serve, listener: socket.socket, number: int) -> None:
    raise SystemExit(serve(listener, number))


def _watch(
    serve: Serve, sockets: list[socket.socket], running: list[SpawnProcess], stopping: threading.Event
) -> int:
    while not stopping.is_set():
        wait([process.sentinel for process in running], timeout=0.2)
        for k, process in enumerate(running):
            if process.is_alive() or stopping.is_set():
                continue
            if (process.exitcode or 0) > 0:
                return 1
            logger.error("worker %s ended with code %s and is restarted", process.pid, process.exitcode)
            running[k] = _start(serve, sockets[k], k)
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
