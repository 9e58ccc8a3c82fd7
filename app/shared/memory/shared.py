"""Memory that the processes of a service share. No folder that is full, cleaned or read-only matters to it.

`multiprocessing` keeps shared memory in a file in ``/dev/shm`` or the system's temporary folder. On Linux we have
anonymous memory instead: forked processes inherit it, others get it through a file descriptor.
"""

from __future__ import annotations

import mmap
import os
import sys
from collections.abc import MutableSequence
from multiprocessing import RawArray
from multiprocessing.reduction import DupFd
from typing import Any, cast

if sys.platform == "linux":

    class _Anonymous(mmap.mmap):
        """Bytes behind a file descriptor; `multiprocessing` can send them to a process that it starts."""

        file: int

        def __new__(cls, size: int, file: int | None = None) -> _Anonymous:
            if file is None:
                file = os.memfd_create("kinboard")
                os.ftruncate(file, size)
            made = super().__new__(cls, file, size)
            made.file = file
            return made

        def __reduce__(self) -> Any:
            return _attach, (len(self), DupFd(self.file))

    def _attach(size: int, sent: Any) -> _Anonymous:
        return _Anonymous(size, sent.detach())


def shared_bytes(size: int) -> MutableSequence[int]:
    """So many bytes, all zero, for this process and those that it starts."""
    # Pythons that were built for old systems do not have the call.
    if sys.platform == "linux" and hasattr(os, "memfd_create"):
        return cast("MutableSequence[int]", _Anonymous(size))
    return cast("MutableSequence[int]", RawArray("B", size))
