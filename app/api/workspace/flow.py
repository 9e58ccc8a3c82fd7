"""Answers that are computed while they are sent, and stop being computed when nobody takes them any more."""

from __future__ import annotations

import logging
import threading
from collections.abc import AsyncIterator, Generator, Iterator
from contextlib import contextmanager, nullcontext
from typing import Generic, TypeVar

from starlette.concurrency import run_in_threadpool
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from app.api.work import busy
from app.shared.metrics import STREAMED

logger = logging.getLogger("kinboard.workspace")
T = TypeVar("T")


class Gate:
    """How many streams may flow at a time; the event loop's alone, so it needs no lock."""

    def __init__(self, most: int) -> None:
        self._most = most
        self.open = 0

    @contextmanager
    def place(self) -> Iterator[None]:
        """A place as long as the context lasts; raises 503 if there is none."""
        if self.open >= self._most:
            raise busy(f"{self.open} clouds and maps are under way, the most at a time.", "KINBOARD_MAX_STREAMS")
        self.open += 1
        try:
            yield
        finally:
            self.open -= 1


class Pieces(Generic[T]):
    """A generator that is run by threads, one at a time, and may be closed by any."""

    def __init__(self, pieces: Generator[T]) -> None:
        self._pieces = pieces
        self._lock = threading.Lock()

    def take(self) -> T | None:
        """The next piece, None at the end."""
        with self._lock:
            return next(self._pieces, None)

    def close(self) -> None:
        """Ends the work, after the piece that is being made."""
        with self._lock:
            self._pieces.close()


class _StoppedError(Exception):
    """The service ends before the answer does."""


class Flow(StreamingResponse):
    """Bytes sent as they are computed, each piece in a thread.

    A reader who is slow holds the computation back; one who leaves ends it: the generator is closed before the
    request is over, whatever ends it.

    Args:
        pieces: what is sent.
        name: what the bytes are counted as in the metrics.
        media_type, headers: of the answer.
        gate: where a place is needed.
    """

    def __init__(
        self,
        pieces: Generator[bytes],
        name: str,
        media_type: str,
        headers: dict[str, str] | None = None,
        gate: Gate | None = None,
    ) -> None:
        self._pieces = Pieces(pieces)
        self._name = name
        self._gate = gate
        super().__init__(self._in_threads(), headers=headers, media_type=media_type)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._work = scope["app"].state.work
        try:
            with self._gate.place() if self._gate else nullcontext():
                await super().__call__(scope, receive, send)
        except _StoppedError:
            # An answer without its end: the server closes the connection, and the reader can tell.
            logger.warning("an answer under way was cut off, as the service is being stopped")
        finally:
            # At once: a reader who leaves is told of after the piece at hand. Only a server that is being stopped
            # may have to wait here.
            self._pieces.close()

    async def _in_threads(self) -> AsyncIterator[bytes]:
        while (piece := await run_in_threadpool(self._pieces.take)) is not None:
            if self._work.closed and self._gate:
                raise _StoppedError
            if piece:
                STREAMED.labels(self._name).inc(len(piece))
                yield piece
