"""Sends scores to platforms, behind the student's back and without making anybody wait.

One thread looks up in the database what is due and hands it to the platform's sender. A sender has a thread of its
own while it has work: a platform that does not answer delays no score for another one. A score is looked up when
it is due, so the score of a student who was removed meanwhile is not sent.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from app.classroom.lti.exchange import PlatformError
from app.classroom.lti.platforms import Platform, Platforms
from app.classroom.lti.seats import Column
from app.classroom.lti.services import post_score
from app.classroom.views import ClassroomUnavailable

logger = logging.getLogger("kinboard.lti")

PAUSES = (0.0, 2.0, 30.0, 300.0)  # s before each try


class Passback:
    """Scores of all platforms; a newer score of a seat replaces an older one.

    Args:
        column: where the score of a seat goes.
    """

    def __init__(
        self,
        platforms: Platforms,
        column: Callable[[str], Column | None],
        pauses: tuple[float, ...] = PAUSES,
    ) -> None:
        self._platforms = platforms
        self._column = column
        self._pauses = pauses
        self._due: dict[str, tuple[float, int]] = {}  # when and which try, by seat
        self._senders = {each: _Sender(platforms, each, self._again) for each in platforms.all}
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._closed = False

    def attempted(self, seat: str) -> None:
        """A seat has a new attempt."""
        with self._changed:
            self._put(seat, 0)

    def close(self) -> None:
        """Send nothing more."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        for sender in self._senders.values():
            sender.close()

    @property
    def busy(self) -> bool:
        """Whether a score is still to be sent."""
        with self._changed:
            return self._thread is not None or any(sender.busy for sender in self._senders.values())

    def _put(self, seat: str, tried: int) -> None:
        self._due[seat] = (time.monotonic() + self._pauses[tried], tried)
        if self._thread is None and not self._closed:
            self._thread = threading.Thread(target=self._run, name="kinboard-lti", daemon=True)
            self._thread.start()
        self._changed.notify()

    def _again(self, seat: str, tried: int) -> None:
        """A score was not taken: it is tried again, unless that was the last time or there is a newer one."""
        with self._changed:
            if tried + 1 >= len(self._pauses):
                logger.error("the score of a seat was not sent: it was tried %s times", tried + 1)
            elif seat not in self._due:
                self._put(seat, tried + 1)

    def _run(self) -> None:
        while True:
            with self._changed:
                if self._closed or not self._due:
                    self._thread = None
                    return
                seat, (at, tried) = min(self._due.items(), key=lambda item: item[1][0])
                wait = at - time.monotonic()
                if wait > 0.0:
                    self._changed.wait(wait)
                    continue
                del self._due[seat]
            try:
                column = self._column(seat)
            except ClassroomUnavailable:
                self._again(seat, tried)
            except Exception:  # the thread has the scores of others to look up
                logger.exception("the score of a seat could not be looked up")
                self._again(seat, tried)
            else:
                platform = None if column is None else self._platforms.find(column.issuer, column.client_id)
                if column is not None and platform is not None:
                    self._senders[platform].put(seat, column, tried)


class _Sender:
    """Sends the scores of one platform, one at a time.

    Args:
        again: called with a seat and the number of its try that failed.
    """

    def __init__(self, platforms: Platforms, platform: Platform, again: Callable[[str, int], None]) -> None:
        self._platforms = platforms
        self._platform = platform
        self._again = again
        self._waiting: dict[str, tuple[Column, int]] = {}
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    @property
    def busy(self) -> bool:
        """Whether its thread runs."""
        return self._thread is not None

    def put(self, seat: str, column: Column, tried: int) -> None:
        """Send this score soon."""
        with self._lock:
            self._waiting[seat] = column, tried
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="kinboard-lti-sender", daemon=True)
                self._thread.start()

    def close(self) -> None:
        """Send nothing more."""
        with self._lock:
            self._waiting.clear()

    def _run(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    self._thread = None
                    return
                seat = next(iter(self._waiting))
                column, tried = self._waiting.pop(seat)
            failed = self._send(column)
            if failed is None or failed.final:
                continue
            failing = {seat: (column, tried)}
            if failed.general:  # one try stands for all that wait
                with self._lock:
                    failing, self._waiting = failing | self._waiting, {}
            for each, (_, tries) in failing.items():
                self._again(each, tries)

    def _send(self, column: Column) -> PlatformError | None:
        where = column.address, column.user
        try:
            post_score(self._platforms, self._platform, *where, column.score, column.most, column.done)
        except PlatformError as error:
            logger.warning("a score could not be sent: %s", error)
            return error
        except Exception:  # the thread has the scores of others to send
            logger.exception("a score could not be sent")
            return PlatformError("an error", final=False)
        return None
