"""What a visitor can share: a link to the page as it is, the arm's state as code, and a frame for other pages.

Viser runs no script of ours when a button is clicked. So ``static/viewer.js`` watches buttons marked ``data-copy``
and copies the ``code`` of their box. Without a clipboard, the text can still be selected.
"""

from __future__ import annotations

import viser

from app.exports.snippets import SNIPPETS, Moment
from app.shared.answers.embedding import MODES, frame
from app.viewer.panel import Post, assign, listen, update_html
from app.viewer.panel.part import add_html
from app.viewer.views.templates import render
from app.viewer.viser_patches import uuid_of
from kin import InputError


def box_html(text: str, label: str, wrap: bool = False) -> str:
    """A text with a button that copies it; `wrap` breaks long lines instead of scrolling."""
    return render("panel/copy_box", text=text, label=label, wrap=wrap)


class SharePanel:
    """The link, a code snippet in a language of the visitor's choice, and frames. Posts ``"copy-as"``."""

    def __init__(self, gui: viser.GuiApi, post: Post) -> None:
        self._link = add_html(gui)
        self._name = next(iter(SNIPPETS))
        hint = "The present configuration and target, for another program"
        self._choice = gui.add_dropdown("Copy as", tuple(SNIPPETS), initial_value=self._name, hint=hint)
        listen(self._choice, post, "copy-as")
        self._code = add_html(gui)
        with gui.add_folder("Embed in a web page", expand_by_default=False):
            add_html(gui, render("panel/embed_note"))
            self._frames = {mode: add_html(gui) for mode in MODES}
        add_html(gui, render("sheet/in_view"))
        self._moment: Moment | None = None
        self._withheld = False

    @property
    def choice_id(self) -> str:
        """The id of the list of languages."""
        return uuid_of(self._choice)

    def show(self, link: str, moment: Moment, withheld: bool = False) -> None:
        """Show this link, and the code for this moment.

        Args:
            withheld: whether an open exercise asks for the arm's table, which most languages write out.
        """
        self._moment, self._withheld = moment, withheld
        update_html(self._link, box_html(link, "Copy link", wrap=True))
        self._show_code(moment)
        for mode, element in self._frames.items():
            code = frame(link.replace("viewer/#", f"viewer/?embed={mode}#", 1))
            update_html(element, box_html(code, f"Copy frame: {MODES[mode]}", wrap=True))

    def choose(self, name: object) -> None:
        """Choose another language; raises `kin.InputError` for an unknown one."""
        if name not in SNIPPETS:
            assign(self._choice, self._name)
            raise InputError("language", name, "one of " + ", ".join(SNIPPETS))
        self._name = str(name)
        if self._moment is not None:
            self._show_code(self._moment)

    def _show_code(self, moment: Moment) -> None:
        code = box_html(SNIPPETS[self._name](moment), "Copy code")
        update_html(self._code, render("panel/code_withheld") if self._withheld else code)
