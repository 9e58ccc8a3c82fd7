"""Worksheets of the tab *Learn*: the lesson on show, or the arm alone, for print and as files.

The printable page is ``static/sheet.html``. ``static/sheets.js`` opens it and hands it what `Worksheets` puts into
the panel, so the service keeps nothing, and it works for an arm of the visitor's own too.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence

from app.exports.snippets import named
from app.exports.worksheet import Part, Question, Sheet, csv_text, draw, latex
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings
from app.viewer.declared.panel import Folder, Html, Node
from app.viewer.feature import Stage
from app.viewer.lessons.guide import outline as guide
from app.viewer.lessons.guide.content import arm_for
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.panel import update_html
from app.viewer.panel.part import Block
from app.viewer.panel.status import Notice
from app.viewer.takehome.sending import send_page
from app.viewer.views.templates import render
from app.viewer.worksheet.views import buttons, page_html
from kin import InputError

FILES: dict[str, tuple[str, Callable[[Sheet], str]]] = {
    "latex": ("tex", latex),
    "csv": ("csv", csv_text),
    "svg": ("svg", lambda sheet: draw(sheet).svg()),
}


class Worksheets(DeclaredFeature[Settings, Facts[Settings]]):
    """The buttons below a lesson. Also pressed in the tab *View*.

    Args:
        lesson: the lesson on show, if there is one.
        page: holds the page to print, hidden. Not in a tab: what is in a closed tab reaches the browser late.
        folder: whether there are buttons in the tab *Learn*; otherwise only those in the tab *View*.
    """

    key = "sheet"
    title = "Worksheet"
    acts = False
    settings_of, facts_of = Settings, Facts
    messages = frozenset({"page", "web", *FILES})

    def __init__(self, stage: Stage, lesson: Lesson | None, page: Block, folder: bool = True) -> None:
        self._lesson, self._page, self._folder = lesson, page, folder
        super().__init__(stage)

    def panel(self) -> Sequence[Node]:
        with_lesson = self._lesson is not None
        shown = [Folder("Worksheet", [Html(buttons, (with_lesson,))], open=with_lesson)]
        return shown if self._folder else ()

    def heard(self, key: Hashable, value: object) -> None:
        match key:
            case ("page", int(serial)):
                page = render("sheet/withheld") if self.hides("table") else page_html(self.sheet())
                update_html(self._page, render("sheet/handed", page=page, serial=serial))
            case ("web", int()):
                send_page(self.stage)
            case (str(name), int()) if name in FILES and self.hides("table"):
                words = "The worksheet would contain the table that the open exercise asks for."
                self.stage.status.show(Notice("advice", "Not now", words))
            case (str(name), int()) if name in FILES:
                sheet = self.sheet()
                suffix, write = FILES[name]
                what = "arm" if self._lesson is None else self._lesson.key
                file = f"{named(sheet.robot).id}-{what}.{suffix}"
                self.stage.client.send_file_download(file, write(sheet).encode(), save_immediately=True)
            case _:
                raise InputError("worksheet", key, "one of page, web, " + ", ".join(FILES))

    def commands(self) -> Iterable[tuple[str, tuple[str | int, ...], object]]:
        return [
            (f"Save the worksheet as {suffix.upper()}", (kind, 0), None) for kind, (suffix, _) in FILES.items()
        ]

    def sheet(self) -> Sheet:
        """The worksheet for the arm as it is, or for the one that the lesson asks about."""
        stage, lesson = self.stage, self._lesson
        if lesson is None:
            return Sheet(
                "The arm at a configuration", stage.arm.now.robot, stage.arm.now.goal, stage.display.units
            )
        text = stage.activity.text(lesson.key)
        robot = arm_for(text, stage.arm.now.robot)
        here, found = robot == stage.arm.now.robot, lesson.outline_in(robot, stage.display.units, text)
        return Sheet(
            lesson.title if found.text is None else found.text.title or lesson.title,
            robot,
            stage.arm.now.goal if here else robot.q_home,
            stage.display.units,
            found.goal,
            parts_of(found),
            lesson.formulas() if here else (),
            lesson.left,
        )

    def remove(self) -> None:
        super().remove()
        update_html(self._page, "")


def parts_of(outline: guide.Outline) -> tuple[Part, ...]:
    """Steps and check of a lesson, for paper."""
    parts = []
    for number, step in enumerate(outline.steps, 1):
        before = () if step.estimate is None else (_question(step.estimate, ""),)
        questions = before if step.question is None else (*before, _question(step.question, step.shown))
        about = "" if step.about is None else f" ({step.about.name})"
        parts.append(Part(f"{number}. {step.title}{about}", step.text, questions))
    return (*parts, Part("Check", "", tuple(_question(question) for question in outline.check)))


def _question(question: guide.Question, shown: str = "") -> Question:
    solution = " ".join(filter(None, (question.solution(), shown)))
    asked = question.asked()
    if asked.form in ("options", "order"):
        return Question(question.prompt, solution, asked.labels)
    return Question(question.prompt, solution, (), " ".join(asked.units))
