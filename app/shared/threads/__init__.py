"""Threads: which processors they run on, their priority, and how a process ends in spite of them.

Of a process's threads only one at a time runs Python. A gizmo drag passes through five of them in turn; if each
wakes up on another processor, a drag among many visitors takes two to ten times as long as on a single one. So
`pin` keeps a process on one processor (each of several worker processes on another). Threads that compute outside
the interpreter for long, such as those of clouds and maps, call `lower_priority` first: it unpins them and lets
visitors go first.
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
from collections.abc import Callable
from concurrent.futures import Executor, Future
from queue import SimpleQueue
from typing import NoReturn, ParamSpec, TypeVar, cast

P = ParamSpec("P")
T = TypeVar("T")

NICENESS = 10  # of threads that compute in the background

_processors: set[int] = set()  # those available before this process was pinned


def pin(number: int | None = None) -> None:
    """Keep this thread and those it starts on one processor. Does nothing where the system has no such call.

    Args:
        number: index of the processor among those available, taken modulo their number; None: a random one.
    """
    if not hasattr(os, "sched_setaffinity"):  # Linux only
        return
    available = sorted(os.sched_getaffinity(0))
    _processors.update(available)
    chosen = random.randrange(len(available)) if number is None else number % len(available)
    os.sched_setaffinity(0, {available[chosen]})


def unpin() -> None:
    """Let this thread run on every processor again."""
    if _processors:
        os.sched_setaffinity(0, _processors)


def lower_priority() -> None:
    """Let the threads of visitors run before this one, and this one on any processor.

    Linux has a niceness per thread. Elsewhere niceness belongs to the process, so only `unpin` is done.
    """
    unpin()
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)


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


def processors() -> int:
    """Number of processors that this thread may use: one where it is pinned."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on Linux
        return os.cpu_count() or 1


def background_threads() -> int:
    """How many threads a background computation uses: all processors but one."""
    return max(1, (os.cpu_count() or 2) - 1)


class DaemonExecutor(Executor):
    """An executor whose threads are daemons: the process may end in the middle of a long computation.

    The standard library's `ThreadPoolExecutor` joins its threads at exit.

    Args:
        max_workers: how many threads there are at most; they are started as needed.
        thread_name_prefix: their names are this and a number.
        initializer: called by each thread first.
    """

    def __init__(self, max_workers: int, thread_name_prefix: str, initializer: Callable[[], None]) -> None:
        self._max_workers = max_workers
        self._name = thread_name_prefix
        self._initializer = initializer
        self._lock = threading.Lock()
        self._threads = 0
        self._tasks: SimpleQueue[tuple[Future[object], Callable[[], None]] | None] = SimpleQueue()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Have ``fn(*args, **kwargs)`` called by one of the threads."""
        future: Future[T] = Future()

        def run() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                future.set_result(fn(*args, **kwargs))
            except BaseException as error:  # noqa: BLE001 - the future raises it
                future.set_exception(error)

        with self._lock:
            self._tasks.put((cast("Future[object]", future), run))
            if self._threads < self._max_workers:
                self._threads += 1
                name = f"{self._name}-{self._threads}"
                threading.Thread(target=self._work, name=name, daemon=True).start()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Start nothing more. Never waits; tasks that have not begun are cancelled in any case."""
        while not self._tasks.empty():
            if (task := self._tasks.get()) is not None:
                task[0].cancel()
        for _ in range(self._threads):
            self._tasks.put(None)

    def _work(self) -> None:
        self._initializer()
        while (task := self._tasks.get()) is not None:
            task[1]()
            del task  # whose result may be large
