"""Messages of the page's own scripts that come in viser's connection, and what these scripts are shown.

The page's scripts send by their channel (:mod:`app.viewer.session.channel`). A message whose order with changes of
viser's controls matters, such as *Undo* after a slider was moved, has to come behind these:
``static/viser_page.js`` writes it into a hidden text field of viser's. Each message has a number, and the field
always holds the last few: viser sends at most one change of a control per 50 ms and drops older ones.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple, Protocol

import viser

from app.viewer.panel import update_html
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


class PageScript:
    """Passes on the messages in the hidden field, and shows what the page starts with and what can be undone."""

    def __init__(self, gui: viser.GuiApi, messages: Messages) -> None:
        self._last = 0
        self._answers: dict[str, object] = {"undo": "", "redo": "", "start": "", "tab": ""}
        self._shown = gui.add_html(self._html())
        field = gui.add_text(LABEL, "")

        @field.on_update
        async def _(event: Any) -> None:
            if event.client is None:
                return
            for number, name, argument in self.read(event.target.value):
                messages.take(number, name, argument)

    def read(self, text: str) -> list[tuple[int, str, object]]:
        """The messages in `text` that have not been read yet, as number, name and argument, in order."""
        try:
            items = read_page_json(text, finite=True)
        except ValueError:
            return []
        found = []
        for item in items[-AT_ONCE:] if isinstance(items, list) else []:
            match item:
                case [int(number), str(name), argument] if self._last < number < MAX_NUMBER:
                    self._last = number
                    found.append((number, name, argument))
        return found

    def show_history(self, undo: str, redo: str) -> None:
        """Show what would be undone and redone next; empty: nothing."""
        self._answers |= {"undo": undo, "redo": redo}
        update_html(self._shown, self._html())

    def show_start(self, state: str, tab: str) -> None:
        """Tell the page the state with which it starts, and the tab where a link to it opens; empty: the first."""
        self._answers |= {"start": state, "tab": tab}
        update_html(self._shown, self._html())

    def _html(self) -> str:
        return render("panel/answers", answers=json.dumps(self._answers))
