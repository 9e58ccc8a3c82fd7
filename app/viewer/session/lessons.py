"""The choice of a lesson: a dropdown, and below it the steps and questions of the lesson and its own controls."""

from __future__ import annotations

import viser

from app.viewer.feature import Feature, Stage
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.feature import Guide
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.panel import Post, assign, listen
from app.viewer.views.templates import render
from app.viewer.worksheet import Worksheets
from kin import InputError

NONE = "None"
KEPT = 50  # lessons of which the progress is kept, in the order in which they were left
HINT = "The drawings of a lesson stay in the scene while other tabs are open."


class LessonChoice:
    """Holds the open lesson, in a tab of its own. Posts ``"lesson"``.

    Attributes:
        shown: the open lesson.
        guide: its goal, steps and questions.
        sheets: the worksheet of the lesson, or of the arm.
    """

    def __init__(self, gui: viser.GuiApi, parent: viser.GuiTabHandle, stage: Stage, post: Post) -> None:
        self._gui = gui
        self._parent = parent
        self._stage = stage
        self._titles = (NONE, *(lesson.title for lesson in LESSONS))
        with parent:
            self._choice = gui.add_dropdown("Lesson", self._titles, initial_value=NONE, hint=HINT)
            self._overview: viser.GuiHtmlHandle | None = gui.add_html(_overview())
            self.sheets = Worksheets(stage, None)
        listen(self._choice, post, "lesson")
        self._box: viser.GuiFolderHandle | None = None
        self.shown: Lesson | None = None
        self.guide: Guide | None = None
        self._left: dict[tuple[str, str], dict[str, object]] = {}  # progress, by lesson and robot

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
                self.sheets = Worksheets(self._stage, None)
            return
        with self._parent:
            self._box = self._gui.add_folder(None)
        with self._box:
            self.guide = Guide(self._stage, chosen)
            if (left := self._left.get((chosen.key, self._stage.robot.id))) is not None:
                self.guide.restore(left)
            self.shown = chosen(self._stage)
            self.guide.attach(self.shown)
        with self._parent:
            self.sheets = Worksheets(self._stage, self.shown)

    @property
    def features(self) -> list[Feature]:
        """The open lesson, its guide, and its worksheet."""
        return [feature for feature in (self.guide, self.shown, self.sheets) if feature is not None]

    def open(self, key: str | None) -> None:
        """Open the lesson with this key, if there is one; None: close the open one."""
        lesson = next((lesson for lesson in LESSONS if lesson.key == key), None)
        if key is None or lesson is not None:
            self.choose(NONE if lesson is None else lesson.title)

    def remove(self) -> None:
        """Remove the open lesson, or the overview if none is open."""
        self.sheets.remove()
        if self.shown is not None and self.guide is not None:
            self._keep(self.shown.key, self.guide.state())
            self.shown.remove()
        if self.guide is not None:
            self.guide.remove()
        self.shown = self.guide = None
        if self._box is not None:
            self._box.remove()
            self._box = None
        if self._overview is not None:
            self._overview.remove()
            self._overview = None

    def _keep(self, lesson: str, progress: dict[str, object]) -> None:
        """Keep the progress in a lesson that is closed."""
        key = (lesson, self._stage.robot.id)
        self._left.pop(key, None)
        self._left[key] = progress
        while len(self._left) > KEPT:
            del self._left[next(iter(self._left))]


def _overview() -> str:
    """All lessons, with one sentence each."""
    return render("panel/lessons", lessons=LESSONS)
