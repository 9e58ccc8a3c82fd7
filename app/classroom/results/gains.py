"""Did they learn? What a course asks before and after, and the normalised gain between them.

A course may pair exercises: one before, one after. A student's first answer to each counts: later ones follow a
verdict, also with other numbers. Asking for the answer before giving one scores 0. With scores from 0 to 1, the
normalised gain is (Hake, 1998)::

    g = (after - before) / (1 - before)

It is 1 if all that was missing has been gained, 0 if nothing has changed, and negative after a loss. It has no
lower bound: the more a student knew before, the smaller is the divisor. If before is 1, there is no g. A class has
the gain of its means over the students who answered both, including those who knew everything before.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from app.classroom.results.table import Member
from app.classroom.work import Attempt
from app.shared.spreadsheets import cell

COLUMNS = ("student", "alias", "item", "before", "after", "score_before", "score_after", "gain", "students")
ALL = "all"  # the item that stands for all of them
CLASS = "class"  # the student who stands for all of them
EXACT = 1e-9  # below this, nothing was missing before

Pair = tuple[str, str]  # ids of exercises


@dataclass(frozen=True)
class Gain:
    """One comparison.

    Attributes:
        before, after: scores or means of scores, 0 to 1; None: not answered.
        students: how many answered both.
    """

    before: float | None
    after: float | None
    students: int

    @property
    def gain(self) -> float | None:
        """The normalised gain; None: it is not defined."""
        if self.before is None or self.after is None or 1.0 - self.before < EXACT:
            return None
        return (self.after - self.before) / (1.0 - self.before)


@dataclass(frozen=True)
class Gains:
    """The comparisons of a student or, without one, of the class: of each pair, and of all."""

    member: Member | None
    items: tuple[Gain, ...]
    whole: Gain


def first_scores(attempts: Iterable[Attempt]) -> dict[tuple[str, str], float]:
    """The score of the first answer, by seat and exercise; attempts come in the order of time."""
    found: dict[tuple[str, str], float] = {}
    for one in attempts:
        found.setdefault((one.seat, one.exercise), 0.0 if one.gave_up else one.score)
    return found


def gains(members: Iterable[Member], attempts: Iterable[Attempt], pairs: Sequence[Pair]) -> list[Gains]:
    """The class first, then each student who has answered something of the pairs, in the order of joining."""
    scores = first_scores(attempts)
    rows: list[Gains] = []
    for member in sorted(members, key=lambda one: one.number):
        items = tuple(_gain(*(scores.get((member.seat, key)) for key in pair)) for pair in pairs)
        if any(one.before is not None or one.after is not None for one in items):
            rows.append(Gains(member, items, _mean(items, 1)))
    together = tuple(_mean([row.items[i] for row in rows]) for i in range(len(pairs)))
    whole = _mean([row.whole for row in rows])
    return [Gains(None, together, whole), *rows]


def csv_of_gains(found: Iterable[Gains], pairs: Sequence[Pair]) -> str:
    """A row for each pair of each student, and one for all pairs; the class comes first."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(COLUMNS)
    for row in found:
        who = (CLASS, "") if row.member is None else (row.member.number, cell(row.member.alias))
        for i, one in enumerate((*row.items, row.whole)):
            item: tuple[object, ...] = (i + 1, *pairs[i]) if i < len(pairs) else (ALL, "", "")
            numbers = ("" if value is None else f"{value:.3f}" for value in (one.before, one.after, one.gain))
            writer.writerow([*who, *item, *numbers, one.students])
    return text.getvalue().encode("utf-8", "replace").decode()


def pairs_of(packed: str) -> list[Pair]:
    """The pairs of a course as a room keeps it; it was read when it was sent."""
    data = json.loads(packed) if packed else {}
    return list(zip(data.get("before", ()), data.get("after", ()), strict=True))


def _gain(before: float | None, after: float | None) -> Gain:
    return Gain(before, after, int(before is not None and after is not None))


def _mean(items: Sequence[Gain], students: int | None = None) -> Gain:
    """The comparison of the means, over what has both.

    Args:
        students: how many they are of, if there is any; None: the sum of theirs.
    """
    both = [(one.before, one.after) for one in items if one.before is not None and one.after is not None]
    if not both:
        return Gain(None, None, 0)
    before, after = (sum(column) / len(both) for column in zip(*both, strict=True))
    return Gain(before, after, sum(one.students for one in items) if students is None else students)
