"""The threads that answer visitors: one acts for all of them, and another goes on where a step takes long.

A step takes half a millisecond, nearly all of it in Python, of which only one thread at a time runs. With a thread
for each visitor, thirty who drag cost a dozen switches of threads per event and gain nothing. So one thread leads:
it takes the visitors in turn, each for one step. A second one watches. If a step lasts longer than `PATIENCE`, the
watcher leads, and the thread of that step only ends it: a visitor whose step blocks holds up the others that long.

The event loop is woken once for the steps of a row (`VisitorThreads.after_steps`). Whenever it wakes, two
threads want Python at once.

Visitors who are there come first, and pages are built after their steps. If two hundred arrive at once, each page
takes some ten milliseconds, and a visitor who drags waits for one of them at most.
"""

from __future__ import annotations

import heapq
import itertools
import logging
import threading
import time
from collections import deque
from collections.abc import Callable

log = logging.getLogger(__name__)

PATIENCE = 0.02  # s without a new step, after which another thread leads
KEEP = 2.0  # s without work, after which the threads end
IN_A_ROW = 10  # steps, after which a page is built that waits
TOGETHER = 8  # steps, after which the event loop is woken for them at the latest
BUILDS = 4  # pages built at a time: more than one where the first take long
LOG_EVERY = 10.0  # s between two log lines about threads that could not be started


class Turn:
    """What one visitor has in a `VisitorThreads`.

    Args:
        act: does what there is to do; returns seconds until it is called again, None: only after `call`.
    """

    def __init__(self, threads: VisitorThreads, act: Callable[[], float | None]) -> None:
        self._threads = threads
        self.act = act
        self.waits = self.acts = self.again = self.builds = False
        self.due: float | None = None  # of `time.monotonic`

    def call(self, build: bool = False) -> None:
        """Have `act` called soon, once for all calls before it begins; any thread may call.

        Args:
            build: whether it is a page that is built, which may wait longer.
        """
        self._threads.call(self, build)


