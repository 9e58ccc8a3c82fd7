"""Did they learn? What a course asks before and after, and the gain between them.

A course may pair exercises of one difficulty. In a room, every second student gets the two of a pair in the
other order. A student's first answer to each counts: later ones follow a verdict, also with other numbers. Asking
for the answer before giving one scores 0. What a student has answered first is *before*.

The gain of a class is the mean of after - before over the two orders, with the same weight. One of the exercises
may be harder: this adds to the differences of one order what it takes from those of the other, and cancels. Within
an order it is the same for all, so it is not in the interval either, which is that of Student's t for a two-period
crossover (Senn, *Cross-over Trials in Clinical Research*, 2002, chapter 3); where all had the same order, that of
paired differences. A bootstrap would be too narrow with so few students. Below `LEAST` of them, no gain is said.
Where all of an order changed alike, as often with one question that is right or wrong, the spread is unknown, not
0: there is no interval.

With scores from 0 to 1, the normalised gain is (Hake, 1998)::

    g = (after - before) / (1 - before)

It is 1 if all that was missing has been gained, 0 if nothing has changed, and negative after a loss. It has no
lower bound: the more a student knew before, the smaller is the divisor. If before is 1, there is no g. A class has
that of its means, including those who knew everything before.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist, fmean

from app.classroom.results.table import Member
from app.classroom.work import Attempt
from app.shared.spreadsheets import cell

COLUMNS = (
    *("student", "alias", "item", "before", "after", "score_before", "score_after", "gain", "students"),
    *("difference", "low", "high"),
)
ALL = "all"  # the item that stands for all of them
CLASS = "class"  # the student who stands for all of them
EXACT = 1e-9  # below this, nothing was missing before, or all changed alike
LEAST = 8  # students who answered both
CONFIDENCE = 0.95

Pair = tuple[str, str]  # ids of exercises


@dataclass(frozen=True)
class Gain:
    """One comparison.

    Attributes:
        before, after: scores or means of scores, 0 to 1; None: not answered.
        students: how many answered both.
        exchanged: whether a student has answered the second exercise of the pair first.
        enough: whether there are enough students for a gain.
        margin: of a class with enough students, half of the interval of after - before; None: all
            of an order changed alike.
        orders: of a class, in how many orders those who answered both did; 0: of a student, or nobody.
    """

    before: float | None
    after: float | None
    students: int
    exchanged: bool = False
    enough: bool = True
    margin: float | None = None
    orders: int = 0

    @property
    def difference(self) -> float | None:
        """after - before; None: it is not defined."""
        if self.before is None or self.after is None or not self.enough:
            return None
        return self.after - self.before

    @property
    def gain(self) -> float | None:
        """The normalised gain; None: it is not defined."""
        if self.before is None or self.difference is None or 1.0 - self.before < EXACT:
            return None
        return self.difference / (1.0 - self.before)

    @property
    def interval(self) -> tuple[float, float] | None:
        """That of after - before."""
        if self.difference is None or self.margin is None:
            return None
        return self.difference - self.margin, self.difference + self.margin


@dataclass(frozen=True)
class Gains:
    """The comparisons of a student or, without one, of the class: of each pair, and of all."""

    member: Member | None
    items: tuple[Gain, ...]
    whole: Gain


def gains(members: Iterable[Member], attempts: Iterable[Attempt], pairs: Sequence[Pair]) -> list[Gains]:
    """The class first, then each student who has answered something of the pairs, in the order of joining.

    Args:
        attempts: in the order of time.
    """
    scores: dict[tuple[str, str], tuple[int, float]] = {}  # of first answers, with their places in this order
    for one in attempts:
        scores.setdefault((one.seat, one.exercise), (len(scores), 0.0 if one.gave_up else one.score))
    rows: list[Gains] = []
    for member in sorted(members, key=lambda one: one.number):
        items = tuple(_gain([scores.get((member.seat, key)) for key in pair]) for pair in pairs)
        if any(one.before is not None for one in items):
            rows.append(Gains(member, items, _of_student(items)))
    together = tuple(_of_class([row.items[i] for row in rows]) for i in range(len(pairs)))
    whole = _of_class([row.whole for row in rows])
    return [Gains(None, together, whole), *rows]


def csv_of_gains(found: Iterable[Gains], pairs: Sequence[Pair]) -> str:
    """A row for each pair of each student, and one for all pairs; the class comes first."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(COLUMNS)
    for row in found:
        who = (CLASS, "") if row.member is None else (row.member.number, cell(row.member.alias))
        for i, one in enumerate((*row.items, row.whole)):
            pair = pairs[i][:: -1 if one.exchanged else 1] if i < len(pairs) else ("", "")
            item = (i + 1 if i < len(pairs) else ALL, *pair)
            scores = _numbers(one.before, one.after, one.gain)
            writer.writerow(
                [*who, *item, *scores, one.students, *_numbers(one.difference, *(one.interval or (None, None)))]
            )
    return text.getvalue().encode("utf-8", "replace").decode()


