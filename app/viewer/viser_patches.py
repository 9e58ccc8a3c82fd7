"""Faster and safer versions of some of viser's operations.

The private names of viser that Kinboard uses are in this module and in :mod:`app.viewer.viser_server`.

Poses: viser's own setters ignore poses within 1e-5 of the last one, so an arm would end near its solution and not
on it. That comparison (`np.allclose`) takes most of their time, and a moving arm sets one pose per joint and
frame: with thirty visitors it was a fifth of all processor time. `assign` sends the setter's message through the
same queue.

Values: viser's setter of an input element's value starts a task of the event loop for each callback, for each
slider that follows the arm. `show_value` starts none.

Pages: viser evaluates the type hints of a class for each of its objects, a quarter of the cost of a page.
`cache_type_hints` caches them.

Wake-ups: messages from other threads than the event loop's wake their reader in an unsafe way; now and then a
visitor's connection was lost. `set_events_in_their_loop` fixes that.

This is why ``pyproject.toml`` allows a narrow range of viser versions, and why tests compare these functions with
viser's own.
"""

from __future__ import annotations

import asyncio
import functools
import threading
import time
import typing
from collections.abc import Sequence
from typing import Any

import numpy as np
import viser
from viser import _assignable_props_api as props
from viser import _messages as messages
from viser.infra import _async_message_buffer as buffers

from kin.transforms import Array


def assign(
    node: viser.SceneNodeHandle,
    position: Array | Sequence[float] | None = None,
    wxyz: Array | Sequence[float] | None = None,
) -> None:
    """Set a node's position ``(3,)`` and quaternion ``(4,)`` in its parent's frame; unchanged values are not sent.

    Raises:
        RuntimeError: the node has been removed.
    """
    state = node._impl
    if state.removed:
        raise RuntimeError(f"{state.name} was removed and cannot be posed")
    if position is not None and (place := _floats(position)) != state.position.tolist():
        state.position[:] = place
        x, y, z = place
        state.api._queue_scene_message(messages.SetPositionMessage(state.name, (x, y, z)))
    if wxyz is not None and (turn := _floats(wxyz)) != state.wxyz.tolist():
        state.wxyz[:] = turn
        w, x, y, z = turn
        state.api._queue_scene_message(messages.SetOrientationMessage(state.name, (w, x, y, z)))


def show_value(handle: Any, value: object) -> None:
    """Show another value in an input element; an unchanged value is not sent.

    viser's own setter also calls the element's callbacks, each as a task of the event loop, which it wakes for it.

    Raises:
        RuntimeError: the element has been removed.
    """
    state = handle._impl
    if state.removed:
        raise RuntimeError(f"a {type(handle).__name__} was removed and cannot be set")
    value = type(state.value)(value)
    if value != state.value:
        state.gui_api._websock_interface.queue_message(messages.GuiUpdateMessage(state.uuid, {"value": value}))
        state.value = value
        state.update_timestamp = time.time()


def is_removed(node: viser.SceneNodeHandle) -> bool:
    """Whether a node is no longer in the scene, so that its properties cannot be set."""
    return bool(node._impl.removed)


def uuid_of(handle: Any) -> str:
    """The id of a control: of its message, and of its element in the page."""
    return str(handle._impl.uuid)


def keep_private(gizmo: viser.TransformControlsHandle) -> None:
    """Stop viser from copying a gizmo's motion to other visitors: a visitor's own scene has no others."""
    gizmo._impl_aux.sync_cb = None


def _floats(values: Array | Sequence[float]) -> list[float]:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


class _LoopEvent(asyncio.Event):
    """An event that only its loop's thread can set: the thread that creates it."""

    def __init__(self) -> None:
        super().__init__()
        self._thread = threading.get_ident()

    def set(self) -> None:
        """Wakes waiters, but only on the loop's own thread."""
        if threading.get_ident() == self._thread:
            super().set()


def set_events_in_their_loop() -> None:
    """Make viser's message buffers wake their readers on the event loop's thread only.

    A message pushed by another thread sets an `asyncio.Event` there, which is unsafe: of two hundred visitors who
    connected at once, some failed ("deque mutated during iteration") or waited forever. viser also asks the loop
    to set the event, at once or at the end of an atomic block, so no wake-up is lost.
    """
    original = buffers.AsyncMessageBuffer.__init__
    if getattr(original, "sets_events_in_its_loop", False):
        return

    @functools.wraps(original)
    def make(self: buffers.AsyncMessageBuffer, *args: Any, **kwargs: Any) -> None:
        original(self, *args, **kwargs)
        self.message_event = _LoopEvent()

    make.sets_events_in_its_loop = True  # type: ignore[attr-defined]
    buffers.AsyncMessageBuffer.__init__ = make  # type: ignore[method-assign]


def cache_type_hints() -> None:
    """Make viser evaluate the type hints of each class once."""
    props.get_type_hints = functools.cache(typing.get_type_hints)  # type: ignore[attr-defined, assignment]
