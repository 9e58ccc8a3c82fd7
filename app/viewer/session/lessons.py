"""The choice of a lesson: a dropdown, and below it the steps and questions of the lesson and its own controls.

The exercises and the courses are two of the choices.
"""

from __future__ import annotations

from functools import partial

import viser

from app.classroom.results.keys import result_key
from app.viewer.courses.feature import CourseFeature
from app.viewer.exercises.feature import Practising
from app.viewer.feature import Feature, Stage
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.feature import Guide
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.panel import Post, assign, listen
from app.viewer.session.services import Services
from app.viewer.views.templates import render
from app.viewer.worksheet import Worksheets
from kin import InputError

NONE = "None"
KEPT = 50  # lessons of which the progress is kept, in the order in which they were left
HINT = "The drawings of a lesson stay in the scene while other tabs are open."


class LessonChoice:
    """Holds the open lesson, in a tab of its own. Posts ``"lesson"``.

    Args:
        page: holds the page to print of a worksheet, hidden.

    Attributes:
        shown: the open lesson.
        guide: its goal, steps and questions.
        sheets: the worksheet of the lesson, or of the arm.
        exercises, courses: which live as long as the page.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        parent: viser.GuiTabHandle,
        page: viser.GuiHtmlHandle,
        stage: Stage,
        post: Post,
        services: Services,
    ) -> None:
        self._gui = gui
        self._page = page
        self._parent = parent
        self._stage = stage
        self._titles = (NONE, *(lesson.title for lesson in LESSONS), Practising.title, CourseFeature.title)
        self.exercises = Practising(stage, services.exercises)
        with parent:
            self.courses = CourseFeature(
                stage, services.courses, self.exercises.practice, partial(result_key, services.classroom)
            )
            self.exercises.course = self.courses
            self.courses.entered = self.exercises.begin_anew
            self._choice = gui.add_dropdown("Lesson", self._titles, initial_value=NONE, hint=HINT)
            self._overview: viser.GuiHtmlHandle | None = gui.add_html(_overview())
            self.sheets: Worksheets | None = Worksheets(stage, None, page)
        listen(self._choice, post, "lesson")
        self._box: viser.GuiFolderHandle | None = None
        self.shown: Lesson | None = None
        self.guide: Guide | None = None
        self._left: dict[tuple[str, str], dict[str, object]] = {}  # progress, by lesson and robot

    def choose(self, title: object) -> None:
        """Open this lesson instead of the present one; raises `kin.InputError` for an unknown one."""
        if title not in self._titles:
            assign(self._choice, self._title)
            raise InputError("lesson", title, "one of " + ", ".join(self._titles))
        assign(self._choice, title)
        self.remove()
        for each in (self.exercises, self.courses):
            if title == each.title:
                with self._parent:
                    each.show()
                    self.sheets = Worksheets(self._stage, None, self._page, folder=False)
                return
        chosen = lesson_titled(title)
        if chosen is None:
            with self._parent:
                self._overview = self._gui.add_html(_overview())
                self.sheets = Worksheets(self._stage, None, self._page)
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
            self.sheets = Worksheets(self._stage, self.shown, self._page)

    @property
    def features(self) -> list[Feature]:
        """The open lesson, its guide and its worksheet, and the exercises."""
        every = (self.guide, self.shown, self.sheets, self.exercises, self.courses)
        return [feature for feature in every if feature is not None]

    @property
    def key(self) -> str | None:
        """Of the open lesson, or of the exercises or courses if they are open."""
        for each in (self.exercises, self.courses):
            if each.shown:
                return each.key
        return None if self.shown is None else self.shown.key

    @property
    def _title(self) -> str:
        for each in (self.exercises, self.courses):
            if each.shown:
                return each.title
        return NONE if self.shown is None else self.shown.title

    def open(self, key: str | None) -> None:
        """Open the lesson with this key, if there is one; None: close the open one."""
        choices: tuple[type[Feature], ...] = (*LESSONS, Practising, CourseFeature)
        chosen = next((each for each in choices if each.key == key), None)
        if key is None or chosen is not None:
            self.choose(NONE if chosen is None else chosen.title)

    def remove(self) -> None:
        """Remove the open lesson or the exercises, or the overview if none is open."""
        if self.sheets is not None:
            self.sheets.remove()
            self.sheets = None
        self.exercises.hide()
        self.courses.hide()
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


def lesson_titled(title: object) -> type[Lesson] | None:
    """The lesson with this title; None if there is none."""
    return next((lesson for lesson in LESSONS if lesson.title == title), None)


def lesson_with_key(key: str | None) -> type[Lesson] | None:
    """The lesson with this key; None if there is none."""
    return next((lesson for lesson in LESSONS if lesson.key == key), None)


def _overview() -> str:
    """All lessons, with one sentence each."""
    return render("panel/lessons", lessons=LESSONS, more=(Practising, CourseFeature))