def pairs_of(packed: str) -> list[Pair]:
    """The pairs of a course as a room keeps it; it was read when it was sent."""
    data = json.loads(packed) if packed else {}
    return list(zip(data.get("before", ()), data.get("after", ()), strict=True))


def exercises_of(packed: str) -> list[str]:
    """The ids of its exercises, each once, in order."""
    items = json.loads(packed).get("item", ()) if packed else ()
    return list(dict.fromkeys(item["exercise"] for item in items if "exercise" in item))


def _gain(scores: Sequence[tuple[int, float] | None]) -> Gain:
    """Of the places and scores of a student's first answers to a pair."""
    found = sorted(one for one in scores if one is not None)
    before, after = (found[i][1] if i < len(found) else None for i in range(2))
    return Gain(before, after, int(after is not None), bool(found) and found[0] == scores[1])


def _of_student(items: Sequence[Gain]) -> Gain:
    """The comparison of the means over the pairs of which both were answered; the first of them has the order."""
    both = [one for one in items if one.after is not None]
    if not both:
        return Gain(None, None, 0)
    before, after = _means(both)
    return replace(both[0], before=before, after=after)


def _of_class(found: Sequence[Gain]) -> Gain:
    """The comparison of those who answered both, each order with the same weight."""
    both = [one for one in found if one.after is not None]
    orders = [
        order for exchanged in (False, True) if (order := [one for one in both if one.exchanged == exchanged])
    ]
    if not orders:
        return Gain(None, None, 0, enough=False)
    before, after = (fmean(column) for column in zip(*map(_means, orders), strict=True))
    if len(both) < LEAST:
        return Gain(before, after, len(both), enough=False, orders=len(orders))
    differences = [[one.difference or 0.0 for one in order] for order in orders]
    freedom = len(both) - len(orders)
    squares = sum((each - fmean(order)) ** 2 for order in differences for each in order)
    if squares < EXACT:
        return Gain(before, after, len(both), orders=len(orders))
    error = math.sqrt(squares / freedom * sum(1.0 / len(order) for order in orders)) / len(orders)
    margin = t_quantile(0.5 + CONFIDENCE / 2.0, freedom) * error
    return Gain(before, after, len(both), margin=margin, orders=len(orders))


def _means(both: Sequence[Gain]) -> tuple[float, float]:
    """The means before and after, of comparisons that have both."""
    return fmean(one.before or 0.0 for one in both), fmean(one.after or 0.0 for one in both)


def t_quantile(probability: float, freedom: int) -> float:
    """Of Student's distribution, by the expansion in 1/freedom; right to 0.001 from six degrees of freedom on.

    Abramowitz and Stegun, *Handbook of Mathematical Functions*, 26.7.5.
    """
    z = NormalDist().inv_cdf(probability)
    terms = (
        z,
        (z**3 + z) / 4.0,
        (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0,
        (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0,
        (79.0 * z**9 + 776.0 * z**7 + 1482.0 * z**5 - 1920.0 * z**3 - 945.0 * z) / 92160.0,
    )
    return sum(term / float(freedom) ** k for k, term in enumerate(terms))


def _numbers(*values: float | None) -> list[str]:
    return ["" if value is None else f"{value:.3f}" for value in values]
