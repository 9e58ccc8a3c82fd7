"""Threads: how many compute, their priority, and how a process ends in spite of them."""

from __future__ import annotations

import atexit
import contextlib
import multiprocessing.util
import os
import sys
import threading
import weakref
from collections.abc import Iterator
from typing import NoReturn

NICENESS = 10  # of threads that compute in the background
SHORT_TURN = 5e-4  # s for which a thread keeps the interpreter while something is computed beside visitors


def processors() -> int:
    """How many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on Linux
        return os.cpu_count() or 1


def lower_priority() -> None:
    """Let the threads of visitors run before this one.

    Linux has a niceness per thread. Elsewhere niceness belongs to the process, and nothing is done.
    """
    if sys.platform == "linux":
        thread = threading.get_native_id()
        own = os.getpriority(os.PRIO_PROCESS, thread)  # who started the process may have lowered it farther
        os.setpriority(os.PRIO_PROCESS, thread, max(own, NICENESS))


_counting = threading.Lock()
_computing = 0  # threads within `in_short_turns`
_usual_turn = 0.0  # s, before the first of them


@contextlib.contextmanager
def in_short_turns() -> Iterator[None]:
    """While this lasts, threads take the interpreter from each other after `SHORT_TURN`.

    The event loop gives it away with each read and write, and a thread that computes in Python would keep it for
    Python's usual 5 ms each time: thirty visitors who drag while equations are derived then wait 0.11 s for half
    of their pictures, and here 0.05 to 0.07 s. Where nothing is computed, the usual turns cost least.
    """
    global _computing, _usual_turn
    with _counting:
        if _computing == 0:
            _usual_turn = sys.getswitchinterval()
            sys.setswitchinterval(min(SHORT_TURN, _usual_turn))
        _computing += 1
    try:
        yield
    finally:
        with _counting:
            _computing -= 1
            if _computing == 0:
                sys.setswitchinterval(_usual_turn)


def end_process(code: int) -> NoReturn:
    """End this process at once, whatever its threads do.

    The usual end of a Python process waits for the threads of executors. Functions registered with `atexit` are
    called, and output is flushed. A forked process must have called `forget_exit_handlers`.
    """
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):  # closed, or nobody reads it
            stream.flush()
    os._exit(code)


def forget_exit_handlers() -> None:
    """Let this process, a copy, end without what its parent does at its end, such as deleting temporary folders.

    What it registers from now on is done at its own end: by `atexit`, `weakref.finalize` and `multiprocessing`.
    """
    atexit._clear()
    for inherited in tuple(weakref.finalize._registry):  # type: ignore[attr-defined]
        inherited.atexit = False
    weakref.finalize._registered_with_atexit = False  # type: ignore[attr-defined]
    atexit.register(multiprocessing.util._exit_function)  # type: ignore[attr-defined] # its list is cleared by the fork


def background_threads() -> int:
    """How many threads a background computation uses: all processors but one."""
    return max(1, processors() - 1)
