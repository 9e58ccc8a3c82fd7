"""Answers to one item or to a list of items: computed in pieces, bounded in size, sent in pieces.

How large the answer will be is estimated before anything is computed. The computed pieces are held as bytes, and
each is dropped as soon as it has been sent. A client that does not read holds memory, but no slot.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from fastapi import Response
from pydantic_core import to_json
from starlette.types import Receive, Scope, Send

from app.api.problems import ProblemError
from app.api.work import Deadline, TooSlowError, busy
from app.shared.answers.answer import as_json
from app.shared.memory.answers import SMALL, AnswerMemory, AnswerTooLargeError, MemoryFullError, Reservation
from app.shared.problems import FieldError

MEDIA_TYPE = "application/json"
MOST_AT_ONCE = 256  # items between two checks of the deadline
QUICK = 0.05  # s; where a piece takes less, the next one is larger
PIECE = 1 << 16  # bytes computed at a time, about; while they are encoded, no other thread runs Python
SENT = 1 << 18  # bytes that are sent at a time


@dataclass(frozen=True)
class Batch:
    """The items of a request.

    Attributes:
        field: where they are in the request.
        count: how many there are.
        single: whether it is one item, not a list.
        size: estimated bytes of the answer to one item.
        advice: what makes answers smaller, if anything does.
    """

    field: str
    count: int
    single: bool
    size: int
    advice: str = ""

    @property
    def at_once(self) -> int:
        """How many items are answered at a time."""
        return max(1, min(MOST_AT_ONCE, PIECE // self.size))

    def reserve(self, memory: AnswerMemory) -> Reservation:
        """Room for the answers; raises 413 naming the field, or 503 if there is none at the moment."""
        with _refused(self.field, self._given, self._expected(memory.most_of_one)):
            return memory.reserve(self.count * self.size)

    def resize(self, reservation: Reservation, size: int, memory: AnswerMemory) -> None:
        """The answers take `size` bytes; raises as `reserve`."""
        with _refused(self.field, self._given, self._expected(memory.most_of_one)):
            reservation.resize(size)

    @property
    def _given(self) -> str:
        return "one item" if self.single else f"a list of {self.count}"

    def _expected(self, most: int) -> str:
        fewer = f"at most {max(1, most // self.size)} items" if not self.single else ""
        return " or ".join(filter(None, (fewer, self.advice))) or "a request with a smaller answer"


@contextmanager
def _refused(field: str, given: str, expected: str) -> Iterator[None]:
    """Turns the errors of the memory into problems."""
    try:
        yield
    except AnswerTooLargeError as error:
        size, most = (f"{size / 1e6:.1f} MB" for size in (error.size, error.most))
        detail = f"The answer would take about {size}; one answer may take {most}."
        hint = "Split the request into several, or ask the operator to raise KINBOARD_MAX_ANSWER."
        wrong = FieldError(field=field, value=given, expected=expected)
        raise ProblemError(413, "answer-too-large", detail, hint, [wrong]) from None
    except MemoryFullError:
        raise busy(
            "Other answers that have not been read yet take all memory.", "KINBOARD_ANSWER_MEMORY"
        ) from None


def one_or_all(
    answers: Callable[[slice], Sequence[object]], batch: Batch, deadline: Deadline, partly: bool = False
) -> Response:
    """The answer itself to a single item, ``{"results": [...]}`` in the same order to a list.

    `answers` computes those of a range of items. A range is serialised before the next is computed: garbage
    collection of a hundred thousand live lists would take longer than the computation. Raises 413 if the answer is
    too large, and 503 after the deadline, unless the results until then are wanted.

    Args:
        partly: after the deadline, the answer is ``{"results": [...], "problem": ...}`` if there are results.
    """
    if batch.single and batch.size <= SMALL:
        return Response(as_json(answers(slice(0, 1))[0]), media_type=MEDIA_TYPE)
    memory = deadline.memory
    reservation = batch.reserve(memory)
    if batch.single:
        content = as_json(answers(slice(0, 1))[0])
        batch.resize(reservation, len(content), memory)
        return held_response([content], reservation)
    pieces: list[bytes] = []
    size, end = 0, b"]}"
    start, count = 0, 1
    while start < batch.count:
        began = time.perf_counter()
        try:
            deadline.check()
            piece = as_json(list(answers(slice(start, start + count))))
        except TooSlowError as error:
            if not (partly and start):
                raise
            end = b'],"problem":' + to_json(error.problem) + b"}"
            break
        pieces += [b"," if start else b'{"results":[', piece[1:-1]]
        size += len(piece)
        if size > batch.count * batch.size:  # estimated too low
            batch.resize(reservation, size, memory)
        start += count
        if time.perf_counter() - began < QUICK:
            count = min(2 * count, batch.at_once)
    batch.resize(reservation, size, memory)
    return held_response([*pieces, end], reservation)


def held_json(content: object, batch: Batch, reservation: Reservation, memory: AnswerMemory) -> Response:
    """One answer that may be large, as JSON; raises 413 naming the field if it is larger than allowed."""
    body = as_json(content)
    batch.resize(reservation, len(body), memory)
    return held_response([body], reservation)


def held_response(pieces: list[bytes], reservation: Reservation) -> Response:
    """A JSON response of these pieces."""
    size = sum(map(len, pieces))
    head = [(b"content-type", MEDIA_TYPE.encode()), (b"content-length", b"%d" % size)]
    return response_of(200, head, pieces, reservation)


def response_of(
    status: int, headers: list[tuple[bytes, bytes]], pieces: list[bytes], reservation: Reservation
) -> Response:
    """A response of these pieces.

    Args:
        status: of the response.
        headers: all of them, with its length.
        pieces: of its body.
        reservation: room for them.
    """
    if sum(map(len, pieces)) <= SENT:
        reservation.release()
        response = Response(b"".join(pieces), status)
    else:
        response = HeldResponse(pieces, reservation, status)
    response.raw_headers = headers
    return response


class HeldResponse(Response):
    """A computed response that is sent in pieces; what has been sent is dropped. Headers are set afterwards."""

    def __init__(self, pieces: Iterable[bytes], reservation: Reservation, status: int) -> None:
        super().__init__(status_code=status)
        self._pieces = deque(pieces)
        self._reservation = reservation

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
        try:
            for piece in self.taken():
                await send({"type": "http.response.body", "body": piece, "more_body": True})
            await send({"type": "http.response.body", "body": b"", "more_body": False})
        finally:
            self._pieces.clear()
            self._reservation.release()

    @property
    def size(self) -> int:
        """Bytes of the pieces that are left."""
        return sum(map(len, self._pieces))

    def taken(self) -> Iterator[bytes]:
        """The pieces, joined to larger ones. Each is dropped when the next one is asked for."""
        left = self.size
        while self._pieces:
            together = [self._pieces.popleft()]
            size = len(together[0])
            while self._pieces and size + len(self._pieces[0]) <= SENT:  # each call to send takes a while
                together.append(self._pieces.popleft())
                size += len(together[-1])
            piece = b"".join(together)
            for start in range(0, size, SENT):
                yield piece[start : start + SENT]
            left -= len(piece)
            self._reservation.resize(left)
