"""Messages of the page's own scripts that come in viser's connection.

The page's scripts send by their channel (:mod:`app.viewer.session.channel.channel`). A message whose order with
changes of viser's controls matters, such as *Undo* after a slider was moved, has to come behind these:
``static/viser_page.js`` writes it into a hidden text field of viser's. Each message has a number, and the field
always holds the last few: viser sends at most one change of a control per 50 ms and drops older ones.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple, Protocol

import viser

from app.viewer.views.templates import render
from kin.parsing import Limits, read_json

LABEL = "Messages of the page"  # of the hidden text field
AT_ONCE = 32  # messages in the field; more are ignored
MAX_NUMBER = 2**53
LIMITS = Limits(64 * 1024, 20_000, 32)  # of a message, and of a link when it is unpacked


def read_page_json(text: str, finite: bool = False) -> Any:
    """The value of a JSON text from a page or a link; raises `ValueError` for what is none or no page could show.

    JSON can escape half a letter (``"\\ud800"``), which UTF-8 cannot hold.
    """
    value = read_json(text, LIMITS, finite)
    json.dumps(value, ensure_ascii=False).encode()
    return value


class Reply(NamedTuple):
    """The answer to a message.

    Attributes:
        number: of the message.
        error: what is wrong with it; "" if nothing is.
        readings: labels and texts that may have been meant by a typed one; the page offers them.
    """

    number: int
    error: str
    readings: tuple[tuple[str, str], ...] = ()


class Messages(Protocol):
    """Takes messages of the page that come in viser's connection, in the order of their numbers."""

    def take(self, number: int, name: str, argument: object) -> bool:
        """Take a message. False: too many before it are missing."""


def listen_for_messages(gui: viser.GuiApi, messages: Messages) -> None:
    """Add the hidden field, and pass on the messages in it."""
    gui.add_html(render("panel/messages"))
    field = gui.add_text(LABEL, "")
    last = 0

    @field.on_update
    async def _(event: Any) -> None:
        nonlocal last
        if event.client is None:
            return
        for number, name, argument in read_messages(event.target.value, last):
            last = number
            messages.take(number, name, argument)


def read_messages(text: str, last: int) -> list[tuple[int, str, object]]:
    """The messages in `text` beyond number `last`, as number, name and argument, in order."""
    try:
        items = read_page_json(text, finite=True)
    except ValueError:
        return []
    found = []
    for item in items[-AT_ONCE:] if isinstance(items, list) else []:
        match item:
            case [int(number), str(name), argument] if last < number < MAX_NUMBER:
                last = number
                found.append((number, name, argument))
    return found
