"""The form of an exercise as HTML: where to begin, its fields, and what three students get."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from app.exercises import Exercise, Student, Trial
from app.exercises.exercise import TOPICS
from app.exercises.files import MOST_BYTES
from app.exercises.form import Entry, Group, Rows
from app.exercises.kinds import KINDS
from app.viewer.views.templates import render


@dataclass(frozen=True)
class Refusal:
    """Why something typed is not valid, and in which field of the file; false without a reason."""

    field: str = ""
    why: str = ""

    def __bool__(self) -> bool:
        return bool(self.why)

    def is_about(self, entry: Entry) -> bool:
        """Whether it is about this cell, or about one line of it."""
        return bool(self.why) and (self.field == entry.field or self.field.startswith(f"{entry.field}["))

    def is_in(self, rows: Rows) -> bool:
        """Whether it is about a table as a whole."""
        return bool(self.why) and self.field == rows.field


@dataclass(frozen=True)
class ServerFolder:
    """The folder of the service, for a draft.

    Attributes:
        open: whether the visitor may save there.
        obstacle: why not, for whom it concerns.
        saved: whether the draft is there as it is.
        taken: whether an exercise with its id is there.
    """

    open: bool = False
    obstacle: str = ""
    saved: bool = False
    taken: bool = False


def student_html() -> str:
    """For a student in a room, who writes no exercises."""
    return render("exercises/author_seated")


def start_html(exercises: Sequence[Exercise], refusal: Refusal) -> str:
    """From what an exercise may be made."""
    topics = [(topic, [(one.id, one.title) for one in exercises if one.topic == topic]) for topic in TOPICS]
    kinds = [(name, kind.about) for name, kind in KINDS.items()]
    return render("exercises/author_start", topics=topics, kinds=kinds, most=MOST_BYTES, refusal=refusal)


def head_html(trial: Trial, refusal: Refusal, place: ServerFolder) -> str:
    """Whether the draft is an exercise, and what can be done with it."""
    return render("exercises/author_head", trial=trial, refusal=refusal, ready=not trial.error, place=place)


def group_html(group: Group, number: int, values: Mapping[str, tuple[str, ...]], refusal: Refusal) -> str:
    """Some fields with their values for three students."""
    return render(
        "exercises/author_group",
        group=group,
        number=number,
        refusal=refusal,
        values=values_of(group, values),
        is_rows=lambda member: isinstance(member, Rows),
    )


def values_of(group: Group, values: Mapping[str, tuple[str, ...]]) -> dict[str, list[tuple[str, ...]]]:
    """The values of each cell's expressions, one for each line."""
    found = {}
    for member in group.members:
        cells = [member] if isinstance(member, Entry) else [entry for row in member.rows for entry in row]
        for entry in cells:
            if entry.cell.form in ("expression", "expressions"):
                line = f"{entry.field}["
                found[entry.path] = [
                    three for name, three in values.items() if name == entry.field or name.startswith(line)
                ]
    return found


def students_html(students: Sequence[Student], error: str) -> str:
    """What three students get."""
    return render("exercises/author_students", students=students, error=error)
