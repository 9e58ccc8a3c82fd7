"""uvicorn's configuration, and an event loop for which computations wait."""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Callable

import uvicorn

from app.service.guard import Guard
from app.shared.threads.turns import urgent


class GuardedConfig(uvicorn.Config):
    """uvicorn's configuration, and the guard of its connections."""

    guard: Guard

    def get_loop_factory(self) -> Callable[[], asyncio.AbstractEventLoop] | None:
        """asyncio's event loop, for which computations wait. Others, as uvloop, do not tell when they sleep."""
        factory = super().get_loop_factory()
        return _courteous_loop if factory is asyncio.SelectorEventLoop else factory


class _Selector(selectors.DefaultSelector):
    """Counts its event loop among those for whom computations wait, except while the loop sleeps.

    A loop with something to do does not sleep: if computations went on between two of its rounds, each round would
    wait for the interpreter, and an event takes several rounds.
    """

    def __init__(self) -> None:
        super().__init__()
        urgent.enter()

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        ready = super().select(0.0)
        if ready or (timeout is not None and timeout <= 0.0):
            return ready
        urgent.leave()
        try:
            return super().select(timeout)
        finally:
            urgent.enter()

    def close(self) -> None:
        super().close()
        urgent.leave()


def _courteous_loop() -> asyncio.AbstractEventLoop:
    return asyncio.SelectorEventLoop(_Selector())
