"""What makes a short command start fast. Imports nothing heavy."""

from __future__ import annotations

import gc
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

FOLDER_OF_COUNTS = "PROMETHEUS_MULTIPROC_DIR"  # read by prometheus_client when it is imported


@contextmanager
def no_collections() -> Iterator[None]:
    """Switches garbage collection off for imports, where it would take a tenth of the start and free nothing."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


@contextmanager
def hidden(package: str) -> Iterator[None]:
    """Lets imports go on as where `package` is not installed, unless it has been imported; for a single thread."""
    if package in sys.modules:
        yield
        return
    sys.modules[package] = None  # type: ignore[assignment]
    try:
        yield
    finally:
        del sys.modules[package]


@contextmanager
def shared_metrics() -> Iterator[None]:
    """A folder through which the processes of a service count together: known before the metrics are imported.

    Without a place to write, each process counts for itself.
    """
    for place in (None, "/dev/shm"):
        try:
            folder = tempfile.TemporaryDirectory(prefix="kinboard-", dir=place)
        except OSError:
            continue
        with folder as name:
            before = os.environ.get(FOLDER_OF_COUNTS)
            os.environ[FOLDER_OF_COUNTS] = name
            try:
                yield
            finally:  # what this process starts later must not count in a folder that is gone
                if before is None:
                    del os.environ[FOLDER_OF_COUNTS]
                else:
                    os.environ[FOLDER_OF_COUNTS] = before
        return
    yield


def disable_compiler() -> None:
    """Let the kernels of this process run as plain Python, if nothing has imported numba yet."""
    if "numba" not in sys.modules:
        os.environ.setdefault("NUMBA_DISABLE_JIT", "1")
