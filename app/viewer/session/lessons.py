"""The choice of a lesson: a dropdown, and below it the steps and questions of the lesson and its own controls.

The exercises and the courses are two of the choices. What is open, `Activity` knows.
"""

from __future__ import annotations

from collections.abc import Hashable

import viser

from app.viewer.courses.feature import CourseFeature
from app.viewer.exercises.author import Author
from app.viewer.exercises.feature import Practising
from app.viewer.feature import Feature, Stage
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.content import arm_for
from app.viewer.lessons.guide.feature import Guide
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.panel import Post, assign, listen, update_html
from app.viewer.panel.part import Block, add_html
from app.viewer.review.feature import Reviewing
from app.viewer.views.templates import render
from app.viewer.worksheet.feature import Worksheets
from kin import InputError, Robot

NONE = "None"
MORE: tuple[type[Feature], ...] = (Practising, CourseFeature, Author)  # Reviewing has a row of its own
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
        author, exercises, courses, reviewing: which live as long as the page.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        parent: viser.GuiTabHandle,
        page: Block,
        stage: Stage,
        post: Post,
    ) -> None:
        self._gui = gui
        self._forward = post
        self._page = page
        self._parent = parent
        self._stage = stage
        with parent:
            bar = add_html(gui)
            self._offered = self._titles()
            self._choice = gui.add_dropdown("Lesson", tuple(self._offered), initial_value=NONE, hint=HINT)
            self.exercises = Practising(stage)
            self.courses = CourseFeature(stage, bar)
            self.author = Author(stage)
            self.reviewing = Reviewing(stage)
            self._overview: Block | None = add_html(gui, self._list())
            self.sheets: Worksheets | None = Worksheets(stage, None, page)
        listen(self._choice, self._post, "lesson")
        self._box: viser.GuiFolderHandle | None = None
        self.shown: Lesson | None = None
        self.guide: Guide | None = None
        self._left: dict[tuple[str, str], dict[str, object]] = {}  # progress, by lesson and the arm asked about

    def choose(self, title: object, steps: dict[str, object] | None = None) -> None:
        """Open this lesson instead of the present one.

        Args:
            steps: how far the visitor is in its steps, as `Guide.state`; None: as when it was closed last.

        Raises:
            kin.InputError: for an unknown title.
        """
        self._offer()
        chosen = next((each for each in choices() if each.title == title), None)
        if chosen is None and title != NONE:
            assign(self._choice, self._shown_title)
            raise InputError("lesson", title, "one of " + ", ".join((NONE, *(each.title for each in choices()))))
        assign(self._choice, self._as_offered(NONE if chosen is None else chosen.title))
        self.remove()
        try:
            with self._parent:
                self._show(chosen, steps)
        finally:
            self._stage.activity.changed()

    def begin(self, keep_arm: bool = False) -> None:
        """The visitor has opened the lesson, not a link or a leader: the scene comes to its pose."""
        if self.guide is not None:
            self.guide.begin(keep_arm)

    def _show(self, chosen: type[Feature] | None, steps: dict[str, object] | None) -> None:
        """Build what was chosen, in the container that is open; None: the overview."""
        activity, always = self._stage.activity, (self.exercises, self.courses, self.author, self.reviewing)
        if (
            chosen is not None
            and issubclass(chosen, Lesson)
            and chosen.by_rows
            and self._stage.arm.now.robot.coupled
        ):
            assign(self._choice, NONE)
            self._overview = add_html(self._gui, _not_for(chosen, self._stage.arm.now.robot) + self._list())
            chosen = None
        elif chosen is None:
            self._overview = add_html(self._gui, self._list())
        elif issubclass(chosen, Lesson):
            self._box = self._gui.add_folder(None)
            with self._box:
                kept = self._kept(chosen.key) if steps is None else steps
                self.guide = Guide(self._stage, chosen, kept, after(chosen))
                self.shown = self.guide.shown
            activity.lesson = chosen.key
        else:
            activity.lesson = chosen.key
            next(each for each in always if isinstance(each, chosen)).show()
        buttons = chosen is None or self.shown is not None
        self.sheets = Worksheets(self._stage, self.shown, self._page, folder=buttons)

    @property
    def features(self) -> list[Feature]:
        """The open lesson, its guide and its worksheet, the exercises and the courses.

        They are restored in this order: a course asks what was missed.
        """
        every = (self.guide, self.shown, self.sheets, self.author, self.exercises, self.reviewing, self.courses)
        return [feature for feature in every if feature is not None]

    @property
    def misplaced(self) -> bool:
        """Whether a link was opened to a step that is asked about another arm."""
        return self.guide is not None and self.guide.misplaced

    @property
    def opened(self) -> Hashable:
        """As `Activity.opened`, with the step of the lesson and its answers."""
        return self._stage.activity.opened, None if self.guide is None else self.guide.done

    @property
    def _shown_title(self) -> str:
        """What the dropdown shows."""
        key = self._stage.activity.lesson
        return self._as_offered(next((each.title for each in choices() if each.key == key), NONE))

    def _as_offered(self, title: str) -> str:
        return next(said for said, own in self._offered.items() if own == title)

    def _offer(self) -> None:
        """Let the dropdown have the titles of today: files may have changed them."""
        if (titles := self._titles()) != self._offered:
            self._offered = titles
            self._choice.options = tuple(titles)

    def _titles(self) -> dict[str, str]:
        """The title of each choice, by that in the language of the page; each is there once."""
        titles = {NONE: NONE}
        for each in choices():
            text = self._stage.activity.own_text(each.key)
            said = each.title if text is None else text.title or each.title
            while said in titles:
                said = f"{said} ({each.title})"
            titles[said] = each.title
        return titles

    def _post(self, key: Hashable, value: object) -> None:
        """Choices are known by their own titles. This is called in the event loop: it reads no files."""
        self._forward(key, self._offered.get(value, value) if isinstance(value, str) else value)

    def _list(self) -> str:
        """All lessons, with one sentence each."""
        lessons = [(each, self._stage.activity.own_text(each.key)) for each in LESSONS]
        return render("panel/lessons", lessons=lessons, more=MORE)

    def show_language(self) -> None:
        """The page has another language."""
        self._offer()
        assign(self._choice, self._shown_title)
        if self._overview is not None:
            update_html(self._overview, self._list())

    def open(self, key: str | None, steps: dict[str, object] | None = None) -> None:
        """Open the lesson with this key, if there is one, at its `steps`; None: close the open one."""
        chosen = next((each for each in choices() if each.key == key), None)
        if key is None or chosen is not None:
            self.choose(NONE if chosen is None else chosen.title, steps)

    def remove(self) -> None:
        """Remove the open lesson or the exercises, or the overview if none is open."""
        self._stage.activity.lesson = None
        if self.sheets is not None:
            self.sheets.remove()
            self.sheets = None
        self.exercises.hide()
        self.courses.hide()
        self.author.hide()
        self.reviewing.hide()
        if self.shown is not None and self.guide is not None:
            self._keep(self.shown.key, self.guide)
            self.shown.remove()
        if self.guide is not None:
            self.guide.remove()
        self._stage.activity.asked = frozenset()
        self.shown = self.guide = None
        if self._box is not None:
            self._box.remove()
            self._box = None
        if self._overview is not None:
            self._overview.remove()
            self._overview = None

    def _keep(self, lesson: str, guide: Guide) -> None:
        """Keep the progress in a lesson that is closed."""
        key = lesson, guide.arm.id
        self._left.pop(key, None)
        self._left[key] = {**guide.state(), "arm": guide.arm.id}
        while len(self._left) > KEPT:
            del self._left[next(iter(self._left))]

    def _kept(self, lesson: str) -> dict[str, object] | None:
        """The progress in a lesson about the arm on show, or about the last one if it does not ask about this."""
        robot = self._stage.arm.now.robot
        asked = arm_for(self._stage.activity.text(lesson), robot) == robot
        kept = [
            state for (key, arm), state in self._left.items() if key == lesson and (arm == robot.id or not asked)
        ]
        return kept[-1] if kept else None


def choices() -> tuple[type[Feature], ...]:
    """What the tab offers. All but the lessons live as long as the page."""
    return (*LESSONS, *MORE, Reviewing)


def after(lesson: type[Lesson]) -> str:
    """The title of the lesson that follows one; "" after the last."""
    following = LESSONS[LESSONS.index(lesson) + 1 :]
    return following[0].title if following else ""


def lesson_with_key(key: str | None) -> type[Lesson] | None:
    """The lesson with this key; None if there is none."""
    return next((lesson for lesson in LESSONS if lesson.key == key), None)


def _not_for(lesson: type[Lesson], robot: Robot) -> str:
    """Why a lesson is not shown for an arm, above all lessons."""
    return render("panel/not_for", title=lesson.title, robot=robot.name)
