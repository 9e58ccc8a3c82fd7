"""Which threads use the compiler: numba compiles one function at a time, so a thread may also wait for it."""

from __future__ import annotations

from typing import Protocol

from numba.core.event import Event, Listener, register


class Observer(Protocol):
    """Is called in the thread that uses the compiler; calls may be nested."""

    def enter(self) -> None:
        """The thread asks for the compiler."""

    def leave(self) -> None:
        """It has left the compiler."""


def observe_compiler(observer: Observer) -> None:
    """Call the observer from now on, until the end of the process."""
    register("numba:compiler_lock", _Adapter(observer))  # type: ignore[no-untyped-call]


class _Adapter(Listener):
    def __init__(self, observer: Observer) -> None:
        self._observer = observer

    def on_start(self, event: Event) -> None:
        self._observer.enter()

    def on_end(self, event: Event) -> None:
        self._observer.leave()
