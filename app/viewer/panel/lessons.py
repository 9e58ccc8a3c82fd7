"""Which lesson is on show: a dropdown, and below it the lesson's own controls."""

from __future__ import annotations

from html import escape

import viser

from app.viewer.feature import Feature, Stage
from app.viewer.lessons import LESSONS
from app.viewer.panel import Post, assign, listen
from kin import InputError

NONE = "None"
HINT = "What to look at. Its drawings stay in the picture while other tabs are open."


class LessonChoice:
    """Holds the lesson on show, in a tab of its own. Posts ``"lesson"``."""

    def __init__(self, gui: viser.GuiApi, parent: viser.GuiTabHandle, stage: Stage, post: Post) -> None:
        self._gui = gui
        self._parent = parent
        self._stage = stage
        self._titles = (NONE, *(lesson.title for lesson in LESSONS))
        with parent:
            self._choice = gui.add_dropdown("Lesson", self._titles, initial_value=NONE, hint=HINT)
            self._overview: viser.GuiHtmlHandle | None = gui.add_html(_overview())
        listen(self._choice, post, "lesson")
        self._box: viser.GuiFolderHandle | None = None
        self.shown: Feature | None = None

    def choose(self, title: object) -> None:
        """Show this lesson instead of the present one; raises `kin.InputError` for one that there is not."""
        if title not in self._titles:
            assign(self._choice, NONE if self.shown is None else self.shown.title)
            raise InputError("lesson", title, "one of " + ", ".join(self._titles))
        assign(self._choice, title)
        self.remove()
        wanted = next((lesson for lesson in LESSONS if lesson.title == title), None)
        if wanted is None:
            with self._parent:
                self._overview = self._gui.add_html(_overview())
            return
        with self._parent:
            self._box = self._gui.add_folder(None)
        with self._box:
            self.shown = wanted(self._stage)

    def open(self, key: str) -> None:
        """Show the lesson of this key, if there is one."""
        lesson = next((lesson for lesson in LESSONS if lesson.key == key), None)
        if lesson is not None:
            self.choose(lesson.title)

    def remove(self) -> None:
        """Take the lesson on show away, or the list of all if there is none."""
        if self.shown is not None:
            self.shown.remove()
            self.shown = None
        if self._box is not None:
            self._box.remove()
            self._box = None
        if self._overview is not None:
            self._overview.remove()
            self._overview = None


def _overview() -> str:
    """All lessons with a sentence each."""
    rows = "".join(
        f'<dt><b>{escape(lesson.title)}</b></dt><dd style="margin:0 0 .7em">{escape(lesson.about)}</dd>'
        for lesson in LESSONS
    )
    return f'<dl data-lessons style="margin:.2em 1em .4em;font-size:.85em;line-height:1.4">{rows}</dl>'
