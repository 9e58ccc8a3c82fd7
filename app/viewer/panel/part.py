"""Blocks of HTML in the panel.

viser writes all of a block anew for each change; focus, selection, what is being typed and a pressed button are
lost with it. So viser has only the place of a block, with its first contents. Later ones come by the page's
channel, and ``static/parts.js`` changes what differs.
"""

from __future__ import annotations

import itertools
import weakref
from typing import Protocol

import viser


class Block(Protocol):
    """A block of HTML: one of viser's, or a `Part`."""

    content: str
    visible: bool
    order: float

    def remove(self) -> None:
        """Remove it from the panel."""


class Shows(Protocol):
    """What brings values to a page by their keys."""

    def show(self, key: str, value: object) -> None:
        """The value of a key from now on."""

    def forget(self, key: str) -> None:
        """The key has no value any more."""


_NUMBERS = itertools.count(1)
# The channel belongs to its page, which holds the key: a strong value would keep both for ever.
_CHANNELS = weakref.WeakKeyDictionary[viser.GuiApi, weakref.ref[Shows]]()


def bring_parts(gui: viser.GuiApi, channel: Shows) -> None:
    """Have the HTML of this page come by a channel from now on; the caller keeps the channel."""
    _CHANNELS[gui] = weakref.ref(channel)


def add_html(gui: viser.GuiApi, content: str = "", order: float | None = None) -> Block:
    """Add a block of HTML to the container that is open."""
    known = _CHANNELS.get(gui)
    channel = None if known is None else known()
    if channel is None:
        return gui.add_html(content, order=order)
    key = f"part-{next(_NUMBERS)}"
    return Part(gui.add_html(f'<div data-part="{key}">{content}</div>', order=order), key, content, channel)


class Part:
    """A block of HTML that comes by a channel."""

    def __init__(self, place: viser.GuiHtmlHandle, key: str, content: str, channel: Shows) -> None:
        self._place, self._key, self._content, self._channel = place, key, content, channel
        remove = place.remove

        def removed() -> None:
            remove()
            channel.forget(key)

        # viser calls it also where the container is removed; its handles refuse a plain assignment.
        object.__setattr__(place, "remove", removed)

    @property
    def content(self) -> str:
        """Its HTML."""
        return self._content

    @content.setter
    def content(self, content: str) -> None:
        if content != self._content:
            self._content = content
            self._channel.show(self._key, content)

    @property
    def visible(self) -> bool:
        """Whether it is shown."""
        return self._place.visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._place.visible = visible

    @property
    def order(self) -> float:
        """Its place among its neighbours."""
        return self._place.order

    @order.setter
    def order(self, order: float) -> None:
        self._place.order = order

    def remove(self) -> None:
        """Remove it from the panel."""
        self._place.remove()
