"""What viser does slowly, done quickly; all that reaches into viser's private names is here.

Poses: viser's own setters drop whatever is within 1e-5 of the last pose, so an arm would end near its solution and
not on it. Finding that out takes most of their time (`np.allclose`), and an arm that moves is posed joint by joint
for each picture of each visitor: with thirty visitors it was a fifth of all the service did. So the message that
the setter would send is sent from here, through the same queue.

Pages: viser looks up the type hints of a class anew for each object of it, a quarter of what a page costs.

Wake-ups: messages of other threads than the loop's wake their reader unsafely; a visitor was lost now and then.

Hence viser's narrow range in ``pyproject.toml``, and tests that hold all this against viser's own ways.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import threading
import typing
from collections.abc import Iterator, Sequence
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
    """Give a node this position ``(3,)`` and turn ``(4,)`` in its parent's frame; what it has already is not sent.

    Raises:
        RuntimeError: the node was removed.
    """
    told = node._impl
    if told.removed:
        raise RuntimeError(f"{told.name} was removed and cannot be posed")
    if position is not None and (place := _floats(position)) != told.position.tolist():
        told.position[:] = place
        x, y, z = place
        told.api._queue_scene_message(messages.SetPositionMessage(told.name, (x, y, z)))
    if wxyz is not None and (turn := _floats(wxyz)) != told.wxyz.tolist():
        told.wxyz[:] = turn
        w, x, y, z = turn
        told.api._queue_scene_message(messages.SetOrientationMessage(told.name, (w, x, y, z)))


def keep_private(gizmo: viser.TransformControlsHandle) -> None:
    """Have viser not repeat each motion of a gizmo to other visitors: on a visitor's own scene there are none."""
    gizmo._impl_aux.sync_cb = None


def _floats(values: Array | Sequence[float]) -> list[float]:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


@contextlib.contextmanager
def quick_loops() -> Iterator[None]:
    """Event loops made meanwhile are uvloop's, where there is one: viser makes its own and asks nobody."""
    try:
        import uvloop
    except ImportError:  # Windows
        yield
        return
    before = asyncio.get_event_loop_policy()
    asyncio.set_event_loop_policy(uvloop.EventLoopPolicy())
    try:
        yield
    finally:
        asyncio.set_event_loop_policy(before)


class _LoopEvent(asyncio.Event):
    """An event that only its loop's thread sets; it belongs to the thread that makes it."""

    def __init__(self) -> None:
        super().__init__()
        self._thread = threading.get_ident()

    def set(self) -> None:
        """Wake who waits; in another thread nothing at all."""
        if threading.get_ident() == self._thread:
            super().set()


def wake_in_the_loop() -> None:
    """Have viser's buffers wake their readers in their own thread only.

    A message pushed by another thread sets an `asyncio.Event` there, which is not safe: of two hundred visitors
    who came at once some were lost ("deque mutated during iteration"), or waited for ever. viser asks the loop to
    set it as well, at once or at the end of an atomic block, so that nothing is missing here.
    """
    made = buffers.AsyncMessageBuffer.__init__
    if getattr(made, "wakes_in_the_loop", False):
        return

    @functools.wraps(made)
    def make(self: buffers.AsyncMessageBuffer, *given: Any, **named: Any) -> None:
        made(self, *given, **named)
        self.message_event = _LoopEvent()

    make.wakes_in_the_loop = True  # type: ignore[attr-defined]
    buffers.AsyncMessageBuffer.__init__ = make  # type: ignore[method-assign]


def remember_hints() -> None:
    """Have viser look up the type hints of each class once."""
    props.get_type_hints = functools.cache(typing.get_type_hints)  # type: ignore[attr-defined, assignment]
