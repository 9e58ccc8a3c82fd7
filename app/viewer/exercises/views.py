"""The list of exercises and the exercise on show as HTML."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.exercises import Asked, Exercise, Exercises, Variant
from app.exports.worksheet.sheet import indexed
from app.viewer.activity.activity import EXERCISES, Activity
from app.viewer.activity.practice import Mark, Practice, Record
from app.viewer.activity.progress import Progress
from app.viewer.exercises.sheet import Sheet
from app.viewer.views.templates import render
from kin.units import Units

# Symbol, words and colour of what has become of an exercise.
MARKS: dict[Mark, tuple[str, str, str]] = {
    "open": ("", "not begun", ""),
    "wrong": ("◐", "not right yet", "amber"),
    "right": ("✓", "solved", "green"),
    "shown": ("●", "answer shown", "blue"),
}
LEVELS = ("", "easy", "medium", "hard")


def list_html(exercises: Exercises, practice: Practice) -> str:
    """All exercises by topic, with what has become of each."""
    topics = []
    for title, members in exercises.topics():
        rows = []
        for exercise in members:
            record = practice.records.get(exercise.id, Record())
            symbol, words, color = MARKS[record.mark]
            rows.append(
                {
                    "id": exercise.id,
                    "title": exercise.title,
                    "level": exercise.level,
                    "level_words": LEVELS[exercise.level],
                    "symbol": symbol,
                    "words": words,
                    "color": color,
                }
            )
        solved = sum(practice.records.get(one.id, Record()).mark == "right" for one in members)
        topics.append({"title": title, "rows": rows, "solved": solved, "count": len(rows)})
    total, solved = len(exercises.all), sum(topic["solved"] for topic in topics)  # type: ignore[misc]
    return render("exercises/list", topics=topics, total=total, solved=solved)


@dataclass(frozen=True)
class Door:
    """Where an exercise is opened.

    Attributes:
        feature: the key of what gets its events.
        back: what the button that leads back says; "": there is none, as the bar above has one.
        counts: whether the marks count: a room stores the answers, and there may be other numbers.
    """

    feature: str
    back: str
    counts: bool = True


DOOR = Door(EXERCISES, "All exercises")


def task_html(
    exercise: Exercise, variant: Variant, units: Units, at_home: bool, count: int, own: bool, door: Door
) -> str:
    """The head of an exercise: title and text.

    Args:
        at_home: whether the exercise's arm is on show.
        count: how often other numbers were asked for.
        own: whether it was written in this page.
    """
    return render(
        "exercises/task",
        exercise=exercise,
        level=LEVELS[exercise.level],
        text=variant.text(exercise.text, units),
        at_home=at_home,
        count=count,
        own=own,
        door=door,
    )


@dataclass(frozen=True, eq=False)
class Entry:
    """What the template of an answer shows.

    Attributes:
        key: of the question in a lesson; "" in an exercise.
        rows, text: typed cells, or the one text of a program or a pose.
        places: the place of each motion that was put in order.
        rights: the options that are marked as right.
        complete: whether all motions have a place.
        invalid: whether what was typed could not be read.
    """

    asked: Asked
    key: str
    rows: list[list[str]]
    text: str
    places: dict[int, int]
    chosen: int | None
    closed: bool
    rights: frozenset[int]
    complete: bool
    invalid: bool


def entry_of(
    asked: Asked, sheet: Sheet, closed: bool, key: str = "", rights: frozenset[int] = frozenset()
) -> Entry:
    """A sheet as the template shows it."""
    columns = len(asked.labels)
    begun: Sequence[Sequence[str]] = sheet.cells or asked.cells
    rows = [
        [cells[j] if j < len(cells) else "" for j in range(columns)]
        for cells in (begun[i] if i < len(begun) else () for i in range(asked.rows))
    ]
    text = sheet.cells[0][0] if sheet.cells and sheet.cells[0] else asked.start
    places = {option: place for place, option in enumerate(sheet.picked, 1)}
    complete = len(sheet.picked) == columns
    return Entry(asked, key, rows, text, places, sheet.chosen, closed, rights, complete, bool(sheet.error))


def question_html(asked: Asked, sheet: Sheet, closed: bool, door: Door = DOOR, of: str = "") -> str:
    """The fields, options or buttons of the answer; `of` names the exercise and its variant."""
    return render("exercises/question", entry=entry_of(asked, sheet, closed), door=door, of=of)


@dataclass(frozen=True)
class Following:
    """A button that leads on when something is done.

    Attributes:
        words: what is written on it.
        do: what it asks for.
        key: of the exercise that it opens; "": it opens none.
        feature: who is asked; "": whose block it is in.
    """

    words: str
    do: str
    key: str = ""
    feature: str = ""

    @classmethod
    def in_course(cls, progress: Progress) -> Following:
        """The button of the item on show."""
        return cls("Finish the course" if progress.is_last else "Next in the course", "next", feature="course")


def foot_html(
    exercise: Exercise,
    variant: Variant,
    units: Units,
    sheet: Sheet,
    activity: Activity,
    record: Record,
    following: Following | None,
    door: Door,
) -> str:
    """Verdict, hints, solution and what can be done next."""
    hints = [variant.text(hint, units) for hint in exercise.hints[: record.hints]]
    verdict = sheet.verdict
    title, color, detail = "", "", ""
    if sheet.error:
        title, color, detail = "! Not read", "amber", sheet.error
    elif verdict is not None:
        title = "✓ Right" if verdict.right else "◐ Partly right" if verdict.credit > 0.0 else "✗ Not quite"
        color = "green" if verdict.right else "amber" if verdict.credit > 0.0 else "vermilion"
        detail = verdict.reason
    parts = verdict.parts if verdict is not None and not verdict.right and len(verdict.parts) > 1 else ()
    if any(reason == detail for _, reason in parts):
        detail = ""
    return render(
        "exercises/foot",
        title=title,
        color=color,
        detail=indexed(detail),
        parts=parts,
        hints=hints,
        credit=0 if verdict is None or verdict.right else round(100 * verdict.credit),
        more_hints=len(exercise.hints) - record.hints,
        record=record,
        time=_time(record.seconds),
        solution=indexed(unsaid(exercise.solution(variant, units), detail)) if record.closed else "",
        following=following,
        varies=bool(exercise.vary),
        may_reveal=activity.reveals(exercise),
        note=activity.note if door.counts else "",
        seated=activity.practice.seated and door.counts,
        door=door,
    )


def unsaid(solution: str, detail: str) -> str:
    """What a solution adds to what was said to the answer; all of it if that is not a part of it."""
    answer, found, rest = solution.partition(". ")
    if found and detail.endswith(f" {answer}."):
        return rest
    before, found, after = solution.partition(detail) if detail else ("", "", solution)
    return after.strip() if found else before + after


def _time(seconds: int) -> str:
    return f"{seconds} s" if seconds < 60 else f"{seconds // 60} min {seconds % 60} s"
