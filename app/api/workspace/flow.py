"""Answers that are computed while they are sent, and stop being computed when nobody takes them any more."""

from __future__ import annotations

import threading
from collections.abc import AsyncIterator, Generator, Iterator
from contextlib import contextmanager, nullcontext
from typing import Generic, TypeVar

from starlette.concurrency import run_in_threadpool
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from app.api.problems import ProblemError
from app.metrics import STREAMED

RETRY_AFTER = 2  # seconds
T = TypeVar("T")


def busy(detail: str, setting: str = "") -> ProblemError:
    """503, with when to come again and what the operator could raise."""
    hint = "Try again in a moment" + (f", or ask the operator to raise {setting}." if setting else ".")
    return ProblemError(503, "busy", detail, hint, headers={"Retry-After": str(RETRY_AFTER)})


class Gate:
    """How many streams may flow at a time; the event loop's alone, so it needs no lock."""

    def __init__(self, most: int) -> None:
        self._most = most
        self.open = 0

    @contextmanager
    def place(self) -> Iterator[None]:
        """A place as long as the context lasts; raises 503 if there is none."""
        if self.open >= self._most:
            raise busy(f"{self.open} clouds are being sent, the most at a time.", "KINBOARD_MAX_STREAMS")
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
        try:
            with self._gate.place() if self._gate else nullcontext():
                await super().__call__(scope, receive, send)
        finally:
            # At once: a reader who leaves is told of after the piece at hand. Only a server that is being stopped
            # may have to wait here.
            self._pieces.close()

    async def _in_threads(self) -> AsyncIterator[bytes]:
        while (piece := await run_in_threadpool(self._pieces.take)) is not None:
            if piece:
                STREAMED.labels(self._name).inc(len(piece))
                yield piece
