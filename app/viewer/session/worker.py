"""One thread that acts, and an inbox for everybody who wants it to.

Callbacks of the browser post and return. The worker takes everything that is new and makes one step of it; it
sleeps as long as nothing is to be done. What a worker touches needs no lock, because nobody else touches it.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Hashable

import kin
from app.viewer.panel.status import Notice
from app.viewer.session.inbox import Inbox

log = logging.getLogger(__name__)


class Worker:
    """The thread of one visitor. `start`, `post`, `end` and `join` may be called by any thread.

    Args:
        visitor: its number, for the log.
        failed: called as the last thing by a worker that cannot go on.
    """

    def __init__(self, visitor: int, failed: Callable[[], None] | None = None) -> None:
        self._visitor = visitor
        self._failed = failed
        self._inbox = Inbox()
        self._thread = threading.Thread(target=self._run, name=f"visitor-{visitor}", daemon=True)

    def start(self) -> None:
        """Build the visitor's page and begin to answer."""
        self._thread.start()

    def post(self, key: Hashable, value: object = None) -> None:
        """Tell the worker that the visitor did something."""
        self._inbox.post(key, value)

    def end(self) -> None:
        """Let the worker finish."""
        self._inbox.close()

    def join(self, timeout: float | None = None) -> bool:
        """Wait for the worker to finish; whether it did."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

    # What a visitor's worker does

    def _build(self) -> None:
        """Before everything else."""
        raise NotImplementedError

    def _step(self, batch: list[tuple[Hashable, object]]) -> None:
        """Act on what was posted; on nothing, when `_rest` is over."""
        raise NotImplementedError

    @property
    def _rest(self) -> float | None:
        """Seconds the worker may sleep if nothing happens."""
        raise NotImplementedError

    def _report(self, notice: Notice) -> None:
        """Show what went wrong."""
        raise NotImplementedError

    def _leave(self) -> None:
        """After everything else: there is no page any more."""
        raise NotImplementedError

    # The thread

    def _run(self) -> None:
        try:
            self._build()
            while (batch := self._inbox.take(self._rest)) is not None:
                self._guard(lambda batch=batch: self._step(batch))  # type: ignore[misc]
        except BaseException:
            gone = self._inbox.closed
            self._inbox.close()
            log.log(logging.DEBUG if gone else logging.ERROR, "a visitor's worker failed", exc_info=True)
            if self._failed is not None and not gone:
                self._failed()
        finally:
            self._leave()

    def _guard(self, act: Callable[[], None]) -> None:
        """Run one step; an error is logged and shown, and the worker lives on."""
        try:
            act()
        except Exception as error:
            if self._inbox.closed:
                log.debug("visitor %s left in mid-motion: %s", self._visitor, error)
                return
            log.exception("visitor %s", self._visitor)
            self._show_error(error)

    def _show_error(self, error: Exception) -> None:
        expected = isinstance(error, kin.KinematicsError)
        detail = str(error) if expected else f"{type(error).__name__}; the server's log has the details."
        try:
            self._report(Notice("error", "Not understood" if expected else "Something went wrong", detail))
        except Exception:
            log.exception("visitor %s: the error could not be shown", self._visitor)
