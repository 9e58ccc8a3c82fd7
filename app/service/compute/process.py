"""One process of the pool: how it is started, asked, cancelled and replaced."""

from __future__ import annotations

import contextlib
import logging
import math
import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import IO, Any

from app.api.batches import response_of
from app.api.work import busy
from app.service.compute import child
from app.service.compute.child import CANCEL, Failure, Head, read, write
from app.shared.memory.answers import AnswerMemory, MemoryFullError

APART = 1.0  # s between two starts of a process, at least
LOADING = 60.0  # s for a process to load the core, for which it needs one to two, before it is killed
LOOK = 0.1  # s between two looks whether a job that waits for its process is still wanted

logger = logging.getLogger("kinboard.compute")


class LostError(Exception):
    """The process that computed has ended."""


@dataclass(eq=False)
class Job:
    """What a process is asked for. `cancelled` is set by the event loop, the rest by the thread that asks."""

    message: bytes
    over: float = math.inf  # when nobody waits any more for a process that takes it, by `time.monotonic`
    sent: bool = False
    cancelled: bool = False
    seconds: float = 0.0  # that the process took


class ComputeProcess:
    """One process and those that replace it.

    Args:
        begin: the first message to each.

    Attributes:
        job: what it computes; None: nothing.
        child: the present process; None: there is none.
    """

    def __init__(self, begin: bytes) -> None:
        self._begin = begin
        self._asking = threading.Lock()  # held while something is asked
        self._lock = threading.Lock()  # protects what follows
        self.job: Job | None = None
        self.child: subprocess.Popen[bytes] | None = None
        self._started = -APART
        self._lost = 0  # processes that have ended by themselves, or were killed while they loaded
        self._loading: threading.Timer | None = None  # while it loads the core
        self._stopped = threading.Event()

    @property
    def pid(self) -> int | None:
        """Of the present process."""
        running = self.child
        return None if running is None else running.pid

    def start(self) -> None:
        """Start a process if there is none."""
        with contextlib.suppress(LostError):  # the next job tries again
            self.wait()

    def wait(self) -> None:
        """Wait until a process takes jobs, started if there is none; raises `LostError` if it does not.

        Also raises it if the process that another thread has started ends while this one waits for its turn: the
        next process may take as long to load.
        """
        before = self._lost
        with self._asking:
            if self._lost != before:
                raise LostError
            running = self._running()
            try:
                self._load(running)
            except (OSError, EOFError):
                self._bury(running, expected=False)
                raise LostError from None

    def ask(self, job: Job, memory: AnswerMemory | None = None) -> Any:
        """Wait for the answer to a job; raises what the process raises, `LostError`, or 503 if memory is full."""
        with self._turn(job):
            running = self._running()
            if job.cancelled:  # while the process was started
                raise LostError
            began = time.perf_counter()
            with self._lock:
                self.job = job
            try:
                write(running.stdin, job.message)
                with self._lock:
                    job.sent = True
                    if job.cancelled:
                        write(running.stdin, CANCEL)
                self._load(running)
                return self._answer(running.stdout, memory)
            except (OSError, EOFError):
                self._bury(running, expected=job.cancelled)
                threading.Thread(target=self.start, name="kinboard-pool-start", daemon=True).start()
                raise LostError from None
            finally:
                job.seconds = time.perf_counter() - began
                with self._lock:
                    self.job = None

    def cancel(self, job: Job) -> None:
        """Tell the process that nobody waits for this job any more, or do not let it begin. Does not block."""
        with self._lock, contextlib.suppress(OSError):  # it has ended: the thread that asks sees that too
            if not job.cancelled:
                job.cancelled = True
                if job.sent and job is self.job and self.child is not None:
                    write(self.child.stdin, CANCEL)

    def kill(self, job: Job) -> None:
        """Kill the process if it is still at this job, or see to it that it does not begin with it."""
        with self._lock:
            job.cancelled = True
            if job is self.job and self.child is not None:
                self.child.kill()

    def stop(self) -> None:
        """End the process, and start no other one."""
        with self._lock:
            self._stopped.set()
            running = self.child
            if running is not None:
                running.kill()
        if running is not None and self._asking.acquire(timeout=1.0):  # else the thread that asks buries it
            if self.child is running:
                self._bury(running, expected=True)
            self._asking.release()

    @contextlib.contextmanager
    def _turn(self, job: Job) -> Iterator[None]:
        """The right to ask; raises `LostError` if nobody waits any more before the process has loaded the core."""
        while not self._asking.acquire(timeout=LOOK):
            if job.cancelled or time.monotonic() > job.over:
                raise LostError
        try:
            yield
        finally:
            self._asking.release()

    def _load(self, running: subprocess.Popen[bytes]) -> None:
        """Wait until a process has loaded the core, if it does that."""
        if self._loading is not None:
            read(running.stdout)
            self._loading.cancel()
            self._loading = None

    def _answer(self, answers: IO[bytes] | None, memory: AnswerMemory | None) -> Any:
        found = pickle.loads(read(answers))
        if isinstance(found, Failure):
            raise found.error
        if not isinstance(found, Head):
            return found
        pieces, room = [], None
        with contextlib.suppress(MemoryFullError):
            room = (memory or AnswerMemory(1 << 62, 1 << 62)).reserve(found.size)
        left = found.size
        while left:
            piece = read(answers)
            left -= len(piece)
            if room is not None:
                pieces.append(piece)
        if room is None:
            raise busy("Other answers that have not been read yet take all memory.", "KINBOARD_ANSWER_MEMORY")
        return response_of(found.status, found.headers, pieces, room)

    def _running(self) -> subprocess.Popen[bytes]:
        """The process, started if there is none; raises `LostError` if it ends at once or may not start."""
        running = self.child
        if running is not None and running.poll() is None:
            return running
        if running is not None:
            self._bury(running, expected=False)
        self._stopped.wait(self._started + APART - time.monotonic())
        self._started = time.monotonic()
        with self._lock:
            if self._stopped.is_set():
                raise LostError
            started = self.child = start_process(f"from {child.__name__} import main; main()")
        self._loading = threading.Timer(LOADING, _end_loading, (started,))
        self._loading.daemon = True
        self._loading.start()
        try:
            write(started.stdin, self._begin)
        except OSError:
            self._bury(started, expected=False)
            raise LostError from None
        return started

    def _bury(self, ended: subprocess.Popen[bytes], expected: bool) -> None:
        if self._loading is not None:
            self._loading.cancel()
            self._loading = None
        with self._lock:
            self.child = None
            self._lost += not expected
            silent = expected or self._stopped.is_set()
        code = _kill(ended)
        if not silent:
            logger.error("a process that computes has ended with code %s; another one takes its place", code)


def start_process(program: str) -> subprocess.Popen[bytes]:
    """A Python process with two pipes to it, in a session of its own, so that it gets no Ctrl-C."""
    return subprocess.Popen(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
    )


def _end_loading(child: subprocess.Popen[bytes]) -> None:
    """Kill a process that loads for too long: the thread that waits for it sees that."""
    logger.error("a process that computes has not loaded the core within %g s, and is killed", LOADING)
    child.kill()


def _kill(child: subprocess.Popen[bytes]) -> int:
    """End a process and close its pipes; returns its exit code."""
    child.kill()
    code = child.wait()
    for pipe in (child.stdin, child.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):  # what was not read by the process is lost
                pipe.close()
    return code
