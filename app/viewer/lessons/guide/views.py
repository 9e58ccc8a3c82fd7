"""The goal, the steps and the questions of a lesson as HTML."""

from __future__ import annotations

from app.exercises.lesson_text import LessonText
from app.exercises.lessons import ENGLISH
from app.exercises.questions import Choice
from app.viewer.exercises.sheet import Sheet
from app.viewer.exercises.views import Following, entry_of
from app.viewer.lessons.guide.outline import Outline, Question
from app.viewer.lessons.guide.progress import Mark, Progress
from app.viewer.views.templates import render

# Symbol, words and colour of what has become of a question.
MARKS: dict[Mark, tuple[str, str, str]] = {
    "open": ("", "not answered", ""),
    "right": ("✓", "answered right", "green"),
    "wrong": ("✗", "not right yet", "vermilion"),
    "shown": ("●", "answer shown", "blue"),
}


UNFIT = "The file of this lesson asks what has no answer for this arm: the original is shown."
PARTS = {("lesson",): "the goal", ("check",): "the check", ("example",): "the worked example"}


def goal_html(lesson: str, outline: Outline) -> str:
    """What the student can do at the end of the lesson of that title; what is not in the words that are wanted."""
    text = outline.text
    title, note = (lesson, "") if text is None else (text.title or lesson, _untranslated(text))
    note = UNFIT if outline.unfit else note
    return render("guide/goal", lesson=title, goal=outline.goal, note=note, language=language_of(text))


def example_html(title: str, *going: object) -> str:
    """The button of the worked example; while it is on show, what it has come to (`WorkedExample.words`)."""
    names = "step", "at", "count", "arrived", "playing"
    return render("guide/example", title=title, player=dict(zip(names, going, strict=False)))


def language_of(text: LessonText | None) -> str:
    """The code of the language of a lesson's words."""
    return ENGLISH if text is None or text.translation is None else text.translation.language


def _untranslated(text: LessonText) -> str:
    """What a lesson says in the words of the original, as a sentence; "": nothing."""
    if text.translation is None or language_of(text) == ENGLISH:
        return ""
    said, missing = text.translation.said, text.translation.missing
    if not any(map(any, (texts.values() for texts in said.values()))):
        return "This lesson is not translated yet." if said else ""
    steps = [f"“{said[place].get(place[1]) or place[1]}”" for place in missing if place[0] == "steps"]
    others = [name for place, name in PARTS.items() if place in missing]
    found = [*steps, *others, *(() if text.controls else ("the labels below",))]
    return f"Not translated yet: {', '.join(found)}." if found else ""


def steps_html(
    progress: Progress, sheets: dict[str, Sheet], of: str = "", arm: str = "", following: Following | None = None
) -> str:
    """The step on show, or the check.

    Args:
        sheets: what was entered, by the key of the question.
        of: names the lesson and the arm: what is typed for one arm is nothing for another one.
        arm: the name of the arm that the questions are about, if it is not on show: they are not asked then.
        following: the button that leads on after a check that was passed.
    """
    steps, at = progress.outline.steps, progress.at
    marks = []
    for number, step in enumerate(steps, 1):
        mark = MARKS[progress.mark(str(number))] if step.question is not None else ("", "nothing to answer", "")
        marks.append(
            {"name": str(number), "title": step.title, "symbol": mark[0], "words": mark[1], "color": mark[2]}
        )
    right, count = progress.score
    if at == len(steps):
        asked, earlier = (
            [_question(progress, key, one, sheets) for key, one in progress.questions.items() if key[0] == letter]
            for letter in "cr"
        )
        return render(
            "guide/check",
            language=language_of(progress.outline.text),
            of=of,
            arm=arm,
            marks=marks,
            at=at,
            questions=asked,
            right=right,
            count=count,
            earlier=earlier,
            recalled=sum(progress.mark(str(one["key"])) == "right" for one in earlier),
            done=all(question["closed"] for question in asked),
            following=following if right == count else None,
        )
    step, key, before = steps[at], str(at + 1), f"e{at + 1}"
    closed = step.question is None or progress.is_closed(key)
    fine, given = progress.mark(key) == "right", progress.given.get(key)
    estimate = step.estimate if not closed or progress.mark(before) != "open" else None
    return render(
        "guide/step",
        language=language_of(progress.outline.text),
        of=of,
        marks=marks,
        at=at,
        step=step,
        arm=arm,
        question=None if step.question is None or arm else _question(progress, key, step.question, sheets),
        estimate=None if estimate is None or arm else _question(progress, before, estimate, sheets),
        open=closed,
        answered="" if step.answered is None or arm else step.answered(given, fine, closed),
    )


def _question(progress: Progress, key: str, question: Question, sheets: dict[str, Sheet]) -> dict[str, object]:
    """The values of a question for its template."""
    mark, closed, sheet = progress.mark(key), progress.is_closed(key), sheets.get(key, Sheet())
    symbol, title, color, feedback = "", "", "", ""
    if sheet.error:
        symbol, title, color, feedback = "!", "Not read", "amber", sheet.error
    elif mark == "shown":
        symbol, title, color, feedback = "●", "The answer", "blue", question.solution()
    elif mark != "open":
        symbol, _, color = MARKS[mark]
        title, feedback = ("Right" if mark == "right" else "Not quite"), progress.feedback(key)
    rights = frozenset[int]()
    if closed and isinstance(question, Choice):
        rights = frozenset(i for i, option in enumerate(question.options) if option.right)
    return {
        "key": key,
        "prompt": question.prompt,
        "closed": closed,
        "feedback": feedback,
        "symbol": symbol,
        "title": title,
        "color": f"kb-{color}",
        "entry": entry_of(question.asked(), sheet, closed, key, rights),
    }
