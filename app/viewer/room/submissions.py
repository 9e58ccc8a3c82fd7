"""A student's answers on their way into the database: stored in order, in the background, and tried again."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from app.classroom.views import ClassroomUnavailable, Confirmed, NewAttempt, RefusedError

log = logging.getLogger(__name__)

AGAIN = 2.0  # s after an attempt that the database did not take
PATIENCE = 60.0  # s for which a page that has gone still tries


class SubmissionState(NamedTuple):
    """How far a student's answers are.

    Attributes:
        waiting: how many are not stored yet.
        stored: how many are stored.
        problem: why the oldest one is not stored yet, or could not be; empty if all is well.
    """

    waiting: int = 0
    stored: int = 0
    problem: str = ""


class Submissions:
    """Thread-safe. There is a thread only while something is on its way.

    Args:
        submit: stores an attempt, as `Attendance.submit`.
        changed: called by the thread after each outcome.

    Attributes:
        state: how far they are; replaced as a whole, so that readers need no lock and never see half an outcome.
    """

    def __init__(self, submit: Callable[[NewAttempt], Confirmed], changed: Callable[[], None]) -> None:
        self._submit, self._changed = submit, changed
        self._lock = threading.Lock()
        self._waiting: deque[NewAttempt] = deque()
        self._running = False
        self._closed = threading.Event()
        self.state = SubmissionState()

    def add(self, attempt: NewAttempt) -> None:
        """Store an attempt after those that wait."""
        with self._lock:
            self._waiting.append(attempt)
            problem = self.state.problem if len(self._waiting) > 1 else ""  # else that of an answer that is done
            self.state = SubmissionState(len(self._waiting), self.state.stored, problem)
            if self._running:
                return
            self._running = True
        threading.Thread(target=self._run, name="kinboard-answers", daemon=True).start()

    def close(self) -> None:
        """The page has gone: what waits is tried a little longer."""
        self._closed.set()

    def _run(self) -> None:
        tries = PATIENCE / AGAIN
        while True:
            with self._lock:
                if not self._waiting or tries <= 0:
                    self._running = False
                    return
                attempt = self._waiting[0]
            stored, problem = 0, ""
            try:
                self._submit(attempt)
                stored = 1
            except ClassroomUnavailable as error:
                with self._lock:
                    self.state = self.state._replace(problem=str(error))
                self._changed()
                tries -= self._closed.is_set()
                time.sleep(AGAIN)
                continue
            except RefusedError as error:
                problem = str(error)
            except Exception:
                log.exception("an answer could not be stored")
                problem = "The answer could not be stored; the server log has the details."
            with self._lock:
                self._waiting.popleft()
                self.state = SubmissionState(len(self._waiting), self.state.stored + stored, problem)
            self._changed()
