"""Other processes that compile kernels: a compiler keeps a gigabyte of memory as long as its process lives.

A thread that calls a kernel which is in no cache waits here until such a process has compiled it
(:mod:`kin.kernels.elsewhere`), and then loads it. What requests and visitors wait for does not queue behind what
is compiled ahead: each of the two has a process. A request that waits ends when its client leaves or its time is
over; the compilation goes on, and the next request finds the kernel.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import subprocess
import sys
import threading
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextvars import ContextVar
from functools import partial
from typing import Any, Final

from app.api.problems import ProblemError
from app.api.work import TooSlowError, current_deadline, stopping
from app.shared.threads import NICENESS, lower_priority
from kin.kernels.elsewhere import DONE

LOOK = 0.2  # s between two looks at the client and the time of a request that waits
RETRY_AFTER = 5  # s
ASKED_NICENESS = NICENESS // 2  # before what is compiled ahead, behind requests and visitors
SERVE: Final = "from kin.kernels.elsewhere import serve; serve()"

logger = logging.getLogger("kinboard.compiler")
ahead: ContextVar[bool] = ContextVar("ahead", default=False)
"""Whether a thread has kernels compiled before anybody asks for them."""


class CompilerStoppedError(RuntimeError):
    """The service is being stopped, so nothing is compiled any more."""


class KernelCompiler:
    """One other process that compiles kernels, one after the other. It starts with the first, and ends when idle.

    Args:
        niceness: of the process.

    Attributes:
        child: the process, which may have ended; None: there was none.
    """

    def __init__(self, niceness: int = NICENESS) -> None:
        # The process inherits the priority of the thread that starts it.
        self._executor = ThreadPoolExecutor(1, "kinboard-compiler", partial(lower_priority, niceness))
        self._lock = threading.Lock()
        self._stopped = self._warned = False
        self.child: subprocess.Popen[str] | None = None

    def submit(self, line: str) -> Future[bool]:
        """Have the kernel of a line compiled. False: the process has ended."""
        with self._lock:
            if self._stopped:
                raise CompilerStoppedError
            return self._executor.submit(self._compile, line)

    def stop(self) -> None:
        """End the process, whatever it compiles, and all waiting. Any thread may call."""
        with self._lock:
            self._stopped = True
            self._executor.shutdown(wait=False, cancel_futures=True)
            if self.child is not None:
                kill(self.child)  # the thread that waits for it sees that

    def _compile(self, line: str) -> bool:
        with self._lock:
            if self._stopped:
                raise CompilerStoppedError
            if self.child is not None and self.child.poll() is not None:
                kill(self.child)
                self.child = None
            child = self.child = self.child or self._start()
        done = _answer(child, line) == DONE
        if self._stopped:
            raise CompilerStoppedError
        if not done and kill(child) and not self._warned:  # else it was idle
            self._warned = True
            logger.warning("a compiling process ended early; another one is started when it is needed")
        return done

    @staticmethod
    def _start() -> subprocess.Popen[str]:
        child = start_process(SERVE, text=True, stderr=subprocess.DEVNULL)
        # An idle process ends while nobody looks, and stays in the system's table until somebody waits for it.
        with contextlib.suppress(RuntimeError):  # no thread is left: the next kernel finds that it has ended
            threading.Thread(target=child.wait, name="kinboard-compiler-end", daemon=True).start()
        return child


class Compilers:
    """The compiling processes of one process of the service.

    Attributes:
        asked: compiles what requests and visitors wait for.
        ahead: compiles what nobody has asked for yet.
    """

    def __init__(self) -> None:
        self.asked, self.ahead = KernelCompiler(ASKED_NICENESS), KernelCompiler()

    def compile(self, line: str) -> bool:
        """Wait until a kernel is compiled; False: its process has ended before that.

        Raises `ClientLeftError` and 503 as `Deadline.check`. An event loop does not wait: it gets 503.
        """
        deadline = current_deadline.get()
        try:
            answer = (self.ahead if ahead.get() else self.asked).submit(line)
            if _on_event_loop():
                raise _preparing("")
            while True:
                with contextlib.suppress(TimeoutError):
                    return answer.result(LOOK)
                if deadline is not None:
                    deadline.check()
        except TooSlowError:
            raise _preparing(f", and is not ready after {deadline.seconds:g} s" if deadline else "") from None
        except (CompilerStoppedError, CancelledError):
            raise (CompilerStoppedError() if deadline is None else stopping()) from None

    def stop(self) -> None:
        """End both processes; threads that wait for them get `CompilerStoppedError`."""
        self.asked.stop()
        self.ahead.stop()


def _on_event_loop() -> bool:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


def _preparing(how_long: str) -> ProblemError:
    detail = f"What this request needs is being compiled for the first time on this machine{how_long}."
    hint = f"This continues by itself. Try again in {RETRY_AFTER} s."
    return ProblemError(503, "preparing", detail, hint, headers={"Retry-After": str(RETRY_AFTER)})


def _answer(child: subprocess.Popen[str], line: str) -> str:
    """The answer of a process to a line; empty: it has ended."""
    if child.stdin is None or child.stdout is None:
        raise ValueError("the process has no pipes")
    try:
        child.stdin.write(line + "\n")
        child.stdin.flush()
        return child.stdout.readline().strip()
    except (OSError, ValueError):  # its pipes are closed
        return ""


def start_process(program: str, **options: Any) -> subprocess.Popen[Any]:
    """A Python process with two pipes to it, in a session of its own, so that it gets no Ctrl-C."""
    return subprocess.Popen(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
        **options,
    )


def kill(child: subprocess.Popen[Any]) -> int:
    """End a process and close its pipes; returns its exit code."""
    child.kill()
    code = child.wait()
    for pipe in (child.stdin, child.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):  # what was not read by the process is lost
                pipe.close()
    return code
