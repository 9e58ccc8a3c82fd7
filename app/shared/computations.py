"""Cache for expensive results. Concurrent callers with the same key share one computation.

A result is identified by its key, which holds everything the result depends on; what is dropped is computed again.
There are two ways to ask. `ComputationCache.get` returns a future: the computation runs to its end, whether or not
anybody still waits, and the next caller finds the result. `ComputationCache.subscribe` is for long computations:
a :class:`Subscription` shows progress and partial results, and when the last subscriber leaves, the computation is
cancelled. Errors reach every caller and are not cached. Every method may be called by any
thread.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import CancelledError, Executor, Future
from types import TracebackType
from typing import Generic, TypeVar

from app.shared.threads import in_short_turns

T = TypeVar("T")


class TooManyPendingError(RuntimeError):
    """A new computation was refused, because too many are pending.

    Attributes:
        pending: how many are.
    """

    def __init__(self, pending: int) -> None:
        super().__init__(f"{pending} computations are pending already")
        self.pending = pending


class SharedComputation(Generic[T]):
    """One computation and all that its callers see of it. Written by the thread that computes, read by any.

    Attributes:
        key: what is computed.
        future: the result, or the error. Do not cancel it: other callers may wait for it.
        done, total: progress, in units of the computation; `total` is 0 until it is known.
        latest: the newest partial result, and in the end the result; None before the first.
    """

    def __init__(self, key: Hashable) -> None:
        self.key = key
        self.future: Future[T] = Future()
        self.done = 0
        self.total = 0
        self.latest: T | None = None
        self._cancelled = False
        # Protected by the lock of the cache.
        self._subscribers = 0
        self._kept_running = False  # by `ComputationCache.get`

    def check(self) -> None:
        """Raises `CancelledError` if nobody needs the result any more. Long computations call it now and then."""
        if self._cancelled:
            raise CancelledError


class Subscription(Generic[T]):
    """One caller's view of a computation. Call `leave`, or use it as a context manager, when done with it."""

    def __init__(self, computation: SharedComputation[T], on_leave: Callable[[], None]) -> None:
        self._computation = computation
        self._on_leave = on_leave
        self._active = True

    @property
    def future(self) -> Future[T]:
        """The result, or the error. Do not cancel it: other callers may wait for it."""
        return self._computation.future

    @property
    def done(self) -> int:
        """How much is computed, of `total`."""
        return self._computation.done

    @property
    def total(self) -> int:
        """How much there is to compute; 0 until that is known."""
        return self._computation.total

    @property
    def latest(self) -> T | None:
        """The newest partial result, and in the end the result: one object for all subscribers."""
        return self._computation.latest

    @property
    def finished(self) -> bool:
        """Whether there is a result or an error."""
        return self._computation.future.done()

    def leave(self) -> None:
        """End the subscription; may be called again. The last subscriber's leaving cancels the computation."""
        active, self._active = self._active, False
        if active:
            self._on_leave()

    def __enter__(self) -> Subscription[T]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.leave()


class ComputationCache(Generic[T]):
    """Results by key, and the computations under way.

    Args:
        executor: runs the computations. It may be shared with other work, so its owner shuts it down.
        capacity: the most that is kept, as the sum of `size_of`; the result used longest ago is dropped first.
        size_of: size of a result, such as its bytes; by default every result counts 1.
    """

    def __init__(self, executor: Executor, capacity: int, size_of: Callable[[T], int] = lambda _: 1) -> None:
        self._executor = executor
        self._capacity = capacity
        self._size_of = size_of
        self._lock = threading.Lock()
        self._computations: OrderedDict[Hashable, SharedComputation[T]] = OrderedDict()
        self._sizes: dict[Hashable, int] = {}  # of the results
        self._size = 0

    @property
    def size(self) -> int:
        """Sum of the sizes of all results kept."""
        return self._size

    @property
    def pending(self) -> int:
        """How many computations wait or run."""
        return len(self._computations) - len(self._sizes)

    def __len__(self) -> int:
        """How many results are kept or being computed."""
        return len(self._computations)

    def __contains__(self, key: Hashable) -> bool:
        """Whether this result is kept or being computed."""
        return key in self._computations

    def get(
        self, key: Hashable, compute: Callable[[SharedComputation[T]], T], max_pending: int | None = None
    ) -> Future[T]:
        """The result for `key`: kept, being computed, or started now. Do not cancel the future.

        Args:
            key: everything the result depends on.
            compute: computes it; called by a thread of the executor.
            max_pending: do not start a new computation if this many are pending.

        Raises:
            TooManyPendingError: as many as `max_pending` are.
        """
        with self._lock:
            computation = self._find_or_start(key, compute, max_pending)
            computation._kept_running = True
        return computation.future

    def subscribe(
        self, key: Hashable, compute: Callable[[SharedComputation[T]], T], max_pending: int | None = None
    ) -> Subscription[T]:
        """Watch the computation for `key`, which is started if need be.

        Args:
            key: everything the result depends on.
            compute: computes it in a thread of the executor: reports progress and partial results in the
                attributes of its argument, and calls its `check` often.
            max_pending: do not start a new computation if this many are pending.

        Raises:
            TooManyPendingError: as many as `max_pending` are.
        """
        with self._lock:
            computation = self._find_or_start(key, compute, max_pending)
            computation._subscribers += 1
        return Subscription(computation, lambda: self._leave(computation))

    def close(self) -> None:
        """Cancel what is being computed; returns at once."""
        with self._lock:
            for computation in self._computations.values():
                self._cancel(computation)

    def _find_or_start(
        self, key: Hashable, compute: Callable[[SharedComputation[T]], T], max_pending: int | None = None
    ) -> SharedComputation[T]:
        computation = self._computations.get(key)
        if computation is None:
            if max_pending is not None and self.pending >= max_pending:
                raise TooManyPendingError(self.pending)
            computation = SharedComputation(key)
            self._executor.submit(self._run, computation, compute)
            self._computations[key] = computation
        self._computations.move_to_end(key)
        return computation

    def _run(self, computation: SharedComputation[T], compute: Callable[[SharedComputation[T]], T]) -> None:
        if not computation.future.set_running_or_notify_cancel():
            return
        try:
            with in_short_turns():
                result = compute(computation)
            size = self._size_of(result)
        except BaseException as error:  # noqa: BLE001 - every caller raises it
            with self._lock:
                self._forget(computation)  # the next caller tries again
            if computation._cancelled:
                error.__traceback__ = None  # it holds all that was being computed
            computation.future.set_exception(error)
            return
        with self._lock:
            if self._computations.get(computation.key) is computation:
                self._sizes[computation.key] = size
                self._size += size
                self._shrink()
        computation.latest = result
        computation.future.set_result(result)

    def _shrink(self) -> None:
        while self._size > self._capacity:
            oldest = next(key for key in self._computations if key in self._sizes)
            self._forget(self._computations[oldest])

    def _leave(self, computation: SharedComputation[T]) -> None:
        with self._lock:
            computation._subscribers -= 1
            unused = computation._subscribers == 0 and not computation._kept_running
            if unused and not computation.future.done():
                # A caller who comes from now on starts a new one: this one may already have seen the cancellation.
                self._cancel(computation)
                self._forget(computation)

    @staticmethod
    def _cancel(computation: SharedComputation[T]) -> None:
        computation._cancelled = True
        computation.future.cancel()  # succeeds if it has not begun

    def _forget(self, computation: SharedComputation[T]) -> None:
        if self._computations.get(computation.key) is computation:
            del self._computations[computation.key]
            self._size -= self._sizes.pop(computation.key, 0)
