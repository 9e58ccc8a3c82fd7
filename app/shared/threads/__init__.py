"""Threads: which processors they run on, their priority, and how a process ends in spite of them.

Of a process's threads only one at a time runs Python. A gizmo drag passes from the event loop to the thread of
visitors and back; if each wakes up on another processor, a drag among many visitors may take longer than on a
single one. So `pin` keeps a process on one processor. Threads that compute outside the interpreter for long, such
as those of clouds and maps, call `lower_priority` first: it unpins them and lets visitors go first.
"""

from __future__ import annotations

import atexit
import contextlib
import multiprocessing.util
import os
import random
import sys
import threading
import weakref
from typing import NoReturn

NICENESS = 10  # of threads that compute in the background

_processors: set[int] = set()  # those available before this process was pinned


def pin() -> None:
    """Keep this thread and those it starts on one processor. Does nothing where the system has no such call."""
    if not hasattr(os, "sched_setaffinity"):  # Linux only
        return
    available = sorted(os.sched_getaffinity(0))
    _processors.update(available)
    os.sched_setaffinity(0, {random.choice(available)})


def unpin() -> None:
    """Let this thread run on every processor again."""
    if _processors:
        os.sched_setaffinity(0, _processors)


def every_processor() -> frozenset[int]:
    """Numbers of the processors that were available before this process was pinned."""
    try:
        return frozenset(_processors or os.sched_getaffinity(0))
    except AttributeError:  # not on Linux
        return frozenset(range(os.cpu_count() or 1))


def lower_priority(niceness: int = NICENESS) -> None:
    """Let the threads of visitors run before this one, and this one on any processor.

    Linux has a niceness per thread. Elsewhere niceness belongs to the process, so only `unpin` is done.
    """
    unpin()
    if sys.platform == "linux":
        thread = threading.get_native_id()
        own = os.getpriority(os.PRIO_PROCESS, thread)  # who started the process may have lowered it farther
        os.setpriority(os.PRIO_PROCESS, thread, max(own, niceness))


def end_process(code: int) -> NoReturn:
    """End this process at once, whatever its threads do.

    The usual end of a Python process destroys LLVM while a thread compiles a kernel, which aborts the process; and
    it waits for the threads of executors. Functions registered with `atexit` are called, and output is flushed.
    A forked process must have called `forget_exit_handlers`.
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
    return max(1, len(every_processor()) - 1)
