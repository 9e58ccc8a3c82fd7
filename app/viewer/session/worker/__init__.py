"""A worker thread and its inbox.

Browser callbacks post events and return. The worker takes all new events and processes them in one step; it sleeps
while there is nothing to do. State that only the worker touches needs no lock.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Hashable

import kin
from app.shared.threads.turns import urgent
from app.viewer.panel.status import Notice
from app.viewer.session.worker.inbox import Inbox

log = logging.getLogger(__name__)


class Worker:
    """The thread of one visitor. `start`, `post`, `end` and `join` are thread-safe.

    Args:
        visitor: the visitor's number, for the log.
        failed: called last by a worker that cannot continue.
    """

    def __init__(self, visitor: int, failed: Callable[[], None] | None = None) -> None:
        self._visitor = visitor
        self._failed = failed
        self._inbox = Inbox()
        self._thread = threading.Thread(target=self._run, name=f"visitor-{visitor}", daemon=True)

    def start(self) -> None:
        """Build the visitor's page and start processing events."""
        self._thread.start()

    def post(self, key: Hashable, value: object = None) -> None:
        """Queue an event; a newer value replaces a queued one of the same key."""
        self._inbox.post(key, value)

    def end(self) -> None:
        """Tell the worker to finish."""
        self._inbox.close()

    def join(self, timeout: float | None = None) -> bool:
        """Wait for the worker to finish; returns whether it has."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

    # To be overridden

    def _build(self) -> None:
        """Runs first: build the page."""
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

    # The thread

    def _run(self) -> None:
        try:
            self._build()
            while (batch := self._inbox.take(self._timeout)) is not None:
                with urgent:
                    self._guard(lambda batch=batch: self._step(batch))  # type: ignore[misc]
        except BaseException:
            gone = self._inbox.closed
            self._inbox.close()
            log.log(logging.DEBUG if gone else logging.ERROR, "a visitor's worker failed", exc_info=True)
            if self._failed is not None and not gone:
                self._failed()
        finally:
            self._leave()

    def _guard(self, action: Callable[[], None]) -> None:
        """Run an action; an error is logged and shown, and the worker continues."""
        try:
            action()
        except Exception as error:
            if self._inbox.closed:
                log.debug("visitor %s disconnected during a step: %s", self._visitor, error)
                return
            log.exception("visitor %s", self._visitor)
            self._show_error(error)

    def _show_error(self, error: Exception) -> None:
        expected = isinstance(error, kin.KinematicsError)
        detail = str(error) if expected else f"{type(error).__name__}; see the server log for details."
        try:
            self._report(Notice("error", "Invalid input" if expected else "Something went wrong", detail))
        except Exception:
            log.exception("visitor %s: the error could not be shown", self._visitor)
