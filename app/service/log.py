"""The log of a process that strangers reach: no line of it is theirs, and none comes more than once a minute.

What a visitor sends ends up in the log in ways that nobody foresees: in a warning of a library, in the message of
an exception, in a traceback. So one handler writes everything, warnings of Python and errors of threads and of
callbacks too. Control characters, line breaks among them, are escaped, and long lines are cut. The kind of a
record is the place in the code that logs and the place of the error: of each kind the first is written, and those
of the next minute are counted.
"""

from __future__ import annotations

import logging
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Hashable
from types import TracebackType
from typing import Any, Final, TextIO

LOG_EVERY: Final = 60.0  # seconds between two lines of the same kind
KIND: Final = "kind"  # attribute of a record: what counts as the same event
LONGEST: Final = 1000  # characters of a line
FIRST, LAST = 40, 80  # lines of a longer traceback

logger = logging.getLogger("kinboard.errors")
_warnings = logging.getLogger("py.warnings")


def escaped(text: str) -> str:
    """A text on one line, without control characters, those that change the order of others, and half letters."""
    if not text.isprintable():
        text = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return text if len(text) <= LONGEST else text[: LONGEST - 1] + "…"


class LogFormatter(logging.Formatter):
    """Formats records as `escaped` lines, and their tracebacks."""

    def format(self, record: logging.LogRecord) -> str:
        try:
            text = record.getMessage()
        except (TypeError, ValueError, KeyError):  # arguments that do not fit
            text = f"{record.msg} {record.args!r}"
        more = getattr(record, "more", 0)
        lines = [escaped(text) + (f" ({more} more times since the last)" if more else "")]
        error = record.exc_info[1] if record.exc_info else None
        return "\n".join(lines if error is None else lines + _lines(error))


def _lines(error: BaseException) -> list[str]:
    """A traceback; only between frames, and between their lines, there are line breaks."""
    lines: list[str] = []
    for part in traceback.format_exception(error):
        frame = part.startswith("  ")
        lines += map(escaped, part.rstrip("\n").split("\n") if frame else [part.strip("\n")])
    if len(lines) > FIRST + LAST:
        lines[FIRST:-LAST] = [f"… {len(lines) - FIRST - LAST} lines …"]
    return lines


class LogFilter(logging.Filter):
    """Lets the first record of a kind pass, and counts those that follow for `LOG_EVERY` seconds.

    The next one after that has their number as its attribute `more`. Thread-safe.

    Args:
        clock: seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._clock = clock
        self._lock = threading.Lock()
        self._latest: dict[Hashable, tuple[float, int]] = {}  # by kind: when one has passed, and how many have not

    def filter(self, record: logging.LogRecord) -> bool:
        kind, now = kind_of(record), self._clock()
        with self._lock:
            since, count = self._latest.get(kind, (-LOG_EVERY, 0))
            passes = now >= since + LOG_EVERY
            self._latest[kind] = (now, 0) if passes else (since, count + 1)
        record.more = count if passes else 0
        return passes


def kind_of(record: logging.LogRecord) -> Hashable:
    """What counts as the same event: the places in the code; nothing that is in the message.

    Records may state their own kind in the attribute `KIND`.
    """
    if hasattr(record, KIND):
        return record.name, getattr(record, KIND)
    error = record.exc_info[1] if record.exc_info else None
    trace = None if error is None else error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = None if trace is None else (trace.tb_frame.f_code.co_filename, trace.tb_lineno)
    return record.name, record.pathname, record.lineno, type(error), place


class LogHandler(logging.StreamHandler[TextIO]):
    """Writes to standard error through `LogFilter` and `LogFormatter`."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(sys.stderr)
        self.addFilter(LogFilter(clock))
        self.setFormatter(LogFormatter())

    def handleError(self, record: logging.LogRecord) -> None:
        """Nothing: Python would print the record as it is, to the stream that has just failed."""


def guard_log(clock: Callable[[], float] = time.monotonic) -> LogHandler:
    """Make a `LogHandler` write all that this process logs; returns it.

    Call it before threads start, once in each process.
    """
    handler = LogHandler(clock)
    logging.getLogger().handlers[:] = [handler]
    # It warns of each piece that is written to a client who has just left.
    logging.getLogger("asyncio").setLevel(logging.ERROR)
    warnings.showwarning = _show_warning
    threading.excepthook = _log_thread_error
    sys.unraisablehook = _log_unraisable
    return handler


def _show_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: Any, **__: Any
) -> None:
    place = f"{filename}:{lineno}"
    _warnings.warning("%s: %s: %s", place, category.__name__, message, extra={KIND: place})


def _log_thread_error(given: threading.ExceptHookArgs) -> None:
    if given.exc_type is SystemExit:
        return
    name = "a thread" if given.thread is None else f"the thread {given.thread.name}"
    logger.error("%s failed", name, exc_info=_info(given.exc_type, given.exc_value, given.exc_traceback))


def _log_unraisable(given: sys.UnraisableHookArgs) -> None:
    where = given.err_msg or "Exception ignored in"
    what = getattr(given.object, "__qualname__", type(given.object).__qualname__)
    logger.error("%s %s", where, what, exc_info=_info(given.exc_type, given.exc_value, given.exc_traceback))


def _info(
    kind: type[BaseException], error: BaseException | None, trace: TracebackType | None
) -> tuple[type[BaseException], BaseException, TracebackType | None]:
    return kind, kind() if error is None else error, trace
