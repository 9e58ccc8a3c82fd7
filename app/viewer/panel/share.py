"""What a visitor takes away: a link to the page as it is, and the arm as code.

Viser runs no script of ours when a button is clicked. So ``static/viewer.js`` watches for buttons marked
``data-copy`` and copies the ``code`` of the box they are in. Without a clipboard the text can still be selected.
"""

from __future__ import annotations

from html import escape

import viser

from app.exports.snippets import SNIPPETS, Moment
from app.viewer.panel import Post, assign, listen
from kin import InputError

BOX = (
    "position:relative;margin:.2em 1em .6em;border:1px solid rgba(128,128,128,.35);border-radius:.4em;"
    "background:rgba(128,128,128,.1);font-size:.78em;line-height:1.45"
)
BUTTON = (
    "font:inherit;font-weight:600;color:inherit;background:rgba(128,128,128,.18);border:0;border-radius:.3em;"
    "padding:.35em .8em;margin:.35em;min-width:7.2em;cursor:pointer"
)
CODE = "display:block;padding:.1em .7em .6em;overflow:auto;user-select:text;cursor:text;font-size:.95em"


def box_html(text: str, what: str, wrap: bool = False) -> str:
    """A text with a button that copies it; `wrap` breaks it anywhere instead of scrolling."""
    style = f"{CODE};max-height:{'4.6em' if wrap else '16em'};white-space:{'normal' if wrap else 'pre'};"
    style += "overflow-wrap:anywhere" if wrap else ""
    return (
        f'<div data-copy-box style="{BOX}"><div style="text-align:right">'
        f'<button type="button" data-copy style="{BUTTON}">{escape(what)}</button></div>'
        f'<code tabindex="0" aria-label="{escape(what, quote=True)}" style="{style}">{escape(text)}</code></div>'
    )


class SharePanel:
    """The link, and a snippet in the language of the visitor's choice. Posts ``"copy-as"``."""

    def __init__(self, gui: viser.GuiApi, post: Post) -> None:
        self._link = gui.add_html("")
        self._name = next(iter(SNIPPETS))
        hint = "This configuration and this target, for another program"
        self._choice = gui.add_dropdown("Copy as", tuple(SNIPPETS), initial_value=self._name, hint=hint)
        listen(self._choice, post, "copy-as")
        self._code = gui.add_html("")
        self._moment: Moment | None = None

    def show(self, link: str, moment: Moment) -> None:
        """Offer this link and this moment."""
        self._moment = moment
        _set(self._link, box_html(link, "Copy link", wrap=True))
        _set(self._code, box_html(SNIPPETS[self._name](moment), "Copy code"))

    def choose(self, name: object) -> None:
        """Offer another language; raises `kin.InputError` for one that there is not."""
        if name not in SNIPPETS:
            assign(self._choice, self._name)
            raise InputError("language", name, "one of " + ", ".join(SNIPPETS))
        self._name = str(name)
        if self._moment is not None:
            _set(self._code, box_html(SNIPPETS[self._name](self._moment), "Copy code"))


def _set(handle: viser.GuiHtmlHandle, content: str) -> None:
    if handle.content != content:
        handle.content = content
