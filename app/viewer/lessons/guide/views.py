"""The goal, the steps and the questions of a lesson as HTML."""

from __future__ import annotations

from app.exercises.judging import solution_text, tolerance_text, value_text
from app.viewer.lessons.guide.outline import Choice, Number, Question
from app.viewer.lessons.guide.progress import Mark, Progress
from app.viewer.views.templates import render
from kin.units import general

# Symbol, words and colour of what has become of a question.
MARKS: dict[Mark, tuple[str, str, str]] = {
    "open": ("", "not answered", ""),
    "right": ("✓", "answered right", "green"),
    "wrong": ("✗", "not right yet", "vermilion"),
    "shown": ("●", "answer shown", "blue"),
}


def goal_html(goal: str) -> str:
    """What the student can do at the end."""
    return render("guide/goal", goal=goal)


def steps_html(progress: Progress, errors: dict[str, tuple[str, str]]) -> str:
    """The step on show, or the check.

    Args:
        errors: typed text that could not be read, and why, by the key of the question.
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
        questions = [
            _question(progress, key, question, errors)
            for key, question in progress.outline.questions()
            if key.startswith("c")
        ]
        return render(
            "guide/check", marks=marks, at=at, questions=questions, right=right, count=count,
            done=all(question["closed"] for question in questions),
        )  # fmt: skip
    step, key = steps[at], str(at + 1)
    return render(
        "guide/step",
        marks=marks,
        at=at,
        step=step,
        question=None if step.question is None else _question(progress, key, step.question, errors),
        open=step.question is None or progress.is_closed(key),
    )


def _question(
    progress: Progress, key: str, question: Question, errors: dict[str, tuple[str, str]]
) -> dict[str, object]:
    """The values of a question for its template."""
    mark, verdict = progress.mark(key), progress.verdict(key)
    closed = progress.is_closed(key)
    typed, error = errors.get(key, ("", ""))
    feedback = ""
    if error:
        symbol, title, color, feedback = "!", "Not read", "amber", error
    elif mark == "shown":
        symbol, title, color, feedback = "●", "The answer", "blue", solution_text(question)
    elif verdict is not None:
        symbol, _, color = MARKS[mark]
        title, feedback = ("Right" if verdict.right else "Not quite"), verdict.reason
    else:
        symbol, title, color = "", "", ""
    common = {"key": key, "prompt": question.prompt, "closed": closed, "feedback": feedback}
    common |= {"symbol": symbol, "title": title, "color": f"kb-{color}"}
    if isinstance(question, Choice):
        options = [
            {"text": option.text, "chosen": progress.given.get(key) == i, "right": closed and option.right}
            for i, option in enumerate(question.options)
        ]
        return {**common, "options": options}
    return {**common, "options": (), **_field(progress, key, question, typed, bool(error))}


def _field(progress: Progress, key: str, question: Number, typed: str, invalid: bool) -> dict[str, object]:
    given = progress.given.get(key)
    shown = "" if given is None else general(given * question.unit.scale)
    value = typed or (
        value_text(question).removesuffix(question.unit.suffix) if key in progress.revealed else shown
    )
    return {"value": value, "unit": question.unit.name, "tolerance": tolerance_text(question), "invalid": invalid}
