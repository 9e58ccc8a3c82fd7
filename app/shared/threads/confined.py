"""Limits that the system keeps for a process that reads files of strangers.

Such a process is started for one request and ends with it. It limits itself before it reads anything: what is
asked of it can then take no more memory and processor time than this, and cannot write files.
"""

from __future__ import annotations

import sys


def limit_this_process(memory: int, seconds: int, alone: bool = False) -> None:
    """Bound this process from now on, where the system can; Windows has no such limits.

    Args:
        memory: bytes of data; beyond, Python raises `MemoryError`. Only Linux.
        seconds: of processor time; beyond, the system ends the process.
        alone: also start no processes or threads. Only Linux, and it does not bind root.
    """
    if sys.platform == "win32":
        return
    import resource

    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":
        if alone:
            resource.setrlimit(resource.RLIMIT_NPROC, (0, 0))
        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
