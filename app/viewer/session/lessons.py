"""The choice of a lesson: a dropdown, and below it the lesson's own controls."""

from __future__ import annotations

import viser

from app.viewer.feature import Feature, Stage
from app.viewer.lessons import LESSONS
from app.viewer.panel import Post, assign, listen
from app.viewer.views.templates import render
from kin import InputError

NONE = "None"
HINT = "The drawings of a lesson stay in the scene while other tabs are open."


class LessonChoice:
    """Holds the open lesson, in a tab of its own. Posts ``"lesson"``."""

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
        """Open this lesson instead of the present one; raises `kin.InputError` for an unknown one."""
        if title not in self._titles:
            assign(self._choice, NONE if self.shown is None else self.shown.title)
            raise InputError("lesson", title, "one of " + ", ".join(self._titles))
        assign(self._choice, title)
        self.remove()
        chosen = next((lesson for lesson in LESSONS if lesson.title == title), None)
        if chosen is None:
            with self._parent:
                self._overview = self._gui.add_html(_overview())
            return
        with self._parent:
            self._box = self._gui.add_folder(None)
        with self._box:
            self.shown = chosen(self._stage)

    def open(self, key: str | None) -> None:
        """Open the lesson with this key, if there is one; None: close the open one."""
        lesson = next((lesson for lesson in LESSONS if lesson.key == key), None)
        if key is None or lesson is not None:
            self.choose(NONE if lesson is None else lesson.title)

    def remove(self) -> None:
        """Remove the open lesson, or the overview if none is open."""
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
    """All lessons, with one sentence each."""
    return render("panel/lessons", lessons=LESSONS)
