"""Several processes behind one port, and the one that looks after them.

Each process is a whole service: REST, a viewer, and the visitors whose websockets it holds. Nothing is shared, so
any of them can answer anything, and a visitor stays with the process that took the connection. Each has a
listening socket of its own on the same port, and the kernel deals new connections out evenly (``SO_REUSEPORT``);
with one socket for all, whoever wakes up first in a rush of connections would take them all.

A process that is killed is started again; one that gives up would give up again, and ends the service. The socket
of a dead process is kept open here: whoever comes waits a moment instead of being refused.
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

Work = Callable[[socket.socket, int], int]


def supervise(work: Work, sockets: list[socket.socket], grace: float) -> int:
    """Run `work` in one process per socket until SIGTERM or Ctrl-C; the exit code.

    Args:
        work: serves on its socket, as number so many, until SIGTERM and returns 0, or another code if it cannot;
            picklable.
        grace: seconds from SIGTERM until a process that has not ended is killed.
    """
    stopping = threading.Event()
    before = {
        number: signal.signal(number, lambda *_: stopping.set()) for number in (signal.SIGTERM, signal.SIGINT)
    }
    running = [_start(work, each, k) for k, each in enumerate(sockets)]
    try:
        code = _watch(work, sockets, running, stopping)
    finally:
        _end(running, grace)
        for number, handler in before.items():
            signal.signal(number, handler)
    return code


def _start(work: Work, listener: socket.socket, number: int) -> SpawnProcess:
    process = multiprocessing.get_context("spawn").Process(
        target=_run, args=(work, listener, number), name="kinboard-worker"
    )
    process.start()
    return process


def _run(work: Work, listener: socket.socket, number: int) -> None:
    raise SystemExit(work(listener, number))


def _watch(
    work: Work, sockets: list[socket.socket], running: list[SpawnProcess], stopping: threading.Event
) -> int:
    while not stopping.is_set():
        wait([process.sentinel for process in running], timeout=0.2)
        for k, process in enumerate(running):
            if process.is_alive() or stopping.is_set():
                continue
            if (process.exitcode or 0) > 0:
                return 1
            logger.error("worker %s ended with code %s and is started again", process.pid, process.exitcode)
            running[k] = _start(work, sockets[k], k)
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
