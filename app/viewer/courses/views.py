"""Courses as HTML: the bar above a lesson, the list of courses, one course, its editor, result codes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from app.classroom.courses import Course, Courses, Item
from app.classroom.courses.course import LONGEST, MOST_ITEMS
from app.classroom.courses.files import MOST_IN_FILE
from app.classroom.results import Outcome
from app.exercises import Exercises
from app.viewer.activity.practice import Mark
from app.viewer.activity.progress import Progress
from app.viewer.exercises.views import MARKS
from app.viewer.lessons import LESSONS
from app.viewer.panel.share import box_html
from app.viewer.views.templates import render

DONE: frozenset[Mark] = frozenset({"right", "shown"})
# Symbol, words and colour of what has become of a lesson.
LESSON_MARKS: dict[Mark, tuple[str, str, str]] = {
    "open": ("", "not begun", ""),
    "wrong": ("◐", "read, its check is not passed", "amber"),
    "right": ("✓", "check passed", "green"),
}


@dataclass(frozen=True)
class CourseView:
    """What a page shows of its course besides the course.

    Attributes:
        editing: whether the editor is open.
        link: the link to the course, if it is shown.
        code: the result code, if one was made.
        checked: what a code says that was checked.
        typed: that code.
        error: why the last code, alias or file was refused.
        errs: of what: `alias`, `check` or `file`.
    """

    editing: bool = False
    link: str = ""
    code: str = ""
    checked: Outcome | None = None
    typed: str = ""
    error: str = ""
    errs: str = ""


def bar_html(progress: Progress, known: Exercises) -> str:
    """The bar above a lesson or exercise of a course; empty in the list."""
    course, at, item = progress.course, progress.at, progress.item
    if course is None or at is None or item is None:
        return ""
    return render(
        "course/bar",
        course=course,
        number=at + 1,
        count=len(course.items),
        title=_title(known, item),
        note=item.note,
        marks=_marks(progress),
        at=at,
        done=progress.mark(at) in DONE,
    )


def chooser_html(courses: Courses, view: CourseView, seated: bool) -> str:
    """All courses, and, but for a student in a room (`seated`), what is for teachers: own courses, codes."""
    return render(
        "course/choose",
        courses=courses.all,
        view=view,
        most=MOST_IN_FILE,
        said=said(view.checked, courses),
        seated=seated,
    )


def course_html(progress: Progress, known: Exercises, courses: Sequence[Course], view: CourseView) -> str:
    """The list of an open course, or its editor; `courses` are those of the service."""
    course = progress.course
    assert course is not None
    rows = _rows(progress, known)
    done = sum(row["mark"]["color"] == "green" for row in rows)
    link = Markup(box_html(view.link, "Copy link", wrap=True)) if view.link else ""
    if view.editing:
        exercises = [(topic, [(one.id, one.title) for one in members]) for topic, members in known.topics()]
        return render(
            "course/edit",
            course=course,
            rows=rows,
            longest=LONGEST,
            full=len(rows) >= MOST_ITEMS,
            link=link,
            lessons=[(lesson.key, lesson.title) for lesson in LESSONS],
            exercises=exercises,
            view=view,
        )
    code = Markup(box_html(view.code, "Copy code", wrap=True)) if view.code else ""
    return render(
        "course/follow",
        course=course,
        rows=rows,
        done=done,
        view=view,
        link=link,
        code=code,
        alias=progress.alias,
        begun=any(row["mark"]["symbol"] for row in rows),
        complete=all(progress.mark(i) in DONE for i in range(len(rows))),
        following=_following(courses, course),
        outcome=progress.outcome(),
        seated=progress.seated,
        back=[
            {"key": key, "title": _title(known, Item("exercise", key)), "mark": MARKS[mark]}
            for key, mark in progress.back.items()
        ],
    )


def said(outcome: Outcome | None, courses: Courses) -> str:
    """What a code says, as a sentence."""
    if outcome is None:
        return ""
    known = next((course.title for course in courses.all if course.fingerprint == outcome.fingerprint), "")
    title = known or f"{outcome.title}…"
    tries = f"{outcome.tries} answers" if outcome.tries < 255 else "255 answers or more"
    return (
        f"{outcome.alias} · {title}: {outcome.score} %, {outcome.solved} of {outcome.count} exercises solved with "
        f"{tries}, {outcome.day:%Y-%m-%d}."
    )


def _rows(progress: Progress, known: Exercises) -> list[dict[str, Any]]:
    """The items of a course, and for the editor what each may be compared with."""
    course = progress.course
    assert course is not None
    rows: list[dict[str, Any]] = [
        {
            "index": i,
            "kind": item.kind,
            "title": _title(known, item),
            "own": item.title,
            "note": item.note,
            "mark": mark,
            "name": course.items[i].key,
        }
        for i, (item, mark) in enumerate(zip(course.items, _marks(progress), strict=True))
    ]
    partner = dict(zip(course.after, course.before, strict=True))
    taken = {*course.before, *course.after}
    for i, row in enumerate(rows):
        row["before"] = partner.get(str(row["name"]), "")
        row["earlier"] = [
            (one["name"], f"{j + 1}. {one['title']}")
            for j, one in enumerate(rows[:i])
            if one["kind"] == "exercise" and (one["name"] not in taken or one["name"] == row["before"])
        ]
        row["free"] = row["kind"] == "exercise" and row["name"] not in course.before
    return rows


def _following(courses: Sequence[Course], course: Course) -> tuple[int, str] | None:
    """The index and title of the service's next course; None: it has none, or this is none of its courses."""
    after = courses.index(course) + 1 if course in courses else len(courses)
    return (after, courses[after].title) if after < len(courses) else None


def _title(known: Exercises, item: Item) -> str:
    """What an item is called."""
    if item.title:
        return item.title
    if item.kind == "lesson":
        return next((lesson.title for lesson in LESSONS if lesson.key == item.key), item.key)
    exercise = known.get(item.key)
    return item.key if exercise is None else exercise.title


def _marks(progress: Progress) -> list[dict[str, str]]:
    course = progress.course
    assert course is not None
    tables = [LESSON_MARKS if item.kind == "lesson" else MARKS for item in course.items]
    found = [table[progress.mark(i)] for i, table in enumerate(tables)]
    return [{"symbol": symbol, "words": words, "color": color} for symbol, words, color in found]
