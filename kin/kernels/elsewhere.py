"""Kernels are compiled before the program begins, so no other process compiles any."""

from __future__ import annotations

from collections.abc import Callable

DONE = "done"


def compile_elsewhere(ask: Callable[[str], bool] | None) -> None:
    """Does nothing."""


def serve() -> None:
    """Does nothing."""
