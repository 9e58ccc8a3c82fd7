"""Attempts of a room: the teacher's table, and one row per attempt as CSV."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import groupby

from app.classroom.views import ANSWER_SHOWN
from app.shared.spreadsheets import cell

STUCK_TRIES, STUCK_SECONDS = 3, 300.0  # without a right answer
COLUMNS = (
    "alias", "exercise", "title", "attempt", "variant", "answer", "verdict", "score", "started",
    "answered", "seconds",
)  # fmt: skip


@dataclass(frozen=True)
class Attempt:
    """One answer of a student.

    Attributes:
        seat, alias: whose.
        answer: plain data, as it was given.
        score: 0 to 1.
        started, at: seconds since 1970.
    """

    seat: str
    alias: str
    exercise: str
    seed: int
    answer: object
    verdict: str
    score: float
    started: float
    at: float


@dataclass(frozen=True)
class Row:
    """One student's work on one exercise.

    Attributes:
        tries: answers so far; a request for the right one is none.
        score: of the best, 0 to 1.
        seconds: since the student began; until the right answer, if there is one.
        solved: whether an answer was right.
        verdict: the sentence about the last answer.
    """

    seat: str
    alias: str
    exercise: str
    tries: int
    score: float
    seconds: float
    solved: bool
    verdict: str

    @property
    def stuck(self) -> bool:
        """Whether help is due: several wrong answers, or a long time without a right one."""
        return not self.solved and (self.tries >= STUCK_TRIES or self.seconds >= STUCK_SECONDS)


def rows(attempts: Iterable[Attempt], now: float) -> list[Row]:
    """The table: who is stuck first, then who is at work, then who has solved; each by tries and time."""
    found = []
    ordered = sorted(attempts, key=lambda one: (one.seat, one.exercise, one.at))
    for (seat, exercise), group in groupby(ordered, key=lambda one: (one.seat, one.exercise)):
        tries = list(group)
        right = next((one.at for one in tries if one.score >= 1.0), None)
        begin = min(one.started for one in tries)
        count = sum(one.verdict != ANSWER_SHOWN for one in tries)
        found.append(
            Row(
                seat, tries[-1].alias, exercise, count, max(one.score for one in tries),
                max(0.0, (now if right is None else right) - begin), right is not None, tries[-1].verdict,
            )
        )  # fmt: skip
    return sorted(found, key=lambda row: (row.solved, not row.stuck, -row.tries, -row.seconds, row.alias))


def csv_of(pages: Iterable[Iterable[Attempt]], titles: Mapping[str, str]) -> Iterator[str]:
    """One row per attempt, in the given order, which is that of time: first the head, then a text for each page.

    Args:
        titles: of the exercises, by id.
    """
    yield _lines([COLUMNS])
    counts: Counter[tuple[str, str]] = Counter()
    for page in pages:
        rows: list[list[object]] = []
        for one in page:
            counts[one.seat, one.exercise] += 1
            answer = json.dumps(one.answer, ensure_ascii=False, separators=(",", ":"))
            words = [one.alias, one.exercise, titles.get(one.exercise, ""), answer, one.verdict]
            alias, exercise, title, answer, verdict = map(cell, words)
            rows.append(
                [alias, exercise, title, counts[one.seat, one.exercise], one.seed, answer, verdict,
                 f"{one.score:.2f}", _time(one.started), _time(one.at), f"{max(0.0, one.at - one.started):.0f}"]
            )  # fmt: skip
        yield _lines(rows)


def _lines(rows: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    csv.writer(text).writerows(rows)
    return text.getvalue().encode("utf-8", "replace").decode()  # half a letter is none


def _time(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
