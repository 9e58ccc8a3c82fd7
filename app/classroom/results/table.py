"""Attempts of a room: the teacher's table, and one row per attempt as CSV."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

from app.classroom.work import NOTHING, URGENCY, Attempt, Work, works
from app.shared.spreadsheets import cell

COLUMNS = (
    "alias",
    "exercise",
    "title",
    "attempt",
    "variant",
    "answer",
    "verdict",
    "score",
    "started",
    "answered",
    "seconds",
    "seat",
    "state",
    "cause",
)


@dataclass(frozen=True)
class Member:
    """A student who may have a row in the table.

    Attributes:
        number: 1 for who joined the room first.
        came: whether a page of the student was ever connected.
    """

    seat: str
    alias: str
    number: int
    came: bool = True


@dataclass(frozen=True)
class Row:
    """One student's work on one exercise, or that there is none (`exercise` is empty).

    Attributes:
        seconds: since the student began; until the right answer, if there is one.
    """

    member: Member
    exercise: str
    work: Work
    seconds: float = 0.0

    @property
    def state(self) -> str:
        """In words, as in the list of students."""
        if not self.member.came:
            return "not here yet"
        return self.work.progress if self.exercise else "no answer"


def rows(members: Iterable[Member], attempts: Iterable[Attempt], task: str, now: float) -> list[Row]:
    """The table: a row for each exercise of a student, and for each student one of the task.

    Who needs the teacher comes first, then who has tried most and longest. Who has never come is at the end.

    Args:
        attempts: in the order of time.
        task: the exercise that the room has as its task, or empty.
    """
    found, done = [], works(attempts)
    for member in members:
        mine = done.get(member.seat, {})
        if task or not mine:
            mine = {task: NOTHING, **mine}
        for exercise, work in mine.items():
            end = now if work.found is None else work.found
            found.append(Row(member, exercise, work, max(0.0, end - work.began) if work.numbers else 0.0))
    return sorted(
        found,
        key=lambda row: (
            not row.member.came,
            URGENCY.index(row.work.progress),
            -row.work.tries,
            -row.seconds,
            row.member.number,
        ),
    )


def csv_of(pages: Iterable[Iterable[Attempt]], titles: Mapping[str, str]) -> Iterator[str]:
    """One row per attempt, in the given order, which is that of time: first the head, then a text for each page.

    A request for the right answer has a row, and no number of an attempt. The state is that after the attempt, so
    the last row of a student and an exercise has what the list of students says.

    Args:
        titles: of the exercises, by id.
    """
    yield _lines([COLUMNS])
    done: dict[tuple[str, str], Work] = {}
    for page in pages:
        rows: list[list[object]] = []
        for one in page:
            work = done[one.seat, one.exercise] = done.get((one.seat, one.exercise), NOTHING).plus(one)
            answer = json.dumps(one.answer, ensure_ascii=False, separators=(",", ":"))
            words = [one.alias, one.exercise, titles.get(one.exercise, ""), answer, one.verdict]
            alias, exercise, title, answer, verdict = map(cell, words)
            rows.append(
                [
                    alias,
                    exercise,
                    title,
                    "" if one.gave_up else work.tries,
                    one.seed,
                    answer,
                    verdict,
                    f"{one.score:.2f}",
                    _time(one.started),
                    _time(one.at),
                    f"{max(0.0, one.at - one.started):.0f}",
                    one.number,
                    work.progress,
                    one.cause,
                ]
            )
        yield _lines(rows)


def _lines(rows: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    csv.writer(text).writerows(rows)
    return text.getvalue().encode("utf-8", "replace").decode()  # half a letter is none


def _time(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
