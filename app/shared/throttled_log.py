"""Log lines about what clients do: each kind at most every few seconds, so that no client can fill the log."""

from __future__ import annotations

import asyncio
import logging

LOG_EVERY = 60.0  # seconds between two lines of the same kind
KIND = "kind"  # attribute of a record, for `app.service.log`: what counts as the same event; None: nothing does
_COUNTED = {KIND: None}  # here


class ThrottledLog:
    """Logs the first line of a kind at once, those of the next seconds as a number. For one event loop only."""

    def __init__(self, logger: logging.Logger) -> None:
        self._logger = logger
        self._latest: dict[str, tuple[str, int]] = {}  # by kind: the line, and how often since it was logged

    def note(self, kind: str, line: str, error: Exception | None = None) -> None:
        """Log a line, with the traceback of the error if there is one, or count it."""
        if kind in self._latest:
            self._latest[kind] = line, self._latest[kind][1] + 1
        else:
            self._logger.warning("%s", line, exc_info=error, extra=_COUNTED)
            self._begin(kind, line)

    def _begin(self, kind: str, line: str) -> None:
        self._latest[kind] = line, 0
        asyncio.get_running_loop().call_later(LOG_EVERY, self._end, kind)

    def _end(self, kind: str) -> None:
        line, more = self._latest.pop(kind)
        if more:
            self._logger.warning("%s (%d more times in %g s)", line, more, LOG_EVERY, extra=_COUNTED)
            self._begin(kind, line)
