"""Bytes of answers that one process holds, from their computation until the client has read them.

A reservation that nobody refers to any more is given back by its finaliser. The garbage collector may call that in
the middle of any statement, so also in a thread that holds the lock of the memory: a finaliser that waited for
the lock would stop this thread, and all others after it. So it only leaves its bytes in a queue, from which they
are subtracted under the lock later.
"""

from __future__ import annotations

import threading
from collections import deque

SMALL = 64 * 1024  # bytes; smaller answers are not counted


class AnswerTooLargeError(Exception):
    """An answer is larger than one answer may be.

    Attributes:
        size, most: its bytes, and the limit.
    """

    def __init__(self, size: int, most: int) -> None:
        super().__init__(f"an answer of {size} bytes; one answer may take {most}")
        self.size = size
        self.most = most


class MemoryFullError(Exception):
    """The answers that are held already leave no room for another one."""


class AnswerMemory:
    """Counts the bytes of large answers, and bounds those of one and of all. Any thread may use it.

    Args:
        most_of_one: bytes of one answer.
        most: bytes of all answers.
    """

    def __init__(self, most_of_one: int, most: int) -> None:
        self.most_of_one = most_of_one
        self._most = max(most, most_of_one)  # else the largest answer could never be given
        self._lock = threading.Lock()
        self._held = 0
        self._forgotten: deque[int] = deque()  # bytes of reservations that were not released

    @property
    def held(self) -> int:
        """Bytes of all answers that are held or reserved."""
        with self._lock:
            self._settle()
            return self._held

    def reserve(self, size: int) -> Reservation:
        """Room for an answer of about this size.

        Raises:
            AnswerTooLargeError: it is larger than one answer may be.
            MemoryFullError: there is no room.
        """
        reservation = Reservation(self)
        reservation.resize(size)
        return reservation

    def _change(self, before: int, after: int) -> None:
        if after > self.most_of_one:
            raise AnswerTooLargeError(after, self.most_of_one)
        with self._lock:
            self._settle()
            if after > before and self._held + after - before > self._most:
                raise MemoryFullError
            self._held += after - before

    def _settle(self) -> None:
        """Subtract what was forgotten; the lock is held."""
        while self._forgotten:
            self._held -= self._forgotten.popleft()

    def _forget(self, size: int) -> None:
        """Give back bytes of a reservation that is being finalised: takes no lock."""
        self._forgotten.append(size)


class MemoryShare(AnswerMemory):
    """What one client may take of a memory.

    Args:
        whole: the memory, of which the bytes are taken, too.
        most: bytes of the client.
    """

    def __init__(self, whole: AnswerMemory, most: int) -> None:
        super().__init__(whole.most_of_one, most)
        self._most = most
        self._whole = whole

    def _change(self, before: int, after: int) -> None:
        super()._change(before, after)
        try:
            self._whole._change(before, after)
        except MemoryFullError:
            super()._change(after, before)
            raise

    def _forget(self, size: int) -> None:
        super()._forget(size)
        self._whole._forget(size)


class Reservation:
    """Room for one answer, given back by `release` or when it is forgotten."""

    def __init__(self, memory: AnswerMemory) -> None:
        self._memory = memory
        self._size = 0

    def resize(self, size: int) -> None:
        """The answer takes this many bytes; raises as `AnswerMemory.reserve`."""
        after = size if size > SMALL else 0
        self._memory._change(self._size, after)
        self._size = after

    def release(self) -> None:
        """Give the room back; may be called again."""
        self.resize(0)

    def __del__(self) -> None:
        if self._size:
            self._memory._forget(self._size)
