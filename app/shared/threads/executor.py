"""An executor whose threads let the process end."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from queue import SimpleQueue
from typing import ParamSpec, TypeVar, cast

P = ParamSpec("P")
T = TypeVar("T")


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
