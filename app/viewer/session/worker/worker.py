"""A visitor's worker and its inbox.

Browser callbacks post events and return. The worker takes all new events and processes them in one step. Its steps
are called by :class:`~app.viewer.session.worker.threads.VisitorThreads`, one at a time: state that only the worker
touches needs no lock.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Hashable

import kin
from app.viewer.panel.status import Notice
from app.viewer.session.worker.inbox import Inbox
from app.viewer.session.worker.threads import THREADS, Turn

log = logging.getLogger(__name__)


class Worker:
    """Answers one visitor. `start`, `post`, `end` and `join` are thread-safe.

    Args:
        visitor: the visitor's number, for the log.
        failed: called last by a worker that cannot continue.
    """

    def __init__(self, visitor: int, failed: Callable[[], None] | None = None) -> None:
        self._visitor = visitor
        self._failed = failed
        self._inbox = Inbox()
        self._turn = Turn(THREADS, self._act_once)
        self._built = False
        self._ended = threading.Event()
        self._ended.set()  # until it is started

    def start(self) -> None:
        """Build the visitor's page and start processing events."""
        self._ended.clear()
        try:
            threading.Thread(target=self._open, name=f"visitor-{self._visitor}", daemon=True).start()
        except RuntimeError:  # the system has no thread left
            self._fail()

    def post(self, key: Hashable, value: object = None) -> None:
        """Queue an event; a newer value replaces a queued one of the same key."""
        self._inbox.post(key, value)
        if self._built:
            self._turn.call()

    def end(self) -> None:
        """Tell the worker to finish."""
        self._inbox.close()
        if self._built:
            self._turn.call()

    def join(self, timeout: float | None = None) -> bool:
        """Wait for the worker to finish; returns whether it has."""
        return self._ended.wait(timeout)

    # To be overridden

    def _prepare(self) -> None:
        """Runs first, in a thread of its own: wait for what the page needs."""

    def _build(self) -> None:
        """Runs next: build the page."""
        raise NotImplementedError

    def _step(self, batch: list[tuple[Hashable, object]]) -> None:
        """Process the events of a batch; the batch is empty after `_timeout` seconds without an event."""
        raise NotImplementedError

    @property
    def _timeout(self) -> float | None:
        """How long (s) the worker may sleep if nothing happens; None: until the next event."""
        raise NotImplementedError

    def _report(self, notice: Notice) -> None:
        """Show an error to the visitor."""
        raise NotImplementedError

    def _leave(self) -> None:
        """Runs last: the page no longer exists."""
        raise NotImplementedError

    # What the threads call

    def _open(self) -> None:
        try:
            self._prepare()
        except BaseException:  # noqa: BLE001 - logged there
            self._fail()
        else:
            self._turn.call(build=True)

    def _act_once(self) -> float | None:
        """Build the page, process one batch, or finish; returns seconds until the next call."""
        if self._ended.is_set():
            return None
        try:
            if not self._built and self._inbox.closed:  # left before there was a page
                self._finish()
                return None
            if not self._built:
                self._build()
                self._built = True
                if self._inbox.waits:  # what was posted until now called nobody
                    return 0.0
            elif (batch := self._inbox.take()) is None:
                self._finish()
                return None
            else:
                self._guard(lambda: self._step(batch))
            return self._timeout
        except BaseException:  # noqa: BLE001 - logged there
            self._fail()
            return None

    def _fail(self) -> None:
        """End a worker that cannot continue."""
        gone = self._inbox.closed
        self._inbox.close()
        log.log(logging.DEBUG if gone else logging.ERROR, "a visitor's worker failed", exc_info=True)
        try:
            if self._failed is not None and not gone:
                self._failed()
        finally:
            self._finish()

    def _finish(self) -> None:
        try:
            self._leave()
        finally:
            self._ended.set()

    def _guard(self, action: Callable[[], None]) -> None:
        """Run an action; an error is shown, and logged unless the input was invalid; the worker continues."""
        try:
            action()
        except Exception as error:
            if self._inbox.closed:
                log.debug("visitor %s disconnected during a step: %s", self._visitor, error)
                return
            if isinstance(error, kin.KinematicsError):  # visitors must neither fill the log nor write into it
                log.debug("visitor %s: %s", self._visitor, type(error).__name__)
            else:
                log.exception("visitor %s", self._visitor)
            self._show_error(error)

    def _show_error(self, error: Exception) -> None:
        expected = isinstance(error, kin.KinematicsError)
        detail = str(error) if expected else f"{type(error).__name__}; see the server log for details."
        try:
            self._report(Notice("error", "Invalid input" if expected else "Something went wrong", detail))
        except Exception:
            log.exception("visitor %s: the error could not be shown", self._visitor)
