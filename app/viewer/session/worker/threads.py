"""The threads that answer visitors: one acts for all of them, and another goes on where a step takes long.

A step takes half a millisecond, nearly all of it in Python, of which only one thread at a time runs. With a thread
for each visitor, thirty who drag cost a dozen switches of threads per event and gain nothing. So one thread leads:
it takes the visitors in turn, each for one step. A second one watches. If a step lasts longer than `PATIENCE`, a
new thread leads, and the one before only ends its step: a visitor whose step blocks holds up the others that long.

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
KEEP = 1.0  # s without a step, after which nobody watches until the next one
IN_A_ROW = 10  # steps, after which a page is built that waits
BUILDS = 4  # pages built at a time: more than one where the first take long


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
    """The threads of one process: one leads, one watches, others end their steps. They start when called."""

    def __init__(self) -> None:
        self._changed = threading.Condition()  # what the leader waits for; its lock protects all of this
        self._ready: deque[Turn] = deque()
        self._builds: deque[Turn] = deque()
        self._due: list[tuple[float, int, Turn]] = []
        self._building = 0
        self._row = 0  # steps since a page was built
        self._order, self._names = itertools.count(), itertools.count(1)
        self._leader: threading.Thread | None = None
        self._watcher: threading.Thread | None = None
        self._step = 0  # number of the leader's step; odd while it lasts
        self._active = threading.Event()  # whether the watcher looks at the leader again and again

    def call(self, turn: Turn, build: bool) -> None:
        """See `Turn.call`."""
        with self._changed:
            if turn.acts:
                turn.again = True
                return
            if not turn.waits:
                self._queue(turn, build)
            self._leader = self._leader or self._start(self._lead)

    def _start(self, act: Callable[[], None]) -> threading.Thread | None:
        """A new thread; None if the system has none left: the next call, step or look tries again."""
        thread = threading.Thread(target=act, name=f"visitors-{next(self._names)}", daemon=True)
        try:
            thread.start()
        except RuntimeError as error:
            log.error("a thread for visitors could not be started: %s", error)
            return None
        return thread

    def _queue(self, turn: Turn, build: bool) -> None:
        turn.waits, turn.due, turn.builds = True, None, build
        (self._builds if build else self._ready).append(turn)
        self._changed.notify()

    def _lead(self) -> None:
        """Take the visitors in turn, until another thread leads."""
        me = threading.current_thread()
        turn: Turn | None = None
        again: float | None = None
        while True:
            with self._changed:
                if turn is not None:
                    self._end_step(turn, again)
                if self._leader is not me:
                    return
                self._step += self._step & 1
                turn = self._next()
                self._begin_step(turn)
            try:
                again = turn.act()
            except BaseException:
                log.exception("a visitor's step failed")
                again = None

    def _next(self) -> Turn:
        """The next visitor, for whom the leader waits."""
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
            self._changed.wait(self._due[0][0] - now if self._due else None)

    def _begin_step(self, turn: Turn) -> None:
        turn.waits, turn.acts, turn.again = False, True, False
        self._building += turn.builds
        self._step += 1
        self._watcher = self._watcher or self._start(self._watch)
        if not self._active.is_set():
            self._active.set()

    def _end_step(self, turn: Turn, again: float | None) -> None:
        turn.acts = False
        self._building -= turn.builds
        if turn.again:
            self._queue(turn, False)
        elif again is not None:
            turn.due = time.monotonic() + again
            heapq.heappush(self._due, (turn.due, next(self._order), turn))
        self._changed.notify()  # another thread may lead by now

    def _watch(self) -> None:
        """Have another thread lead as soon as a step takes too long."""
        seen, idle = 0, 0
        while self._active.wait():
            time.sleep(PATIENCE)
            with self._changed:
                if self._step != seen:
                    seen, idle = self._step, 0
                elif not seen & 1:
                    idle += 1
                    if idle * PATIENCE > KEEP:
                        self._active.clear()
                elif leader := self._start(self._lead):
                    self._leader = leader
                    self._step += 1


THREADS = VisitorThreads()
