"""Sends scores to platforms, behind the student's back and without making anybody wait."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from app.classroom.lti.platforms import Platforms
from app.classroom.lti.seats import Column
from app.classroom.lti.services import GradeRefused, post_score
from app.classroom.views import ClassroomUnavailable

logger = logging.getLogger("kinboard.lti")

PAUSES = (0.0, 2.0, 30.0, 300.0)  # s before each try


class Passback:
    """One thread that lives while there is something to send. A newer score of a seat replaces an older one.

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
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._closed = False

    def attempted(self, seat: str) -> None:
        """A seat has a new attempt."""
        with self._changed:
            self._due[seat] = (time.monotonic() + self._pauses[0], 0)
            if self._thread is None and not self._closed:
                self._thread = threading.Thread(target=self._run, name="kinboard-lti", daemon=True)
                self._thread.start()
            self._changed.notify()

    def close(self) -> None:
        """Send nothing more."""
        with self._changed:
            self._closed = True
            self._changed.notify()

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
            again = self._tried(seat)
            if again and tried + 1 < len(self._pauses):
                with self._changed:
                    self._due.setdefault(seat, (time.monotonic() + self._pauses[tried + 1], tried + 1))
            elif again:
                logger.error("the score of a seat was not sent: the platform refused it %s times", tried + 1)

    def _tried(self, seat: str) -> bool:
        """As `_send`; no error ends the thread, which has the scores of others to send."""
        try:
            return self._send(seat)
        except Exception:
            logger.exception("a score could not be sent")
            return True

    def _send(self, seat: str) -> bool:
        """Send the present score; True: try again."""
        try:
            column = self._column(seat)
            if column is None:
                return False
            platform = self._platforms.find(column.issuer, column.client_id)
            if platform is None:
                return False
            where = column.address, column.user
            post_score(self._platforms, platform, *where, column.score, column.most, column.done)
        except ClassroomUnavailable:
            return True
        except GradeRefused as error:
            logger.warning("a score could not be sent: %s", error)
            return not error.final
        return False
