"""What makes a short command start fast. Imports nothing heavy."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


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


def disable_compiler() -> None:
    """Let the kernels of this process run as plain Python, if nothing has imported numba yet."""
    if "numba" not in sys.modules:
        os.environ.setdefault("NUMBA_DISABLE_JIT", "1")
