"""Memory that the processes of a service share, which outlives full, cleaned and read-only folders.

`multiprocessing` keeps shared memory in a file in ``/dev/shm`` or the system's temporary folder. If that folder
fills up later, the kernel ends the process that writes to the memory (SIGBUS). On Linux we have anonymous memory
instead: forked processes inherit it, others get it through a file descriptor. Where Python lacks the call for it,
a deleted file serves as well, because its space is reserved before it is mapped.
"""

from __future__ import annotations

import mmap
import os
import sys
import tempfile
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
                file = _memory(size) if hasattr(os, "memfd_create") else _deleted_file(size)
            made = super().__new__(cls, file, size)
            made.file = file
            return made

        def __reduce__(self) -> Any:
            return _attach, (len(self), DupFd(self.file))

    def _memory(size: int) -> int:
        file = os.memfd_create("kinboard")
        os.ftruncate(file, size)
        return file

    def _deleted_file(size: int) -> int:
        """A file without a name, for Pythons that were built for old systems."""
        refusals = []
        for folder in ("/dev/shm", None):
            try:
                with tempfile.TemporaryFile(dir=folder) as found:
                    os.posix_fallocate(found.fileno(), 0, size)
                    return os.dup(found.fileno())
            except OSError as error:
                refusals.append(error)
        raise refusals[-1]

    def _attach(size: int, sent: Any) -> _Anonymous:
        return _Anonymous(size, sent.detach())


def shared_bytes(size: int) -> MutableSequence[int]:
    """So many bytes, all zero, for this process and those that it starts.

    Raises:
        OSError: there is no such memory. With anonymous memory, only if the system has none left.
    """
    if sys.platform == "linux":
        return cast("MutableSequence[int]", _Anonymous(size))
    return cast("MutableSequence[int]", RawArray("B", size))
