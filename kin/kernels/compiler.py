"""Which threads use the compiler: numba compiles one function at a time, so a thread may also wait for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

from kin.kernels.private import EVENTS, MISSING, Listener, install_recorder, register_listener


class Observer(Protocol):
    """Is called in the thread that uses the compiler; calls may be nested."""

    def enter(self) -> None:
        """The thread asks for the compiler."""

    def leave(self) -> None:
        """It has left the compiler."""


def observe_compiler(observer: Observer) -> None:
    """Call the observer from now on, until the end of the process; never if numba does not say who compiles."""
    if EVENTS not in MISSING:
        register_listener("numba:compiler_lock", _Adapter(observer))


@contextmanager
def record_compilations() -> Iterator[Sequence[object]]:
    """Within the context, what is compiled is added to the sequence, which has an entry if unknown."""
    if EVENTS in MISSING:
        yield ("unknown",)
        return
    with install_recorder("numba:compile") as recorder:
        yield recorder.buffer


class _Adapter(Listener):  # type: ignore[misc]
    def __init__(self, observer: Observer) -> None:
        self._observer = observer

    def on_start(self, event: Any) -> None:
        self._observer.enter()

    def on_end(self, event: Any) -> None:
        self._observer.leave()
