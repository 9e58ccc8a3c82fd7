"""The service starts again if it is killed or hangs: by the process that has started it, which does nothing else.

On Linux the service is a copy of that process, made before any thread was started. So a new one starts at once,
without importing anything, and with the robots, exercises and listening socket that the first one had: new
connections wait meanwhile. Elsewhere the service is one process, and the operating system's supervisor starts it.

A service whose event loop makes no step for a while ends itself (`end_after`). The C library's timer of
`faulthandler` does that, so it works even if a computation never gives the interpreter back; it writes where each
thread was.
"""

from __future__ import annotations

import contextlib
import faulthandler
import logging
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO, ClassVar, NoReturn

from app.shared.threads import end_process, forget_exit_handlers

SHORT_LIFE = 5.0  # s: what ends sooner, the third time in a row, is started again later and later
LONGEST_PAUSE = 3.0  # s
_SIGNALS = (signal.SIGTERM, signal.SIGINT)  # that stop the service

logger = logging.getLogger("kinboard.restarts")


@dataclass
class _State:
    """What the signal handlers of the first process share with it."""

    first: ClassVar[int] = 0  # number of that process
    child: int = 0  # number of the process that serves; 0: there is none
    stopping: bool = False


def can_restart() -> bool:
    """Whether `restarted` can be used: on Linux, by a process with one thread, as a copy has no others."""
    return sys.platform == "linux" and threading.active_count() == 1


def restarted(serve: Callable[[bool, Callable[[], None]], int], grace: float) -> int:
    """Run `serve` in another process, again and again until SIGTERM or Ctrl-C; returns the exit code.

    If one ends with an error before it has said that it serves, so would the next: its code is returned.

    Args:
        serve: called with whether it is the first one, and what it calls once it serves.
        grace: seconds from SIGTERM until a process that has not ended is killed.
    """
    state, short = _State(), 0
    _State.first = os.getpid()

    def stop(*_: object) -> None:
        state.stopping = True
        if state.child:
            os.kill(state.child, signal.SIGTERM)
            timer = threading.Timer(grace, give_up)
            timer.daemon = True
            timer.start()

    def give_up() -> None:
        if state.child:
            logger.error("the service did not end within %s s and is killed", grace)
            os.kill(state.child, signal.SIGKILL)

    before = {number: signal.signal(number, stop) for number in _SIGNALS}
    first = True
    try:
        while not state.stopping:
            began = time.monotonic()
            code, served = _run(serve, first, state)
            if state.stopping or (code > 0 and first and not served):
                return 0 if state.stopping else code
            first, short = False, short + 1 if time.monotonic() - began < SHORT_LIFE else 0
            pause = 0.0 if short < 3 else min(2.0 ** (short - 3), LONGEST_PAUSE)
            when = f"in {pause:g} s" if pause else "now"
            logger.error("the service has ended with code %s and is started again %s", code, when)
            time.sleep(pause)
        return 0
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _run(serve: Callable[[bool, Callable[[], None]], int], first: bool, state: _State) -> tuple[int, bool]:
    """The exit code of one process, and whether it has served."""
    ours, its = os.pipe()
    signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)  # so that the copy does not run our handlers
    try:
        with warnings.catch_warnings():
            # Python cannot know that the threads of numpy's linear algebra are made for this.
            warnings.simplefilter("ignore", DeprecationWarning)
            state.child = os.fork()
        if not state.child:
            os.close(ours)
            _become(serve, first, its)
        os.close(its)
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
    try:
        code = os.waitstatus_to_exitcode(os.waitpid(state.child, 0)[1])
    finally:
        state.child = 0
    served = bool(os.read(ours, 1))
    os.close(ours)
    return code, served


def _become(serve: Callable[[bool, Callable[[], None]], int], first: bool, pipe: int) -> NoReturn:
    """Serve in this process, a copy, and end it."""
    code = 1
    try:
        forget_exit_handlers()
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
        code = serve(first, lambda: _say(pipe))
    except BaseException:
        logger.exception("the service could not be started")
    finally:
        end_process(code)


def _say(pipe: int) -> None:
    with contextlib.suppress(OSError):  # the first process has ended
        os.write(pipe, b".")
    os.close(pipe)


def end_after(seconds: float) -> None:
    """End this process after so many seconds, and write where its threads were, unless this is called again."""
    file: IO[str] | None = sys.__stderr__
    if file is not None:
        faulthandler.dump_traceback_later(seconds, exit=True, file=file)


def is_orphan() -> bool:
    """Whether the process that has started this one, a copy, has ended: nobody else would stop it."""
    return os.getppid() != _State.first
