"""The control panel: one group of controls per module.

Every group is built from a visitor's own `viser.GuiApi` and a `post` function. Its callbacks only post into the
visitor's inbox; its `show…` methods are called by the visitor's worker. `assign` calls no callbacks. Assigning a
value in viser's own way does, with ``event.client is None``. Those calls are ignored; otherwise moving the gizmo
would move the sliders, which would move the gizmo.

A control that shows a value in a unit is replaced when the unit changes, and its key contains the `Units` it was
created with. So an event that was already on its way is not mistaken for one of its successor.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any

from app.viewer.panel.part import Block
from app.viewer.viser_patches import sent_value, show_value

Post = Callable[[Hashable, object], None]


def listen(handle: Any, post: Post, key: Hashable) -> None:
    """Post the element's new value under `key` whenever the *visitor* changes it."""

    @handle.on_update  # type: ignore[untyped-decorator]
    async def _(event: Any) -> None:
        if event.client is not None:
            post(key, sent_value(event))


def assign(handle: Any, value: object) -> None:
    """Show another value in an input element."""
    show_value(handle, value)


def update_html(element: Block, content: str) -> None:
    """Show other HTML in an element; unchanged HTML is not sent."""
    if element.content != content:
        element.content = content


def listen_click(handle: Any, post: Post, keys: dict[str, Hashable]) -> None:
    """Post the key of the button that was clicked in a button group."""

    @handle.on_click  # type: ignore[untyped-decorator]
    async def _(event: Any) -> None:
        if event.client is not None and event.target.value in keys:
            post(keys[event.target.value], None)