class VisitorThreads:
    """The threads of one process. They start with the first call and end after `KEEP` seconds without one."""

    def __init__(self, patience: float = PATIENCE, keep: float = KEEP) -> None:
        self._patience, self._keep = patience, keep
        self._lock = threading.Lock()
        self._work = threading.Condition(self._lock)  # what the leader waits for
        self._watch = threading.Condition(self._lock)  # what the watcher waits for
        self._ready: deque[Turn] = deque()
        self._builds: deque[Turn] = deque()
        self._building = 0
        self._row = 0  # steps since a page was built
        self._after: dict[Callable[[], None], None] = {}  # see `after_steps`
        self._together = 0  # steps since the last of these calls
        self._due: list[tuple[float, int, Turn]] = []
        self._order = itertools.count()
        self._numbers = itertools.count(1)
        self._leader: threading.Thread | None = None
        self._watcher: threading.Thread | None = None
        self._step = 0  # number of the leader's step; odd while it lasts
        self._log_at = 0.0  # when a thread that could not be started is logged again
        self._watches = False  # whether the watcher looks at the leader again and again

    def call(self, turn: Turn, build: bool) -> None:
        """See `Turn.call`."""
        with self._lock:
            if turn.acts:
                turn.again = True
                return
            if not turn.waits:
                self._queue(turn, build)
            if self._leader is None:
                self._leader = self._start(True)
            elif not self._step & 1:
                self._work.notify()

    def after_steps(self, act: Callable[[], None]) -> None:
        """Call `act` once for several steps: when no visitor waits any more, or after `TOGETHER` steps.

        Outside of the leading thread it is called at once. It must be quick, and not fail.
        """
        with self._lock:
            if is_leader := threading.current_thread() is self._leader:
                self._after[act] = None
        if not is_leader:
            act()

    def _call_after(self) -> None:
        self._together += 1
        if self._ready and not self._builds and self._together < TOGETHER:
            return
        with self._lock:
            self._together, after, self._after = 0, self._after, {}
        for act in after:
            act()

    def _start(self, leads: bool) -> threading.Thread | None:
        """A new thread; None if the system has none left: the next call or step tries again."""
        thread = threading.Thread(
            target=self._run, args=(leads,), name=f"visitors-{next(self._numbers)}", daemon=True
        )
        try:
            thread.start()
        except RuntimeError as error:
            if time.monotonic() >= self._log_at:
                self._log_at = time.monotonic() + LOG_EVERY
                log.error("a thread for visitors could not be started: %s", error)
            return None
        return thread

    def _run(self, leads: bool) -> None:
        while leads or self._take_over():
            leads = False
            if not self._lead():
                return

    def _queue(self, turn: Turn, build: bool) -> None:
        turn.waits, turn.due, turn.builds = True, None, build
        (self._builds if build else self._ready).append(turn)

    # The leader

    def _lead(self) -> bool:
        """Take the visitors in turn. True: another thread leads now; False: there was nothing to do for long."""
        me = threading.current_thread()
        turn: Turn | None = None
        again: float | None = None
        while True:
            if self._after:
                self._call_after()
            with self._lock:
                if turn is not None:
                    self._end_step(turn, again)
                if self._leader is not me:
                    return True
                self._step += self._step & 1
                turn = self._next()
                if turn is None:
                    self._leader = None
                    self._watch.notify()
                    return False
                self._begin_step(turn)
            try:
                again = turn.act()
            except BaseException:
                log.exception("a visitor's step failed")
                again = None

    def _next(self) -> Turn | None:
        """The next visitor, for whom the leader waits; None: there was none for long."""
        while True:
            now = time.monotonic()
            while self._due:
                at, _, turn = self._due[0]
                called = turn.due != at  # before it was due
                if not called and at > now:
                    break
                heapq.heappop(self._due)
                if not called:
                    self._queue(turn, False)
            builds = self._builds and self._building < BUILDS
            if self._ready and not (builds and self._row >= IN_A_ROW):
                self._row += 1
                return self._ready.popleft()
            if builds:
                self._row = 0
                return self._builds.popleft()
            wait = self._due[0][0] - now if self._due else self._keep
            if not self._work.wait(wait) and not (self._ready or self._builds or self._due):
                return None

    def _begin_step(self, turn: Turn) -> None:
        turn.waits, turn.acts, turn.again = False, True, False
        self._building += turn.builds
        self._step += 1
        if self._watcher is None:
            self._watches = True
            self._watcher = self._start(False)
        elif not self._watches:
            self._watches = True
            self._watch.notify()

    def _end_step(self, turn: Turn, again: float | None) -> None:
        turn.acts = False
        self._building -= turn.builds
        if turn.again:
            self._queue(turn, False)
        elif again is not None:
            turn.due = time.monotonic() + again
            heapq.heappush(self._due, (turn.due, next(self._order), turn))
        if self._leader is None and (self._ready or self._due):
            self._leader = self._start(True)
        elif self._leader is not threading.current_thread() and not self._step & 1:
            self._work.notify()  # it sleeps, and did not know of this

    # The watcher

    def _take_over(self) -> bool:
        """Watch, and lead as soon as a step takes too long. False: this thread is not needed."""
        me = threading.current_thread()
        with self._lock:
            if self._watcher not in (None, me):
                return False  # another thread does
            self._watcher = me
            late = self._watch_leader()
            self._watcher = None
            if late:
                self._leader = me
                self._step += 1  # of the thread that led, and only ends its step
            return late

    def _watch_leader(self) -> bool:
        """Wait; True: a step takes too long, False: there is no leader any more."""
        idle, seen = 0, 0
        while self._leader is not None:
            if self._step & 1:
                if self._step == seen:
                    return True
                idle = 0
            else:
                idle += 1
            seen = self._step
            self._watches = idle * self._patience < 1.0
            self._watch.wait(self._patience if self._watches else None)
        return False


THREADS = VisitorThreads()
