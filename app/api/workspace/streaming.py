"""Responses that are computed while they are sent. The computation ends when the client leaves."""

from __future__ import annotations

import logging
import threading
from collections.abc import AsyncIterator, Generator, Iterator
from contextlib import contextmanager
from typing import Generic, TypeVar

from starlette.concurrency import run_in_threadpool
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from app.api.work import busy
from app.shared.clients import client_of
from app.shared.metrics import STREAMED
from app.shared.slots import Slot, Slots

logger = logging.getLogger("kinboard.workspace")
T = TypeVar("T")


class StreamLimit:
    """Limits the number of concurrent streams. Used by the event loop only, so it needs no lock.

    A stream whose client does not read gives its slot to another, so more may be open than are being sent.

    Args:
        most: how many are sent at a time.
        share: of one client.
    """

    OPEN = 4  # streams may be open for each that is sent

    def __init__(self, most: int, share: float = 1.0) -> None:
        self._sent = Slots(most, share)
        self._open = Slots(self.OPEN * most, share)

    @property
    def open(self) -> int:
        """How many streams are open."""
        return self._open.taken

    @contextmanager
    def slot(self, client: str) -> Iterator[Slot]:
        """A slot for as long as the context lasts; raises 503 if there is none."""
        if not self._open.free(client) or not self._sent.take(client):
            detail = (
                f"{self._sent.taken} clouds and maps are being sent, which is the maximum or your share of it."
            )
            raise busy(detail, "KINBOARD_MAX_STREAMS")
        self._open.take(client)
        with Slot(self._open, client), Slot(self._sent, client) as slot:
            yield slot


class ThreadedGenerator(Generic[T]):
    """A generator that any thread may advance, one at a time, and any thread may close."""

    def __init__(self, pieces: Generator[T]) -> None:
        self._pieces = pieces
        self._lock = threading.Lock()

    def take(self) -> T | None:
        """The next piece, None at the end."""
        with self._lock:
            return next(self._pieces, None)

    def close(self) -> None:
        """End the computation after the current piece."""
        with self._lock:
            self._pieces.close()


class _StoppedError(Exception):
    """The service ends before the response does."""


class ComputedResponse(StreamingResponse):
    """A response whose bytes are computed piece by piece in threads while it is sent.

    A slow client slows the computation down, and gives its slot to others while it reads nothing; a client that
    leaves ends it: the generator is always closed before the request ends.

    Args:
        pieces: the bytes to send.
        name: label of the bytes in the metrics.
        media_type, headers: of the response.
        limit: the limit of concurrent streams.
    """

    def __init__(
        self,
        pieces: Generator[bytes],
        name: str,
        media_type: str,
        headers: dict[str, str],
        limit: StreamLimit,
    ) -> None:
        self._pieces = ThreadedGenerator(pieces)
        self._name = name
        self._limit = limit
        super().__init__(self._in_threads(), headers=headers, media_type=media_type)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._slots = scope["app"].state.compute
        try:
            with self._limit.slot(client_of(scope)) as slot:
                await super().__call__(scope, receive, slot.lent(send))
        except _StoppedError:
            # The response is incomplete: the server closes the connection, which shows the client that it is.
            logger.warning("a response was cut off because the service is being stopped")
        finally:
            # Returns at once, because a disconnect is only noticed between pieces. Only a server that is being
            # stopped may have to wait here.
            self._pieces.close()

    async def _in_threads(self) -> AsyncIterator[bytes]:
        while (piece := await run_in_threadpool(self._pieces.take)) is not None:
            if self._slots.closed:
                raise _StoppedError
            if piece:
                STREAMED.labels(self._name).inc(len(piece))
                yield piece
