"""The control panel: one idea per module.

Every piece is built from a visitor's own `viser.GuiApi` and a `post` function. Its callbacks do nothing but post
into the visitor's inbox; its `show…` methods are called by the visitor's worker. Assigning a value here makes
viser call the callbacks too, with ``event.client is None``: those calls are ignored, or moving the gizmo would
move the sliders would move the gizmo.

A control that shows a value in a unit is made anew when the unit changes, and posts under a key that holds the
`Units` it was made in: an event that was on its way meanwhile is told apart from those of its successor.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any

Post = Callable[[Hashable, object], None]


def listen(handle: Any, post: Post, key: Hashable) -> None:
    """Post the element's new value under `key` whenever the *visitor* changes it."""

    @handle.on_update  # type: ignore[untyped-decorator]
    async def _(event: Any) -> None:
        if event.client is not None:
            post(key, event.target.value)


def assign(handle: Any, value: object) -> None:
    """Show another value in an input element. (Its type stubs call `value` read-only.)"""
    handle.value = value


def listen_click(handle: Any, post: Post, keys: dict[str, Hashable]) -> None:
    """Post the key of the button that was clicked in a button group."""

    @handle.on_click  # type: ignore[untyped-decorator]
    async def _(event: Any) -> None:
        if event.client is not None and event.target.value in keys:
            post(keys[event.target.value], None)
